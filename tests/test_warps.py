"""Warps and what they are made from, against numpy on the same receivers."""

from __future__ import annotations

import numpy as np
import pytest

import lixel as lx
from lixel.scenes import colonnade

pytestmark = pytest.mark.usefixtures("engine")

WARPS = ("rtw", "notw")
# Functions that are the prefix sums themselves. As published there is one for each row, too:
# `function_count`.
PAPER = {"smoothing": 0, "exponent": 1, "even_share": 0}


@pytest.fixture(scope="module")
def view():
    scene = colonnade(columns=4, detail=12)
    return scene, scene.cameras["default"].resized(320, 180), scene.lights["default"]


def places(frame: lx.Frame) -> np.ndarray:
    """Linear map coordinates, in [0, 1], of the receivers that face the light."""
    matrix = frame.light_matrix[0]
    points = frame.position[frame.facing]
    texels = points @ matrix[:2, :3].T + matrix[:2, 3]
    return texels / frame.shadow_map.shape[1:][::-1]


def values(functions: np.ndarray, index: np.ndarray, x: np.ndarray) -> np.ndarray:
    cells = functions.shape[1] - 1
    cell = np.minimum((x * cells).astype(int), cells - 1)
    a, b = functions[index, cell], functions[index, cell + 1]
    return a + (b - a) * (x * cells - cell)


