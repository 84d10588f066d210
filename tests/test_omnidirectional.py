"""Lights with a position, and the maps around them: cube, paraboloids, spot."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from views import small, soup

import lixel as lx
from lixel.lab.random_views import is_in_view

IMAGE = {"width": 240, "height": 160}
METHODS = [
    lx.Cube(),
    lx.Cube(cut="face"),
    lx.Cube(turned=True),
    lx.DualParaboloid(),
    lx.DualParaboloid(cut="receivers"),
    lx.ImprovedParaboloid(),
    lx.ImprovedParaboloid(cut="cone"),
    lx.ImprovedParaboloid(cut="frustum"),
    lx.RectilinearWarp(fit="cube"),
    lx.NonOrthogonalWarp(fit="dual_paraboloid"),
    lx.Uniform(),
    lx.DesiredView(),
]


def name_of(method: lx.Method) -> str:
    parameters = method.parameters()
    return "-".join(filter(None, (method.name, parameters.get("cut"), parameters.get("fit"))))


def wrong(scene, camera, light, method) -> lx.Comparison:
    truth = lx.reference(scene, camera, light)
    return lx.compare(lx.render(scene, camera, light, method), truth)


def floor_and_box() -> lx.Scene:
    """A floor of two huge triangles, and a box above it."""
    floor = np.array([(-50, 0, -50), (50, 0, -50), (50, 0, 50), (-50, 0, 50)], dtype=float)
    sides = np.array([(-0.6, 0.5, -0.6), (0.6, 1.7, 0.6)])
    corners = np.array([[sides[i >> axis & 1][axis] for axis in range(3)] for i in range(8)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads]
    return lx.Scene(
        np.concatenate([floor, corners]),
        np.concatenate([[(0, 2, 1), (0, 3, 2)], np.array(faces) + 4]),
    )


@pytest.mark.parametrize("method", METHODS, ids=name_of)
@pytest.mark.parametrize("position", [(1.7, 3.1, 2.3), (-4.1, 2.7, 1.3)])
def test_a_floor_of_two_triangles_needs_no_tessellation(method, position):
    scene = floor_and_box()
    camera = lx.Camera.look_at((4, 5, 7), (0, 0.3, 0), yfov=0.9, **IMAGE)
    truth = lx.reference(scene, camera, lx.PointLight(position))
    assert (truth.visibility == 0).sum() > 300
    result = wrong(scene, camera, lx.PointLight(position), method)
    assert result.misclassified_count < 0.001 * result.covered_count


@pytest.mark.parametrize("method", METHODS, ids=name_of)
@pytest.mark.parametrize("seed", range(3))
def test_triangles_all_around_the_light(method, seed):
    """They cross layers, pass behind the light and reach over a paraboloid's rim."""
    scene = soup(seed)
    position = np.random.default_rng(seed).uniform(-0.4, 0.4, 3)
    camera = lx.Camera.look_at((1.5, 1.1, 2.5), (0, 0, 0), yfov=0.9, **IMAGE)
    triangle = dataclasses.replace(method, lookup="triangle")
    result = wrong(scene, camera, lx.PointLight(position), triangle)
    assert result.false_shadow_count == 0
    assert result.false_lit_count < 0.02 * result.covered_count
    result = wrong(scene, camera, lx.PointLight(position), method)
    assert result.misclassified_count < 0.02 * result.covered_count


@pytest.mark.parametrize("outer", [0.3, 1.0, 1.3, np.pi / 2])
@pytest.mark.parametrize("cut", ["receivers", "cone"])
def test_spots_of_every_width(outer, cut):
    scene = lx.scenes.plane_and_box()
    camera = lx.Camera.look_at((4, 5, 7), (0, 0.3, 0), yfov=0.9, **IMAGE)
    light = lx.SpotLight((1.7, 3.1, 2.3), (-0.5, -1, -0.6), outer)
    for method in (lx.Spot(cut=cut), "ray_traced", "spot+rtw"):
        result = wrong(scene, camera, light, method)
        assert result.misclassified_count < 0.001 * result.covered_count
    visibility = lx.render_shadows(scene, camera, light, lx.Spot(cut=cut))
    truth = lx.reference(scene, camera, light)
    outside = (truth.triangle_id >= 0) & ~light.reaches(truth.position) & ~truth.tie
    assert (visibility[outside] == 0).all()


def test_a_hemisphere_lights_its_side():
    scene = lx.scenes.plane_and_box()
    camera = lx.Camera.look_at((4, 5, 7), (0, 0.3, 0), yfov=0.9, **IMAGE)
    light = lx.HemisphereLight((0.3, 2.1, 0.2), (1, -0.1, 0.3))
    for method in ("dual_paraboloid", "improved_paraboloid", "cube", "desired_view", "ray_traced"):
        result = wrong(scene, camera, light, method)
        assert result.misclassified_count < 0.001 * result.covered_count, method
    # The back paraboloid has nothing to hold.
    assert lx.render(scene, camera, light, "dual_paraboloid").stats["layers"] == 1


