"""Options that the papers have beside lixel's defaults: each formula is computed anew in numpy."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from views import small

import lixel as lx

DIRECTION = np.array([0.5, -1.0, 0.3]) / np.linalg.norm([0.5, -1.0, 0.3])
SUN = lx.DirectionalLight(DIRECTION)
# A quarter of a turn and more comes to the same as less.
ANGLES = {0.0: 0.0, 0.3: 0.3, 0.75: 0.75, 2.0: 2.0 - np.pi / 2}
ROTATED = {
    "uniform": lx.Uniform,
    "desired_view": lx.DesiredView,
    "cascades": lx.Cascades,
    "rtw": lx.RectilinearWarp,
    "uniform+notw": lambda **given: lx.NonOrthogonalWarp(fit="uniform", **given),
}


@pytest.fixture(scope="module")
def city() -> tuple[lx.Scene, lx.Camera]:
    scene = small("city")
    return scene, scene.cameras["default"].resized(160, 90)


def axes_of_sun() -> np.ndarray:
    """Right and down in a map in which the world's Y is up."""
    right = np.cross(DIRECTION, (0.0, 1.0, 0.0))
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(DIRECTION, right)])


def rows_of(frame: lx.Frame, layer: int = 0) -> np.ndarray:
    """The directions of a map's rows and columns in the world."""
    rows = frame.light_matrix[layer][:2, :3]
    return rows / np.linalg.norm(rows, axis=1, keepdims=True)


def box_of(frame: lx.Frame, layer: int, axes: np.ndarray) -> np.ndarray:
    """Least and greatest place of a parallel map's borders along two directions."""
    matrix, side = frame.light_matrix[layer], frame.shadow_map.shape[-1]
    scale = np.linalg.norm(matrix[:2, :3], axis=1)
    # A point of the map's first row and column, and of its last.
    corner = -matrix[:2, 3] / scale
    return np.stack([corner, corner + side / scale]) @ (rows_of(frame, layer) @ axes.T)


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("name", ROTATED)
def test_a_map_is_rotated_by_the_angle_from_where_the_world_stands_up(name, angle, city):
    right, down = axes_of_sun()
    turn = ANGLES[angle]
    expected = (
        right * np.cos(turn) + down * np.sin(turn),
        down * np.cos(turn) - right * np.sin(turn),
    )
    frame = lx.render(*city, SUN, ROTATED[name](rotation=angle, resolution=64))
    for layer in range(len(frame.light_matrix)):
        assert np.allclose(rows_of(frame, layer), expected, atol=1e-9)


def test_a_rotated_map_is_the_box_along_its_own_axes(city):
    scene, camera = city
    for angle in (0.0, 0.6):
        uniform = lx.render(scene, camera, SUN, lx.Uniform(rotation=angle, resolution=64))
        view = lx.render(scene, camera, SUN, lx.DesiredView(rotation=angle, resolution=64))
        axes = rows_of(uniform)
        for frame, points in (
            (uniform, scene.vertices[scene.faces].reshape(-1, 3)),
            (view, view.position[view.facing]),
        ):
            places = points @ axes.T
            expected = np.stack([places.min(axis=0), places.max(axis=0)])
            assert np.allclose(box_of(frame, 0, axes), expected, atol=1e-3 * np.ptp(expected))
    default = lx.render(scene, camera, SUN, lx.Uniform(resolution=64))
    assert not np.allclose(rows_of(default), axes_of_sun(), atol=0.01)


def test_the_effective_resolution_is_of_a_map_along_the_same_rows(city):
    """A uniform map matches itself, however it is rotated; a smaller one by its sides."""
    scene, camera = city
    for angle in (0.0, 0.4, 0.7):
        frame = lx.render(scene, camera, SUN, lx.Uniform(rotation=angle, resolution=64))
        assert frame.max_effective_resolution == pytest.approx((64, 64), rel=1e-6)
    frame = lx.render(scene, camera, SUN, lx.MinimalShadowMap(resolution=64))
    rows = rows_of(frame)
    across = np.ptp(scene.vertices[scene.faces].reshape(-1, 3) @ rows.T, axis=0)
    texels = np.linalg.norm(frame.light_matrix[0][:2, :3], axis=1)
    assert frame.max_effective_resolution == pytest.approx(tuple(across * texels), rel=1e-4)


