"""`ray_traced` by the device's own ray queries. That they get no pixel wrong is tested in
test_exact.py, too; where the device has none, what needs them is skipped."""

from __future__ import annotations

import numpy as np
import pytest
from views import cameras, small

import lixel as lx
from lixel.scenes import GENERATORS

COMPUTE = lx.RayTraced(traversal="compute")


def differing(scene: lx.Scene, camera: lx.Camera, light: lx.Light, method: lx.Method) -> int:
    """Pixels in which it differs from the walk in compute, and that are no ties."""
    other = lx.render_shadows(scene, camera, light, COMPUTE)
    truth = lx.reference(scene, camera, light)
    frame = lx.render_shadows(scene, camera, light, method)
    return int(((frame != other) & truth.covered & ~truth.tie).sum())


@pytest.mark.parametrize(
    ("traversal", "error"),
    [("fast", ValueError), ("", ValueError), (None, TypeError), (1, TypeError)],
)
def test_another_traversal_is_refused(traversal, error):
    with pytest.raises(error, match="traversal must be one of 'auto', 'compute', 'hardware'"):
        lx.RayTraced(traversal=traversal)


@pytest.mark.not_on_cpu("it asks for an adapter")
def test_a_device_without_ray_queries_says_so(view):
    device = lx.info().device
    if "EXPERIMENTAL_RAY_QUERY" in device["used_features"]:
        assert "ray queries" in lx.render(*view, lx.RayTraced(traversal="hardware")).timings
        return
    with pytest.raises(lx.DeviceError, match=r"hardware.* needs ray queries .*RAY_QUERY.* lacks"):
        lx.render(*view, lx.RayTraced(traversal="hardware"))
    # And the next frame is as if nothing had happened.
    assert "shadow rays" in lx.render(*view, "ray_traced").timings


@pytest.mark.not_on_cpu("it asks for an adapter")
def test_auto_takes_them_on_a_gpu_alone(view):
    device = lx.info().device
    has_them = "EXPERIMENTAL_RAY_QUERY" in device["used_features"] and device["type"] != "Cpu"
    frame = lx.render(*view, "ray_traced")
    assert ("ray queries" in frame.stats) == has_them
    assert ("shadow rays" in frame.stats) == (not has_them)


def test_the_frame_tells_of_them(ray_queries, view):
    frame = lx.render(*view, ray_queries)
    assert 0 < frame.stats["ray queries"]["rays"] <= view.camera.width * view.camera.height
    assert 0 < frame.stats["ray queries"]["longest_walk"] <= len(view.scene.faces)
    assert frame.timings["acceleration structure"] > 0.0
    # Nothing is built on the CPU.
    assert "hierarchy (CPU)" not in frame.timings
    again = lx.render(*view, ray_queries)
    assert "acceleration structure" in again.stats["skipped"]
    assert "acceleration structure" not in again.timings
    view.scene.update_vertices(view.scene.vertices * 1.01)
    assert "acceleration structure" in lx.render(*view, ray_queries).timings


@pytest.mark.parametrize("name", GENERATORS)
def test_they_answer_as_the_walk_in_compute(name, ray_queries):
    scene = small(name)
    low, high = scene.bounds
    lights = [*scene.lights.values(), lx.PointLight(low + (high - low) * [0.4, 1.3, 0.6])]
    for light in lights:
        for label, camera in list(cameras(scene))[:3]:
            assert differing(scene, camera, light, ray_queries) == 0, (label, light)


@pytest.mark.parametrize(
    "direction", [(0, -1, 0), (0, 1, 0), (0, -1, 1e-9), (1, 0, 0), (0, 0, -1), (1e-8, -1, 0)]
)
def test_rays_along_the_axes_through_flat_boxes(direction, ray_queries):
    """The squares are parallel to the axes, and so are their boxes' sides."""
    square = np.array([[-1, 0, -1], [-1, 0, 1], [1, 0, 1], [1, 0, -1]], dtype=float)
    above, right, behind = np.array([[0, 1, 0], [1, 1, 0], [0, 1, -1]])
    squares = [4 * square, square + above]
    squares += [square[:, [1, 0, 2]] + right, square[:, [0, 2, 1]] + behind]
    faces = [np.array([[0, 1, 2], [0, 2, 3]]) + 4 * i for i in range(len(squares))]
    scene = lx.Scene(np.concatenate(squares), np.concatenate(faces))
    camera = lx.Camera.look_at((3, 3, 4), (0, 0.5, 0), yfov=1.0, width=160, height=90)
    light = lx.DirectionalLight(direction)
    truth = lx.reference(scene, camera, light)
    frame = lx.render_shadows(scene, camera, light, ray_queries)
    assert lx.compare(frame, truth).misclassified_count == 0


