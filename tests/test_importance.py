"""Importance: each function against numpy on the same receivers, and products of any of them."""

from __future__ import annotations

import numpy as np
import pytest

import lixel as lx
from lixel.scenes import colonnade, plane_and_box

pytestmark = pytest.mark.usefixtures("engine")

CELLS = 32
RTW = {"importance_resolution": CELLS}


@pytest.fixture(scope="module")
def view():
    scene = colonnade(columns=4, detail=12)
    return scene, scene.cameras["default"].resized(320, 180), scene.lights["default"]


def cells(frame: lx.Frame, count: int = CELLS) -> tuple[np.ndarray, np.ndarray]:
    """Column and row of the cell of each receiver that faces the light."""
    matrix = frame.light_matrix[0]
    texels = frame.position[frame.facing] @ matrix[:2, :3].T + matrix[:2, 3]
    column, row = np.clip(texels / frame.shadow_map.shape[1] * count, 0, count - 1).astype(int).T
    return column, row


def maxima(frame: lx.Frame, values: np.ndarray) -> np.ndarray:
    expected = np.zeros((CELLS, CELLS))
    np.maximum.at(expected, cells(frame)[::-1], values)
    return expected


def assert_mostly_equal(found: np.ndarray, expected: np.ndarray) -> None:
    """A receiver within rounding of a cell's border may fall on either side."""
    wrong = np.abs(found - expected) > 1e-4 * expected.max()
    assert wrong.mean() < 0.01
    assert expected.max() > 0


def normal_factor(frame: lx.Frame, bonus: float) -> np.ndarray:
    to_eye = frame.camera.eye - frame.position[frame.facing]
    cosine = np.einsum("nc,nc->n", frame.normal[frame.facing], to_eye)
    return 1 + bonus * np.abs(cosine) / np.linalg.norm(to_eye, axis=1)


def test_backward_product_of_everything_but_edges(view):
    random = np.random.default_rng(2)
    pixels, grid = random.uniform(0.5, 2, (180, 320)), random.uniform(0.5, 2, (5, 7))
    method = lx.RectilinearWarp(
        importance=("normal", "distance"),
        normal_bonus=3,
        pixel_weights=pixels,
        map_weights=grid,
        **RTW,
    )
    assert method.importance == "distance*normal"
    frame = lx.render(*view, method)
    column = cells(frame, 7)[0]
    row = cells(frame, 5)[1]
    values = normal_factor(frame, 3) / frame.depth[frame.facing]
    values *= pixels[frame.facing] * grid[row, column]
    assert_mostly_equal(frame.importance_map[0], maxima(frame, values))


def widths_of_texels(frame: lx.Frame, layer: int, points: np.ndarray) -> np.ndarray:
    """The root of a texel's area in the plane of constant depth through each point, by finite
    differences of the places that the light matrix gives."""
    matrix = frame.light_matrix[layer]
    depth_axis = matrix[2, :3] / np.linalg.norm(matrix[2, :3])
    across = np.linalg.svd(depth_axis[None])[2][1:]
    step = 1e-4 * np.ptp(points, axis=0).max()

    def texels(p: np.ndarray) -> np.ndarray:
        homogeneous = p @ matrix[:, :3].T + matrix[:, 3]
        return homogeneous[..., :2] / homogeneous[..., 3:]

    x, y = ((texels(points + step * a) - texels(points - step * a)) / (2 * step) for a in across)
    return 1 / np.sqrt(np.abs(x[:, 0] * y[:, 1] - x[:, 1] * y[:, 0]))


