"""Methods that promise no wrong pixel but ties, from views where that is hard, on both engines."""

from __future__ import annotations

import numpy as np
import pytest
from views import cameras, small, soup

import lixel as lx
from lixel.scenes import GENERATORS

SIZE = {"width": 160, "height": 90}

pytestmark = pytest.mark.usefixtures("engine")


@pytest.fixture(params=["exact", "rays in compute", "ray queries"])
def method(request: pytest.FixtureRequest) -> lx.Method:
    match request.param:
        case "exact":
            return lx.Exact()
        case "rays in compute":
            return lx.RayTraced(traversal="compute")
        case _:
            return request.getfixturevalue("ray_queries")


def wrong(method: str | lx.Method, scene: lx.Scene, camera: lx.Camera, light: lx.Light) -> int:
    truth = lx.reference(scene, camera, light)
    return lx.compare(lx.render_shadows(scene, camera, light, method), truth).misclassified_count


def directional_lights(scene: lx.Scene) -> list[lx.Light]:
    """The scene's own, overhead along an axis, and so low that shadows are fifty times as long."""
    directions = [(0.0, -1.0, 0.0), (1.0, -0.02, 0.3), (-0.3, -1.0, 0.9)]
    return [*scene.lights.values(), *(lx.DirectionalLight(d) for d in directions)]


@pytest.mark.parametrize("name", GENERATORS)
def test_no_pixel_is_wrong(method, name):
    scene = small(name)
    for light in directional_lights(scene):
        for label, camera in cameras(scene):
            assert wrong(method, scene, camera, light) == 0, (label, light)


def lights_with_a_position(scene: lx.Scene) -> list[lx.Light]:
    """Inside and above the scene: to all sides, in a narrow and a wide cone, to half of space."""
    low, high = scene.bounds
    inside = low + (high - low) * [0.45, 0.6, 0.55]
    above = low + (high - low) * [0.3, 1.5, 0.7]
    return [
        lx.PointLight(inside),
        lx.PointLight(above),
        lx.SpotLight(above, (0.2, -1.0, -0.3), outer=0.6),
        lx.SpotLight(inside, (0.3, -1.0, 0.1), outer=1.4),
        lx.HemisphereLight(inside, (0.1, -1.0, 0.2)),
    ]


@pytest.mark.parametrize("name", GENERATORS)
def test_no_pixel_is_wrong_near_a_light(method, name):
    scene = small(name)
    for light in lights_with_a_position(scene):
        for label, camera in list(cameras(scene))[:3]:
            assert wrong(method, scene, camera, light) == 0, (label, light)


@pytest.mark.parametrize("name", ["grass", "needles", "terrain"])
def test_all_searches_decide_alike(name):
    """The light's grid, which rounds for the whole scene, only says which casters may be met."""
    scene = small(name)
    light = lx.DirectionalLight((1.0, -0.02, 0.3))
    for label, camera in cameras(scene):
        view = scene, camera.resized(320, 180), light
        by_rays = lx.render_shadows(*view, lx.RayTraced(traversal="compute"))
        assert lx.render_shadows(*view, "exact").tobytes() == by_rays.tobytes(), label


def test_what_falls_away_behind_an_edge_casts_no_shadow_over_it(method):
    """Grazing light reaches a pixel of a needle; the next side's edge is 1e-7 away from its ray."""
    scene = small("needles")
    camera = dict(cameras(scene))["outside"].resized(640, 360)
    assert wrong(method, scene, camera, lx.DirectionalLight((-0.3, -1.0, 0.9))) == 0


@pytest.mark.parametrize("warp", ["rtw", "notw"])
def test_no_warp_and_no_resolution_changes_a_pixel(warp):
    scene = small("city")
    camera = scene.cameras["default"].resized(320, 180)
    for light in (*scene.lights.values(), *lights_with_a_position(scene)[:2]):
        plain = lx.render_shadows(scene, camera, light, "exact")
        for resolution in (1, 100, 1024):
            method = lx.Exact(warp=warp, resolution=resolution)
            other = lx.render_shadows(scene, camera, light, method)
            assert other.tobytes() == plain.tobytes(), (light, resolution)


