"""Parts of triangles that lie behind others are not drawn, in no map and not for the camera."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import lixel as lx
from lixel.frame import frame_parts
from lixel.methods import MAP_METHODS, OMNIDIRECTIONAL_METHODS

METHODS = [*MAP_METHODS, *OMNIDIRECTIONAL_METHODS]
LIGHT = lx.DirectionalLight((0.35, -1.0, -0.3))
LIGHTS = [
    LIGHT,
    lx.PointLight((0.3, 6.0, 0.4)),
    lx.SpotLight((0.5, 7.0, 1.0), (0.0, -1.0, -0.1), 0.7),
]
OUTLOOK = lx.Camera.look_at((4, 5, 6), (0, 1, 0), yfov=0.8, width=90, height=60)


def square(centre, u, v):
    """Two triangles, u and v from the centre to the sides."""
    corners = [np.subtract(centre, u) - v, np.add(centre, u) - v, np.add(centre, u) + v]
    return [*corners, corners[0], corners[2], np.subtract(centre, u) + v]


def scene_of(corners, seed=None):
    """Of the corners of triangles, which a seed shuffles."""
    triangles = np.reshape(np.asarray(corners, np.float64), (-1, 3, 3))
    if seed is not None:
        triangles = np.random.default_rng(seed).permutation(triangles)
    vertices = triangles.reshape(-1, 3)
    return lx.Scene(vertices, np.arange(len(vertices)).reshape(-1, 3))


def storeys(seed):
    """Floors under floors, level, tilted and crossing each other, and crumbs all over the place."""
    random = np.random.default_rng(seed)
    corners = square((0, 0, 0), (4, 0, 0), (0, 0, 4))
    for height in np.linspace(0.3, 3.0, 8):
        tilt = random.uniform(-0.35, 0.35, 2)
        centre = random.uniform(-1.0, 1.0, 3) * (1, 0, 1) + (0, height, 0)
        size = random.uniform(0.4, 1.6)
        corners += square(centre, (size, tilt[0], 0), (0, tilt[1], size))
    for place in random.uniform((-2, 0, -2), (2, 4, 2), (400, 3)):
        corners += [place + random.uniform(-0.06, 0.06, 3) for _ in range(3)]
    return scene_of(corners, seed)


@pytest.mark.not_on_cpu("it counts the work items of the shaders")
@pytest.mark.parametrize("method", METHODS)
def test_what_lies_behind_changes_no_map(method):
    """Maps, the camera's too, are those of a frame that draws everything."""
    chosen = dataclasses.replace(lx.method_from(method), resolution=200, lookup="triangle")
    hidden = compared = 0
    for seed, light in enumerate(filter(chosen.takes, LIGHTS)):
        view = (storeys(seed), OUTLOOK, light, chosen, ("triangle_id", "shadow_map"))
        frame, whole = (frame_parts(*view, culling=culls) for culls in (True, False))
        hidden += frame.stats["shadow map"]["hidden_items"]
        assert whole.stats["shadow map"]["hidden_items"] == 0
        assert frame.visibility.tobytes() == whole.visibility.tobytes()
        shown, all_shown = frame.outputs, whole.outputs
        assert shown.triangle_id.tobytes() == all_shown.triangle_id.tobytes()
        # Layers that no receiver needs are drawn then.
        if shown.shadow_map.shape == all_shown.shadow_map.shape:
            assert shown.shadow_map.tobytes() == all_shown.shadow_map.tobytes()
            compared += 1
    assert hidden > 0
    assert compared > 0 or method in OMNIDIRECTIONAL_METHODS


@pytest.mark.not_on_cpu("it counts the work items of the shaders")
@pytest.mark.parametrize("method", ["uniform", "rtw", "notw"])
def test_of_a_pile_one_floor_is_drawn(method):
    """The last of the list, but for the tiles that its two triangles share."""
    floors = 12
    corners = []
    for i in range(floors):
        corners += square((0, 0.01 * i, 0), (3, 0, 0), (0, 0, 3))
    light = lx.DirectionalLight((0.02, -1.0, 0.03))
    chosen = dataclasses.replace(lx.method_from(method), resolution=512)
    camera = lx.Camera.look_at((0, 5, 0.1), (0, 0, 0), yfov=1.0, width=64, height=64)
    stats = lx.render(scene_of(corners), camera, light, chosen).stats["shadow map"]
    assert stats["hidden_items"] > 0.9 * (floors - 1) / floors * stats["work_items"]


@pytest.mark.not_on_cpu("it counts the work items of the shaders")
def test_of_a_pile_one_floor_is_seen():
    corners = []
    for i in range(12):
        corners += square((0, 0.3 * i, 0), (9, 0, 0), (0, 0, 9))
    camera = lx.Camera.look_at((0.5, 8, 0.4), (0, 0, 0), yfov=1.0, width=320, height=240)
    stats = lx.render(scene_of(corners), camera, LIGHT, "uniform").stats["visibility"]
    assert stats["hidden_items"] > 0.9 * 11 / 12 * stats["work_items"]


@pytest.mark.not_on_cpu("it counts the work items of the shaders")
def test_small_triangles_are_hidden_too():
    """One floor above a thousand crumbs."""
    random = np.random.default_rng(3)
    corners = square((0, 1, 0), (3, 0, 0), (0, 0, 3))
    for place in random.uniform((-1, 0, -1), (1, 0.5, 1), (1000, 3)):
        corners += [place + random.uniform(-0.02, 0.02, 3) for _ in range(3)]
    light = lx.DirectionalLight((0.02, -1.0, 0.03))
    camera = lx.Camera.look_at((0, 0.2, 4), (0, 0, 0), yfov=1.0, width=64, height=64)
    stats = lx.render(scene_of(corners), camera, light, lx.Uniform(resolution=256)).stats
    drawn = stats["shadow map"]["work_items"] - stats["shadow map"]["hidden_items"]
    floor = lx.render(scene_of(corners[:6]), camera, light, lx.Uniform(resolution=256)).stats
    # Those near the diagonal, where no triangle covers a tile, are drawn.
    assert drawn < floor["shadow map"]["work_items"] + 250


def test_what_is_nearer_than_the_near_plane_hides_nothing():
    """A wall that the near plane cuts from corner to corner of the image, and a floor behind it."""
    camera = lx.Camera.look_at(
        (0, 4, 0), (0, 0, 0), up=(0, 0, 1), yfov=0.8, width=96, height=96, znear=1.5
    )
    wall = square((0, 2.5, 0), (2.5, 1, 0), (0, 1, 2.5))
    floor = square((0, 0, 0), (4, 0, 0), (0, 0, 4))
    frame = lx.render(scene_of([*floor, *wall]), camera, LIGHT, "uniform")
    sees_floor = np.isin(frame.triangle_id, (0, 1))
    # The wall is as far as the near plane where its two sides' slopes cancel.
    across = frame.position[..., 0] + frame.position[..., 2]
    assert sees_floor.mean() == pytest.approx(0.5, abs=0.02)
    assert (across[sees_floor] > -0.1).all()
    assert (across[~sees_floor] < 0.1).all()