def test_a_spot_lights_map_is_rotated_and_a_cubes_faces_are_not(city):
    low, high = city[0].bounds
    place = (low + high) / 2 + (0.0, 0.7 * (high - low)[1], 0.0)
    spot = lx.SpotLight(place, (0.2, -1.0, 0.1), 0.6)
    rows = [
        rows_of(lx.render(*city, spot, lx.DesiredView(rotation=angle, resolution=64)))
        for angle in (0.0, 0.5)
    ]
    turn = np.cross(rows[0][0], rows[1][0])
    # Rows of a perspective lean to its axis: the angle between them is that of their planes.
    assert np.linalg.norm(turn) > 0.2
    faces = [
        lx.render(*city, lx.PointLight(place), lx.DesiredView(rotation=angle, resolution=64))
        for angle in (None, 0.5)
    ]
    assert np.array_equal(faces[0].light_matrix, faces[1].light_matrix)


def test_rotation_comes_with_fits_that_have_none_of_their_own():
    words = "rotation must come with one of the fits 'desired_view', 'uniform'.*, got 'min_sm'"
    with pytest.raises(ValueError, match=words):
        lx.RectilinearWarp(fit="min_sm", rotation=0.0)


@pytest.mark.parametrize("warp", [lx.RectilinearWarp, lx.NonOrthogonalWarp])
def test_a_warp_of_the_whole_view_is_over_the_uniform_map(warp, city):
    frame = lx.render(*city, SUN, warp(fit="uniform", resolution=64))
    plain = lx.render(*city, SUN, lx.Uniform(resolution=64))
    assert np.array_equal(frame.light_matrix, plain.light_matrix)


def test_rows_and_columns_without_importance_are_culled(city):
    """Rosen, 4.2 and Eq. 1, over the whole of the light's view: maxima, a Gaussian, prefix sums."""
    method = lx.RectilinearWarp(
        fit="uniform", rotation=0.0, resolution=64, importance_resolution=128, blur=3.0
    )
    frame = lx.render(*city, SUN, method)
    importance = frame.importance_map[0].astype(float)
    offsets = np.arange(-9, 10)
    kernel = np.exp(-0.5 * (offsets / 3.0) ** 2)
    for axis in (0, 1):
        maxima = importance.max(axis=axis)
        assert (maxima == 0.0).sum() > 20
        sums = np.convolve(maxima, kernel, "same") / np.convolve(np.ones(128), kernel, "same")
        boundaries = np.concatenate([[0.0], np.cumsum(sums)]) / sums.sum()
        places = np.full((129, 2), 0.5)
        places[:, axis] = np.arange(129) / 128
        found = lx.warp_points(frame.warp_map[0], places)[:, axis]
        assert np.allclose(found, boundaries, atol=2e-5)
        # More than three sigmas from what is seen there is no texel at all.
        reach = np.convolve(maxima > 0.0, np.ones(19), "same") > 0
        assert np.ptp(np.diff(boundaries)[~reach]) == 0.0


@pytest.mark.parametrize("warp", [lx.RectilinearWarp, lx.NonOrthogonalWarp])
def test_the_importance_map_may_have_the_maps_own_size(warp, city):
    for resolution in (32, 100):
        method = warp(resolution=resolution, importance_resolution=None)
        frame = lx.render(*city, SUN, method)
        assert frame.importance_map.shape == (1, resolution, resolution)


# --- Cascades ---


