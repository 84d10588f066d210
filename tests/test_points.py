"""`lixel.shadows_at` against brute force in float64 that shares nothing with it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import numpy.typing as npt
import pytest
import views

import lixel as lx
from lixel import _core
from lixel.lab.points import measure, on_surfaces

Floats = npt.NDArray[np.float64]

ROUNDING = 2.0**-48


def brute_force(
    scene: lx.Scene, points: Floats, light: lx.Light
) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
    """Whether something stands between each point and the light, and whether that is certain.

    Ray against triangle by volumes of tetrahedra, and no answer where one of them is nearly zero.
    """
    corners = scene.vertices[scene.faces]
    lit, certain = np.ones(len(points), bool), np.ones(len(points), bool)
    for i, point in enumerate(points):
        to_light = light.vectors_from(point[None])[0]
        a, b, c = (corners[:, k] - point for k in range(3))
        volumes = np.stack([np.cross(v, w) @ to_light for v, w in ((a, b), (b, c), (c, a))])
        normal = np.cross(b - a, c - a)
        height, slope = np.einsum("ij,ij->i", normal, a), normal @ to_light
        with np.errstate(divide="ignore", invalid="ignore"):
            along = height / slope
        end = 1.0 if hasattr(light, "position") else np.inf
        size = np.abs(corners).max() ** 3
        inside = (volumes > 0).all(axis=0) | (volumes < 0).all(axis=0)
        lit[i] = not (inside & (along > 0) & (along < end)).any()
        is_close = (np.abs(volumes) < 1e-11 * size).any(axis=0) & (along > -1e-9)
        is_close |= inside & ((np.abs(along) < 1e-9) | (np.abs(along - end) < 1e-9))
        certain[i] = not is_close.any()
    return lit, certain


def by_both(scene: lx.Scene, points: Floats, light: lx.Light) -> npt.NDArray[np.float32]:
    """What grids answer, which is what rays do."""
    answers = [
        _core.shadows_at(
            scene._core, (points, ROUNDING), None, [light._core], None, int, by_rays=by_rays
        )[0]
        for by_rays in (False, True)
    ]
    np.testing.assert_array_equal(*answers)
    return answers[0]


LIGHTS = {
    "sun": lx.DirectionalLight((0.3, -1.0, 0.4)),
    "sun along an axis": lx.DirectionalLight((0, 0, -1)),
    "lamp inside": lx.PointLight((0.1, 0.2, -0.1)),
    "lamp outside": lx.PointLight((2.0, 3.0, 1.0)),
    "spot": lx.SpotLight((1.5, 1.5, 0.5), (-1, -1, -0.2), outer=0.6),
    "hemisphere": lx.HemisphereLight((0.0, 1.2, 0.0), (0.1, -1, 0)),
}


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("offset", [0.0, 1e4])
def test_points_in_space_are_those_of_brute_force(light, offset):
    random = np.random.default_rng(7)
    scene = views.soup(3, count=60)
    points = random.uniform(-1.5, 1.5, (900, 3))
    lit, certain = brute_force(scene, points, light)
    lit &= light.reaches(points)
    if offset:
        # The same scene far from the origin: what float64 holds of it.
        moved = lx.Scene(scene.vertices + offset, scene.faces)
        fields = {name: getattr(light, name) for name in light._fields}
        if "position" in fields:
            fields["position"] = fields["position"] + offset
        scene, points, light = moved, points + offset, type(light)(**fields)
    found = by_both(scene, points, light)
    assert certain.mean() > 0.95
    assert 0.02 < lit.mean() < 0.95
    np.testing.assert_array_equal(found[certain], lit[certain])


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_points_in_a_crowd_are_those_of_rays(light):
    """Most triangles are in one cell of the light's grid, which has a finer one for them."""
    random = np.random.default_rng(3)
    middles = random.uniform(-0.5, 0.5, (9_000, 1, 3))
    corners = middles + random.normal(size=(9_000, 3, 3)) * 0.01
    floor = 400.0 * np.array([[-1, -0.002, -1], [1, -0.002, -1], [0, -0.002, 1]])
    vertices = np.concatenate([corners.reshape(-1, 3), floor])
    scene = lx.Scene(vertices, np.arange(len(vertices)).reshape(-1, 3))
    points = random.uniform(-1.0, 1.0, (3_000, 3))
    points[::3] *= (200.0, 1.0, 200.0)
    assert 0.02 < by_both(scene, points, light).mean() < 0.98


