"""Formulas of the papers, computed anew in numpy from what a frame gives out."""

from __future__ import annotations

import numpy as np
import pytest

import lixel as lx

SIDE = 64


@pytest.fixture(scope="module")
def seen() -> tuple[lx.Scene, lx.Camera]:
    scene = lx.scenes.objects_on_floor(count=25, subdivisions=1)
    eye, target = (0.0, 1.5, 9.0), (0.0, 1.5, 0.0)
    return scene, lx.Camera.look_at(eye, target, yfov=0.8, width=160, height=90, znear=1.0)


# --- Milet et al., and the thesis ---


def counted(uv: np.ndarray) -> np.ndarray:
    return np.histogram2d(uv[:, 1], uv[:, 0], bins=SIDE, range=[[0, 1], [0, 1]])[0]


def offsets(counts: np.ndarray) -> np.ndarray:
    """Eq. 1 to 4: of each row o(x) = g(x) / N - x at the borders of cells."""
    g = np.concatenate([np.zeros((len(counts), 1)), counts.cumsum(axis=1)], axis=1)
    total = g[:, -1:]
    x = np.arange(SIDE + 1) / SIDE
    return np.where(total > 0, g / np.maximum(total, 1), x) - x


def test_columns_are_equalized_where_the_rows_put_the_receivers(seen):
    """Eq. 5 and 6: x' = x + o(x) by the row's function, then the columns' functions from the counts
    of (x', y)."""
    light = lx.DirectionalLight((0.3, -1.0, -0.2))
    method = lx.NonOrthogonalWarp.published(resolution=SIDE, smoothing=0.0, tessellation=None)
    frame = lx.render(*seen, light, method)
    points = frame.position[frame.facing]
    uv = np.column_stack([points, np.ones(len(points))]) @ frame.light_matrix[0].T
    uv = np.clip(uv[:, :2] / uv[:, 3:] / SIDE, 0.0, 1.0)
    x = np.arange(SIDE + 1) / SIDE
    rows = offsets(counted(uv))
    i = np.minimum((uv[:, 1] * SIDE).astype(int), SIDE - 1)
    moved = uv[:, 0] + [np.interp(u, x, rows[k]) for u, k in zip(uv[:, 0], i, strict=True)]
    columns = offsets(counted(np.column_stack([moved, uv[:, 1]])).T)
    # A receiver within rounding of a border may be counted on either side.
    for found, expected in zip(frame.warp_map[0], (rows, columns), strict=True):
        assert np.quantile(np.abs(found - x - expected), 0.99) < 1e-5
        assert np.abs(found - x - expected).max() < 0.05


