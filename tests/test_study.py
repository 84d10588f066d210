"""Studies: what a row says, the order of the work, and what is left when it is stopped."""

import concurrent.futures
import json
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter

import numpy as np
import pandas as pd
import pytest

import lixel as lx
from lixel import cli
from lixel.lab.cases import cases_of
from lixel.lab.result_tables import read

# `lixel.study` is the function.
module = sys.modules["lixel.lab.study"]

SMALL = {"size": (64, 36), "progress": False}


def lines(path):
    # A killed process may have left half a line at the end.
    whole, _, _ = path.read_text().rpartition("\n")
    return [json.loads(line) for line in whole.splitlines()]


def samples(path):
    return Counter((line["case"], line["turn"]) for line in lines(path))


# --- What a row says ---


def test_study_row_is_what_single_calls_give(view):
    table = lx.study(
        view.scene,
        cameras=view.camera,
        lights={"from above": view.light},
        methods=[lx.RectilinearWarp(resolution=64)],
        repeats=3,
        progress=False,
    )
    (row,) = table.to_dict("records")
    frame = lx.render(*view, lx.RectilinearWarp(resolution=64))
    found = lx.compare(frame, lx.reference(*view))
    assert row["misclassified_count"] == found.misclassified_count
    assert row["edge_displacement_p95"] == found.edge_displacement_p95
    assert row["ssim"] == found.ssim
    assert row["aliasing_median"] == pytest.approx(
        np.nanmedian(frame.aliasing_error[found.facing]), rel=0.05
    )
    assert row["map_bytes"] == 64 * 64 * 8 + frame.warp_map.nbytes
    assert (row["light"], row["light_kind"], row["method"]) == (
        "from above",
        "DirectionalLight",
        "rtw",
    )
    assert (row["width"], row["height"], row["triangles"], row["repeats"]) == (96, 64, 14, 3)
    assert row["device"] == frame.adapter["name"]
    assert row["error"] is None
    assert table.attrs["complete"]
    passes = [name for name in row if name.startswith("pass_ms.")]
    assert {"pass_ms.visibility", "pass_ms.warp map", "pass_ms.lookup"} <= set(passes)
    # Every pass of every timed frame ran: no camera was seen before.
    assert all(row[name] > 0.0 for name in passes)
    assert row["stats.covered_pixels"] > 0
    for name in ("gpu_ms", "wall_ms"):
        assert 0.0 < row[f"{name}_q1"] <= row[name] <= row[f"{name}_q3"]
    assert row["gpu_ms"] < row["wall_ms"]


def test_every_combination_has_a_row():
    table = lx.study(
        {"box": "plane_and_box", "needles": ("needles", {"count": 50})},
        lights=[lx.DirectionalLight((1, -1, 0)), lx.DirectionalLight((0, -1, 0))],
        methods=["uniform", "notw"],
        parameters={"resolution": [32, 64], "smoothing": [0.0, 4.0]},
        repeats=1,
        **SMALL,
    )
    # Uniform has no smoothing.
    assert len(table) == 2 * 2 * (2 + 4)
    assert table["case"].is_unique
    assert list(table["scene"].unique()) == ["box", "needles"]
    names = list(table.columns)
    assert names.index("smoothing") < names.index("width")


def test_all_methods_by_default():
    table = lx.study("plane_and_box", repeats=1, **SMALL)
    light = lx.DirectionalLight((0, -1, 0))
    known = [name for name, method in lx.METHODS.items() if method().takes(light)]
    assert list(table["method"]) == known


def test_methods_by_default_are_those_of_the_device():
    light = lx.DirectionalLight((0, -1, 0))
    cases = cases_of("plane_and_box", None, light, None, None, (16, 9), "cpu")
    fitting = [name for name, method in lx.METHODS.items() if method().takes(light)]
    assert [case.method.name for case in cases] == fitting