@pytest.mark.parametrize("splits", ["uniform", "logarithmic", "practical"])
def test_slabs_have_the_box_of_their_part_of_the_view_frustum(splits, city):
    """Zhang et al.: the corners of the frustum between two splits, along the map's rows."""
    scene, camera = city
    forward = -camera.pose[:3, 2]
    camera = lx.Camera.look_at(
        camera.eye, camera.eye + forward, yfov=camera.yfov, width=160, height=90, znear=20.0
    )
    count = 3
    method = lx.Cascades(layers=count, splits=splits, boxes="slabs", rotation=0.2, resolution=64)
    frame = lx.render(scene, camera, SUN, method)
    assert len(frame.light_matrix) == count
    receivers = lx.render(scene, camera, SUN, lx.Cascades(
        layers=count, splits=splits, rotation=0.2, resolution=64
    ))  # fmt: skip
    # Where the scene ends: the greatest depth of a corner of its part that is in view.
    near, far = camera.znear, farthest_in_view(scene, camera)
    share = np.arange(count + 1) / count
    even, growing = near + (far - near) * share, near * (far / near) ** share
    ends = {"uniform": even, "logarithmic": growing, "practical": 0.5 * (even + growing)}[splits]
    axes = rows_of(frame)
    for layer in range(count):
        corners = np.concatenate([corners_at(camera, depth) for depth in ends[layer : layer + 2]])
        places = corners @ axes.T
        expected = np.stack([places.min(axis=0), places.max(axis=0)])
        found = box_of(frame, layer, axes)
        assert np.allclose(found, expected, atol=2e-3 * np.ptp(expected)), layer
        inner = box_of(receivers, layer, axes)
        slack = 1e-3 * np.ptp(expected)
        assert (inner[0] >= found[0] - slack).all()
        assert (inner[1] <= found[1] + slack).all()


def corners_at(camera: lx.Camera, depth: float) -> np.ndarray:
    """(4, 3): the corners of the image at a depth along the view."""
    (fx, fy), (cx, cy) = camera.focal, camera.centre
    columns, rows = np.array([0.0, camera.width]), np.array([0.0, camera.height])
    x, y = np.meshgrid((columns - cx) / fx, (cy - rows) / fy)
    rays = np.stack([x.ravel(), y.ravel(), -np.ones(4)], axis=1) * depth
    return rays @ camera.pose[:3, :3].T + camera.eye


def farthest_in_view(scene: lx.Scene, camera: lx.Camera) -> float:
    """By points of the scene's box: the greatest depth that the camera sees of any."""
    low, high = scene.bounds
    steps = np.linspace(0.0, 1.0, 81)
    grid = np.stack(np.meshgrid(steps, steps, steps), axis=-1).reshape(-1, 3)
    pixels = camera.project(low + grid * (high - low))
    inside = (pixels[:, 2] > 0) & (pixels[:, :2] >= 0).all(axis=1)
    inside &= (pixels[:, :2] <= (camera.width, camera.height)).all(axis=1)
    return float(pixels[inside, 2].max())


@pytest.mark.parametrize("fit", ["cascades", "focused", "psm", "plane_optimal"])
@pytest.mark.parametrize("warp", [lx.RectilinearWarp, lx.NonOrthogonalWarp])
def test_a_warp_is_laid_over_the_maps_of_the_fit(fit, warp, city):
    scene, camera = city
    frame = lx.render(scene, camera, SUN, warp(fit=fit, resolution=256))
    plain = lx.render(scene, camera, SUN, lx.METHODS[fit](resolution=256))
    assert np.array_equal(frame.light_matrix, plain.light_matrix)
    assert len(frame.warp_map) == len(plain.light_matrix)
    truth = lx.reference(scene, camera, SUN)
    wrong = lx.compare(frame, truth).misclassified_count
    assert wrong < 1.5 * lx.compare(plain, truth).misclassified_count + 20
    assert lx.method_from(f"{fit}+{warp.name}") == warp(fit=fit)


# --- Paraboloids ---