def sphere(subdivisions: int = 4) -> SimpleNamespace:
    """A convex closed mesh, and points on its triangles with their normals."""
    trimesh = pytest.importorskip("trimesh")
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=2.0)
    random = np.random.default_rng(1)
    weights = random.dirichlet((1, 1, 1), len(mesh.faces))
    points = np.einsum("fk,fkc->fc", weights, mesh.triangles)
    scene = lx.Scene(mesh.vertices, mesh.faces)
    return SimpleNamespace(
        scene=scene,
        mesh=mesh,
        points=points,
        normals=mesh.face_normals,
    )


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("offset", [0.0, 1e3])
@pytest.mark.parametrize("light", [LIGHTS["sun"], lx.PointLight((3.0, 4.0, -2.0))])
def test_a_convex_surface_does_not_shadow_itself(dtype, offset, light):
    ball = sphere()
    lit = np.einsum("nc,nc->n", ball.normals, light.vectors_from(ball.points)) > 0
    scene = lx.Scene(ball.mesh.vertices.astype(dtype).astype(float) + offset, ball.mesh.faces)
    if hasattr(light, "position"):
        light = lx.PointLight(light.position + offset)
    points = ball.points.astype(dtype) + dtype(offset)
    # Without normals the far side of the ball stands before what faces away. At its rim the ball is
    # so thin that the rounding of float32 does not tell its sides apart.
    is_sure = np.abs(np.einsum("nc,nc->n", ball.normals, light.vectors_from(points))) > (
        0.3 if dtype is np.float32 else 0.0
    ) * np.linalg.norm(light.vectors_from(points), axis=1)
    for normals in (None, ball.normals):
        found = lx.shadows_at(scene, points, light, normals)
        np.testing.assert_array_equal(found[is_sure], lit[is_sure])


def test_vertices_are_not_shadowed_by_the_triangles_that_meet_there():
    ball = sphere(3)
    light = LIGHTS["sun"]
    towards = -light.direction
    normals = ball.mesh.vertices
    found = lx.shadows_at(ball.scene, ball.mesh.vertices, light, normals)
    # At the rim the vertex and its triangles do not agree.
    cosine = normals @ towards / 2.0
    np.testing.assert_array_equal(found[cosine > 0.2], 1.0)
    np.testing.assert_array_equal(found[cosine <= 0.0], 0.0)


def test_a_wall_is_lit_from_either_side_unless_a_normal_says_which():
    wall = lx.Scene([(0, 0, 0), (4, 0, 0), (4, 3, 1), (0, 3, 1)], [(0, 1, 2), (0, 2, 3)])
    random = np.random.default_rng(2)
    u, v = random.uniform(0.01, 0.99, (2, 500, 1))
    points = u * [4.0, 0, 0] + v * [0, 3.0, 1.0]
    front = np.broadcast_to([0.0, -1.0, 3.0], points.shape)
    before, behind = (lx.DirectionalLight((0.1, -0.2, z)) for z in (-1.0, 1.0))
    assert lx.shadows_at(wall, points, before).all()
    assert lx.shadows_at(wall, points, behind).all()
    assert lx.shadows_at(wall, points, before, front).all()
    assert not lx.shadows_at(wall, points, behind, front).any()
    for by_rays in (False, True):
        lights = [before._core, behind._core]
        given = (wall._core, (points, ROUNDING), np.ascontiguousarray(front), lights)
        answers = _core.shadows_at(*given, None, int, by_rays=by_rays)
        np.testing.assert_array_equal(answers.mean(axis=1), (1, 0))
        # In the air before it nothing stands in the way but the normal.
        for normal, share in ((front, 1), (-front, 0)):
            given = (wall._core, (points + front, ROUNDING), np.ascontiguousarray(normal))
            found = _core.shadows_at(*given, [before._core], None, int, by_rays=by_rays)
            assert (found == share).all()
    # A smooth normal may face a light that its triangle does not: that stands in the way.
    smooth = front + np.array([2.0, 0.0, 0.0])
    grazing = lx.DirectionalLight((-1.0, 0.0, 0.05))
    assert (smooth @ -grazing.direction > 0).all()
    assert not lx.shadows_at(wall, points, grazing, smooth).any()


def test_points_of_a_view_are_lit_as_its_pixels_are():
    scene = views.small("colonnade")
    camera = scene.cameras["default"].resized(160, 90)
    light = scene.lights["default"]
    truth = lx.reference(scene, camera, light)
    counts = truth.covered & ~truth.tie & ~truth.triangle_tie
    found = lx.shadows_at(scene, truth.position[counts], light, truth.normal[counts])
    np.testing.assert_array_equal(found, truth.visibility[counts])


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_a_single_point_and_points_in_a_row_are_answered(light):
    scene = views.soup(3, count=60)
    along = np.linspace(-0.9, 0.9, 30)[:, None]
    direction = light.vectors_from(np.zeros((1, 3)))
    row = 0.2 + along * direction / np.linalg.norm(direction)
    lit, certain = brute_force(scene, row, light)
    lit &= light.reaches(row)
    assert not lit.all()
    np.testing.assert_array_equal(by_both(scene, row, light)[certain], lit[certain])
    for i in np.flatnonzero(certain)[::5]:
        assert by_both(scene, row[[i]], light) == lit[i]


