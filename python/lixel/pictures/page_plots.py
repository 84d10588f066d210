"""Pictures of maps in pages: the level that each pixel looks into, and the pages of the map.

Each function draws into `ax`, or into new axes where None is given, and returns the axes.
matplotlib is in the extra ``plot``.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from ..arguments import needs
from ..frame import Frame
from .display import shadow_picture
from .plots import axes_or_new, bare

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLOURS = "turbo"


def page_levels(frame: Frame, ax: Axes | None = None) -> Axes:
    """The shadows, coloured by the level that each pixel looks into; the others are grey.

    Parameters
    ----------
    frame : Frame
        Of `VirtualShadowMap`.
    ax : matplotlib.axes.Axes, optional

    Raises
    ------
    ValueError
        The frame has no pages.
    """
    colour_of = _colours(frame)
    ax = axes_or_new(ax)
    picture = shadow_picture(frame._shares) / 255.0
    looks = frame.page_levels >= 0
    picture[looks] *= colour_of(frame.page_levels[looks])[:, :3]
    ax.imshow(picture, interpolation="nearest")
    _name_levels(frame, ax, colour_of)
    return bare(ax)


def page_table(frame: Frame, ax: Axes | None = None, *, face: int = 0) -> Axes:
    """The pages of one map, where they lie on it, coloured by their levels, the finest in front.

    Both axes are places in the map, from 0 to 1, from the left and from the top. A page is a square
    of so many texels, whatever its level, so that coarse ones cover more of the map.

    Parameters
    ----------
    frame, ax
        As for `page_levels`.
    face : int
        Of a light with a position: which of the frame's faces.

    Raises
    ------
    ValueError
        The frame has no pages of that face.
    """
    colour_of = _colours(frame)
    pages = frame.pages[frame.pages["face"] == face]
    if not len(pages):
        known = ", ".join(map(str, np.unique(frame.pages["face"])))
        raise ValueError(f"face must be one of {known}, which have pages, got {face}")
    ax = axes_or_new(ax)
    patches = needs("matplotlib.patches", "plot")
    resolution = int(frame.method.parameters()["resolution"])
    for page in np.flip(np.sort(pages, order="level")):
        # Of the level, which has that many texels along a side.
        side = frame.shadow_map.shape[1] / (resolution >> int(page["level"]))
        corner = (page["column"] * side, page["row"] * side)
        colour = colour_of(page["level"])
        ax.add_patch(patches.Rectangle(corner, side, side, facecolor=colour, edgecolor="white"))
    _name_levels(frame, ax, colour_of)
    ax.set(xlim=(0, 1), ylim=(1, 0), aspect="equal")
    ax.set_title(f"{len(pages):,} pages of {frame.shadow_map.shape[1]}²")
    return ax


def _colours(frame: Frame) -> Any:
    """From levels to colours."""
    if not len(frame.pages):
        raise ValueError(f"frame must be one of lixel.VirtualShadowMap, got {frame.method}")
    levels = frame.pages["level"]
    colours = needs("matplotlib", "plot").colormaps[COLOURS]
    low, high = levels.min(), levels.max()
    return lambda level: colours(0.15 + 0.7 * (np.asarray(level) - low) / max(high - low, 1))


def _name_levels(frame: Frame, ax: Axes, colour_of: Any) -> None:
    patch = needs("matplotlib.patches", "plot").Patch
    levels, counts = np.unique(frame.pages["level"], return_counts=True)
    names = zip(levels, counts, strict=True)
    handles = [
        patch(color=colour_of(level), label=f"level {level}: {count:,}") for level, count in names
    ]
    ax.legend(handles=handles, title="pages", loc="upper left", fontsize="small", framealpha=0.9)
