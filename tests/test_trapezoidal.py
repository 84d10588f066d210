"""Trapezoidal shadow maps: the formula, and how the map changes with the light."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from views import small

import lixel as lx

PAGE = Path(__file__).parents[1] / "docs" / "pages" / "own.md"
RESOLUTION = 256


@pytest.fixture(scope="module")
def objects() -> tuple[lx.Scene, lx.Camera]:
    scene = small("objects_on_floor")
    return scene, scene.cameras["default"].resized(240, 180)


@pytest.fixture(scope="module")
def in_python():
    """The ten lines of the page, which know nothing of the core's fit."""
    (code,) = re.findall(
        r"^(@lx\.shadow_method\(lights.*?from_eye\))$", PAGE.read_text(), re.M | re.S
    )
    names = {"lx": lx, "np": np}
    exec(code.replace("def trapezoid(", "def trapezoid_of_the_page("), names)
    return names["trapezoid_of_the_page"]


def places(frame: lx.Frame) -> np.ndarray:
    """Map coordinates, in texels, of the receivers that face the light."""
    points = frame.position[frame.facing]
    column, row, _, w = frame.light_matrix[0] @ np.column_stack([points, np.ones(len(points))]).T
    return np.stack([column / w, row / w], axis=-1)


@pytest.mark.parametrize("focus", [0.3, 0.5, 0.7])
@pytest.mark.parametrize("direction", [(0.3, -1, 0.2), (-0.9, -0.3, 0.1), (0.1, -0.15, -1)])
def test_it_is_the_matrix_of_the_ten_lines_in_python(direction, focus, in_python, objects):
    light = lx.DirectionalLight(direction)
    # Each fourth pixel of 240, as the page takes them.
    built_in = lx.Trapezoidal(focus=focus, sample_resolution=60, resolution=RESOLUTION)
    own = in_python(focus=focus, resolution=RESOLUTION)
    got, want = (places(lx.render(*objects, light, method)) for method in (built_in, own))
    assert len(got) > 1000
    assert np.allclose(got, want, atol=1e-6 * RESOLUTION)


@pytest.mark.parametrize("line", [0.7, 0.8, 0.9])
def test_the_nearer_part_has_its_share_of_the_map(line, objects):
    """Along the centre line, without a margin: the quotient of the rows at half of the length."""
    light = lx.DirectionalLight((0, -1, 0))
    method = lx.Trapezoidal(line=line, margin=0.0, resolution=RESOLUTION)
    frame = lx.render(*objects, light, method)
    row = places(frame)[:, 1] / RESOLUTION
    ahead = -frame.camera.pose[:3, 2] * (1, 0, 1)
    along = frame.position[frame.facing] @ (ahead / np.linalg.norm(ahead))
    first, last = along[row.argmin()], along[row.argmax()]
    # Samples lie a little inside.
    assert np.interp(0.5 * (first + last), *sorted_by(along, row)) == pytest.approx(line, abs=0.01)


def sorted_by(key: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    order = np.argsort(key)
    return key[order], values[order]


def test_the_map_does_not_jump_as_the_light_comes_to_shine_along_the_view(objects):
    scene, camera = objects
    forward, up = -camera.pose[:3, 2], camera.pose[:3, 1]
    stretches = []
    for angle in np.geomspace(1.0, 0.004, 13):
        light = lx.DirectionalLight(forward + angle * up)
        frame = lx.render(scene, camera, light, lx.Trapezoidal(resolution=RESOLUTION))
        points = frame.position[frame.facing]
        w = points @ frame.light_matrix[0, 3, :3] + frame.light_matrix[0, 3, 3]
        stretches.append(w.max() / w.min())
    ratios = np.divide(stretches[1:], stretches[:-1])
    # From a trapezoid to a box, in steps that are those of the light.
    assert stretches[0] > 3.0
    assert stretches[-1] < 1.1
    assert (ratios > 0.4).all()


def test_a_camera_of_parallel_rays_has_a_box(objects):
    scene, camera = objects
    flat = lx.Camera.orthographic(camera.pose, xmag=4.0, ymag=3.0, width=160, height=120)
    frame = lx.render(scene, flat, lx.DirectionalLight((0.3, -1, 0.2)), lx.Trapezoidal())
    assert np.allclose(frame.light_matrix[0, 3], (0, 0, 0, frame.light_matrix[0, 3, 3]))


def test_its_parameters_are_ruled():
    with pytest.raises(ValueError, match="focus must be a number above 0 and at most 1, got 0"):
        lx.Trapezoidal(focus=0)
    with pytest.raises(ValueError, match=r"line must be below 1, .* got 1"):
        lx.render_shadows(
            lx.scenes.plane_and_box(),
            lx.Camera.look_at((0, 2, 5), (0, 0, 0), yfov=1.0, width=8, height=8),
            lx.DirectionalLight((0, -1, 0)),
            lx.Trapezoidal(line=1.0),
        )
