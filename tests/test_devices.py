"""The choice of who renders, and what the CPU engine does without a driver."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import textwrap
from dataclasses import replace

import numpy as np
import pytest
from conftest import View

import lixel as lx
from lixel import _core, cli

EXACT = ("exact", "ray_traced", "shadow_volumes")
ADAPTERS = lx.info().adapters
SOFTWARE = ("Cpu", "Other")
HAS_HARDWARE = any(a["type"] not in SOFTWARE and not a["missing_features"] for a in ADAPTERS)


@pytest.fixture
def no_device(monkeypatch: pytest.MonkeyPatch) -> None:
    """As for a user who names no device."""
    monkeypatch.delenv("LIXEL_DEVICE", raising=False)


def environment(**more: str) -> dict[str, str]:
    """That of a process for a user who names no device."""
    kept = {name: text for name, text in os.environ.items() if name != "LIXEL_DEVICE"}
    return {**kept, **more}


NO_DRIVER = {"VK_ICD_FILENAMES": "/nonexistent", "VK_DRIVER_FILES": "/nonexistent"}


def ended(text: str, **more: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-W", "error", "-c", textwrap.dedent(text)]
    return subprocess.run(
        command, capture_output=True, text=True, timeout=120, check=False, env=environment(**more)
    )


def light_for(method: str, view: View) -> lx.Light:
    """One that the method takes."""
    others = (lx.PointLight((1, 4, 1)), lx.SpotLight((1, 4, 1), (0, -1, 0), 0.7))
    return next(light for light in (view.light, *others) if lx.METHODS[method]().takes(light))


# --- The choice ---


def test_the_cpu_engine_is_named_in_a_frame(view):
    frame = lx.render(*view, "exact", device="cpu")
    assert set(frame.adapter) == set(lx.render(*view, "exact").adapter)
    assert frame.adapter["type"] == "Cpu engine"
    assert frame.adapter["backend"] == "lixel"
    assert frame.adapter["name"] == lx.info().cpu["name"]
    assert frame.adapter["driver"].startswith(f"{lx.__version__}, ")
    for part in ("lanes", "threads"):
        assert str(lx.info().cpu[part]) in frame.adapter["driver"]


@pytest.mark.parametrize("method", lx.METHODS)
def test_any_number_of_threads_gives_the_same_image(method, view):
    seen = view.scene, view.camera, light_for(method, view)
    frames = [lx.render(*seen, method, device="cpu", threads=threads) for threads in (1, 2, 5)]
    for threads, frame in zip(("1 thread", "2 threads", "5 threads"), frames, strict=True):
        assert frame.adapter["driver"].endswith(f" {threads}")
        for name in ("visibility", "triangle_id", "shadow_map", "importance_map", "warp_map"):
            assert getattr(frame, name).tobytes() == getattr(frames[0], name).tobytes(), name
    images = lx.render_shadows(*seen[:2], [seen[2]] * 2, method, device="cpu", threads=3)
    assert all(image.tobytes() == frames[0].visibility.tobytes() for image in images)


def test_the_environment_says_how_many_threads(monkeypatch, view):
    monkeypatch.setenv("LIXEL_THREADS", "3")
    assert lx.render(*view, "exact", device="cpu").adapter["driver"].endswith(" 3 threads")
    frame = lx.render(*view, "exact", device="cpu", threads=1)
    assert frame.adapter["driver"].endswith(" 1 thread")
    monkeypatch.setenv("LIXEL_THREADS", "many")
    with pytest.raises(ValueError, match="LIXEL_THREADS must be from 1 to 1024, got many"):
        lx.render_shadows(*view, "exact", device="cpu")


@pytest.mark.parametrize(
    ("threads", "error"), [(0, ValueError), (-1, ValueError), (2000, ValueError), (1.5, TypeError)]
)
def test_a_number_of_threads_that_there_cannot_be_is_refused(threads, error, view):
    with pytest.raises(error, match="threads must be"):
        lx.render_shadows(*view, "exact", device="cpu", threads=threads)


@pytest.mark.not_on_cpu("it asks for an adapter")
@pytest.mark.parametrize("name", ["cpu", "CPU", "Cpu"])
def test_the_cpu_by_argument_and_by_environment(name, view, monkeypatch):
    by_argument = lx.render(*view, "exact", device=name)
    assert by_argument.adapter["type"] == "Cpu engine"
    monkeypatch.setenv("LIXEL_DEVICE", name)
    assert lx.render(*view, "exact").adapter == by_argument.adapter
    # What the caller says counts for more.
    assert lx.render(*view, "exact", device="gpu").adapter["type"] != "Cpu engine"


@pytest.mark.not_on_cpu("it asks for an adapter")
def test_an_adapter_by_a_part_of_its_name(view):
    name = ADAPTERS[0]["name"]
    for part in (name, name.upper(), name[1:5].lower()):
        assert lx.render(*view, "exact", device=part).adapter["name"] == name
    assert lx.render(*view, "exact", device="gpu").adapter["name"] == name


@pytest.mark.not_on_cpu("it asks for an adapter")
def test_two_names_of_one_adapter_are_one_device(view):
    name = ADAPTERS[0]["name"]
    lx.render(*view, "uniform", device="gpu")
    # What is known of the scene was not thrown away.
    assert "visibility" in lx.render(*view, "uniform", device=name).stats["skipped"]


@pytest.mark.not_on_cpu("it asks for an adapter")
@pytest.mark.parametrize("device", ["no such thing", ""])
def test_an_unknown_device_is_a_value_error(device, view):
    with pytest.raises(
        ValueError, match=r"device must be 'cpu', 'gpu' or a part .*, got "
    ) as caught:
        lx.render_shadows(*view, device=device)
    if device:
        assert ADAPTERS[0]["name"] in str(caught.value)


@pytest.mark.parametrize("device", [7, b"cpu", ("cpu",), True])
def test_a_device_of_another_type_is_a_type_error(device, view):
    with pytest.raises(TypeError, match=f"device must be .*, got {type(device).__name__}"):
        lx.render_shadows(*view, device=device)


def test_an_unknown_device_in_the_environment(view, monkeypatch):
    monkeypatch.setenv("LIXEL_DEVICE", "no such thing")
    with pytest.raises(ValueError, match="got 'no such thing'"):
        lx.render_shadows(*view)
    found = lx.info()
    assert found.device is None
    assert "no such thing" in found.problem


def test_without_a_name_hardware_comes_before_the_cpu_engine(no_device, view):
    for method in lx.METHODS:
        if not lx.METHODS[method]().takes(view.light):
            continue
        kind = lx.render(*view, method).adapter["type"]
        if HAS_HARDWARE:
            assert kind not in (*SOFTWARE, "Cpu engine")
        else:
            assert kind == "Cpu engine"


def test_an_empty_word_in_the_environment_names_nothing(no_device, view, monkeypatch):
    found = lx.render(*view, "exact").adapter
    monkeypatch.setenv("LIXEL_DEVICE", "")
    assert lx.render(*view, "exact").adapter == found


@pytest.mark.not_on_cpu("it asks for an adapter")
def test_the_method_for_want_of_one(no_device, view, monkeypatch):
    assert lx.render(*view, device="cpu").method == lx.Exact()
    assert "auto" in lx.render(*view, device="gpu").stats
    assert (lx.render(*view).method == lx.Exact()) or HAS_HARDWARE
    # A bound of the error is one of `Auto`.
    assert "auto" in lx.render(*view, device="cpu", max_error=0.1).stats
    with pytest.raises(ValueError, match="max_error must come with the method 'auto'"):
        lx.render_shadows(*view, "exact", device="cpu", max_error=0.1)


@pytest.mark.not_on_cpu("it compares the engines")
def test_auto_on_the_cpu_takes_what_never_errs(view):
    frame = lx.render(*view, "auto", device="cpu")
    assert frame.method == lx.Exact()
    facts, of_gpu = frame.stats["auto"], lx.render(*view, "auto", device="gpu").stats["auto"]
    assert list(facts) == list(of_gpu)
    assert (facts["method"], facts["predicted_error"]) == ("exact", 0.0)
    assert "CPU engine" in facts["why"]


def test_ray_queries_are_no_thing_of_the_cpu_engine(view):
    with pytest.raises(
        lx.DeviceError, match="'hardware' cannot be: the CPU engine has no ray quer"
    ):
        lx.render_shadows(*view, lx.RayTraced(traversal="hardware"), device="cpu")


@pytest.mark.not_on_cpu("it compares the engines")
def test_functions_that_make_parts_of_frames_take_a_device(view):
    for part in (lx.warp_map, lx.importance_map):
        of_cpu, of_gpu = (part(*view, "rtw", device=device) for device in ("cpu", "gpu"))
        assert of_cpu.shape == of_gpu.shape
        # A receiver on the border of two cells may be in either.
        assert np.mean(np.abs(of_cpu - of_gpu) > 1e-3) < 1e-3
        assert part(*view, "exact", device="cpu").shape[0] == 0


@pytest.mark.not_on_cpu("it compares the engines")
def test_a_study_has_rows_of_each_device(tmp_path):
    rows = {}
    for device in ("cpu", "gpu"):
        table = lx.study(
            "plane_and_box", methods=["exact"], size=(64, 36), repeats=1, progress=False,
            device=device, journal=tmp_path / "journal",
        )  # fmt: skip
        [rows[device]] = table.to_dict("records")
        assert rows[device]["misclassified_count"] == 0
        assert np.isnan(rows[device].get("error") or np.nan)
    assert rows["cpu"]["device"] == lx.info().cpu["name"]
    assert rows["gpu"]["device"] == ADAPTERS[0]["name"]
    assert rows["cpu"]["case"] != rows["gpu"]["case"]


@pytest.mark.not_on_cpu("it asks for an adapter")
def test_a_command_takes_a_device(tmp_path, capfd):
    arguments = ["render", "plane_and_box", "--size", "48x32", "-o", str(tmp_path / "x.npy")]
    assert cli.main([*arguments, "--method", "exact", "--device", "cpu"]) == 0
    assert "caster tests" in capfd.readouterr().out
    assert cli.main([*arguments, "--method", "exact", "--device", "nothing"]) == 2
    assert "device must be" in capfd.readouterr().err
    assert cli.main([*arguments, "--method", "exact", "--device", "cpu", "--threads", "2"]) == 0
    assert cli.main([*arguments, "--method", "exact", "--device", "cpu", "--threads", "0"]) == 2
    assert "LIXEL_THREADS must be from 1 to 1024, got 0" in capfd.readouterr().err
    # It holds for one command.
    assert lx.info().device["type"] != "Cpu engine"


def test_info_lists_the_cpu_engine_first_and_what_is_in_use(no_device):
    found = lx.info()
    lines = str(found).splitlines()
    assert lines[1] == "CPU engine"
    assert f"  threads: {found.cpu['threads']}" in lines
    assert lines[-1] == f"in use: {found.device['name']} ({found.device['type']})"
    assert (found.device["type"] == "Cpu engine") != HAS_HARDWARE


# --- Frames of the CPU engine ---


@pytest.mark.not_on_cpu("it compares the engines")
@pytest.mark.parametrize("method", lx.METHODS)
def test_a_frame_has_all_that_a_frame_has(method, view):
    seen = view.scene, view.camera, light_for(method, view)
    frame, other = (lx.render(*seen, method, device=device) for device in ("cpu", "gpu"))
    truth = lx.reference(*seen)
    assert np.array_equal(frame.triangle_id, other.triangle_id)
    wrong, wrong_on_gpu = (lx.compare(f, truth).misclassified_count for f in (frame, other))
    assert wrong <= (0 if method in EXACT else 1.05 * wrong_on_gpu + 3)
    for name in ("shadow_map", "importance_map", "warp_map", "light_matrix"):
        assert getattr(frame, name).shape == getattr(other, name).shape, name
    # A texel whose ray passes an edge within rounding may hold what is on either side of it.
    depths = np.abs(frame.shadow_map - other.shadow_map)
    assert np.count_nonzero(depths > 1e-4) <= 1e-3 * depths.size
    # A receiver on the border of two cells may be counted in either.
    assert np.allclose(frame.warp_map, other.warp_map, atol=0.02)
    assert np.allclose(frame.light_matrix, other.light_matrix, rtol=1e-3, atol=0.1)
    if frame.warp_map.size == 0:
        assert np.allclose(frame.aliasing_error, other.aliasing_error, rtol=1e-2, equal_nan=True)
    assert frame.stats["triangles"] == view.scene.triangle_count
    assert set(frame.timings) <= set(_core.labels())
    assert all(milliseconds >= 0.0 for milliseconds in frame.timings.values())


@pytest.mark.not_on_cpu("it compares the engines")
@pytest.mark.parametrize("method", lx.METHODS)
def test_a_list_of_lights_is_as_each_alone(method):
    scene = lx.scenes.colonnade(columns=4, detail=12)
    camera = scene.cameras["default"].resized(160, 90)
    low, high = scene.bounds
    inside = low + (high - low) * [0.45, 0.6, 0.55]
    lights = [
        *scene.lights.values(),
        lx.PointLight(inside),
        lx.SpotLight(inside, (0.2, -1, 0.1), 0.8),
        lx.HemisphereLight(inside, (0, -1, 0)),
        lx.DirectionalLight((1, -0.1, 0.2)),
    ]
    lights = [light for light in lights if lx.METHODS[method]().takes(light)]
    together = lx.render_shadows(scene, camera, lights, method, device="cpu")
    on_gpu = lx.render_shadows(scene, camera, lights, method, device="gpu")
    for light, found, other in zip(lights, together, on_gpu, strict=True):
        fresh = lx.Scene(scene.vertices, scene.faces)
        alone = lx.render_shadows(fresh, camera, light, method, device="cpu")
        assert found.tobytes() == alone.tobytes(), light
        truth = lx.reference(scene, camera, light)
        wrong, of_gpu = (lx.compare(image, truth).misclassified_count for image in (found, other))
        # Float32 rounds otherwise on each engine: some pixels at edges fall on the other side.
        assert wrong <= (0 if method in EXACT else 1.1 * of_gpu + 5), (light, of_gpu)
    assert lx.render_shadows(scene, camera, [], method, device="cpu").shape == (0, 90, 160)


MAPS = ("desired_view", "cube+notw", "dual_paraboloid+rtw", "lispsm+rtw", "notw", "cascades")
LOOKUPS = (
    "auto", "auto_5x5", "depth", "triangle", "triangle_1x1", "triangle_5x5",
    lx.Pcf(radius=2.0, samples=12), lx.Pcf(radius=0.05, samples=9, space="unwarped"),
    "revectorized", "variance", lx.ExponentialVariance(kernel="box"), lx.Moments(blur=4.5),
)  # fmt: skip


@pytest.mark.not_on_cpu("it compares the engines")
@pytest.mark.parametrize("lookup", LOOKUPS, ids=str)
@pytest.mark.parametrize("method", MAPS)
def test_lookups_answer_as_the_shaders_do(method, lookup):
    scene = lx.scenes.city()
    camera = scene.cameras["default"].resized(160, 90)
    low, high = scene.bounds
    lights = [*scene.lights.values(), lx.PointLight(low + (high - low) * [0.4, 0.9, 0.6])]
    method = replace(lx.method_from(method), lookup=lookup, resolution=256)
    for light in lights:
        if method.takes(light):
            seen = scene, camera, light, method
            of_cpu, of_gpu = (lx.render_shadows(*seen, device=device) for device in ("cpu", "gpu"))
            assert np.array_equal(np.isnan(of_cpu), np.isnan(of_gpu))
            differs = np.nan_to_num(np.abs(of_cpu - of_gpu)) > 0.2
            # Single pixels whose texel or edge is decided by the last bit.
            assert differs.sum() <= 20, light


def test_what_the_camera_sees_is_kept(view):
    scene, camera, light = view
    first = lx.render(scene, camera, light, "exact", device="cpu")
    assert "visibility" in first.timings
    again = lx.render(scene, camera, lx.PointLight((1, 4, 1)), "ray_traced", device="cpu")
    assert "visibility" not in again.timings
    assert again.stats["skipped"] == ["visibility"]
    assert "hierarchy (CPU)" in again.timings
    # The reference searches in the same hierarchy.
    lx.reference(scene, camera, light)
    again = lx.render(scene, camera, light, "ray_traced", device="cpu")
    assert again.stats["skipped"] == ["visibility", "hierarchy (CPU)"]
    assert "visibility" in lx.render(scene, camera.resized(95, 64), light, device="cpu").timings
    scene.update_vertices(scene.vertices + np.array([0.0, 0.1, 0.0]))
    moved = lx.render(scene, camera.resized(95, 64), light, "ray_traced", device="cpu")
    assert {"visibility", "hierarchy (CPU)"} <= set(moved.timings)


def test_what_the_light_sees_is_kept(view):
    scene, camera, light = view

    camera = camera.resized(384, 256)

    def exact(camera, light):
        return lx.render(scene, camera, light, "exact", device="cpu")

    first = exact(camera, light)
    assert "light grid" in first.timings
    again = exact(camera, light)
    assert again.stats["skipped"] == ["visibility", "light grid"]
    assert "light grid" not in again.timings
    assert np.array_equal(again.visibility, first.visibility, equal_nan=True)
    # It serves a camera beside it, too; but no other light, and no other shape.
    assert exact(camera.resized(381, 254), light).stats["skipped"] == ["light grid"]
    assert "light grid" in exact(camera, lx.PointLight((1, 4, 1))).timings
    assert "light grid" in exact(camera, light).timings
    scene.update_vertices(scene.vertices + np.array([0.0, 0.1, 0.0]))
    moved = exact(camera, light)
    assert "light grid" in moved.timings
    fresh = lx.Scene(scene.vertices, scene.faces)
    truth = lx.render_shadows(fresh, camera, light, "exact", device="cpu")
    assert np.array_equal(moved.visibility, truth, equal_nan=True)


def test_an_image_beyond_memory_is_refused(view):
    for size in ((2**20, 2**20), (1, 2**31), (2**32 - 1, 2**32 - 1)):
        with pytest.raises(ValueError, match=r"image size must not exceed .* on the CPU engine"):
            lx.render_shadows(view.scene, view.camera.resized(*size), view.light, device="cpu")


@pytest.mark.parametrize("method", ["uniform", "rtw", "dual_paraboloid"])
def test_a_map_beyond_memory_is_refused(method, view):
    light = light_for(method, view)
    large = replace(lx.METHODS[method](), resolution=32768)
    words = r"resolution must not exceed 268435456 pixels .* got width 32768 and height 32768"
    with pytest.raises(ValueError, match=words):
        lx.render(view.scene, view.camera, light, large, device="cpu")


# --- Processes ---

PICTURES = """
    import hashlib, json
    import lixel as lx

    scene = lx.scenes.colonnade(columns=4, detail=12)
    camera = scene.cameras["default"].resized(320, 180)
    low, high = scene.bounds
    lights = [*scene.lights.values(), lx.PointLight(low + (high - low) * [0.45, 0.6, 0.55])]
    found = {}
    for method in ("exact", "ray_traced"):
        for turn in range(2):
            images = lx.render_shadows(scene, camera, lights, method, device="cpu")
            found[f"{method} {turn}"] = hashlib.sha256(images.tobytes()).hexdigest()
    cpu = lx.info().cpu
    print(json.dumps([found, cpu["threads"], cpu["lanes"]]))