@pytest.mark.parametrize("sigma", [1.0, 2.5])
def test_smoothing_is_the_average_of_functions_weighted_by_their_counts(seen, sigma):
    """Section 3.1, thesis 4.1.4: a weighted average among the functions, based on the number of
    view samples on each row; about a Gaussian, as a window over a window."""
    light = lx.DirectionalLight((0.3, -1.0, -0.2))
    method = lx.NonOrthogonalWarp.published(resolution=SIDE, smoothing=sigma, tessellation=None)
    frame = lx.render(*seen, light, method)
    counts = frame.importance_map[0].astype(float)
    functions, total = offsets(counts), counts.sum(axis=1)
    half = round((np.sqrt(6.0 * sigma**2 + 1.0) - 1.0) / 2.0)
    apart = np.subtract.outer(np.arange(SIDE), np.arange(SIDE))
    window = (np.abs(apart) <= half).astype(float)
    kernel = window @ window
    spread = np.sqrt((kernel * apart**2).sum(axis=1) / kernel.sum(axis=1))
    assert spread[SIDE // 2] == pytest.approx(sigma, rel=0.25)
    weights = kernel * total
    some = weights.sum(axis=1) > 0
    expected = (weights @ functions)[some] / weights.sum(axis=1, keepdims=True)[some]
    x = np.arange(SIDE + 1) / SIDE
    assert np.allclose(frame.warp_map[0, 0][some] - x, expected, atol=1e-6)


# --- Paraboloids ---


def distances(scene: lx.Scene, origin: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Along unit vectors to the first triangle, infinite where there is none (Moller and
    Trumbore)."""
    nearest = np.full(len(directions), np.inf)
    for a, b, c in scene.vertices[scene.faces]:
        with np.errstate(divide="ignore", invalid="ignore"):
            across = np.cross(directions, c - a)
            scale = 1.0 / (across @ (b - a))
            u = across @ (origin - a) * scale
            q = np.cross(origin - a, b - a)
            v = directions @ q * scale
            t = (c - a) @ q * scale
            is_hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        nearest = np.minimum(nearest, np.where(is_hit, t, np.inf))
    return nearest


@pytest.mark.parametrize("method", [lx.DualParaboloid, lx.ImprovedParaboloid])
def test_a_paraboloid_maps_directions_as_its_vertex_shader(method):
    """Thesis 3.3.2: a unit vector's x and y over 1 + z; the depth is (L - n) / (f - n), with the
    distance L."""
    scene = lx.scenes.plane_and_box()
    camera = scene.cameras["default"].resized(96, 54)
    light = lx.PointLight((1.5, 4.0, 1.0))
    frame = lx.render(scene, camera, light, method(resolution=SIDE))
    axes, projection = frame.light_matrix[0][:3, :3], frame.projections[0]
    depth = frame.shadow_map[0]
    rows, columns = np.nonzero(depth < 1.0)
    x, y = (np.array([columns, rows]).T + 0.5 - projection["centre"]).T / np.array(
        projection["scale"]
    )[:, None]
    # Of a unit vector x / (1 + z) and y / (1 + z) are x and y: solved for the vector.
    z = (1 - x**2 - y**2) / (1 + x**2 + y**2)
    directions = np.column_stack([x * (1 + z), y * (1 + z), z])
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0)
    found = distances(scene, np.array(light.position), directions @ axes)
    is_hit = np.isfinite(found)
    # The map's first and last row may look just past what it holds.
    assert is_hit.mean() > 0.95
    line = np.polynomial.Polynomial.fit(found[is_hit], depth[rows, columns][is_hit], 1)
    assert line.deriv()(0.0) > 0.0
    assert np.quantile(np.abs(line(found) - depth[rows, columns])[is_hit], 0.98) < 1e-5


def corners_of_view(camera: lx.Camera, depths: tuple[float, float]) -> np.ndarray:
    """(8, 3): of the view frustum between two depths."""
    half = np.tan(camera.yfov / 2) * np.array([camera.width / camera.height, 1.0])
    signs = np.array([(x, y) for x in (-1, 1) for y in (-1, 1)])
    rays = np.column_stack([signs * half, -np.ones(4)]) @ camera.pose[:3, :3].T
    return np.concatenate([camera.eye + depth * rays for depth in depths])


@pytest.mark.parametrize("place", [(-4.0, 7.5, -10.0), (5.0, 9.0, -9.0), (0.5, 14.0, -6.0)])
def test_the_cut_of_the_frustum_is_its_light_cone(place):
    """Vanek et al., Eq. 1 and 2 and section 3.3: the mean direction to the eight border points, the
    largest angle to it, and where the paraboloid has the edge of that cone."""
    scene = lx.scenes.plane_and_box()
    eye, target = (2.6, 2.4, 5.6), (0.2, 0.0, 1.0)
    camera = lx.Camera.look_at(eye, target, yfov=0.9, width=96, height=72)
    method = lx.ImprovedParaboloid(cut="frustum", resolution=SIDE)
    frame = lx.render(scene, camera, lx.PointLight(place), method)
    depth = frame.depth[frame.facing]
    vectors = corners_of_view(camera, (depth.min(), depth.max())) - place
    axis = vectors.sum(axis=0)
    axis /= np.linalg.norm(axis)
    assert len(frame.light_matrix) == 1
    assert np.allclose(frame.light_matrix[0][2, :3], axis, atol=1e-3)
    angle = np.arccos((vectors @ axis / np.linalg.norm(vectors, axis=1)).min())
    zoom = np.sin(angle) / (1.0 + np.cos(angle))
    # The cone ends at the sides of the map, but for a thousandth.
    assert np.allclose(frame.projections[0]["scale"], SIDE / 2 / zoom, rtol=3e-3)
    assert np.allclose(frame.projections[0]["centre"], SIDE / 2)


# --- Chong and Gortler, and what they compare with ---


def test_the_perspective_of_lispsm_begins_where_it_is_optimal(seen):
    """Wimmer et al., 2004, section 4.2: n = z_n + sqrt(z_n z_f) for a light across the view; the
    apex, where w is 0, lies so far before the nearest receiver."""
    scene, camera = seen
    light = lx.DirectionalLight((0.0, -1.0, 0.0))
    frame = lx.render(scene, camera, light, lx.LightSpacePerspective(resolution=SIDE))
    w = frame.light_matrix[0][3]
    from_eye = (w[:3] @ camera.eye + w[3]) / np.linalg.norm(w[:3])
    depth = frame.depth[frame.facing]
    near, far = depth.min(), depth.max()
    assert from_eye + near == pytest.approx(near + np.sqrt(near * far), rel=0.01)


def test_h_is_the_sum_of_the_squares_of_the_inverse_jacobians():
    """Chong and Gortler, Eq. 6: of how far the image moves with the map, at each sample; by
    differences between places on a floor that fills the view."""
    side = 16
    corners = np.array([[-50, 0, -50], [-50, 0, 50], [50, 0, 50], [50, 0, -50]], float)
    floor = lx.Scene(corners, [[0, 1, 2], [0, 2, 3]])
    eye, target = (1.0, 6.0, 9.0), (0.0, 0.0, -1.0)
    camera = lx.Camera.look_at(eye, target, yfov=0.6, width=side, height=side)
    light = lx.DirectionalLight((0.4, -1.0, -0.5))
    method = lx.SceneOptimized(samples="facing", sample_resolution=side, resolution=SIDE)
    frame = lx.render(floor, camera, light, method)
    assert frame.facing.all()

    def texels(pixels: np.ndarray) -> np.ndarray:
        """Where the map has what a place in the image sees."""
        image = (2 * pixels / side - 1) * np.tan(camera.yfov / 2) * (1, -1)
        rays = np.column_stack([image, -np.ones(len(image))]) @ camera.pose[:3, :3].T
        points = camera.eye - rays * (camera.eye[1] / rays[:, 1:2])
        q = np.column_stack([points, np.ones(len(points))]) @ frame.light_matrix[0].T
        return q[:, :2] / q[:, 3:]

    pixels = np.stack(np.meshgrid(*[np.arange(side) + 0.5] * 2), axis=-1).reshape(-1, 2)
    step = 1e-4
    jacobian = np.stack(
        [(texels(pixels + at) - texels(pixels - at)) / (2 * step) for at in step * np.eye(2)],
        axis=-1,
    )
    h = (np.linalg.inv(jacobian) ** 2).sum()
    assert frame.stats["h"] == pytest.approx(h, rel=1e-4)
