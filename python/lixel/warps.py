"""Importance maps and warp maps by themselves, and warps applied to any coordinates in numpy."""

from __future__ import annotations

from typing import Any, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import reals
from .camera import Camera
from .frame import Frame, Output, frame_parts
from .light import Light
from .methods import Method, method_from
from .scene import Scene

Floats: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.int64]

_SIDES: tuple[Literal["left", "right"], ...] = ("left", "right")


def importance_map(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: str | Method = "rtw",
    *,
    device: str | None = None,
    **parameters: Any,
) -> npt.NDArray[np.float32]:
    """What a warp is made from: `Frame.importance_map`, without reading back the rest of a frame.

    Parameters
    ----------
    scene, camera, light, method, device, **parameters
        As for `render_shadows`; a method without a warp has no importance map.

    Returns
    -------
    (layers, cells, cells) float32
        Row 0 at the top of the map: the greatest importance of each cell (rtw), or how much the
        receivers in it count (notw).

    Raises
    ------
    ValueError, TypeError, DeviceError
        As for `render_shadows`.
    """
    return _output(
        "importance_map", scene, camera, light, method_from(method, **parameters), device
    )


def warp_map(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: str | Method = "rtw",
    *,
    device: str | None = None,
    **parameters: Any,
) -> npt.NDArray[np.float32]:
    """The functions of a warp: `Frame.warp_map`, without reading back the rest of a frame.

    Parameters
    ----------
    scene, camera, light, method, device, **parameters
        As for `render_shadows`; a method without a warp has no warp map.

    Returns
    -------
    (layers, 2, functions, cells + 1) float32
        Values in [0, 1] at the boundaries of cells, linear in between: along x, one function for
        each band of rows, and along y, one for each band of columns. One function of each for rtw.
        Less the identity, ``np.linspace(0, 1, cells + 1)``, they are the papers' displacements.
        Of a `GivenWarp` by samples (layers, h, w, 2), the samples.

    Raises
    ------
    ValueError, TypeError, DeviceError
        As for `render_shadows`.
    """
    return _output("warp_map", scene, camera, light, method_from(method, **parameters), device)


def _output(
    name: Output,
    scene: Scene,
    camera: Camera,
    light: Light,
    method: Method,
    device: str | None,
) -> npt.NDArray[np.float32]:
    found: npt.NDArray[np.float32] = getattr(
        frame_parts(scene, camera, light, method, [name], device=device).outputs, name
    )
    return found