@pytest.mark.parametrize("analysis", ["backward", "forward"])
@pytest.mark.parametrize("fit", ["lispsm", "scene_optimized", "desired_view", "cube", "spot"])
def test_distance_knows_the_texels_that_the_fit_gave(view, fit, analysis):
    """Importance is the width of the fit's texels over the distance, but for a constant."""
    scene, camera, light = view
    low, high = scene.bounds
    position = 0.5 * (low + high) + (high - low) * (0.1, 0.3, 0.15)
    if fit == "cube":
        light = lx.PointLight(position)
    elif fit == "spot":
        light = lx.SpotLight(position, (0.3, -1.0, 0.2), 0.8)
    chosen = lx.RectilinearWarp(fit=fit, analysis=analysis, **RTW)
    frame = lx.render(scene, camera, light, chosen)
    layer = len(frame.light_matrix) - 1
    matrix = frame.light_matrix[layer]
    points = frame.position[frame.facing]
    homogeneous = points @ matrix[:, :3].T + matrix[:, 3]
    size = frame.shadow_map.shape[1]
    with np.errstate(divide="ignore", invalid="ignore"):
        uv = homogeneous[:, :2] / homogeneous[:, 3:] / size
    # A face of a cube takes what is in its pyramid.
    axes = frame.light_matrix[:, 3] if fit == "cube" else matrix[None, 3]
    of_axes = np.column_stack([points, np.ones(len(points))]) @ axes.T
    mine = (homogeneous[:, 3] > 0) & ((uv > 0) & (uv < 1)).all(axis=1)
    mine &= of_axes.argmax(axis=1) == layer
    values = widths_of_texels(frame, layer, points[mine]) / frame.depth[frame.facing][mine]
    expected = np.zeros((CELLS, CELLS))
    column, row = (uv[mine] * CELLS).astype(int).T
    np.maximum.at(expected, (row, column), values)
    found = frame.importance_map[layer]
    both = (found > 0) & (expected > 0)
    assert both.sum() > 30
    ratio = found[both] / expected[both]
    middle = np.median(ratio)
    # The light may see more of a cell than the camera does.
    assert (np.abs(ratio / middle - 1) < 0.02).mean() > (0.95 if analysis == "backward" else 0.6)


@pytest.mark.parametrize(
    "importance", ["desired_view", "distance", "normal", ("distance", "normal")]
)
def test_forward_sees_what_backward_sees_where_light_and_camera_see_the_same(importance):
    """A plane, seen and lit whole."""
    scene = lx.Scene([[-1, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]], [[0, 2, 1], [0, 3, 2]])
    camera = lx.Camera.look_at((0.5, 3, 1), (0, 0, 0), yfov=1.0, width=400, height=400)
    view = scene, camera, lx.DirectionalLight((0.3, -1, 0.2))
    backward, forward = (
        lx.render(*view, lx.RectilinearWarp(importance=importance, analysis=analysis, **RTW))
        for analysis in ("backward", "forward")
    )
    np.testing.assert_allclose(forward.importance_map, backward.importance_map, rtol=0.02)


def test_forward_leaves_out_what_the_camera_does_not_see(view):
    frame = lx.render(*view, lx.RectilinearWarp(analysis="forward", **RTW))
    assert 0 < (frame.importance_map > 0).sum() < frame.importance_map.size
    far = lx.render(*view, lx.RectilinearWarp(analysis="forward", importance="distance", **RTW))
    nearest = 1 / far.depth[far.covered].min()
    assert far.importance_map.max() < 1.3 * nearest


@pytest.mark.parametrize("analysis", ["forward", "hybrid"])
def test_shadow_edges_are_the_outline_of_the_box(analysis):
    scene = plane_and_box()
    view = scene, scene.cameras["default"].resized(320, 180), scene.lights["default"]
    method = lx.RectilinearWarp(
        importance="shadow_edge",
        analysis=analysis,
        importance_resolution=128,
        analysis_resolution=128,
        edge_bias=0.4,
        edge_floor=0.25,
    )
    frame = lx.render(*view, method)
    values = frame.importance_map[0]
    assert set(np.unique(values)) == {0, 0.25, 1}
    # Cells of a map of the same size across whose border the depth jumps.
    depth = lx.render(*view, lx.DesiredView(resolution=128)).shadow_map[0]
    depth = np.where(depth == 1, 1e9, depth)  # an empty texel is beyond every depth
    length = 1 / np.linalg.norm(frame.light_matrix[0][2, :3])
    padded = np.pad(depth, 1, mode="edge")
    around = [padded[y : y + 128, x : x + 128] for y in range(3) for x in range(3)]
    jump = (np.max(np.abs(np.array(around) - depth), axis=0) * length) > 0.4
    assert ((values == 1) <= jump).mean() > 0.999
    assert 0.002 < (values == 1).mean() < 0.2


