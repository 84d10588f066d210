"""The smoothing of non-orthogonal warps that suits a view, for want of one set by hand."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from .camera import Camera
from .frame import render
from .light import Light
from .methods import Method, NonOrthogonalWarp, method_from
from .scene import Scene
from .warps import receiver_places, warp_points

Floats: TypeAlias = npt.NDArray[np.float64]

SHARES = (1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4)
"""Standard deviations that are tried, as shares of the cells."""

MAX_RECEIVERS = 20_000
"""Receivers of a layer that the error is estimated at, evenly among all."""


def automatic_smoothing(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: str | Method = "notw@published",
    *,
    device: str | None = None,
    **parameters: Any,
) -> float:
    """The `smoothing` of a `NonOrthogonalWarp` with straight edges, by the view.

    The papers set it by hand for each scene, and leave open how to find it (J. Navrátil's thesis,
    5.4.1): with little smoothing, straight edges between warped corners miss their places; with
    much, the texels are not where the receivers are. Of a few values the one is taken that makes
    the estimate least of how many pixels are wrong,

    .. math:: \\sum_r \\sqrt{c_r} \\, (1 + m_r) \\, / \\sqrt{X'_r Y'_r}

    over the receivers: how wide a texel is for them, in pixels, where ``c`` of them share a cell
    and the functions have the slopes ``X'`` and ``Y'``; and how many texels from its place the
    middle is taken of a straight line as long as a cell, ``m``, the more so of one along the rows
    and one along the columns.

    Parameters
    ----------
    scene, camera, light, device
        As for `render_shadows`.
    method : str or NonOrthogonalWarp
        Whose other parameters are taken; with ``rasterization="linear"``. Receivers are counted,
        whatever its importance.
    **parameters
        Parameters of the method that is named.

    Returns
    -------
    float
        In cells, for the parameter `smoothing`.

    Raises
    ------
    ValueError
        A method with exact rasterization, which needs no smoothing.
    TypeError
        A method of another kind.

    Examples
    --------
    >>> from lixel import scenes
    >>> scene = scenes.plane_and_box()
    >>> camera, light = scene.cameras["default"].resized(64, 36), scene.lights["default"]
    >>> automatic_smoothing(scene, camera, light, resolution=64)
    8.0
    """
    chosen = method_from(method, **parameters)
    if not isinstance(chosen, NonOrthogonalWarp):
        raise TypeError(f"method must be a lixel.NonOrthogonalWarp, got {chosen.spelling}")
    if chosen.rasterization != "linear":
        raise ValueError(
            f"rasterization of the method must be 'linear', got {chosen.rasterization!r}"
        )
    # The map that is warped, with a warp that costs little.
    plain = replace(chosen, rasterization="exact", function_count=1, importance_resolution=8)
    frame = render(scene, camera, light, plain, device=device)
    layers = [receiver_places(frame, layer) for layer in range(len(frame.shadow_map))]
    layers = [places for places in layers if len(places)]
    cells = chosen.importance_resolution or chosen.resolution
    tried = [share * cells for share in SHARES]
    errors = [
        sum(_error(places, replace(chosen, smoothing=smoothing), cells) for places in layers)
        for smoothing in tried
    ]
    return tried[int(np.argmin(errors))]


def _error(places: Floats, method: NonOrthogonalWarp, cells: int) -> float:
    """The estimate of wrong pixels, but for a factor, of the receivers at places of a layer."""
    counts = _counted(places, cells)
    warp = warp_of_places(places, method, cells)
    some = places[:: math.ceil(len(places) / MAX_RECEIVERS)]
    column, row = _cells_of(some, cells).T
    at = warp_points(warp, some)
    missed, stretched = np.zeros(len(some)), np.ones(len(some))
    for axis in (0, 1):
        step = np.zeros(2)
        step[axis] = 0.5 / cells
        before, after = (warp_points(warp, some + sign * step) for sign in (-1.0, 1.0))
        miss = method.resolution * np.linalg.norm((before + after) / 2 - at, axis=1)
        missed = np.maximum(missed, miss)
        # Of a level function all but a thousandth.
        stretched *= np.maximum(cells * (after - before)[:, axis], 1e-3)
    of_pixel = np.sqrt(counts[row, column] / stretched)
    return float(of_pixel @ (1.0 + missed)) * len(places) / len(some)


def warp_of_places(places: Floats, method: NonOrthogonalWarp, cells: int) -> Floats:
    """(2, functions, cells + 1): the warp that spreads receivers at places of a map (Milet et al.,
    Eq. 1 to 6)."""
    along_x = _functions_of_counts(_counted(places, cells), method)
    identity = np.broadcast_to(np.linspace(0.0, 1.0, cells + 1), along_x.shape)
    after_rows = warp_points(np.stack([along_x, identity]), places)
    return np.stack([along_x, _functions_of_counts(_counted(after_rows, cells).T, method)])


def _functions_of_counts(counts: Floats, method: NonOrthogonalWarp) -> Floats:
    """(functions, cells + 1): prefix sums of the rows, smoothed among them."""
    cells = len(counts)
    functions = method.function_count or cells
    # Twice a window of 2 h + 1 rows has the variance ((2 h + 1)^2 - 1) / 6.
    sigma = method.smoothing or 0.0
    half = min(round((math.sqrt(6.0 * sigma * sigma + 1.0) - 1.0) / 2.0), cells)
    if half:
        for _ in range(2):
            sums = np.pad(counts, ((half + 1, half), (0, 0))).cumsum(axis=0)
            counts = sums[2 * half + 1 :] - sums[: -2 * half - 1]
    served = np.arange(functions) * cells // functions
    weights = np.add.reduceat(counts, served, axis=0) ** method.exponent
    weights[np.add.reduceat(counts, served, axis=0) == 0.0] = 0.0
    totals = weights.sum(axis=1, keepdims=True)
    even = np.linspace(0.0, 1.0, cells + 1)
    sums = np.pad(weights.cumsum(axis=1), ((0, 0), (1, 0)))
    values = np.where(totals > 0.0, sums / np.maximum(totals, 1e-300), even)
    values[:, -1] = 1.0
    return np.asarray((1.0 - method.even_share) * values + method.even_share * even)


def _counted(places: Floats, cells: int) -> Floats:
    """(cells, cells): how many are in each cell, row by row."""
    column, row = _cells_of(places, cells).T
    found = np.bincount(row * cells + column, minlength=cells * cells)
    return found.reshape(cells, cells).astype(np.float64)


def _cells_of(places: Floats, cells: int) -> npt.NDArray[np.int64]:
    """(n, 2): column and row."""
    return np.asarray(np.minimum((places * cells).astype(np.int64), cells - 1))
