"""Logarithmic perspective shadow maps: the error that they reach, and their formula."""

from __future__ import annotations

import numpy as np
import pytest
from views import cameras, small

import lixel as lx
from lixel import cli
from lixel.lab import angles
from lixel.lab.result_tables import read

NEAR, FAR = 1.0, 100.0
SIDE = 64
ANGLES = (90, 75, 60, 45, 30, 20, 10, 3)
"""Degrees between the light and the view, from overhead to along the view."""


@pytest.fixture(scope="module")
def frustum() -> tuple[lx.Scene, lx.Camera]:
    """A view that begins at a small plate and ends at a wall: 60 degrees wide."""
    wall = np.array([(-90, -90, -FAR), (90, -90, -FAR), (90, 90, -FAR), (-90, 90, -FAR)])
    plate = np.array([(-0.02, -0.3, -1), (0.02, -0.3, -1), (0.02, -0.3, -1.1), (-0.02, -0.3, -1.1)])
    quad = np.array([(0, 1, 2), (0, 2, 3)])
    scene = lx.Scene(np.concatenate([wall, plate]), np.concatenate([quad, quad + 4]))
    camera = lx.Camera.look_at(
        (0, 0, 0), (0, 0, -1), yfov=np.pi / 3, width=SIDE, height=SIDE, znear=0.999, zfar=100.1
    )
    return scene, camera


def light_at(degrees: float) -> lx.DirectionalLight:
    angle = np.radians(degrees)
    return lx.DirectionalLight((0, -np.sin(angle), -np.cos(angle)))


def largest_error(degrees: float, distance: float) -> float:
    """The largest perspective aliasing error over the frustum of a map with as many texels as there
    are pixels, whose apex is that far before it.

    Texels by finite differences of the map's inverse, pixels by the area of their beams, on a grid.
    """
    angle, tangent = np.radians(degrees), np.tan(np.pi / 6)
    shares = np.linspace(-1, 1, 9) * tangent
    depth, right, up = np.meshgrid(np.geomspace(NEAR, FAR, 60), shares, shares, indexing="ij")
    pixel = 2 * tangent * depth / (1 + right**2 + up**2) ** 0.25
    # Across the light: along the view, and beside it.
    along = depth * (np.sin(angle) + up * np.cos(angle))
    w = along - along.min() + distance
    slopes, ratio = depth * right / w, w.max() / distance

    def place(u, v):
        ahead = distance * ratio**v
        return np.stack([(slopes.min() + u * np.ptp(slopes)) * ahead, ahead])

    u, v = (slopes - slopes.min()) / np.ptp(slopes), np.log(w / distance) / np.log(ratio)
    h = 1e-5
    sides = [
        np.linalg.norm(place(u + du, v + dv) - place(u - du, v - dv), axis=0) / (2 * h)
        for du, dv in ((h, 0), (0, h))
    ]
    return float((np.maximum(*sides) / pixel).max())


@pytest.mark.parametrize("degrees", ANGLES)
def test_it_reaches_the_least_error_of_its_kind_at_every_angle(degrees, frustum):
    """Over all angles from overhead to along the view, as the papers sweep them."""
    light = light_at(degrees)
    bound = min(largest_error(degrees, FAR * share) for share in np.geomspace(1e-4, 1e4, 200))
    method = lx.LogPerspective(fit="frustum", margin=0.0, resolution=SIDE)
    reached = lx.render(*frustum, light, method).largest_aliasing_error
    assert reached == pytest.approx(bound, rel=0.1)


def test_overhead_its_error_is_the_logarithm_of_far_over_near(frustum):
    """The bound for any map of this kind: texels as long as pixels are wide, all along the view."""
    method = lx.LogPerspective(fit="frustum", margin=0.0, resolution=SIDE)
    reached = lx.render(*frustum, light_at(90), method).largest_aliasing_error
    wide = 2 * np.tan(np.pi / 6)
    # Rows are longer in the corners of the image, where pixels are smaller, too.
    corner = (1 + 2 * np.tan(np.pi / 6) ** 2) ** 0.25 * np.hypot(1, np.tan(np.pi / 6))
    assert np.log(FAR / NEAR) / wide < reached < 1.1 * corner * np.log(FAR / NEAR) / wide