@pytest.mark.not_on_cpu("its lists are of triangles, and nothing warps them")
def test_a_warp_shortens_the_longest_list():
    scene = lx.scenes.colonnade(columns=4, detail=12)
    view = scene, scene.cameras["default"].resized(640, 360), scene.lights["default"]
    longest = {
        warp: lx.render(*view, lx.Exact(warp=warp)).stats["receiver lists"]["longest_list"]
        for warp in ("none", "notw")
    }
    assert longest["notw"] < 0.7 * longest["none"]


def test_random_triangles(method):
    for seed in range(12):
        scene = soup(seed, count=200)
        light = lx.DirectionalLight(np.random.default_rng(seed).normal(size=3))
        camera = lx.Camera.look_at((2, 1.5, 3), (0, 0, 0), yfov=1.0, **SIZE)
        assert wrong(method, scene, camera, light) == 0, seed


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_any_unit_of_length_and_any_place(method, size):
    scene = small("objects_on_floor")
    camera, light = scene.cameras["default"], scene.lights["default"]
    offset = np.array([3e5, -2e5, 7e5]) * size
    moved = lx.Scene(size * scene.vertices + offset, scene.faces)
    pose = camera.pose.copy()
    pose[:3, 3] = size * pose[:3, 3] + offset
    camera = camera.resized(SIZE["width"], SIZE["height"])
    camera = lx.Camera(pose, focal=camera.focal, centre=camera.centre, **SIZE)
    assert wrong(method, moved, camera, light) == 0


def test_twins_in_one_plane(method):
    """Two coplanar layers, one of them with its winding turned, over a floor with a hole in it."""
    grid = np.linspace(-2, 2, 9)
    x, z = np.meshgrid(grid, grid, indexing="ij")
    points = np.stack([x.ravel(), np.zeros(81), z.ravel()], axis=1)
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.concatenate(
        [
            np.stack([corner, corner + 1, corner + 9], axis=1),
            np.stack([corner + 1, corner + 10, corner + 9], axis=1),
        ]
    )
    leaf = points * 0.4 + [0.3, 1.0, -0.2]
    vertices = np.concatenate([points, leaf, leaf])
    scene = lx.Scene(vertices, np.concatenate([faces, faces + 81, faces[:, ::-1] + 162]))
    for direction in ((0.3, -1.0, 0.2), (0.3, 1.0, 0.2), (1.0, -0.05, 0.0)):
        for eye in ((2.0, 2.5, 3.0), (0.5, -2.0, 1.0)):
            camera = lx.Camera.look_at(eye, (0, 0.3, 0), yfov=1.0, **SIZE)
            assert wrong(method, scene, camera, lx.DirectionalLight(direction)) == 0


def test_the_same_bytes_twice(method):
    scene = small("grass")
    view = scene, scene.cameras["default"].resized(320, 180), scene.lights["default"]
    first = lx.render_shadows(*view, method)
    assert first.tobytes() == lx.render_shadows(*view, method).tobytes()


def test_moved_vertices_cast_their_new_shadows(method):
    scene = small("city")
    camera, light = scene.cameras["default"].resized(160, 90), scene.lights["default"]
    before = lx.render_shadows(scene, camera, light, method)
    vertices = scene.vertices.copy()
    vertices[:, 1] *= 1.5
    scene.update_vertices(vertices)
    assert wrong(method, scene, camera, light) == 0
    assert lx.render_shadows(scene, camera, light, method).tobytes() != before.tobytes()


def test_a_scene_without_area_shows_nothing(method):
    scene = lx.Scene([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2], [0, 0, 0]])
    camera = lx.Camera.look_at((2, 1.5, 3), (0, 0, 0), yfov=1.0, **SIZE)
    light = lx.DirectionalLight((0.3, -1.0, 0.2))
    assert np.isnan(lx.render_shadows(scene, camera, light, method)).all()


@pytest.mark.not_on_cpu("it does not count the steps of a walk")
def test_rays_are_counted():
    scene = small("city")
    view = scene, scene.cameras["default"].resized(160, 90), scene.lights["default"]
    method = lx.RayTraced(traversal="compute")
    frame = lx.render(*view, method)
    assert 0 < frame.stats["shadow rays"]["rays"] <= 160 * 90
    assert 0 < frame.stats["shadow rays"]["longest_walk"] < 65_000
    assert "hierarchy (CPU)" in frame.timings
    assert "hierarchy (CPU)" in lx.render(*view, method).stats["skipped"]