def test_what_cannot_be_rendered_has_a_row_with_the_reason():
    table = lx.study(
        "plane_and_box",
        methods="uniform",
        parameters={"resolution": [64, 32768]},
        repeats=2,
        **SMALL,
    )
    assert list(table["repeats"]) == [2, 0]
    # Larger than any engine can, which each says in its own words.
    assert re.search("resolution must not exceed|needs [0-9]+ bytes", table["error"][1])
    assert table["misclassified_count"].isna()[1]


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"parameters": {"blurr": [1]}}, r"parameters must be among .* got 'blurr'"),
        ({"parameters": {"resolution": []}}, r"parameters\['resolution'\] .* at least one value"),
        ({"scenes": ["a/x.glb", "b/x.glb"]}, r"scenes must differ in name, got 'x' twice"),
        ({"scenes": [("nowhere", {})]}, r"scenes must name one of plane_and_box"),
        ({"repeats": 0}, r"repeats must be at least 1"),
        ({"methods": "nothing"}, r"method must be one of"),
        ({"cameras": {"other": {}}}, r"cameras must have an entry for the scene 'plane_and_box'"),
    ],
)
def test_bad_arguments_are_refused(given, message):
    with pytest.raises(ValueError, match=message):
        lx.study(**{"scenes": "plane_and_box", **SMALL, **given})


def test_lights_in_place_of_cameras_are_refused(view):
    with pytest.raises(TypeError, match=r"cameras\['0'\] must be a lixel.Camera"):
        lx.study(view.scene, cameras=[view.light], **SMALL)


def test_cases_of_a_scene_take_turns(monkeypatch):
    order = []
    monkeypatch.setattr(
        module, "sample", lambda case, turn: order.append((case.key, turn)) or blank(case, turn)
    )
    table = lx.study("plane_and_box", methods=["uniform", "rtw"], repeats=3, **SMALL)
    assert order == [(key, turn) for turn in range(3) for key in table["case"]]


def blank(case, turn):
    return {"case": case.key, "turn": turn, "wall_ms": 1.0, "pass_ms": {}, "device": "none"}