@pytest.mark.parametrize("method", [lx.DualParaboloid, lx.ImprovedParaboloid])
def test_two_halves_are_rotated_to_the_truncated_view_frustum(method, city):
    """Vanek et al., Eq. 1: the mean direction to the eight corners."""
    scene, camera = city
    low, high = scene.bounds
    place = camera.eye + 0.2 * np.linalg.norm(high - low) * -camera.pose[:3, 2]
    light = lx.PointLight(place)
    given = {"cut": "frustum"} if method is lx.ImprovedParaboloid else {}
    frame = lx.render(scene, camera, light, method(splitting="view", resolution=64, **given))
    seen = frame.position[frame.facing]
    depths = (seen - camera.eye) @ -camera.pose[:3, 2]
    corners = np.concatenate([corners_at(camera, depths.min()), corners_at(camera, depths.max())])
    axis = (corners - place).sum(axis=0)
    axis /= np.linalg.norm(axis)
    # The half space of a layer is what its axis looks into.
    normals = [np.array(layer["region"])[0, :3] for layer in frame.projections]
    found = [normal / np.linalg.norm(normal) for normal in normals]
    assert any(np.allclose(normal, axis, atol=1e-4) for normal in found)
    assert all(abs(normal @ axis) > 1.0 - 1e-6 for normal in found)
    truth = lx.reference(scene, camera, light)
    wrong = [
        lx.compare(
            lx.render_shadows(scene, camera, light, method(splitting=to, resolution=512, **given)),
            truth,
        ).misclassified_count
        for to in ("light", "view")
    ]
    assert wrong[1] <= 2 * wrong[0] + 20
    down = lx.render(scene, camera, light, method(resolution=64, **given))
    normals = [np.array(layer["region"])[0, :3] for layer in down.projections]
    assert all(abs(normal[1]) > 0.999 * np.linalg.norm(normal) for normal in normals)


# --- From frame to frame ---


def frames(scene: lx.Scene, camera: lx.Camera, count: int, **given: object) -> list[lx.Frame]:
    """Of a camera that moves to the right, each with the one before."""
    made: list[lx.Frame] = []
    for i in range(count):
        pose = camera.pose.copy()
        pose[:3, 3] += 0.4 * i * pose[:3, 0]
        method = lx.SceneOptimized(resolution=200, previous=made[-1] if made else None, **given)
        made.append(lx.render(scene, camera.posed(pose), SUN, method))
    return made


def test_a_matrix_is_kept_for_as_many_frames_as_are_asked_for(city):
    """Chong and Gortler, 2.4: P is updated every three frames."""
    made = frames(*city, 7, every=3)
    assert [frame.stats["matrix_age"] for frame in made] == [1, 2, 3, 1, 2, 3, 1]
    for before, after in itertools.pairwise(made):
        is_kept = after.stats["matrix_age"] > 1
        assert ("fit light matrix (CPU)" in after.timings) != is_kept
        if is_kept:
            # What takes a point to its texel, up to the scale of homogeneous coordinates.
            old, new = (frame.light_matrix[0][[0, 1, 3]] for frame in (before, after))
            old, new = (rows / np.linalg.norm(rows[2]) for rows in (old, new))
            assert np.allclose(old, new, rtol=1e-6, atol=1e-6 * np.abs(old).max())
    for frame in made:
        truth = lx.reference(city[0], frame.camera, SUN)
        wrong = lx.compare(frame, truth).misclassified_count
        assert wrong < 0.05 * np.count_nonzero(truth.facing)


def test_boundaries_are_those_of_the_last_frames_map(city):
    """Its map finds nearly the same boundaries as a focused one, and so nearly the same matrix."""
    scene, camera = city
    given = {"samples": "boundary"}
    [_, focused] = frames(scene, camera, 2, **given)
    [_, previous] = frames(scene, camera, 2, boundaries="previous", **given)
    assert previous.stats["h"] == pytest.approx(focused.stats["h"], rel=0.3)
    assert previous.stats["h"] != focused.stats["h"]
    truth = lx.reference(scene, previous.camera, SUN)
    # What the last map does not hold is lit in the first pass, and its boundaries are missed.
    wrong = lx.compare(previous, truth).misclassified_count
    assert wrong < 0.05 * np.count_nonzero(truth.facing)