def warped(warp: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Eq. 6 of Milet et al."""
    rows = warp.shape[1]
    i = np.minimum((uv[:, 1] * rows).astype(int), rows - 1)
    x = values(warp[0], i, uv[:, 0])
    j = np.minimum((x * rows).astype(int), rows - 1)
    return np.stack([x, values(warp[1], j, uv[:, 1])], axis=1)


@pytest.mark.parametrize("method", WARPS)
def test_functions_are_monotone_from_0_to_1(view, method):
    warp = lx.render(*view, method).warp_map
    assert np.isfinite(warp).all()
    assert (np.diff(warp, axis=-1) >= 0).all()
    assert (warp[..., 0] == 0).all()
    assert (warp[..., -1] == 1).all()


def test_counts_are_those_of_the_receivers(view):
    frame = lx.render(*view, lx.NonOrthogonalWarp(importance_resolution=64))
    uv = places(frame)
    expected = np.histogram2d(uv[:, 1], uv[:, 0], bins=64, range=[[0, 1], [0, 1]])[0]
    counts = frame.importance_map[0]
    assert counts.sum() == len(uv)
    # A receiver within rounding of a cell's border may fall on either side.
    assert np.abs(counts - expected).sum() <= 2 + 1e-3 * len(uv)


@pytest.mark.parametrize("functions", [64, 8, 6, 1])
def test_row_functions_are_prefix_sums(view, functions):
    method = lx.NonOrthogonalWarp(importance_resolution=64, function_count=functions, **PAPER)
    frame = lx.render(*view, method)
    # Rows that share a function are added up.
    first = np.arange(functions) * 64 // functions
    counts = np.add.reduceat(frame.importance_map[0].astype(np.float64), first)
    total = counts.sum(axis=1)
    rows = frame.warp_map[0, 0]
    expected = np.cumsum(counts, axis=1)[total > 0] / total[total > 0, None]
    np.testing.assert_allclose(rows[total > 0, 1:], expected, atol=1e-6)
    # A row without receivers stays as it is.
    identity = np.arange(65) / 64
    np.testing.assert_allclose(rows[total == 0], np.tile(identity, ((total == 0).sum(), 1)))


def test_there_are_no_more_functions_than_rows(view):
    few = lx.render(*view, lx.NonOrthogonalWarp(importance_resolution=7))
    assert few.warp_map.shape == (1, 2, 7, 8)


def test_notw_spreads_the_receivers(view):
    frame = lx.render(*view, lx.NonOrthogonalWarp(function_count=512, **PAPER))
    uv = places(frame)

    def longest(points: np.ndarray) -> float:
        return np.histogram2d(*points.T, bins=180, range=[[0, 1], [0, 1]])[0].max()

    assert longest(warped(frame.warp_map[0], uv)) < 0.2 * longest(uv)


def test_importance_is_one_over_the_least_distance(view):
    frame = lx.render(*view, lx.RectilinearWarp(importance_resolution=32))
    uv = places(frame)
    depth = frame.depth[frame.facing]
    expected = np.zeros((32, 32))
    cell = np.clip((uv * 32).astype(int), 0, 31)
    np.maximum.at(expected, (cell[:, 1], cell[:, 0]), 1 / depth)
    wrong = np.abs(frame.importance_map[0] - expected) > 1e-5 * expected.max()
    assert wrong.mean() < 0.01


def test_rectilinear_functions_follow_the_blurred_maxima(view):
    method = lx.RectilinearWarp(importance_resolution=48, blur=2.0)
    frame = lx.render(*view, method)
    offsets = np.arange(-6, 7)
    weights = np.exp(-0.5 * (offsets / 2.0) ** 2)
    for axis, function in ((0, frame.warp_map[0, 0, 0]), (1, frame.warp_map[0, 1, 0])):
        maxima = frame.importance_map[0].max(axis=axis).astype(np.float64)
        inside = np.convolve(np.ones(48), weights, mode="same")
        blurred = np.convolve(maxima, weights, mode="same") / inside
        expected = np.concatenate([[0], np.cumsum(blurred)]) / blurred.sum()
        np.testing.assert_allclose(function, expected, atol=2e-6)


@pytest.mark.parametrize("method", WARPS)
def test_same_bytes_every_time(view, method):
    first, second = (lx.render(*view, method) for _ in range(2))
    for name in ("visibility", "importance_map", "warp_map", "shadow_map"):
        assert getattr(first, name).tobytes() == getattr(second, name).tobytes()


@pytest.mark.parametrize("method", WARPS)
def test_warps_show_in_the_measures(view, method):
    plain = lx.render(*view, "desired_view")
    frame = lx.render(*view, method)
    assert np.all(np.array(frame.max_effective_resolution) > plain.max_effective_resolution)
    # A spread is a spread: where the warp widens the texels' beams narrow.
    seen = frame.facing
    assert np.median(frame.aliasing_error[seen]) < np.median(plain.aliasing_error[seen])


@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_nothing_to_warp(view, method):
    """Every receiver faces away: no layer, no importance, no warp."""
    scene = lx.Scene([[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]])
    camera = lx.Camera.look_at((0.2, 0.2, 2), (0.2, 0.2, 0), yfov=0.6, width=32, height=32)
    frame = lx.render(scene, camera, lx.DirectionalLight((0, 0, 1)), method)
    seen = ~np.isnan(frame.visibility)
    assert seen.any()
    assert (frame.visibility[seen] == 0).all()
    assert len(frame.importance_map) == len(frame.warp_map) == 0


@pytest.mark.parametrize("method", WARPS)
def test_one_lit_pixel(view, method):
    scene, camera, light = view
    frame = lx.render(scene, camera.resized(1, 1), light, method)
    assert frame.visibility.shape == (1, 1)
    assert np.isfinite(frame.warp_map).all()


@pytest.mark.parametrize("blur", [0.0, 1e-9, 1e9])
def test_any_blur_gives_a_warp(view, blur):
    frame = lx.render(*view, lx.RectilinearWarp(blur=blur, importance_resolution=96))
    assert (np.diff(frame.warp_map) >= 0).all()
    if blur > 1:  # as wide as the map: little is left to warp
        identity = np.arange(97) / 96
        assert np.abs(frame.warp_map[0, :, 0] - identity).max() < 0.1


def test_any_smoothing_gives_a_warp(view):
    """With all functions averaged there is one function."""
    frame = lx.render(*view, lx.NonOrthogonalWarp(smoothing=1e9, importance_resolution=96))
    assert np.ptp(frame.warp_map[0], axis=1).max() == 0


def test_long_functions(view):
    """Longer loops than some drivers finish, if they were nested."""
    method = lx.RectilinearWarp(importance_resolution=4096, resolution=64, blur=20)
    frame = lx.render(*view, method)
    assert (np.diff(frame.warp_map) >= 0).all()
    assert frame.warp_map[0, :, 0, -2].min() > 0.5


@pytest.mark.not_on_cpu("its memory is not in buffers of a device")
def test_too_many_cells_are_refused(view):
    with pytest.raises(ValueError, match=r"importance_resolution .* 1 to 16384 or None, got 20000"):
        lx.RectilinearWarp(importance_resolution=20000)
    with pytest.raises(lx.DeviceError, match=r"the .* needs \d+ bytes in one buffer"):
        lx.render(*view, lx.NonOrthogonalWarp(importance_resolution=16384))