@pytest.mark.parametrize("sizes", [1e6, 1e12])
def test_a_lamp_far_away_is_a_sun(sizes):
    scene = lx.scenes.colonnade()
    low, high = scene.vertices.min(axis=0), scene.vertices.max(axis=0)
    points = np.random.default_rng(3).uniform(low, high, (20_000, 3))
    direction = np.array([0.42, -0.8, -0.43])
    sun = lx.shadows_at(scene, points, lx.DirectionalLight(direction))
    lamp = lx.PointLight(-direction * sizes * np.linalg.norm(high - low))
    assert 0.05 < (sun == 0).mean() < 0.5
    np.testing.assert_array_equal(lx.shadows_at(scene, points, lamp), sun)


def test_points_that_nothing_can_stand_before_are_lit():
    scene = views.soup(3, count=60)
    inside = np.random.default_rng(4).uniform(-1, 1, (300, 3))
    beside = inside + np.array([9.0, 0, 0])
    assert by_both(scene, beside, lx.DirectionalLight((0.1, -1, 0.2))).all()
    # A lamp that is far away from the scene, but not from the points behind it.
    place = np.array([2e7, 5e7, 1e7])
    behind = place * np.random.default_rng(5).uniform(1.01, 2, (300, 1))
    both = np.concatenate([behind, inside])
    found = by_both(scene, both, lx.PointLight(place))
    assert found[:300].all()
    assert 0.1 < found[300:].mean() < 0.9


def test_many_lights_are_each_alone():
    scene = views.soup(5)
    points = np.random.default_rng(0).uniform(-1, 1, (300, 3))
    lights = list(LIGHTS.values())
    together = lx.shadows_at(scene, points, lights)
    assert together.shape == (len(lights), 300)
    assert together.dtype == np.float32
    for light, found in zip(lights, together, strict=True):
        np.testing.assert_array_equal(lx.shadows_at(scene, points, light, threads=1), found)
    assert lx.shadows_at(scene, points, []).shape == (0, 300)
    assert lx.shadows_at(scene, np.zeros((0, 3)), lights).shape == (len(lights), 0)


def test_what_is_no_point_is_refused():
    scene, sun = views.soup(5), LIGHTS["sun"]
    good = np.zeros((4, 3))
    bad = good.copy()
    bad[2, 1] = np.nan
    with pytest.raises(ValueError, match=r"points must be finite.*row 2 is \[0.0, nan, 0.0\]"):
        lx.shadows_at(scene, bad, sun)
    with pytest.raises(ValueError, match=r"points must have shape \(n, 3\), got \(4, 2\)"):
        lx.shadows_at(scene, good[:, :2], sun)
    with pytest.raises(TypeError, match="points must be an array of real numbers"):
        lx.shadows_at(scene, [["a", "b", "c"]], sun)
    with pytest.raises(ValueError, match="normals must be as many as points, 4, got 3"):
        lx.shadows_at(scene, good, sun, np.ones((3, 3)))
    with pytest.raises(ValueError, match=r"normals must be .*not of zero length: row 0"):
        lx.shadows_at(scene, good, sun, good)
    with pytest.raises(TypeError, match=r"light must be a lixel\.DirectionalLight"):
        lx.shadows_at(scene, good, (0, -1, 0))
    with pytest.raises(ValueError, match="threads must be"):
        lx.shadows_at(scene, good, sun, threads=0)


def test_the_caller_can_stop_it_between_two_pieces():
    scene, sun = views.soup(5), LIGHTS["sun"]
    seen = []

    def advance(count: int) -> None:
        seen.append(count)
        raise KeyboardInterrupt

    points = np.zeros((10, 3))
    with pytest.raises(KeyboardInterrupt):
        _core.shadows_at(scene._core, (points, ROUNDING), None, [sun._core] * 9, None, advance)
    assert seen == [10]


def test_answers_a_second_are_measured_beside_embree():
    rows = measure(lx.scenes.plane_and_box(), 2000, 3, repeats=1)
    assert [row["by"] for row in rows] == ["lixel.shadows_at", "without normals", "embreex"]
    assert all(row["million answers a second"] > 0 for row in rows)
    # Normals change nothing where surfaces are closed; Embree's rays start above them.
    assert rows[0]["other than the first"] == rows[1]["other than the first"] == "0.0000%"
    assert float(rows[2]["other than the first"].rstrip("%")) < 0.5


def test_points_are_spread_by_area():
    scene = lx.Scene(
        [[0, 0, 0], [3, 0, 0], [0, 0, 1], [10, 0, 0], [11, 0, 0], [10, 0, 1]],
        [[0, 1, 2], [3, 4, 5]],
    )
    points, normals = on_surfaces(scene, 4000, np.random.default_rng(0))
    near = points[points[:, 0] < 5]
    assert len(near) == pytest.approx(3000, abs=150)
    assert np.allclose(near.mean(axis=0), (1, 0, 1 / 3), atol=0.05)
    assert (near[:, 0] / 3 + near[:, 2] <= 1 + 1e-12).all()
    assert np.allclose(normals[:, [0, 2]], 0)