def test_an_eye_far_away_builds_anew_and_a_nearer_one_does_not(ray_queries):
    """The boxes are grown by what float32 rounds of a point at that distance."""
    scene = small("city")
    light = scene.lights["default"]
    low, high = scene.bounds
    centre, size = (low + high) / 2, float(np.linalg.norm(high - low))
    built = []
    for distance in (1.0, 1e3, 1e4, 1e3, 1.0):
        eye = centre + size * distance * np.array([0.5, 0.4, 0.7])
        camera = lx.Camera.look_at(eye, centre, yfov=0.9 / distance, width=160, height=90)
        frame = lx.render(scene, camera, light, ray_queries)
        truth = lx.reference(scene, camera, light)
        assert lx.compare(frame, truth).misclassified_count == 0, distance
        built.append("acceleration structure" in frame.timings)
    assert built == [True, True, True, False, False]


@pytest.mark.parametrize("distance", [1.0, 1e3])
def test_no_ray_slips_between_two_boxes(distance, ray_queries):
    """Under a canopy of many cells, with the light along the sides of their boxes: what rounding
    moves out of one box must be moved into the next."""
    grid = np.linspace(-1.0, 1.0, 60)
    x, z = np.meshgrid(grid, grid, indexing="ij")
    canopy = np.stack([x.ravel(), np.full(x.size, 0.5), z.ravel()], axis=1)
    corner = (np.arange(59)[:, None] * 60 + np.arange(59)).ravel()
    cells = np.stack([corner, corner + 1, corner + 60, corner + 61], axis=1)
    ground = np.array([[-1.1, 0, -1.1], [1.1, 0, -1.1], [1.1, 0, 1.1], [-1.1, 0, 1.1]])
    scene = lx.Scene(
        np.concatenate([canopy, ground]),
        np.concatenate(
            [
                cells[:, [0, 1, 2]],
                cells[:, [1, 3, 2]],
                canopy.shape[0] + np.array([[0, 2, 1], [0, 3, 2]]),
            ]
        ),
    )
    eye = distance * np.array([0.3, 0.6, 3.0])
    camera = lx.Camera.look_at(eye, (0, 0, 0), yfov=0.8 / distance, width=160, height=90)
    light = lx.DirectionalLight((0, -1, 0))
    truth = lx.reference(scene, camera, light)
    frame = lx.render_shadows(scene, camera, light, ray_queries)
    assert lx.compare(frame, truth).misclassified_count == 0


def test_vertices_that_move_again_and_again(ray_queries):
    scene = small("objects_on_floor")
    camera, light = scene.cameras["default"].resized(160, 90), scene.lights["default"]
    vertices = scene.vertices.copy()
    for step in range(4):
        moved = vertices * [1.0, 1.0 + 0.4 * step, 1.0]
        if step == 2:
            # Of most objects no area is left; and these coordinates are not float32's.
            moved[len(moved) // 4 :] = moved[0]
            moved += 0.1
        scene.update_vertices(moved)
        truth = lx.reference(scene, camera, light)
        frame = lx.render_shadows(scene, camera, light, ray_queries)
        assert lx.compare(frame, truth).misclassified_count == 0, step


def test_several_lights_share_the_structure(ray_queries, view):
    scene, camera, light = view
    point_light = lx.PointLight((1.0, 4.0, 1.0))
    together = lx.render_shadows(scene, camera, [light, point_light, light], ray_queries)
    for layer, alone in zip(together, (light, point_light, light), strict=True):
        assert layer.tobytes() == lx.render_shadows(scene, camera, alone, ray_queries).tobytes()


def test_too_many_boxes_for_one_ray_are_an_error(ray_queries):
    """Slivers along a diagonal: rays pass through every box and meet no triangle."""
    count = 66_000
    ground = [[-4, 0, -4], [4, 0, -4], [4, 0, 4], [-4, 0, 4]]
    starts = np.array([-1.0, 1.0, -1.0]) + np.random.default_rng(0).normal(0, 1e-3, (count, 3))
    ends = starts + 2.0
    slivers = np.stack([starts, ends, ends + np.array([0.001, 0.0, 0.0])], axis=1)
    faces = 4 + np.arange(3 * count).reshape(-1, 3)
    scene = lx.Scene(
        np.concatenate([ground, slivers.reshape(-1, 3)]),
        np.concatenate([[[0, 2, 1], [0, 3, 2]], faces]),
    )
    camera = lx.Camera.look_at((0, 0.8, 6), (0, 0, 0), yfov=0.8, width=64, height=48)
    light = lx.DirectionalLight((0.2, -1, -0.1))
    with pytest.raises(lx.DeviceError, match="boxes of 65000 triangles or more"):
        lx.render_shadows(scene, camera, light, ray_queries)