@pytest.mark.parametrize("degrees", ANGLES)
def test_no_other_map_of_one_view_has_a_smaller_largest_error(degrees, frustum):
    light = light_at(degrees)
    found = {
        name: lx.render(
            *frustum, light, lx.method_from(name, fit="frustum", margin=0.0, resolution=SIDE)
        ).largest_aliasing_error
        for name in ("log_psm", "lispsm", "psm", "trapezoidal", "focused")
    }
    assert found["log_psm"] < 1.05 * min(found.values())
    if degrees > 60:
        assert found["log_psm"] < 0.5 * found["lispsm"] < 0.5 * found["focused"]


@pytest.mark.parametrize("name", ["colonnade", "terrain", "city"])
def test_rows_follow_from_the_matrix_by_a_logarithm(name):
    """A lit receiver lies at a texel whose depth is its own."""
    scene = small(name)
    _, camera = next(cameras(scene))
    light = lx.DirectionalLight((0.3, -1, -0.2))
    frame = lx.render(scene, camera, light, lx.LogPerspective(resolution=2048))
    (projection,), (matrix,) = frame.projections, frame.light_matrix
    assert projection["kind"] == "log_perspective"
    lit = frame.facing & (frame.visibility == 1.0)
    points = frame.position[lit]
    column, s, depth, w = matrix @ np.column_stack([points, np.ones(len(points))]).T
    row = projection["centre"][1] - projection["scale"][1] * np.log(s / w)
    texel = np.floor(np.stack([row, column / w])).astype(int)
    inside = ((texel >= 0) & (texel < 2048)).all(axis=0)
    assert inside.mean() > 0.999
    stored = frame.shadow_map[0][tuple(texel[:, inside])]
    assert np.median(np.abs(stored - depth[inside])) < 1e-3
    with pytest.raises(ValueError, match="frame must have light matrices, got log_perspective"):
        lx.LightMatrix.of(frame)


def test_a_margin_is_left_free_along_rows_and_columns():
    scene = small("colonnade")
    _, camera = next(cameras(scene))
    light = lx.DirectionalLight((0.3, -1, -0.2))
    frame = lx.render(scene, camera, light, lx.LogPerspective(resolution=512, margin=0.25))
    (projection,), (matrix,) = frame.projections, frame.light_matrix
    points = frame.position[frame.facing]
    column, s, _, w = matrix @ np.column_stack([points, np.ones(len(points))]).T
    row = projection["centre"][1] - projection["scale"][1] * np.log(s / w)
    for texel in (row, column / w):
        np.testing.assert_allclose([texel.min(), texel.max()], [512 / 6, 512 * 5 / 6], atol=0.02)


def test_where_there_is_no_logarithm_it_is_another_method():
    scene = small("objects_on_floor")
    camera = scene.cameras["default"].resized(160, 90)
    low, high = scene.bounds
    lamp = lx.PointLight((*(0.5 * (low + high))[[0]], high[1] + 5.0, 1.0))
    flat = lx.Camera.orthographic(camera.pose, xmag=4.0, width=160, height=90)
    along = lx.DirectionalLight(-camera.pose[:3, 2])
    for eye, light, other in (
        (camera, lamp, "lispsm"),
        (flat, lx.DirectionalLight((0.3, -1, 0.2)), "focused"),
        (camera, along, "focused"),
    ):
        mine, others = (
            lx.render(scene, eye, light, method, resolution=128) for method in ("log_psm", other)
        )
        assert np.array_equal(mine.light_matrix, others.light_matrix)
        assert np.array_equal(mine.visibility, others.visibility, equal_nan=True)


def test_the_command_writes_the_errors_by_angle(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(angles, "DEGREES", (90, 1))
    monkeypatch.setattr(angles, "FAR_OVER_NEAR", (10, 100))
    path = tmp_path / "angles.csv"
    assert cli.main(["lab", "angles", "-o", str(path)]) == 0
    assert "log_psm" in capsys.readouterr().out
    table = read(path).set_index(["far_over_near", "degrees"])
    assert list(table.columns) == list(angles.METHODS)
    assert (table.loc[(100, 90), "log_psm"] / table.loc[(10, 90), "log_psm"]) < 2.1
