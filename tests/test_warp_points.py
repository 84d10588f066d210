"""The warps' functions in numpy, by property; and against the warps that the GPU makes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra.numpy import arrays

import lixel as lx

places = st.floats(0, 1, allow_nan=False)


@st.composite
def importances(draw: st.DrawFn) -> np.ndarray:
    """Of each cell of some functions: anything, flat, nothing, one spike, one cell."""
    functions, cells = draw(st.integers(1, 6)), draw(st.integers(1, 40))
    kind = draw(st.sampled_from(["any", "flat", "zero", "spike"]))
    shape = (2, functions, cells)
    if kind == "any":
        return draw(arrays(np.float64, shape, elements=st.floats(0, 1e6)))
    values = np.full(shape, float(kind == "flat"))
    if kind == "spike":
        values[..., draw(st.integers(0, cells - 1))] = draw(st.sampled_from([1.0, 1e-30, 1e30]))
    return values


def warp_of(importance: np.ndarray, even: float) -> np.ndarray:
    """As on the GPU: prefix sums, or the identity where there is nothing, and some identity."""
    total = importance.sum(axis=-1, keepdims=True)
    sums = np.concatenate([np.zeros_like(total), np.cumsum(importance, axis=-1)], axis=-1)
    identity = np.linspace(0, 1, importance.shape[-1] + 1)
    warp = np.where(total > 0, sums / np.where(total > 0, total, 1), identity)
    warp = (1 - even) * warp + even * identity
    warp[..., 0], warp[..., -1] = 0, 1
    return np.maximum.accumulate(np.minimum(warp, 1), axis=-1)


@settings(deadline=None)
@given(importances(), st.floats(0.01, 1), arrays(np.float64, (50, 2), elements=places))
def test_inverse_after_forward_is_the_identity(importance, even, points):
    warp = warp_of(importance, even)
    warped = lx.warp_points(warp, points)
    assert ((warped >= 0) & (warped <= 1)).all()
    # At the border of two functions rounding may choose the other one: leave those points out.
    functions = warp.shape[1]
    keep = np.ones(len(points), bool)
    for value in (points[:, 1], warped[:, 0]):
        keep &= np.abs(value * functions - np.round(value * functions)) > 1e-9
    np.testing.assert_allclose(
        lx.unwarp_points(warp, warped[keep]), points[keep], atol=1e-12 / even
    )


@settings(deadline=None)
@given(importances(), st.floats(0, 1), arrays(np.float64, (50, 2), elements=places))
def test_forward_after_inverse_is_the_identity(importance, even, points):
    """Also where functions are level: there the inverse takes one of many places."""
    warp = warp_of(importance, even)
    back = lx.unwarp_points(warp, points)
    assert ((back >= 0) & (back <= 1)).all()
    functions = warp.shape[1]
    keep = np.ones(len(points), bool)
    for value in (points[:, 0], back[:, 1]):
        keep &= np.abs(value * functions - np.round(value * functions)) > 1e-9
    steep = np.diff(warp, axis=-1).max() * warp.shape[-1]
    np.testing.assert_allclose(
        lx.warp_points(warp, back[keep]), points[keep], atol=1e-13 * (1 + steep)
    )


@settings(deadline=None)
@given(importances(), st.floats(0, 1), places)
def test_each_function_is_monotone(importance, even, fixed):
    warp = warp_of(importance, even)
    x = np.linspace(0, 1, 200)
    row = lx.warp_points(warp, np.stack([x, np.full_like(x, fixed)], axis=1))[:, 0]
    assert (np.diff(row) >= 0).all()
    assert row[0] == 0
    assert row[-1] == 1
    back = lx.unwarp_points(warp, np.stack([np.full_like(x, fixed), x], axis=1))[:, 1]
    assert (np.diff(back) >= -1e-15).all()


@pytest.mark.parametrize("method", ["rtw", "notw"])
def test_texels_unwarp_to_what_the_gpu_stored(view, method):
    """Depths of a plane: a texel's depth is that of the place which it is unwarped to."""
    corners = [[-3, 0, -3], [3, 0, -3], [3, 0, 3], [-3, 0, 3]]
    plane = lx.Scene(corners, [[0, 2, 1], [0, 3, 2]])
    frame = lx.render(plane, view.camera, lx.DirectionalLight((0.3, -1, 0.5)), method)
    depth = frame.shadow_map[0]
    row, column = np.nonzero(depth < 1)
    size = depth.shape[0]
    texels = (np.stack([column, row], axis=1) + 0.5) / size
    uv = lx.unwarp_points(frame.warp_map[0], texels)
    # The plane y = 0 in the map: depth is affine in the place.
    design = np.column_stack([uv, np.ones(len(uv))])
    fitted, *_ = np.linalg.lstsq(design, depth[row, column], rcond=None)
    assert np.abs(design @ fitted - depth[row, column]).max() < 2e-4


@pytest.mark.parametrize("method", ["rtw", "notw", "min_sm+notw"])
def test_maps_alone_are_those_of_the_frame(view, method):
    frame = lx.render(*view, method)
    assert np.array_equal(lx.importance_map(*view, method), frame.importance_map)
    assert np.array_equal(lx.warp_map(*view, method), frame.warp_map)
    assert lx.warp_map(*view, "desired_view").shape[0] == 0


@pytest.mark.parametrize(
    ("warp", "words"),
    [
        (np.zeros((3, 1, 4)), "warp must have shape"),
        (np.zeros((2, 1, 1)), "a function and a cell"),
        ([[[0, 0.6, 0.4, 1]]] * 2, "nowhere falling"),
        ([[[0, np.nan, 1]]] * 2, "must be finite"),
        ([[[0.1, 0.5, 1]]] * 2, "from 0 to 1"),
    ],
)
def test_what_is_no_warp_is_refused(warp, words):
    for function in (lx.warp_points, lx.unwarp_points):
        with pytest.raises(ValueError, match=words):
            function(warp, [[0.5, 0.5]])
