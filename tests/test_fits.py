"""Maps that are turned around the light's direction before their sides are fitted."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import ConvexHull, QhullError
from views import cameras, small, soup

import lixel as lx

FITS = ("desired_view", "min_sm", "principal_axes")


def places(frame: lx.Frame) -> np.ndarray:
    """Map coordinates, in [0, 1] where they are inside, of the receivers that face the light."""
    matrix = frame.light_matrix[0]
    texels = frame.position[frame.facing] @ matrix[:2, :3].T + matrix[:2, 3]
    return texels / frame.shadow_map.shape[1:][::-1]


def sides(frame: lx.Frame) -> np.ndarray:
    """Width and height of the map in the world."""
    return frame.shadow_map.shape[1] / np.linalg.norm(frame.light_matrix[0][:2, :3], axis=1)


def smallest_area(frame: lx.Frame) -> float:
    """Of the rectangles with a side along an edge of the receivers' hull, one by one."""
    points = places(frame) * sides(frame)
    hull = points[ConvexHull(points).vertices]
    edges = np.roll(hull, -1, axis=0) - hull
    axis = edges / np.linalg.norm(edges, axis=1, keepdims=True)
    across = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
    return float((np.ptp(hull @ axis.T, axis=0) * np.ptp(hull @ across.T, axis=0)).min())


def alignment(scene: lx.Scene, frame: lx.Frame) -> float:
    """Mean of cos 4a over the angles a of the scene's edges in the map: 1 along rows or columns,
    -1 midway."""
    corners = scene.vertices[scene.faces]
    edges = (np.roll(corners, 1, axis=1) - corners).reshape(-1, 3)
    rows = frame.light_matrix[0][:2, :3]
    x, y = (edges @ (rows / np.linalg.norm(rows, axis=1, keepdims=True)).T).T
    weights = (x**2 + y**2) ** 2 / np.linalg.norm(edges, axis=1) ** 3
    return float(np.average(np.cos(4 * np.arctan2(y, x)), weights=weights))


@pytest.mark.parametrize("turn", [0.0, 0.4, 1.0])
@pytest.mark.parametrize("method", [lx.Uniform, lx.DesiredView, lx.RectilinearWarp, lx.Cascades])
def test_rows_and_columns_run_diagonally_to_the_edges_of_a_city_at_any_angle(method, turn):
    city = small("city")
    cosine, sine = np.cos(turn), np.sin(turn)
    about_y = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    scene = lx.Scene(city.vertices @ about_y.T, city.faces)
    light = lx.DirectionalLight(about_y @ (0.4, -0.8, 0.2))
    for label, camera in cameras(scene):
        frame = lx.render(scene, camera, light, method())
        if len(frame.light_matrix):
            assert alignment(scene, frame) < 0.0, label


def test_a_turned_cube_has_fewer_wrong_pixels_where_most_edges_lie_along_three_axes():
    scene = small("city")
    camera = scene.cameras["default"].resized(240, 135)
    low, high = scene.bounds
    wrong = np.zeros(2, int)
    for x in (0.3, 0.5, 0.7):
        light = lx.PointLight(low + (high - low) * (x, 1.2, 0.45))
        truth = lx.reference(scene, camera, light)
        for i, turned in enumerate((False, True)):
            method = lx.Cube(resolution=128, lookup="triangle", turned=turned)
            frame = lx.render(scene, camera, light, method)
            wrong[i] += lx.compare(frame, truth).misclassified_count
    assert wrong[1] < 0.6 * wrong[0]


@pytest.mark.parametrize("name", ["colonnade", "city", "terrain"])
def test_min_sm_is_the_smallest_map_that_holds_every_receiver(name):
    scene = small(name)
    random = np.random.default_rng(7)
    compared = 0
    for _, camera in cameras(scene):
        for direction in random.normal(size=(3, 3)):
            frame = lx.render(scene, camera, lx.DirectionalLight(direction), "min_sm")
            if frame.facing.sum() < 100:
                continue
            uv = places(frame)
            assert uv.min() > -1e-4
            assert uv.max() < 1 + 1e-4
            # A directional light that an edge of the scene looks along sees a line.
            try:
                least = smallest_area(frame)
            except QhullError:
                continue
            # Its direction is that of a hull of some receivers; its sides hold all of them.
            assert 0.9999 * least <= np.prod(sides(frame)) < 1.03 * least
            compared += 1
    assert compared > 8


def test_principal_axes_are_those_of_the_receivers():
    scene = small("colonnade")
    camera = scene.cameras["default"].resized(320, 180)
    for direction in np.random.default_rng(3).normal(size=(5, 3)) * (1, 0.2, 1) - (0, 1, 0):
        light = lx.DirectionalLight(direction)
        frame = lx.render(scene, camera, light, "principal_axes+rtw")
        covariance = np.cov((places(frame) * sides(frame)).T)
        # Diagonal but for what the sample of pixels leaves.
        assert abs(covariance[0, 1]) < 0.03 * np.trace(covariance)


@pytest.mark.parametrize("fit", FITS)
@pytest.mark.parametrize("warp", [lx.RectilinearWarp, lx.NonOrthogonalWarp])
def test_any_fit_gives_right_shadows(fit, warp):
    scene = soup(5)
    camera = lx.Camera.look_at((1.5, 1.2, 3), (0, 0, 0), yfov=0.7, width=160, height=90)
    light = lx.DirectionalLight((-0.5, -1, -0.4))
    frame = lx.render(scene, camera, light, warp(fit=fit, resolution=1024))
    result = lx.compare(frame, lx.reference(scene, camera, light))
    assert result.misclassified_count <= 0.001 * result.covered_count


@pytest.mark.parametrize("method", ["min_sm", "min_sm+notw", "principal_axes+rtw"])
@pytest.mark.parametrize("width", [1, 2])
def test_one_receiver_and_receivers_on_a_line(method, width):
    scene = small("plane_and_box")
    camera = scene.cameras["default"].resized(width, 1)
    frame = lx.render(scene, camera, scene.lights["default"], method)
    assert np.isfinite(frame.light_matrix).all()
    assert lx.compare(frame, lx.reference(scene, camera, scene.lights["default"])).covered.any()


@pytest.mark.parametrize("method", ["min_sm", "min_sm+notw", "principal_axes+rtw"])
def test_fits_are_the_same_every_time(method):
    scene = small("city")
    view = scene, scene.cameras["default"].resized(160, 90), scene.lights["default"]
    first, second = (lx.render(*view, method) for _ in range(2))
    assert first.light_matrix.tobytes() == second.light_matrix.tobytes()