def test_without_pandas_the_error_says_the_remedy(monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    with pytest.raises(ImportError, match=r"package pandas: pip install 'lixel\[study\]'"):
        lx.study("plane_and_box")


# --- Stopped and gone on with ---


def test_finished_study_measures_nothing_again(tmp_path, monkeypatch):
    journal = tmp_path / "journal.jsonl"
    first = lx.study("plane_and_box", repeats=2, journal=journal, **SMALL)
    monkeypatch.setattr(module, "sample", None)
    again = lx.study("plane_and_box", repeats=2, journal=journal, **SMALL)
    pd.testing.assert_frame_equal(first, again)


def test_more_repeats_add_to_those_there_are(tmp_path):
    journal = tmp_path / "journal.jsonl"
    lx.study("plane_and_box", methods="uniform", repeats=2, journal=journal, **SMALL)
    table = lx.study("plane_and_box", methods="uniform", repeats=3, journal=journal, **SMALL)
    assert list(table["repeats"]) == [3]
    assert set(samples(journal).values()) == {1}


def test_half_a_line_is_measured_again(tmp_path):
    journal = tmp_path / "journal.jsonl"
    lx.study("plane_and_box", methods="uniform", repeats=2, journal=journal, **SMALL)
    journal.write_bytes(journal.read_bytes()[:-20])
    table = lx.study("plane_and_box", methods="uniform", repeats=2, journal=journal, **SMALL)
    assert list(table["repeats"]) == [2]
    assert sorted(turn for _, turn in samples(journal)) == [0, 1]


def test_another_file_is_no_journal(tmp_path):
    journal = tmp_path / "poem.txt"
    journal.write_text("not a journal\n")
    with pytest.raises(ValueError, match=r"journal must hold samples of a study, got .*, line 1"):
        lx.study("plane_and_box", journal=journal, **SMALL)
    assert journal.read_text() == "not a journal\n"


def test_a_changed_scene_is_another_case(tmp_path):
    journal = tmp_path / "journal.jsonl"
    given = {"methods": "uniform", "repeats": 1, "journal": journal, **SMALL}
    first = lx.study({"s": ("needles", {"count": 20})}, **given)
    second = lx.study({"s": ("needles", {"count": 21})}, **given)
    assert first["case"][0] != second["case"][0]
    assert len(lines(journal)) == 2


@pytest.mark.not_on_cpu("it asks for an adapter")
def test_what_a_device_could_not_do_is_tried_again(tmp_path):
    journal = tmp_path / "journal.jsonl"
    given = {"methods": "uniform", "parameters": {"resolution": [32768]}, "repeats": 1}
    table = lx.study("plane_and_box", journal=journal, **given, **SMALL)
    assert "DeviceError" in table["error"][0]
    assert lines(journal) == []


def test_killed_study_resumes(tmp_path):
    journal = tmp_path / "journal.jsonl"
    arguments = (
        f"'plane_and_box', methods=['uniform', 'rtw'], repeats=4, size=(64, 36), progress=False, "
        f"parameters={{'resolution': [32, 48, 64, 80, 96]}}, journal={str(journal)!r}"
    )
    process = subprocess.Popen([sys.executable, "-c", f"import lixel as lx; lx.study({arguments})"])
    until(lambda: journal.exists() and journal.read_bytes().count(b"\n") >= 12)
    process.kill()
    process.wait()
    survived = samples(journal)
    assert 12 <= len(survived) < 40, "killed too late to show anything"
    table = eval(f"lx.study({arguments})", {"lx": lx})
    assert list(table["repeats"]) == 10 * [4]
    assert set(samples(journal)) > set(survived)
    assert len(samples(journal)) == 40
    assert set(samples(journal).values()) == {1}


def until(holds, seconds=60.0):
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end
        time.sleep(0.005)


def test_ctrl_c_keeps_what_there_is(monkeypatch, capfd):
    sample = module.sample

    def interrupted(case, turn):
        if turn == 1 and case.method.name == "rtw":
            os.kill(os.getpid(), signal.SIGINT)
        return sample(case, turn)

    monkeypatch.setattr(module, "sample", interrupted)
    table = lx.study("plane_and_box", methods=["uniform", "rtw"], repeats=3, **SMALL)
    assert list(table["repeats"]) == [2, 1]
    assert not table.attrs["complete"]
    assert "stopped" in capfd.readouterr().err


# --- Elsewhere ---

METHODS = {"methods": ["uniform", "desired_view", "rtw"]}
COMPARED = ["scene", "method", "resolution", "misclassified_count", "ssim", "repeats", "case"]


@pytest.fixture(scope="module")
def here():
    return study_of_two_scenes(None)


def study_of_two_scenes(executor, **more):
    return lx.study(
        ["plane_and_box", lx.scenes.needles(count=30)],
        parameters={"resolution": [32, 64]},
        repeats=2,
        executor=executor,
        **METHODS,
        **SMALL,
        **more,
    )


def test_processes_find_the_same(here, tmp_path):
    journal = tmp_path / "journal.jsonl"
    context = multiprocessing.get_context("spawn")
    with concurrent.futures.ProcessPoolExecutor(2, mp_context=context) as executor:
        table = study_of_two_scenes(executor, journal=journal)
    pd.testing.assert_frame_equal(table[COMPARED], here[COMPARED])
    assert set(samples(journal).values()) == {1}


def test_threads_find_the_same(here):
    with concurrent.futures.ThreadPoolExecutor(2) as executor:
        table = study_of_two_scenes(executor)
    pd.testing.assert_frame_equal(table[COMPARED], here[COMPARED])


# Dask's packages leave sockets to the garbage collector, and warn about one another.
@pytest.mark.filterwarnings("ignore")
def test_a_dask_cluster_finds_the_same(here, tmp_path):
    from dask.distributed import Client, LocalCluster

    journal = tmp_path / "journal.jsonl"
    with (
        LocalCluster(
            n_workers=2,
            threads_per_worker=1,
            dashboard_address=None,
            local_directory=str(tmp_path),
        ) as cluster,
        Client(cluster) as client,
    ):
        table = study_of_two_scenes(client.get_executor(), journal=journal)
        # It did go there.
        pids = set(client.run(os.getpid).values())
        assert os.getpid() not in pids
        rendered = client.run(lambda: "lixel" in sys.modules)
        assert any(rendered.values())
    pd.testing.assert_frame_equal(table[COMPARED], here[COMPARED])
    assert set(samples(journal).values()) == {1}


def test_an_error_of_a_worker_is_not_swallowed(tmp_path):
    class Broken(concurrent.futures.ThreadPoolExecutor):
        def submit(self, function, task):
            if task[0][1] == 1:
                return super().submit(lambda: 1 / 0)
            return super().submit(function, task)

    journal = tmp_path / "journal.jsonl"
    with Broken(1) as executor, pytest.raises(ZeroDivisionError):
        study_of_two_scenes(executor, journal=journal)
    # What had arrived is kept.
    assert all(turn == 0 for _, turn in samples(journal))


@pytest.mark.parametrize(
    ("light_count", "methods", "tasks"),
    [(70, 10, 70), (70, 2, 70), (200, 1, 50), (7, 10, 35), (1, 20, 20)],
    ids=["whole views", "small views", "several views", "pieces of views", "one view"],
)
def test_the_cases_of_a_view_travel_together(light_count, methods, tasks):
    # Where they do not, each worker casts the rays of the reference again.
    sent = []

    class Kept(concurrent.futures.ThreadPoolExecutor):
        def submit(self, function, task):
            sent.append([(case.light, case.key) for case, _ in task])
            return super().submit(list)

    lights = {str(i): lx.DirectionalLight((0.01 * i, -1.0, 0.0)) for i in range(light_count)}
    resolutions = [32 + i for i in range(methods)]
    with Kept(1) as executor:
        lx.study(
            "plane_and_box",
            lights=lights,
            methods="uniform",
            parameters={"resolution": resolutions},
            repeats=1,
            executor=executor,
            **SMALL,
        )
    assert len(sent) == tasks
    keys = [key for task in sent for _, key in task]
    assert len(keys) == len(set(keys)) == light_count * methods
    views = [{repr(light) for light, _ in task} for task in sent]
    if light_count >= 64:
        assert sum(map(len, views)) == light_count


# --- On the command line ---


def test_study_command_resumes(tmp_path, capfd):
    output = tmp_path / "table.csv"
    command = [
        *("lab", "study", "plane_and_box", "needles", "--size", "64x36", "--repeats", "2"),
        *("--method", "uniform", "--method", "rtw", "--resolution", "64"),
        *("--set", "lookup=auto,depth", "-o", str(output)),
    ]
    assert cli.main(command) == 0
    text = capfd.readouterr().out.splitlines()
    assert text[0].split()[:6] == ["scene", "camera", "light", "method", "resolution", "lookup"]
    assert len(text) == 2 + 2 * 2 * 2
    table = read(output)
    assert list(table["lookup"].unique()) == ["auto", "depth"]
    assert table.attrs["command"].startswith("lixel lab study plane_and_box needles --size 64x36")
    assert re.fullmatch(r"\d{4}-\d\d-\d\d", table.attrs["date"])
    assert set(samples(tmp_path / "table.csv.jsonl").values()) == {1}
    before = output.read_text()
    assert cli.main(command) == 0
    assert output.read_text() == before
    assert len(lines(tmp_path / "table.csv.jsonl")) == 16


def test_study_command_takes_every_view_of_a_file(tmp_path, capfd):
    views = tmp_path / "views.json"
    camera = {"eye": [1, 2, 3], "target": [0, 0, 0], "fov_y_deg": 60}
    lights = [{"kind": "directional", "direction": d} for d in ([0, -2, 0], [1, -2, 0])]
    views.write_text(
        json.dumps({"cameras": [camera, {**camera, "eye": [3, 2, 1]}], "lights": lights})
    )
    output = tmp_path / "table.csv"
    command = [
        *("lab", "study", "plane_and_box", "--views", str(views), "--all-views", "--size", "64x36"),
        *("--method", "uniform", "--resolution", "64", "--repeats", "1", "-o", str(output)),
    ]
    assert cli.main(command) == 0
    table = read(output)
    assert table[["camera", "light"]].values.tolist() == [[0, 0], [0, 1], [1, 0], [1, 1]]


def test_study_command_draws_time_against_error(tmp_path):
    picture = tmp_path / "plot.png"
    command = ["lab", "study", "plane_and_box", "--size", "64x36", "--repeats", "1"]
    assert cli.main([*command, "--resolution", "64", "--plot", str(picture)]) == 0
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("option", ["-o", "--plot"])
def test_study_command_refuses_an_output_before_the_work(option, tmp_path, capfd):
    assert cli.main(["lab", "study", "plane_and_box", option, str(tmp_path / "table.xlsx")]) == 2
    assert "must end in ." in capfd.readouterr().err