"""


def test_the_same_bytes_with_any_threads_and_lanes():
    pictures, lanes = [], []
    for more in (
        {"RAYON_NUM_THREADS": "1"},
        {"RAYON_NUM_THREADS": "2"},
        {"RAYON_NUM_THREADS": "7"},
        {"RAYON_NUM_THREADS": "2", "LIXEL_LANES": "baseline"},
    ):
        process = ended(PICTURES, **more)
        assert process.returncode == 0, process.stderr
        found, threads, of_process = json.loads(process.stdout)
        assert threads == int(more["RAYON_NUM_THREADS"])
        assert found["exact 0"] == found["exact 1"]
        pictures.append(found)
        lanes.append(of_process)
    assert all(found == pictures[0] for found in pictures[1:])
    assert lanes[0] == lanes[1]


def test_without_any_driver_exact_renders():
    process = ended(
        """
        import lixel as lx

        scene = lx.scenes.plane_and_box()
        view = scene, scene.cameras["default"].resized(96, 64), scene.lights["default"]
        assert lx.info().adapters == []
        truth = lx.reference(*view)
        for method in (None, "auto", "exact", "ray_traced", "shadow_volumes"):
            frame = lx.render(*view, method)
            assert frame.adapter["type"] == "Cpu engine"
            assert lx.compare(frame, truth).misclassified_count == 0
        lx.clear_cache()
        assert lx.render(*view, "uniform").adapter["type"] == "Cpu engine"
        linear = lx.RectilinearWarp(rasterization="linear")
        assert lx.render(*view, linear).adapter["type"] == "Cpu engine"
        for device in ("gpu", "llvmpipe"):
            try:
                lx.render_shadows(*view, device=device)
            except (lx.DeviceError, ValueError) as error:
                print(error)
        """,
        **NO_DRIVER,
    )
    assert (process.returncode, process.stderr) == (0, "")
    of_gpu, of_name = process.stdout.splitlines()
    assert of_gpu.startswith("no GPU adapter found; install a Vulkan driver")
    assert of_name.endswith("got 'llvmpipe': no adapter is called so; there is none")


def test_the_demo_needs_no_driver(tmp_path):
    process = ended(
        f"""
        from lixel import cli

        raise SystemExit(cli.main(["demo", "--out", {str(tmp_path)!r}, "--size", "64x36"]))
        """,
        **NO_DRIVER,
    )
    assert process.returncode == 0, process.stderr
    shown = {line.split()[0] for line in process.stdout.splitlines() if line}
    assert shown >= set(lx.METHODS) - {"spot"}
    assert (tmp_path / "directional" / "exact.png").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="signals are another matter there")
def test_an_interrupt_ends_a_list_of_lights():
    process = ended(
        """
        import os, signal, threading, time
        import lixel as lx

        scene = lx.scenes.plane_and_box()
        camera, light = scene.cameras["default"].resized(640, 360), scene.lights["default"]
        # A shell has what runs in the background ignore it.
        signal.signal(signal.SIGINT, signal.default_int_handler)
        threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
        start = time.monotonic()
        try:
            lx.render_shadows(scene, camera, [light] * 4000, "exact", device="cpu")
        except KeyboardInterrupt:
            print(time.monotonic() - start < 5)
        """
    )
    assert (process.returncode, process.stdout, process.stderr) == (0, "True\n", "")
