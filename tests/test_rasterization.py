"""Linear rasterization, as published, beside the exact one (Rosen, section 6.1 and Table 3)."""

from __future__ import annotations

import dataclasses
from functools import cache
from typing import Any

import numpy as np
import pytest

import lixel as lx
from lixel.scenes import GENERATORS

pytestmark = pytest.mark.usefixtures("engine")

SCENES: dict[str, dict[str, Any]] = {
    "plane_and_box": {},
    "colonnade": {"columns": 4, "detail": 12},
    "city": {"blocks": 8},
}
SHARES = (None, 0.05, 0.025, 0.01)


@cache
def view(name: str, is_point: bool = False) -> tuple[lx.Scene, lx.Camera, lx.Light, lx.Reference]:
    scene = GENERATORS[name](**SCENES[name])
    light: lx.Light = scene.lights["default"]
    if is_point:
        low, high = scene.bounds
        light = lx.PointLight((low + high) / 2 + (0.3, 0.3 * (high - low).max(), 0.2))
    seen = scene, scene.cameras["default"].resized(320, 180), light
    return *seen, lx.reference(*seen)


def drawn(method: str, share: float | None = None, **parameters: Any) -> lx.Method:
    chosen = lx.method_from(method)
    parameters = {"resolution": 512, "lookup": "depth", **parameters}
    return dataclasses.replace(chosen, rasterization="linear", tessellation=share, **parameters)


def wrong(frame: lx.Frame, truth: lx.Reference) -> int:
    return lx.compare(frame, truth).misclassified_count


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize(
    ("method", "is_point"),
    [
        ("uniform", False),
        ("desired_view", False),
        ("lispsm", False),
        ("plane_optimal", False),
        ("cube", True),
        ("uniform", True),
    ],
)
@pytest.mark.parametrize("share", [None, 0.02])
def test_lines_stay_lines_where_nothing_is_warped(name, method, is_point, share):
    """However they are cut: the pieces of a triangle are the triangle, and its neighbours fit."""
    *seen, _ = view(name, is_point)
    linear = lx.render(*seen, drawn(method, share))
    exact = lx.render(*seen, dataclasses.replace(drawn(method), rasterization="exact"))
    # Texels whose rays pass an edge within rounding may see the other side.
    differ = np.abs(linear.shadow_map - exact.shadow_map) > 1e-4
    assert differ.mean() < 0.001
    covered = linear.covered
    assert (linear.visibility != exact.visibility)[covered].mean() < 0.002
    # No light through seams: what is covered stays covered.
    assert np.count_nonzero((linear.shadow_map == 1) != (exact.shadow_map == 1)) < 50


@pytest.mark.parametrize("name", SCENES)
@pytest.mark.parametrize("method", ["rtw", "notw", "lispsm+rtw"])
def test_warped_edges_are_wrong_until_they_are_split(name, method):
    *seen, truth = view(name)
    frames = [lx.render(*seen, drawn(method, share)) for share in SHARES]
    counts = [wrong(frame, truth) for frame in frames]
    exact = lx.render(*seen, dataclasses.replace(drawn(method), rasterization="exact"))
    print(name, method, counts, wrong(exact, truth))
    # The error of the papers shows, and most of it is gone with 1 %.
    assert counts[0] > 3 * wrong(exact, truth) + 100
    assert counts[3] - wrong(exact, truth) < 0.4 * (counts[0] - wrong(exact, truth))
    assert wrong(exact, truth) <= 1.05 * min(counts)
    pieces = [frame.stats["shadow map"]["rasterized"] for frame in frames]
    assert pieces == sorted(pieces)
    assert pieces[3] > 1.5 * pieces[0]


def test_paraboloids_are_wrong_until_they_are_split():
    """A floor of two triangles, as in Brabec et al.: its edges are circles in the map."""
    *seen, truth = view("plane_and_box", is_point=True)
    counts = [wrong(lx.render(*seen, drawn("dual_paraboloid", share)), truth) for share in SHARES]
    chosen = dataclasses.replace(drawn("dual_paraboloid"), rasterization="exact")
    exact = wrong(lx.render(*seen, chosen), truth)
    print(counts, exact)
    assert counts[0] > 5 * exact
    assert counts[3] <= 1.2 * exact + 2


