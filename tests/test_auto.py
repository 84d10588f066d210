"""The choice of a method: it keeps its promise, says what it did, and does the same again."""

from __future__ import annotations

import copy
from pathlib import Path

import numpy as np
import pytest
from views import small

import lixel as lx
from lixel import auto
from lixel.lab import calibration
from lixel.lab.result_tables import read

RESULTS = Path(__file__).parents[1] / "docs" / "results" / "auto" / "llvmpipe.parquet"

NAMES = ("plane_and_box", "objects_on_floor", "colonnade", "city", "grass", "terrain")


def changed(monkeypatch, **parts):
    """A model with other numbers."""
    model = copy.deepcopy(auto.model())
    for part, values in parts.items():
        model[part].update(values)
    monkeypatch.setattr(auto, "model", lambda: model)


@pytest.fixture
def cheap_maps(monkeypatch):
    costly = ("ray_traced", "exact, directional", "exact, positional")
    changed(monkeypatch, ms={name: [1e6, 0.0, 0.0, 0.0] for name in costly})


def lights(scene):
    low, high = scene.bounds
    point_light = low + (high - low) * [0.3, 1.3, 0.6]
    return (*scene.lights.values(), lx.PointLight(point_light))


@pytest.mark.parametrize("name", NAMES)
def test_the_promise_is_kept(name, cheap_maps):
    scene = small(name)
    camera = scene.cameras["default"].resized(320, 180)
    for light in lights(scene):
        truth = lx.reference(scene, camera, light)
        for max_error in (0.1, 0.01, 0.002, 0.0):
            frame = lx.render(scene, camera, light, max_error=max_error)
            told = frame.stats["auto"]
            assert lx.compare(frame, truth).rate_covered <= max_error, told
            assert told["predicted_error"] <= max_error


@pytest.mark.not_on_cpu("there it takes what never errs")
def test_maps_are_taken_where_they_are_cheaper_and_good_enough(cheap_maps):
    scene = small("colonnade")
    view = scene, scene.cameras["default"].resized(320, 180), scene.lights["default"]
    chosen = {e: lx.render(*view, max_error=e) for e in (0.5, 0.002, 0.0)}
    assert chosen[0.5].method == lx.LightSpacePerspective(resolution=512)
    assert chosen[0.5].stats["auto"]["tried"] == ["lispsm 256", "lispsm 512"]
    assert chosen[0.5].shadow_map.shape == (1, 512, 512)
    # What it errs is measured above.
    assert chosen[0.002].method.map_resolution in (512, 1024, 2048)
    assert chosen[0.0].method in (lx.Exact(), lx.RayTraced())
    assert chosen[0.0].stats["auto"]["tried"] == []
    point_light = lights(scene)[1]
    frame = lx.render(*view[:2], point_light, max_error=0.5)
    assert frame.method == lx.DesiredView(resolution=512)
    # Every map that was rendered counts.
    alone = lx.render(*view[:2], point_light, frame.method)
    assert frame.timings.keys() >= alone.timings.keys() - {"visibility"}


@pytest.mark.not_on_cpu("there it takes what never errs")
def test_a_map_that_is_not_good_enough_is_not_taken(cheap_maps, monkeypatch):
    scene = small("grass")
    view = scene, scene.cameras["default"].resized(320, 180), scene.lights["default"]
    frame = lx.render(*view, max_error=0.001)
    assert frame.method in (lx.Exact(), lx.RayTraced())
    assert frame.stats["auto"]["tried"][:2] == ["lispsm 256", "lispsm 512"]
    assert "no map was found" in frame.stats["auto"]["why"]
    # The bound of two maps is what decides.
    changed(monkeypatch, error={"share": 1e-6})
    assert lx.render(*view, max_error=0.001).method == lx.LightSpacePerspective(resolution=512)


@pytest.mark.not_on_cpu("there it takes what never errs")
def test_no_map_is_tried_where_rays_are_cheaper(view, monkeypatch):
    changed(monkeypatch, ms={"ray_traced": [1e-3, 0.0, 0.0, 0.0]})
    frame = lx.render(*view, max_error=0.1)
    assert frame.method == lx.RayTraced()
    assert frame.stats["auto"]["why"] == "no pair of maps is cheaper"
    # A scene that moves pays for the hierarchy in every frame.
    changed(monkeypatch, ms={"ray_traced": [1e-3] + [0.0] * 3, "build": [1e12]})
    view.scene.update_vertices(view.scene.vertices * 1.01)
    assert lx.render(*view, max_error=0.0).method == lx.Exact()


@pytest.mark.not_on_cpu("there it takes what never errs")
def test_too_little_time_is_said(cheap_maps, view):
    frame = lx.render(*view, max_error=0.0, max_ms=1e-3)
    told = frame.stats["auto"]
    assert frame.method.map_resolution == auto.RESOLUTIONS[0]
    assert told["why"] == "nothing keeps both max_error and max_ms: the fastest map"
    assert told["predicted_error"] is None
    assert lx.render(*view, max_error=0.0, max_ms=1e9).method in (lx.Exact(), lx.RayTraced())