def test_layers_that_no_receiver_needs_are_not_made():
    scene = lx.scenes.plane_and_box()
    camera = lx.Camera.look_at((0, 2, 6), (0, 0, 0), yfov=0.7, **IMAGE)
    behind = lx.PointLight((0.2, 4.0, 11.0))
    for cut in ("frustum", "cone", "receivers"):
        frame = lx.render(scene, camera, behind, lx.ImprovedParaboloid(cut=cut))
        assert frame.stats["layers"] == 1
    frame = lx.render(scene, camera, behind, "cube")
    layers, skipped = frame.stats["layers"], frame.stats["skipped_layers"]
    assert layers + skipped == 6
    assert layers <= 2
    assert frame.shadow_map.shape == (layers, 1024, 1024)
    assert frame.light_matrix.shape == (layers, 4, 4)
    frame = lx.render(scene, camera, behind, "cube+notw")
    assert len(frame.importance_map) == len(frame.warp_map) == frame.stats["layers"]


@pytest.mark.parametrize(
    "method", ["cube", "dual_paraboloid", "improved_paraboloid", "cube+notw", "ray_traced"]
)
@pytest.mark.parametrize("place", ["on a surface", "on a vertex", "at the eye", "far away"])
def test_a_light_in_an_awkward_place_is_right_or_a_tie(method, place):
    scene = lx.scenes.plane_and_box()
    eye = np.array((4.0, 5.0, 7.0))
    camera = lx.Camera.look_at(eye, (0, 0.3, 0), yfov=0.9, **IMAGE)
    position = {
        "on a surface": (0.9, 0.0, 0.8),
        "on a vertex": scene.vertices[scene.vertices[:, 1].argmax()],
        "at the eye": eye,
        "far away": (3e6, 9e6, 2e6),
    }[place]
    light = lx.PointLight(position)
    visibility = lx.render_shadows(scene, camera, light, method)
    assert set(np.unique(visibility[~np.isnan(visibility)])) <= {0.0, 1.0}
    result = wrong(scene, camera, light, method)
    assert result.misclassified_count < 0.003 * result.covered_count


def test_methods_refuse_lights_that_they_are_not_made_for():
    scene = lx.scenes.plane_and_box()
    camera = lx.Camera.look_at((4, 5, 7), (0, 0.3, 0), yfov=0.9, **IMAGE)
    directional, point = lx.DirectionalLight((0, -1, 0)), lx.PointLight((0, 3, 0))
    for method in ("cube", "dual_paraboloid", "cube+rtw"):
        assert not lx.method_from(method).takes(directional)
        with pytest.raises(ValueError, match="needs a light with a position, got a directional"):
            lx.render_shadows(scene, camera, directional, method)
    for light in (directional, point):
        assert not lx.Spot().takes(light)
        with pytest.raises(ValueError, match="needs a spot light, got a"):
            lx.render_shadows(scene, camera, light, "spot")
    with pytest.raises(ValueError, match="cut must be one of 'receivers', 'face', got 'cone'"):
        lx.Cube(cut="cone")


def test_parallel_rays_are_the_limit_of_a_distant_light():
    scene = lx.scenes.colonnade(columns=4, detail=12)
    camera = scene.cameras["default"].resized(**IMAGE)
    direction = scene.lights["default"].direction
    far = lx.PointLight(np.mean(scene.bounds, axis=0) - 1e4 * direction)
    for cut in ("frustum", "cone", "receivers"):
        method = lx.ImprovedParaboloid(cut=cut)
        near_limit = lx.render(scene, camera, far, method)
        limit = lx.render(scene, camera, scene.lights["default"], method)
        assert near_limit.stats["layers"] == limit.stats["layers"] == 1
        differ = (near_limit.visibility != limit.visibility) & ~np.isnan(limit.visibility)
        assert differ.mean() < 0.02


def test_the_cube_knows_its_aliasing_error():
    """Against the width of a texel and of a pixel by hand."""
    scene = lx.scenes.plane_and_box()
    camera = lx.Camera.look_at((4, 5, 7), (0, 0.3, 0), yfov=0.9, **IMAGE)
    light = lx.PointLight((1.7, 3.1, 2.3))
    frame = lx.render(scene, camera, light, lx.Uniform(resolution=64))
    # A face of 64 texels over a right angle: below the light a texel is 2 / 64 of its height.
    points = frame.position
    foot = np.linalg.norm(points - np.array((1.7, 0, 2.3)), axis=-1)
    place = np.unravel_index(np.nanargmin(foot), foot.shape)
    assert frame.facing[place]
    to_eye = camera.eye - points[place]
    distance, depth = np.linalg.norm(to_eye), frame.depth[place]
    # The area of a pixel's beam is depth² / focal² across the view, less across the ray.
    pixel = depth / camera.focal[0] * np.sqrt(depth / distance)
    expected = 2 / 64 * 3.1 / pixel * to_eye[1] / distance
    assert frame.aliasing_error[place] == pytest.approx(expected, rel=0.02)