def test_an_edge_from_near_to_behind_the_light_is_cut():
    """Triangles that reach behind a light have corners without a place in a face of a cube."""
    floor = [[-40, 0, -40], [40, 0, -40], [0, 0, 60]]
    wall = [[-1, -5, -2], [1, -5, -2], [0, 15, 1]]
    scene = lx.Scene(np.array([*floor, *wall], float), np.arange(6).reshape(2, 3))
    camera = lx.Camera.look_at((6, 5, 6), (0, 0, -1), yfov=0.9, width=160, height=90)
    seen = scene, camera, lx.PointLight((0.5, 3, 2))
    truth = lx.reference(*seen)
    for method in ("cube", "cube+rtw", "uniform"):
        for share in (None, 0.01):
            counts = wrong(lx.render(*seen, drawn(method, share)), truth)
            exact = dataclasses.replace(drawn(method), rasterization="exact")
            if method != "cube+rtw" or share is not None:
                assert counts <= wrong(lx.render(*seen, exact), truth) + 20, (method, share)


@pytest.mark.parametrize("method", ["rtw", "notw", "dual_paraboloid"])
def test_same_bytes_at_every_run(method):
    *seen, _ = view("city", is_point=method == "dual_paraboloid")
    chosen = drawn(method, 0.02, lookup="auto")
    runs = {lx.render(*seen, chosen).shadow_map.tobytes() for _ in range(3)}
    assert len(runs) == 1


def test_other_lookups_take_the_triangles_of_the_pieces():
    *seen, truth = view("city")
    depth = wrong(lx.render(*seen, drawn("rtw", 0.01)), truth)
    auto = lx.compare(lx.render(*seen, drawn("rtw", 0.01, lookup="auto")), truth)
    assert auto.misclassified_count < depth
    triangle = lx.compare(lx.render(*seen, drawn("rtw", lookup="triangle")), truth)
    assert triangle.false_shadow_count == 0


def test_splitting_ends_where_no_splitting_makes_an_edge_short(engine):
    """Of a paraboloid with a warp that is torn: corners in a line leave an area in its map."""
    scene = lx.scenes.plane_and_box()
    camera = scene.cameras["default"].resized(64, 36)
    light = lx.PointLight((0.0, 2.2, 0.0))
    method = lx.method_from("dual_paraboloid+notw@published", resolution=64, tessellation=0.1)
    frame = lx.render(scene, camera, light, method)
    counted = ("rasterized", "culled_outside", "culled_by_depth")
    pieces = sum(frame.stats["shadow map"].get(name, 0) for name in counted)
    on_cpu = lx.render(scene, camera, light, method, device="cpu")
    assert pieces == pytest.approx(on_cpu.stats["shadow map"]["rasterized"], rel=0.05)
    differing = frame.visibility[frame.covered] != on_cpu.visibility[frame.covered]
    assert differing.mean() < 0.02


def test_more_pieces_than_the_device_holds_are_refused():
    *seen, truth = view("plane_and_box")
    with pytest.raises(lx.DeviceError, match=r"tessellation makes more than \d+ pieces"):
        lx.render(*seen, drawn("rtw", 1e-4))
    # And the next frame is as if nothing had happened.
    assert wrong(lx.render(*seen, drawn("rtw", 0.05)), truth) < 1000


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"rasterization": "cubic"}, ValueError, "rasterization must be one of 'exact', 'linear'"),
        (
            {"tessellation": 0.0},
            ValueError,
            "tessellation must be a number above 0 .*, got 0.0",
        ),
        ({"tessellation": 1.5}, ValueError, "tessellation must be .* at most 1 or None, got 1.5"),
        ({"tessellation": float("nan")}, ValueError, "tessellation must be .* got nan"),
        ({"tessellation": "5%"}, TypeError, "tessellation must be .*, got '5%'"),
    ],
)
def test_bad_parameters_are_named(arguments, error, words):
    with pytest.raises(error, match=words):
        lx.Uniform(**arguments)
