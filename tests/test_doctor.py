"""`lixel doctor` and `lixel bench`: what they find, and what they call wrong."""

import json
import os
import re
import time

import numpy as np
import pytest

import lixel as lx
from lixel import _core, cli
from lixel.lab import bench, doctor

CPU = _core.device("cpu")


@pytest.fixture
def small(monkeypatch):
    """One scene, and few methods, in this process."""
    monkeypatch.setattr(doctor, "SCENES", {"city": doctor.SCENES["city"]})
    names = ("desired_view", "cube", "exact")
    monkeypatch.setattr(doctor, "METHODS", {name: doctor.METHODS[name] for name in names})
    monkeypatch.setattr(doctor, "apart", lambda function, *arguments: function(*arguments))
    # The suite sets it.
    monkeypatch.setenv("WGPU_BACKEND", os.environ.get("WGPU_BACKEND", ""))


def test_the_cpu_engine_is_right_and_the_report_says_so(capsys):
    assert cli.main(["doctor", "cpu"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("## lixel doctor\n\n- lixel: ")
    for words in (
        "- python: ",
        "- numpy: ",
        "- system: ",
        f"### {CPU['name']} (lixel's own engine",
    ):
        assert words in text
    assert "engine): right\n" in text
    rows = re.findall(
        r"^\| (sun|lamp) \| ([^|]+) \| (\d+) \| (\d+) \|.* (\d+\.\d\d) \|$", text, re.M
    )
    assert {method for _, method, *_ in rows} == set(doctor.METHODS)
    assert len(rows) > 1.5 * len(doctor.METHODS)
    for _, method, covered, wrong, _ in rows:
        # Half of what would be called wrong, and the checks can see something.
        limit = 0 if method in doctor.NEVER_WRONG else 0.5 * doctor.MAX_SHARE * int(covered)
        assert int(wrong) <= limit, method
    assert sum(int(wrong) for *_, wrong, _ in rows) > 0


@pytest.mark.not_on_cpu("it asks for an adapter")
def test_every_adapter_is_compared_with_the_cpu_engine(small, capsys):
    assert cli.main(["doctor"]) == 0
    text = capsys.readouterr().out
    for adapter in _core.adapters():
        part = text.split(f"### {adapter['name']} (")[1].split("###")[0]
        assert part.startswith("software driver): right") == (adapter["type"] in ("Cpu", "Other"))
        for name in ("backend", "driver", "missing_features", "used_features", "limits"):
            assert f"\n- {name}: " in part
        assert part.count("| exact |") == 2


def test_a_wrong_engine_is_named_and_fails(small, capsys, monkeypatch):
    right = doctor.frame_parts

    def wrong(*view, device):
        parts = right(*view, device=device)
        parts.visibility[parts.visibility == 0.0] = 1.0
        return parts

    monkeypatch.setattr(doctor, "frame_parts", wrong)
    assert cli.main(["doctor", "cpu"]) == 2
    out, err = capsys.readouterr()
    assert "engine): wrong\n" in out
    assert re.search(
        r"- \*\*wrong\*\*: exact, city, sun: [1-9]\d* pixels .* at most 0 expected", out
    )
    assert re.search(r"- \*\*wrong\*\*: cube, city, lamp: [1-9]\d* pixels", out)
    assert f"what is wrong with {CPU['name']}" in err


def test_errors_are_findings_and_the_rest_goes_on(small, capsys, monkeypatch):
    class PanicException(BaseException):
        pass

    right = doctor.frame_parts

    def broken(*view, device):
        if isinstance(view[-1], lx.Cube):
            raise PanicException("index out of\nbounds")
        return right(*view, device=device)

    monkeypatch.setattr(doctor, "frame_parts", broken)
    assert cli.main(["doctor", "cpu"]) == 2
    out = capsys.readouterr().out
    assert out.count("**wrong**") == 1
    assert "- **wrong**: cube, city, lamp: PanicException: index out of bounds\n" in out
    assert "| lamp | exact | 11312 | 0 |" in out


def test_another_adapter_in_its_place_is_a_finding(small):
    report = doctor.examined({**CPU, "driver": "another"})
    assert all("rendered in its place" in fault for fault in report.faults)
    assert len(report.faults) == len(report.rows) == 5


def test_what_cannot_be_used_is_no_fault():
    adapter = {**CPU, "type": "IntegratedGpu", "missing_features": ["COMPUTE_SHADERS"]}
    report = doctor.examined(adapter)
    assert report.faults == []
    assert "(IntegratedGpu): cannot be used\n" in str(report)
    assert "- missing_features: COMPUTE_SHADERS\n" in str(report) + "\n"


def row(method, wrong, by_cpu, covered=10_000):
    return doctor.Row("city", "sun", method, covered, wrong, by_cpu, 0, {})


def test_a_map_may_err_as_much_as_on_the_cpu_engine_and_a_little_more():
    assert row("rtw", 25, 19).fault() is None
    assert "at most 25 expected" in row("rtw", 26, 19).fault()
    assert "at most 200 expected" in row("rtw", 201, 1000).fault()
    assert row("exact", 1, 1).fault() == (
        "exact, city, sun: 1 pixels misclassified, at most 0 expected"
    )


def test_a_process_that_crashes_or_hangs_costs_itself_alone():
    assert doctor.apart(abs, -3) == 3
    with pytest.raises(ChildProcessError, match="ended with the exit code 7"):
        doctor.apart(os._exit, 7)
    with pytest.raises(TimeoutError, match="no answer within 1 s"):
        doctor.apart(time.sleep, 60, patience=1.0)


def test_a_crash_is_a_fault_of_the_device(monkeypatch):
    def apart(*arguments):
        raise ChildProcessError("the process ended with the exit code -11")

    monkeypatch.setattr(doctor, "apart", apart)
    assert doctor.examined(CPU).faults == ["the process ended with the exit code -11"]


def test_an_unknown_name_is_refused(capsys):
    assert cli.main(["doctor", "no such thing"]) == 2
    assert "NAME must be a part of one of cpu" in capsys.readouterr().err


# --- lixel bench ---


def test_the_bench_writes_one_file(tmp_path, capsys):
    file = tmp_path / "made" / "bench.json"
    given = ["bench", "plane_and_box", "--size", "96x64", "--repeats", "3", "--no-peers"]
    given += ["--method", "exact", "--method", "rtw", "--method", "cube", "--device", "cpu"]
    assert cli.main([*given, "-o", str(file)]) == 0
    found = json.loads(file.read_text())
    assert found["device"] == found["adapter"]["name"] == CPU["name"]
    assert found["command"].startswith("lixel bench plane_and_box")
    assert set(found["versions"]) == {"lixel", "python", "numpy", "system"}
    first, lamp = found["views"]
    assert [row["method"] for row in first["methods"]] == ["exact", "rtw"]
    assert [row["method"] for row in lamp["methods"]] == ["exact", "rtw", "cube"]
    scene = lx.scenes.plane_and_box()
    view = scene, scene.cameras["default"].resized(96, 64), scene.lights["default"]
    truth = lx.reference(*view)
    wrong = lx.compare(lx.render_shadows(*view, "rtw", device="cpu"), truth)
    assert first["methods"][1]["misclassified"] == wrong.misclassified_count
    assert first["covered"] == truth.covered.sum()
    for row in (*first["methods"], *lamp["methods"]):
        assert row["frames"] == 3
        wall = row["wall_ms"]
        assert 0 < wall["least"] <= wall["median"] <= wall["greatest"]
        assert "visibility" in row["pass_ms"]
        # Every frame is from a new camera; passes run one after the other.
        assert 0 < sum(row["pass_ms"].values()) < 1.5 * wall["greatest"]
    assert "| " not in (out := capsys.readouterr().out)
    assert out.startswith("first light\n")


def test_every_method_is_timed_in_some_light():
    scene = lx.scenes.plane_and_box()
    methods = [method() for method in lx.METHODS.values()]
    views = list(bench.lights_for(methods, scene, scene.lights["default"]))
    assert [name for name, *_ in views] == ["first", "lamp", "spot"]
    assert {m.name for *_, fitting in views for m in fitting} == set(lx.METHODS)
    assert all(m.takes(light) for _, light, fitting in views for m in fitting)
    only_cube = bench.lights_for([lx.Cube()], scene, scene.lights["default"])
    assert [name for name, *_ in only_cube] == ["lamp"]


def test_a_peer_that_ends_the_process_costs_no_times(tmp_path, monkeypatch):
    def end(*_):
        raise SystemExit

    monkeypatch.setattr(bench, "beside_methods", end)
    file = tmp_path / "bench.json"
    given = ["bench", "plane_and_box", "--size", "96x64", "--repeats", "1", "--method", "exact"]
    with pytest.raises(SystemExit):
        cli.main([*given, "--device", "cpu", "-o", str(file)])
    [first] = json.loads(file.read_text())["views"]
    assert first["methods"][0]["misclassified"] == 0
    assert "peers" not in first


@pytest.mark.of_checkout("it compares with another renderer")
def test_the_bench_has_peers_beside_it(view, monkeypatch):
    renderers = {"embreex": bench.peers.PEERS["embreex"]}
    monkeypatch.setattr(bench.peers, "PEERS", renderers)
    rows = bench.beside_methods(lx.reference(*view), 1)
    assert [row["renderer"] for row in rows] == [
        "lixel exact",
        "lixel ray_traced",
        "lixel desired_view 1024",
        "embreex",
    ]
    assert not any(isinstance(v, float) and np.isnan(v) for row in rows for v in row.values())
    sky = lx.HemisphereLight((1, 4, 1), (0, -1, 0))
    assert bench.beside_methods(lx.reference(view.scene, view.camera, sky), 1) == []


def test_a_method_that_cannot_be_rendered_says_why(view):
    methods = [lx.RayTraced(traversal="hardware"), lx.Exact()]
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LIXEL_DEVICE", "cpu")
        failed, exact = bench.measure(lx.reference(*view), methods, 1)
    assert "CPU engine has no ray quer" in failed["error"]
    assert exact["misclassified"] == 0
    assert [bench.line(row).get("error") for row in (failed, exact)] == [failed["error"], None]


LLVMPIPE = {"name": "llvmpipe (LLVM 15)", "type": "Cpu"}


@pytest.mark.parametrize(
    ("asked", "found", "is_taken"),
    [
        (None, {"name": "Arc", "type": "DiscreteGpu"}, True),
        (None, LLVMPIPE, False),
        ("gpu", LLVMPIPE, False),
        ("LLVMpipe", LLVMPIPE, True),
        ("cpu", {"name": "Xeon", "type": "Cpu engine"}, False),
    ],
)
def test_gpu_takes_a_software_driver_only_by_its_name(asked, found, is_taken, monkeypatch):
    monkeypatch.setattr(bench._core, "device", lambda name: found)
    if is_taken:
        assert bench.gpu(asked) == (asked or "gpu")
    else:
        with pytest.raises(lx.DeviceError, match="--gpu needs a hardware GPU"):
            bench.gpu(asked)