def warp_points(warp: npt.ArrayLike, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """Where a warp takes points of the map that it is made for.

    .. math:: x' = X_i(x),\\; i = \\lfloor y r \\rfloor, \\qquad
              y' = Y_j(y),\\; j = \\lfloor x' r \\rfloor

    for ``r`` functions along each axis (Milet et al., WSCG 2015, Eq. 6; Rosen's warp has one).

    Parameters
    ----------
    warp : (2, functions, cells + 1) or (h, w, 2) array
        A layer of a `warp_map`: along x, then along y; from 0 to 1, and nowhere falling. Or the
        samples of a `GivenWarp`, more than two rows of them, whose inverse is taken.
    points : (n, 2) array
        (x, y) in [0, 1], from the left and from the top of the map; others are taken to its border.

    Returns
    -------
    (n, 2) float64
        Places in [0, 1] of the warped map; NaN, or up to half a step beyond it, where samples do
        not reach.

    Raises
    ------
    ValueError, TypeError
        A warp or points of another shape or kind, functions that fall, or samples without an
        inverse.

    Examples
    --------
    >>> identity = np.broadcast_to(np.linspace(0, 1, 5), (2, 1, 5))
    >>> warp_points(identity, [[0.3, 0.9]]).tolist()
    [[0.3, 0.9]]
    """
    if _is_table(warp):
        return _core.sampled_points(warp, _places_in_map(points), False)
    functions = _functions(warp)
    x, y = _places_in_map(points).T
    warped = _values(functions[0], _index(len(functions[0]), y), x)
    return np.stack([warped, _values(functions[1], _index(len(functions[1]), warped), y)], axis=1)


def unwarp_points(warp: npt.ArrayLike, points: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """The inverse of `warp_points`: where a warp takes to the points.

    .. math:: y = Y_j^{-1}(y'),\\; j = \\lfloor x' r \\rfloor, \\qquad
              x = X_i^{-1}(x'),\\; i = \\lfloor y r \\rfloor

    Where a function is level, many places have the same value; the middle of them is taken.

    Parameters
    ----------
    warp : (2, functions, cells + 1) or (h, w, 2) array
        As for `warp_points`.
    points : (n, 2) array
        (x', y') in [0, 1] of the warped map; others are taken to its border.

    Returns
    -------
    (n, 2) float64
        Places in [0, 1] of the map that the warp is made for.

    Raises
    ------
    ValueError, TypeError
        As for `warp_points`.
    """
    if _is_table(warp):
        return _core.sampled_points(warp, _places_in_map(points), True)
    functions = _functions(warp)
    x, y = _places_in_map(points).T
    unwarped = _places(functions[1], _index(len(functions[1]), x), y)
    return np.stack(
        [_places(functions[0], _index(len(functions[0]), unwarped), x), unwarped], axis=1
    )


def receiver_places(frame: Frame, layer: int) -> npt.NDArray[np.float64]:
    """(n, 2): places in [0, 1] of a layer's map, before any warp, of the receivers that it is for.

    Those that face the light and lie in the layer's region are given, pixel by pixel, but for what
    a light matrix leaves off the map.
    """
    projection, matrix = frame.projections[layer], frame.light_matrix[layer]
    points = frame.position[frame.facing]
    homogeneous = np.column_stack([points, np.ones(len(points))])
    is_own = np.ones(len(points), bool)
    for plane in projection["region"]:
        is_own &= homogeneous @ plane >= 0.0
    q = homogeneous[is_own] @ matrix.T
    if projection["kind"] == "paraboloid":
        along = np.linalg.norm(q[:, :3], axis=1) + q[:, 2]
        texels = projection["centre"] + q[:, :2] / along[:, None] * projection["scale"]
    else:
        q = q[q[:, 3] > 0.0]
        texels = q[:, :2] / q[:, 3:]
    if projection["kind"] == "log_perspective":
        texels[:, 1] = projection["centre"][1] - projection["scale"][1] * np.log(texels[:, 1])
    uv = np.asarray(texels / frame.shadow_map.shape[:0:-1], np.float64)
    # Rounding may leave one at the border.
    is_inside = (np.abs(uv - 0.5) < 0.501).all(axis=1)
    return np.clip(uv[is_inside], 0.0, 1.0)


def _is_table(warp: npt.ArrayLike) -> bool:
    """Whether these are samples. Two rows of them are taken for functions of one cell."""
    try:
        shape = np.shape(warp)
    except ValueError:  # A ragged list, which is refused by name later.
        return False
    return len(shape) == 3 and shape[0] != 2 and shape[2] == 2


def _functions(warp: npt.ArrayLike) -> Floats:
    functions = reals("warp", warp, 2, "functions", "boundaries")
    if functions.shape[1] < 1 or functions.shape[2] < 2:
        raise ValueError(f"warp must have a function and a cell, got shape {functions.shape}")
    if not np.isfinite(functions).all() or (np.diff(functions, axis=2) < 0).any():
        raise ValueError("warp must be finite and nowhere falling along its last axis")
    if (functions[..., 0] != 0).any() or (functions[..., -1] != 1).any():
        raise ValueError("warp must run from 0 to 1 along its last axis")
    return functions


def _places_in_map(points: npt.ArrayLike) -> Floats:
    places = reals("points", points, "n", 2)
    if np.isnan(places).any():
        row = int(np.flatnonzero(np.isnan(places).any(axis=1))[0])
        raise ValueError(f"points must be numbers, got {places[row].tolist()} in row {row}")
    return np.asarray(np.clip(places, 0.0, 1.0))


def _index(count: int, place: Floats) -> Indices:
    return np.asarray(np.minimum((place * count).astype(np.int64), count - 1))


def _values(functions: Floats, index: Indices, x: Floats) -> Floats:
    cells = functions.shape[1] - 1
    cell = _index(cells, x)
    low, high = functions[index, cell], functions[index, cell + 1]
    # Between its boundaries whatever is rounded.
    return np.asarray(np.clip(low + (high - low) * (x * cells - cell), low, high))


def _places(functions: Floats, index: Indices, value: Floats) -> Floats:
    crossings = [_crossings(functions, index, value, side) for side in _SIDES]
    return np.asarray(np.mean(crossings, axis=0) / (functions.shape[1] - 1))


def _crossings(
    functions: Floats, index: Indices, value: Floats, side: Literal["left", "right"]
) -> Floats:
    """Where, in cells, the functions first reach the values, or on the right first exceed them."""
    boundary = np.empty(len(value), np.int64)
    for function in np.unique(index):
        own = index == function
        boundary[own] = np.searchsorted(functions[function], value[own], side)
    last = functions.shape[1] - 1
    end = np.clip(boundary, 1, last)
    low, high = functions[index, end - 1], functions[index, end]
    rise = high - low
    part = np.where(rise > 0, (value - low) / np.where(rise > 0, rise, 1.0), 1.0)
    place = end - 1 + np.clip(part, 0.0, 1.0)
    return np.select([boundary == 0, boundary > last], [0.0, float(last)], place)
