"""Pictures of maps and their warps, as matplotlib axes: the figures of Rosen and of Milet et al.

Each function draws one layer of a frame into `ax`, or into new axes where None is given, and
returns the axes. Both axes are places in the map, from 0 to 1, from the left and from the top.
matplotlib is in the extra ``plot``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
import numpy.typing as npt

from ..arguments import count
from ..frame import Frame
from ..warps import receiver_places, unwarp_points, warp_points
from .plots import axes_or_new

if TYPE_CHECKING:
    from matplotlib.axes import Axes


class _Maps(Protocol):
    """What a frame has, and what was asked of one alone."""

    @property
    def shadow_map(self) -> Any: ...
    @property
    def warp_map(self) -> Any: ...


def importance(frame: Frame, ax: Axes | None = None, *, layer: int = 0) -> Axes:
    """The importance map; cells of no importance are left empty.

    Parameters
    ----------
    frame : Frame
        Of a method that warps.
    ax : matplotlib.axes.Axes, optional
    layer : int
        Which of the frame's layers.

    Raises
    ------
    ValueError
        The frame has no warp in that layer, or one that is not made from importance.
    """
    _check(frame, layer)
    if not len(frame.importance_map):
        raise ValueError(f"frame must have an importance map; {frame.method.name!r} makes none")
    ax = axes_or_new(ax)
    _show(frame.importance_map[layer], ax)
    ax.set_title("importance")
    return ax


def warp_grid(frame: Frame, ax: Axes | None = None, *, layer: int = 0, lines: int = 33) -> Axes:
    """The lines of a regular grid of texels, taken back to the map that is not warped.

    Where lines are close there are many texels. The receivers' cells are shaded, where the warp is
    made from importance.

    Parameters
    ----------
    frame, ax, layer
        As for `importance`.
    lines : int
        Along each axis; at least 2.

    Raises
    ------
    ValueError
        The frame has no warp in that layer, or there are fewer lines than two.
    """
    _check(frame, layer)
    lines = count("lines", lines, least=2)
    ax = axes_or_new(ax)
    if len(frame.importance_map):
        shaded = frame.importance_map[layer] > 0
        ax.imshow(shaded, extent=(0, 1, 1, 0), cmap="Greys", vmin=0, vmax=4)
    for line in grid_lines(frame.warp_map[layer], lines):
        ax.plot(*line.T, color="#0072B2", linewidth=0.5)
    ax.set(xlim=(0, 1), ylim=(1, 0), aspect="equal", title="texels of the warp")
    return ax


def grid_lines(warp: npt.NDArray[Any] | None, lines: int) -> list[npt.NDArray[np.float64]]:
    """Those of a regular grid of texels, `lines` along each axis, as points (n, 2) before the warp;
    straight without one."""
    along = np.linspace(0, 1, 513)
    found = []
    for place in np.linspace(0, 1, lines):
        across = np.full_like(along, place)
        for points in ((across, along), (along, across)):
            line = np.stack(points, axis=1)
            found.append(line[[0, -1]] if warp is None else unwarp_points(warp, line))
    return found


def unwarped_depths(frame: _Maps, layer: int = 0) -> np.ma.MaskedArray[Any, Any]:
    """What a layer's map holds at places before the warp; texels without a caster are masked, and
    what the warp does not reach."""
    depths: np.ma.MaskedArray[Any, Any] = np.ma.masked_equal(frame.shadow_map[layer], 1.0)
    if not len(frame.warp_map):
        return depths
    # Finer than the map: the warp has made some of its texels narrow.
    rows, columns = 2 * np.array(depths.shape)
    centres = [(np.arange(count) + 0.5) / count for count in (columns, rows)]
    places = np.stack(np.meshgrid(*centres), axis=-1).reshape(-1, 2)
    warped = warp_points(frame.warp_map[layer], places)
    is_reached = _is_in_map(warped)
    size = np.array(depths.shape[::-1])
    texels = np.where(is_reached[:, None], warped, 0.0) * size
    column, row = np.minimum(texels, size - 1).astype(int).T
    found = depths[row, column]
    found[~is_reached] = np.ma.masked
    return found.reshape(rows, columns)  # type: ignore[no-any-return]


def _is_in_map(places: npt.NDArray[np.float64]) -> npt.NDArray[np.bool_]:
    """Which are; those that are not numbers are not."""
    return np.asarray((np.abs(places - 0.5) <= 0.5).all(axis=1))


def receiver_counts(
    frame: Frame, ax: Axes | None = None, *, layer: int = 0, warped: bool = True, cells: int = 128
) -> Axes:
    """How many receivers fall in each cell of the map, before or after the warp.

    Parameters
    ----------
    frame, ax, layer
        As for `importance`.
    warped : bool
        After the warp, or before it.
    cells : int
        Along each side.

    Raises
    ------
    ValueError
        The frame has no warp in that layer.
    """
    _check(frame, layer)
    ax = axes_or_new(ax)
    uv = receiver_places(frame, layer)
    if warped:
        uv = warp_points(frame.warp_map[layer], uv)
        uv = uv[_is_in_map(uv)]
    counts, *_ = np.histogram2d(uv[:, 1], uv[:, 0], bins=cells, range=((0, 1), (0, 1)))
    _show(counts, ax)
    when = "after" if warped else "before"
    ax.set_title(f"receivers {when} the warp, at most {counts.max():.0f}")
    return ax


def shadow_map(frame: Frame, ax: Axes | None = None, *, layer: int = 0) -> Axes:
    """The depths that the map holds, warped where the method warps; near is light, far is dark.

    Texels without a caster are left empty.

    Parameters
    ----------
    frame, ax, layer
        As for `importance`.

    Raises
    ------
    ValueError
        The frame has no such layer.
    """
    if not 0 <= layer < len(frame.shadow_map):
        raise ValueError(f"layer must be one of the map's {len(frame.shadow_map)}, got {layer}")
    ax = axes_or_new(ax)
    depth = np.ma.masked_equal(frame.shadow_map[layer], 1.0)
    ax.imshow(depth, extent=(0, 1, 1, 0), cmap="gray_r", interpolation="nearest")
    ax.set_title("shadow map")
    return ax


def _show(values: npt.NDArray[Any], ax: Axes) -> None:
    """Cells of a map by a logarithmic scale of colours, those of zero left empty."""
    positive = values[values > 0]
    shown = ax.imshow(
        np.ma.masked_equal(values, 0),
        extent=(0, 1, 1, 0),
        norm="log" if positive.size and positive.max() > positive.min() else None,
        cmap="viridis",
        interpolation="nearest",
    )
    ax.figure.colorbar(shown, ax=ax, shrink=0.8)


def _check(frame: Frame, layer: int) -> None:
    layers = len(frame.warp_map)
    if not 0 <= layer < layers:
        raise ValueError(
            f"layer must be one of the frame's {layers} layers with a warp, got {layer}"
        )
