"""Passes over the receivers of a layer look at the tiles of the image that may hold some."""

from __future__ import annotations

import numpy as np
import pytest

import lixel as lx
from lixel.frame import frame_parts

# A tile is 64 pixels wide and 32 high; the last of each row and column are cut.
SIZES = [(200, 100), (64, 32), (65, 33), (63, 31), (1, 1)]
METHODS = [
    "cube",
    "cube+notw",
    "cube+rtw",
    "dual_paraboloid",
    "cascades",
    "virtual",
    "uniform",
    "notw",
    "exact",
]


@pytest.mark.parametrize("size", SIZES, ids=str)
@pytest.mark.parametrize("method", METHODS)
def test_tiles_without_a_receiver_change_nothing(method, size):
    scene = lx.scenes.objects_on_floor(count=36, subdivisions=2)
    camera = lx.Camera.look_at((2, 3, 6), (0, 1, 0), yfov=1.1, width=size[0], height=size[1])
    chosen = lx.method_from(method)
    lights = [lx.DirectionalLight((0.4, -1.0, -0.3)), lx.SpotLight((1, 6, 1), (0, -1, 0.1), 0.4)]
    # In the view and behind the camera.
    lights += [lx.PointLight((0.3, 0.8, 1.0)), lx.PointLight((5.0, 4.0, 9.0))]
    for light in filter(chosen.takes, lights):
        tiled = lx.render_shadows(scene, camera, light, chosen)
        whole = frame_parts(scene, camera, light, chosen, culling=False)
        assert whole.visibility.tobytes() == tiled.tobytes()


def looked_at(frame):
    counters = frame.stats["image tiles"]
    return counters["looked_at"], counters["tiles"]


@pytest.mark.not_on_cpu("it counts the tiles of the shaders")
def test_all_faces_of_a_cube_look_at_little_more_than_one_image():
    scene = lx.scenes.colonnade()
    camera = scene.cameras["default"].resized(960, 540)
    for position in [(0.5, 2.0, -6.3), (3.0, 1.0, -2.0), (-2.0, 4.0, 5.0)]:
        light = lx.PointLight(position)
        layers = frame_parts(scene, camera, light, lx.Cube())
        listed, tiles = looked_at(layers)
        assert tiles == 15 * 17 * 6
        assert listed < 1.7 * tiles / 6


@pytest.mark.not_on_cpu("it counts the tiles of the shaders")
def test_tiles_that_only_see_what_faces_away_are_left_out():
    """Below is a floor that faces the light, above it a wall that does not."""
    floor = [(-50, 0, -4), (50, 0, -4), (50, 0, 9), (-50, 0, 9)]
    wall = [(-50, 0, -4), (50, 0, -4), (50, 60, -4), (-50, 60, -4)]
    faces = [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)]
    scene = lx.Scene(np.array([*floor, *wall], float), np.array(faces))
    camera = lx.Camera.look_at((0, 3, 6), (0, 1, 0), yfov=0.9, width=640, height=320)
    light = lx.DirectionalLight((0.1, -1.0, 0.8))
    frame = lx.render(scene, camera, light, "desired_view")
    # Towards the camera, as normals are.
    faces_light = np.einsum("hwc,c->hw", frame.normal, (0.1, -1.0, 0.8)) < 0
    expected = faces_light.reshape(10, 32, 10, 64).any(axis=(1, 3)).sum()
    assert 20 < expected < 80
    assert frame.stats["image tiles"] == {"looked_at": expected, "tiles": 100}