@pytest.mark.not_on_cpu("there it takes what never errs")
@pytest.mark.parametrize("of_rays", [0.5, 0.9, 1.0, 1.1, 3.0, 30.0])
@pytest.mark.parametrize("max_ms", [1e-3, 1.0, 15.0, 40.0, 200.0, None])
def test_no_map_is_taken_that_is_expected_slower_and_wrong(of_rays, max_ms, view, monkeypatch):
    """Whatever the time: rays cost so many times what the smallest map does."""
    light = view.light
    smallest = auto.map_for(light, auto.RESOLUTIONS[0])
    size = view.scene.triangle_count, view.camera.width * view.camera.height
    of_map = auto.predicted_ms(smallest, light, *size, is_moving=False)
    changed(monkeypatch, ms={"ray_traced": [of_rays * of_map, 0.0, 0.0, 0.0]})
    frame = lx.render(*view, max_error=1e-3, max_ms=max_ms)
    told = frame.stats["auto"]
    is_exact = frame.method in (lx.Exact(), lx.RayTraced())
    assert is_exact or told["predicted_ms"] < told["predicted_ms_without_error"]
    keeps_time = max_ms is None or told["predicted_ms_without_error"] <= max_ms
    if is_exact and not keeps_time:
        assert told["why"].endswith("no map is faster than what misclassifies no pixel")
        assert told["predicted_error"] == 0.0


@pytest.mark.not_on_cpu("there it takes what never errs")
def test_more_time_is_less_error(cheap_maps, view):
    resolutions = []
    for max_ms in (1e-3, 400.0, 1e5):
        frame = lx.render(*view, max_error=0.0, max_ms=max_ms)
        resolutions.append(frame.method.map_resolution)
        if frame.stats["auto"]["predicted_error"] is not None:
            assert frame.stats["auto"]["predicted_error"] > 0.0
    assert resolutions[0] < resolutions[-1] == auto.RESOLUTIONS[-1]
    assert resolutions == sorted(resolutions)


def test_it_is_the_default_and_chooses_for_each_light(view):
    scene, camera, light = view
    point_light = lx.PointLight((1.0, 6.0, 2.0))
    both = lx.render_shadows(scene, camera, [light, point_light])
    for layer, one in zip(both, (light, point_light), strict=True):
        alone = lx.render(scene, camera, one, lx.Auto())
        assert layer.tobytes() == alone.visibility.tobytes()
        assert lx.render_shadows(scene, camera, one).tobytes() == layer.tobytes()
        assert alone.stats["auto"]["max_error"] == 0.001


def test_a_device_that_cannot_is_given_another_method(view, monkeypatch):
    scene, camera, light = view
    changed(monkeypatch, ms={"ray_traced": [1e-3, 0.0, 0.0, 0.0]})

    def render(method):
        if isinstance(method, auto.RayTraced):
            raise lx.DeviceError("too long a walk")
        return lx.frame.frame_parts(scene, camera, light, method)

    parts = auto.choose(scene, camera, light, lx.Auto(max_error=0.0), render)
    assert parts.method == lx.Exact()
    assert parts.stats["auto"]["failed"] == ["ray_traced: too long a walk"]

    def refuse(method):
        raise lx.DeviceError(f"no {method.name}")

    with pytest.raises(lx.DeviceError, match="no ray_traced; exact: no exact"):
        auto.choose(scene, camera, light, lx.Auto(max_error=0.0), refuse)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"max_error": -0.1}, ValueError, "max_error must be a number from 0 to 1, got -0.1"),
        ({"max_error": float("nan")}, ValueError, "max_error must be"),
        ({"max_error": "1"}, TypeError, "max_error must be a number from 0 to 1, got '1'"),
        ({"max_ms": 0.0}, ValueError, "max_ms must be a finite number above 0 or None, got 0.0"),
        (
            {"method": "rtw", "max_ms": 1.0},
            ValueError,
            "max_ms must come with .* 'auto', got 'rtw'",
        ),
    ],
)
def test_bad_bounds_are_named(arguments, error, words, view):
    for render in (lx.render, lx.render_shadows):
        with pytest.raises(error, match=words):
            render(*view, **arguments)


# --- The calibration that is kept ---


def test_the_model_comes_from_the_kept_table():
    """But for what rounding another library's least squares may do."""
    table = read(RESULTS)
    fitted = calibration.fit(table)
    kept = auto.model()
    assert kept["command"] == fitted["command"]
    assert kept["command"].startswith("lixel lab calibration ")
    assert kept["error"] == fitted["error"]
    for key, coefficients in kept["ms"].items():
        np.testing.assert_allclose(coefficients, fitted["ms"][key], rtol=0.01, atol=0.01)


def test_the_bound_held_on_scenes_that_it_was_not_made_from():
    table = read(RESULTS)
    held_out = [
        r for r in calibration.how_often_it_held(table, auto.model()) if r["set"] == "held out"
    ]
    assert sum(row["accepted"] for row in held_out) > 50
    assert sum(row["kept"] for row in held_out) >= 0.95 * sum(r["accepted"] for r in held_out)


def test_calibration_goes_on_where_it_stopped(tmp_path, monkeypatch):
    scene = lx.scenes.plane_and_box()
    monkeypatch.setattr(
        calibration,
        "scenes",
        lambda folder: iter([("generated", "plane_and_box", scene, [*scene.cameras.values()])]),
    )
    path = tmp_path / "table.csv"
    counts = {"generated": 1}
    calibration.collect(tmp_path, path, counts, "lixel lab calibration")
    first = path.read_text()
    calibration.collect(tmp_path, path, counts, "lixel lab calibration")
    assert path.read_text() == first
    assert read(path)["method"].tolist() == ["lispsm"] * 4 + ["exact", "ray_traced"]
