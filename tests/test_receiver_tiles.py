"""Maps that are not drawn whole: tiles that no receiver looks at are left out."""

from __future__ import annotations

import dataclasses

import pytest

import lixel as lx
from lixel.frame import frame_parts
from lixel.methods import MAP_METHODS, OMNIDIRECTIONAL_METHODS


@pytest.mark.parametrize("lookup", ["depth", "triangle_5x5", "auto", lx.Pcf(radius=20)], ids=str)
@pytest.mark.parametrize("method", [*MAP_METHODS, *OMNIDIRECTIONAL_METHODS])
def test_tiles_that_no_receiver_looks_at_change_nothing(method, lookup):
    """Few receivers, many texels apart: none stands in for another."""
    scene = lx.scenes.objects_on_floor(count=16, subdivisions=2)
    camera = lx.Camera.look_at((2, 3, 6), (1, 0, 0), yfov=0.5, width=60, height=40)
    chosen = dataclasses.replace(lx.method_from(method), lookup=lookup, resolution=1024)
    lights = [lx.DirectionalLight((0.4, -1.0, -0.3)), lx.PointLight((1.0, 4.0, 2.0))]
    lights.append(lx.SpotLight((1.0, 6.0, 1.0), (0.0, -1.0, 0.1), 0.6))
    for light in filter(chosen.takes, lights):
        part = frame_parts(scene, camera, light, chosen)
        whole = lx.render(scene, camera, light, chosen)
        expected = whole.visibility.tobytes()
        assert part.visibility.tobytes() == expected
        drawn = frame_parts(scene, camera, light, chosen, culling=False)
        assert drawn.visibility.tobytes() == expected


@pytest.mark.parametrize(
    ("light", "function_count"),
    [
        (lx.DirectionalLight((0.4, -1.0, -0.3)), 64),
        (lx.DirectionalLight((0.4, -1.0, -0.3)), 512),
        (lx.DirectionalLight((0.8, -0.5, -0.3)), 64),
        (lx.DirectionalLight((0.8, -0.5, -0.3)), 256),
        (lx.PointLight((1.0, 4.0, 2.0)), 128),
    ],
    ids=["high-64", "high-512", "low-64", "low-256", "point-128"],
)
def test_nothing_is_skipped_that_a_torn_map_needs(light, function_count):
    """The lookup goes on across seams, and triangles hide what lies behind them in whole tiles."""
    fit = "desired_view" if isinstance(light, lx.DirectionalLight) else "cube"
    for subdivisions, width, height in ((2, 60, 40), (4, 96, 64)):
        scene = lx.scenes.objects_on_floor(count=16, subdivisions=subdivisions)
        camera = lx.Camera.look_at((2, 3, 6), (1, 0, 0), yfov=0.5, width=width, height=height)
        for lookup in ("auto", "triangle"):
            torn = lx.NonOrthogonalWarp(
                fit=fit, lookup=lookup, resolution=1024, function_count=function_count, smoothing=0
            )
            part = lx.render_shadows(scene, camera, light, torn)
            whole = frame_parts(scene, camera, light, torn, culling=False)
            assert part.tobytes() == whole.visibility.tobytes()


def view_of_few_texels():
    scene = lx.scenes.objects_on_floor(count=64, subdivisions=3)
    camera = lx.Camera.look_at((4, 3, 4), (0, 0, 0), yfov=0.4, width=160, height=90)
    return scene, camera


@pytest.mark.not_on_cpu("it counts the work items of the shaders")
def test_less_is_drawn_where_no_receiver_looks():
    scene, camera = view_of_few_texels()
    light = lx.DirectionalLight((0.4, -1.0, -0.3))
    method = lx.Uniform(resolution=512)
    part = frame_parts(scene, camera, light, method)
    whole = lx.render(scene, camera, light, method)
    items = part.stats["shadow map"]["work_items"]
    assert items < 0.7 * whole.stats["shadow map"]["work_items"]
    assert "receiver tiles" in part.timings
    # A map that is asked for is whole, and finding the tiles of a small one would take longer.
    assert "receiver tiles" not in whole.timings
    small = frame_parts(scene, camera, light, lx.Uniform(resolution=64))
    assert "receiver tiles" not in small.timings


@pytest.mark.parametrize("method", ["uniform", "cascades", "cube", "dual_paraboloid"])
def test_tiles_are_skipped_on_the_cpu(method, monkeypatch):
    monkeypatch.setenv("LIXEL_DEVICE", "cpu")
    scene, camera = view_of_few_texels()
    light = lx.DirectionalLight((0.4, -1.0, -0.3))
    if method in ("cube", "dual_paraboloid"):
        light = lx.PointLight((0.0, 6.0, 0.0))
    chosen = dataclasses.replace(lx.method_from(method), resolution=1024)
    part = frame_parts(scene, camera, light, chosen)
    tiles = part.stats["layers"] * (1024 // 64) ** 2
    assert 0.2 * tiles < part.stats["shadow map"]["skipped_tiles"] < tiles
    assert "receiver tiles" in part.timings
    # Maps that are asked for are whole, and so are those of far lookups, of warps, and small ones.
    whole = lx.render(scene, camera, light, chosen)
    assert whole.shadow_map.shape[1:] == (1024, 1024)
    drawn = [whole]
    for changes in ({"lookup": lx.Pcf(radius=3)}, {"resolution": 16}):
        drawn.append(frame_parts(scene, camera, light, dataclasses.replace(chosen, **changes)))
    drawn.append(frame_parts(scene, camera, light, chosen, culling=False))
    if method == "cube":
        drawn.append(frame_parts(scene, camera, light, lx.method_from("cube+rtw")))
    for frame in drawn:
        assert "receiver tiles" not in frame.timings