def boundary_weights(view, frame: lx.Frame, weight: float) -> np.ndarray:
    """By tiles of 4 x 4 pixels: those that hold lit and shadowed receivers, or neighbours do."""
    visibility = lx.render_shadows(*view, lx.DesiredView(resolution=512))
    height, width = visibility.shape
    tiles = np.zeros((2, -(-height // 4) + 2, -(-width // 4) + 2), bool)
    row, column = np.nonzero(frame.facing)
    tiles[visibility[row, column].astype(int), row // 4 + 1, column // 4 + 1] = True
    h, w = tiles.shape[1:]
    near = sum(tiles[:, y : h - 2 + y, x : w - 2 + x] for y in range(3) for x in range(3)) > 0
    return np.where(near.all(axis=0), weight, 1.0)[row // 4, column // 4]


def test_boundaries_weigh_more(view):
    method = lx.NonOrthogonalWarp(importance="boundary", boundary_weight=8, **RTW)
    frame = lx.render(*view, method)
    weights = boundary_weights(view, frame, 8)
    assert 0.01 < (weights == 8).mean() < 0.5
    assert frame.importance_map.sum() == pytest.approx(weights.sum(), rel=1e-5)
    rtw = lx.RectilinearWarp(importance="boundary", boundary_weight=8, **RTW)
    assert_mostly_equal(lx.render(*view, rtw).importance_map[0], maxima(frame, weights))


def test_boundary_weights_leave_fewer_wrong_pixels():
    scene = colonnade()
    view = scene, scene.cameras["default"].resized(480, 270), scene.lights["default"]
    truth = lx.reference(*view)
    wrong = [
        lx.compare(lx.render(*view, method), truth).misclassified_count
        for method in (
            lx.NonOrthogonalWarp(resolution=256),
            lx.NonOrthogonalWarp(resolution=256, importance="boundary"),
        )
    ]
    # 0.71 here: the warp without it has become better, by its exponent.
    assert wrong[1] < 0.75 * wrong[0]


def test_weighted_counts_add_up(view):
    random = np.random.default_rng(4)
    weights = random.uniform(0, 5, (180, 320))
    frame = lx.render(*view, lx.NonOrthogonalWarp(pixel_weights=weights, **RTW))
    expected = np.zeros((CELLS, CELLS))
    np.add.at(expected, cells(frame)[::-1], weights[frame.facing])
    assert np.abs(frame.importance_map[0] - expected).sum() < 2e-3 * expected.sum()


@pytest.mark.parametrize("huge", [1e-30, 1e30])
def test_weights_of_any_size_neither_overflow_nor_vanish(view, huge):
    ones, scaled = (
        lx.render(*view, lx.NonOrthogonalWarp(pixel_weights=np.full((180, 320), w), **RTW))
        for w in (1.0, huge)
    )
    np.testing.assert_allclose(scaled.warp_map, ones.warp_map, atol=1e-3)
    np.testing.assert_allclose(scaled.importance_map / huge, ones.importance_map, rtol=1e-3)


@pytest.mark.parametrize("warp", [lx.RectilinearWarp, lx.NonOrthogonalWarp])
def test_no_importance_is_no_warp(view, warp):
    frame = lx.render(*view, warp(pixel_weights=np.zeros((180, 320)), **RTW))
    identity = np.linspace(0, 1, CELLS + 1)
    np.testing.assert_allclose(frame.warp_map - identity, 0, atol=1e-6)
    plain = lx.render_shadows(*view, "desired_view")
    assert np.nanmean(frame.visibility != plain) < np.isnan(plain).mean() + 0.001


@pytest.mark.parametrize(
    "method",
    [
        lx.RectilinearWarp(importance="distance*shadow_edge", analysis="forward"),
        lx.RectilinearWarp(importance="distance*shadow_edge*boundary", analysis="hybrid"),
        lx.NonOrthogonalWarp(importance="normal*shadow_edge*boundary"),
    ],
    ids=["forward", "hybrid", "notw"],
)
@pytest.mark.parametrize(
    "light",
    [
        None,
        lx.PointLight((0.5, 3.0, -3.0)),
        lx.SpotLight((0.5, 4.0, 0.0), (0.1, -1, -0.4), 0.9),
        lx.HemisphereLight((0, 4.5, -3), (0, -1, 0)),
    ],
    ids=["directional", "point", "spot", "hemisphere"],
)
def test_every_light_and_the_same_bytes_every_time(view, method, light):
    scene, camera, directional = view
    view = scene, camera, light or directional
    first, second = (lx.render(*view, method) for _ in range(2))
    for name in ("visibility", "importance_map", "warp_map", "shadow_map"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()
    assert (np.diff(first.warp_map) >= 0).all()
    assert first.importance_map.max() > 0
    result = lx.compare(first, lx.reference(*view))
    assert result.misclassified_count < 0.02 * result.covered_count


def test_weights_of_another_image_are_refused(view):
    with pytest.raises(ValueError, match=r"pixel_weights must have .* \(3, 4\)"):
        lx.render(*view, lx.NonOrthogonalWarp(pixel_weights=np.ones((3, 4))))
