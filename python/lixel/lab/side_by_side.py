"""Draw one view by several methods: misclassified pixels in red, below them where the texels are.

Below the picture of a method is its map: the depths that the light sees, and over them a regular
grid of the texels that are stored, taken back through the warp. Where its lines are close there are
many texels. Below a method without a map are the pixels of the view, as the light sees them.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from ..arguments import needs
from ..camera import Camera
from ..compare import FALSE_LIT, FALSE_SHADOW, Comparison, compare
from ..frame import Frame, render
from ..light import Light
from ..methods import Method
from ..pictures import plots
from ..pictures.warp_plots import grid_lines, unwarped_depths
from ..reference import reference
from ..scene import Scene
from ..warps import receiver_places
from .options import (
    PICTURES,
    add_methods,
    add_output,
    add_resolutions,
    add_scene_and_view,
    method_with,
    texels_text,
    view_of,
)
from .report import progress, waiting

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

METHODS = ("uniform", "rtw", "notw", "exact")
RESOLUTION = 256
LINES = 25
"""Of the grid, along each axis."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab side_by_side`."""
    add_scene_and_view(parser)
    add_methods(parser, ", ".join(METHODS))
    add_resolutions(parser, str(RESOLUTION))
    add_output(parser, "the picture", PICTURES, required=True)


def run(options: argparse.Namespace) -> None:
    """Render and draw."""
    methods = []
    for name in options.method or METHODS:
        plain = method_with(name, None, ())
        sizes = (options.resolution or [RESOLUTION]) if plain.map_resolution else [None]
        methods += [method_with(name, size, ()) for size in sizes]
    scene, camera, light = view_of(options)
    plots.save(drawn(scene, camera, light, methods), options.output, options.line)


def drawn(scene: Scene, camera: Camera, light: Light, methods: Sequence[Method]) -> Figure:
    """A column for each method."""
    with waiting("reference: casting rays on the CPU"):
        truth = reference(scene, camera, light)
    shape = camera.height / camera.width
    width = 3.2
    figure = needs("matplotlib.figure", "plot").Figure(
        (width * len(methods), width * (shape + 1.0) + 0.5), layout="constrained"
    )
    figure.get_layout_engine().set(h_pad=0.05, w_pad=0.02, hspace=0.0, wspace=0.0)
    axes = figure.subplots(
        2, len(methods), squeeze=False, gridspec_kw={"height_ratios": (shape, 1.0)}
    )
    frames = [render(scene, camera, light, method) for method in progress(methods, "render")]
    with_map = next((frame for frame in frames if len(frame.shadow_map)), None)
    for column, frame in zip(axes.T, frames, strict=True):
        _draw_view(frame, compare(frame, truth), column[0])
        column[1].set(xlim=(0, 1), ylim=(1, 0), aspect="equal", xticks=(), yticks=())
        if len(frame.shadow_map):
            _draw_map(frame, column[1])
        elif with_map is not None:
            _draw_pixels(with_map, column[1])
        else:
            column[1].set_axis_off()
    return figure  # type: ignore[no-any-return]


def _draw_view(frame: Frame, found: Comparison, ax: Axes) -> None:
    picture = frame.to_image()
    picture[found.false_lit] = FALSE_LIT
    picture[found.false_shadow] = FALSE_SHADOW
    ax.imshow(picture, interpolation="nearest")
    size = f", {texels_text(frame.method)} texels" if len(frame.shadow_map) else ""
    ax.set_title(
        f"{frame.method.spelling}{size}\n{found.misclassified_count:,} pixels misclassified",
        fontsize="large",
    )
    ax.set_axis_off()


def _draw_map(frame: Frame, ax: Axes) -> None:
    """The first layer's depths at their places before the warp, near light, and the grid."""
    depths = unwarped_depths(frame)
    low, high = float(depths.min()), float(depths.max())
    # No darker than what the lines can be seen on.
    ax.imshow(
        depths, extent=(0, 1, 1, 0), cmap="gray_r", vmin=low, vmax=2.2 * high - 1.2 * low,
        interpolation="nearest",
    )  # fmt: skip
    warp = frame.warp_map[0] if len(frame.warp_map) else None
    for line in grid_lines(warp, LINES):
        ax.plot(*line.T, color="#0072B2", linewidth=0.6)


def _draw_pixels(frame: Frame, ax: Axes) -> None:
    """The pixels of the view as the light of another method's map sees them."""
    x, y = receiver_places(frame, 0).T
    ax.plot(x, y, ",", color="#0072B2")
    ax.text(0.03, 0.97, "no map: every pixel\nis decided by itself", fontsize="large")