def test_an_improved_paraboloid_turns_with_the_receivers():
    """A long picture of a floor next to a light is as fine however the camera is rolled."""
    scene = lx.scenes.plane_and_box()
    light = lx.PointLight((1.5, 4.0, 0.5))
    mean = {}
    for roll in (0.0, 0.3, 0.7):
        up = (np.sin(roll), 0, -np.cos(roll))
        camera = lx.Camera.look_at((0, 5, 0), (0, 0, 0), up, yfov=0.2, width=480, height=80)
        frame = lx.render(scene, camera, light, "improved_paraboloid")
        mean[roll] = np.nanmean(frame.aliasing_error[frame.facing])
    assert max(mean.values()) < 1.3 * min(mean.values())


@pytest.mark.parametrize("lookup", ["auto", "depth", "triangle"])
def test_outside_the_view_one_improved_paraboloid_is_better_than_two(lookup):
    scene = small("colonnade")
    camera = scene.cameras["default"].resized(320, 180)
    low, high = scene.bounds
    wrong = {lx.ImprovedParaboloid: 0, lx.DualParaboloid: 0}
    for place in ((0.1, 0.9, 1.1), (0.9, 0.6, 1.2), (0.5, 1.4, 1.0), (-0.2, 0.5, 0.9)):
        light = lx.PointLight(low + (high - low) * place)
        assert not is_in_view(camera, light.position)
        truth = lx.reference(scene, camera, light)
        for method in wrong:
            frame = lx.render(scene, camera, light, method(resolution=256, lookup=lookup))
            wrong[method] += lx.compare(frame, truth).misclassified_count
            assert method is lx.DualParaboloid or frame.stats["layers"] == 1
    assert wrong[lx.ImprovedParaboloid] < 0.75 * wrong[lx.DualParaboloid]


def test_around_a_light_in_the_view_an_improved_paraboloid_is_dual_paraboloids():
    """As published. Beyond that the other cuts keep to what the receivers need."""
    scene = small("colonnade")
    camera = scene.cameras["default"].resized(160, 90)
    target = np.mean(scene.bounds, axis=0)
    light = lx.PointLight(0.6 * target + 0.4 * camera.eye)
    published = lx.ImprovedParaboloid(cut="frustum", resolution=128)
    improved = lx.render(scene, camera, light, published)
    dual = lx.render(scene, camera, light, lx.DualParaboloid(resolution=128))
    assert len(improved.light_matrix) == len(dual.light_matrix) == 2
    assert improved.visibility.tobytes() == dual.visibility.tobytes()
    cut = lx.render(scene, camera, light, lx.ImprovedParaboloid(cut="receivers", resolution=128))
    truth = lx.reference(scene, camera, light)
    wrong = [lx.compare(frame, truth).misclassified_count for frame in (cut, dual)]
    assert wrong[0] < wrong[1]


@pytest.mark.parametrize(
    "method",
    [
        lx.DualParaboloid(),
        lx.DualParaboloid(cut="receivers"),
        lx.ImprovedParaboloid(),
        lx.ImprovedParaboloid(cut="frustum"),
    ],
    ids=name_of,
)
def test_effective_resolution_is_that_of_the_finest_texel_of_a_paraboloid(method):
    """Directions of all texels by the formula of the stereographic projection, their distances by
    differences; a face of a cube has two units at a distance of one."""
    scene = floor_and_box()
    camera = lx.Camera.look_at((4, 5, 7), (0, 0.3, 0), yfov=0.9, **IMAGE)
    chosen = dataclasses.replace(method, resolution=256)
    frame = lx.render(scene, camera, lx.PointLight((1.7, 3.1, 2.3)), chosen)
    finest = np.full(2, np.inf)
    for projection in frame.projections:
        assert projection["kind"] == "paraboloid"
        edges = np.arange(257)
        x, y = np.meshgrid(edges, edges)
        places = (np.stack([x, y], axis=-1) - projection["centre"]) / projection["scale"]
        squared = (places**2).sum(axis=-1, keepdims=True)
        directions = np.concatenate([2 * places, 1 - squared], axis=-1) / (1 + squared)
        # A half is for what lies before the light.
        is_used = (directions[..., 2] >= 0) | (len(projection["region"]) == 0)
        for axis, of_axis in ((1, 0), (0, 1)):
            lengths = np.linalg.norm(np.diff(directions, axis=axis), axis=-1)
            used = np.take(is_used, range(256), axis=axis)
            finest[of_axis] = min(finest[of_axis], lengths[used].min())
    assert np.allclose(frame.max_effective_resolution, 2 / finest, rtol=0.02)
