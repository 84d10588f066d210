"""Measure filtered maps against the lit share of many samples in each pixel, by filter and radius.

The first camera of every scene of a folder, in each light that its scenes.json lists, and two roofs
at different heights over a floor, under which light leaks. Each filter blurs the same map with
several radii; beside them stand lookups without a filter. The truth is `lixel.coverage` with the
samples of `exact`. The table is written view by view, and the same command goes on where the last
one stopped.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from ..arguments import needs
from ..camera import Camera
from ..compare import compare
from ..coverage import Coverage, coverage
from ..frame import render_shadows
from ..light import DirectionalLight
from ..load import load
from ..methods import ExponentialVariance, Method, Moments, Pcf, Variance, method_from
from ..methods.base import Lookup
from ..methods.filters import Filter
from ..pictures import plots
from ..scene import Scene
from .options import (
    MORE,
    PICTURES,
    add_one_method,
    add_output,
    add_size,
    method_with,
    path_ending_in,
)
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .views import View, listed_in

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

RADII = (0.5, 1.0, 2.0, 4.0, 8.0, 16.0)
"""In texels of the map."""

LEAKING = "two_roofs"
"""The view of which every dark pixel is far from the light."""

Series: TypeAlias = Mapping[str, Filter]

FILTERS: Series = {
    "pcf": Pcf(samples=64),
    "variance": Variance(),
    "variance, reduced": Variance(bleeding_reduction=0.3),
    "EVSM2": ExponentialVariance(negative_exponent=None),
    "EVSM4": ExponentialVariance(),
    "moments": Moments(),
    "moments, mips": Moments(mips=True),
}
"""By their names in the table, of any radius."""

UNFILTERED: Mapping[Lookup, str] = {"depth": ":", "revectorized": "-.", "auto": "--"}
"""With the style of their lines."""


# --- The command ---


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab filters`."""
    parser.add_argument(
        "folder", type=Path, nargs="?",
        help="with a scenes.json and the files that it lists; default: the two roofs alone",
    )  # fmt: skip
    add_size(parser, "480x270", (480, 270))
    parser.add_argument("--scene", action="append", metavar="NAME", help=f"of the folder; {MORE}")
    parser.add_argument(
        "--samples", type=int, default=32, metavar="N", help="of each pixel of the truth (32)"
    )
    add_one_method(parser, 512)
    parser.add_argument(
        "--plot", type=path_ending_in(*PICTURES), metavar="FILE",
        help="draw error and leaks against the radius",
    )  # fmt: skip
    add_output(parser, "table of every view and filter, .csv or .parquet", required=True)


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet, append it, print the means and draw them."""
    before = resume(options.output, options.line)
    done = {(row["scene"], str(row["light"])) for row in before}
    method = method_with(options.method, options.resolution, options.parameters)
    for name, light_name, view in views_of(options):
        if (name, light_name) in done:
            continue
        truth = coverage(*view, "exact", samples=options.samples)
        shared = {"scene": name, "light": light_name, "light_kind": type(view[2]).__name__}
        tried = progress(list(lookups()), f"{name}, light {light_name}")
        rows = [
            {**shared, "filter": filter_name, "radius": radius,
             **evaluate(view, method_from(method, lookup=lookup), truth)}
            for filter_name, radius, lookup in tried
        ]  # fmt: skip
        append(options.output, options.line, rows)
    table = read(options.output)
    print(as_text(summary(table).to_dict("records")))
    if options.plot is not None:
        draw(table, options.plot, options.line)


def lookups() -> Iterator[tuple[str, float, Lookup | Filter]]:
    """Name, radius and lookup of everything that is measured."""
    for word in UNFILTERED:
        yield word, 0.0, word
    for name, plain in FILTERS.items():
        for radius in RADII:
            if isinstance(plain, Pcf):
                yield name, radius, replace(plain, radius=radius)
            else:
                yield name, radius, replace(plain, blur=radius)


def views_of(options: argparse.Namespace) -> Iterator[tuple[str, str, View]]:
    """Scene, light and view of all that is measured."""
    scene, camera, light = two_roofs()
    yield LEAKING, "0", (scene, camera.resized(*options.size), light)
    if options.folder is None:
        return
    for file, listed in listed_in(options.folder):
        name = Path(file).stem
        if not options.scene or name in options.scene:
            scene = load(options.folder / file)
            camera = next(iter(listed.cameras.values())).resized(*options.size)
            for light_name, of_list in listed.lights.items():
                yield name, light_name, (scene, camera, of_list)


def two_roofs() -> View:
    """A floor in the shadow of a low roof, seen from below it; a high roof over half of it changes
    nothing. Its edge and the low roof are both in a blur of the map."""
    quads = (((-8, 8), 0.0), ((-6, 6), 1.0), ((-6, 0.13), 6.0))
    corners = [
        (x, height, z)
        for (low, high), height in quads
        for x, z in ((low, -6), (high, -6), (high, 6), (low, 6))
    ]
    faces = [[4 * i + k for k in face] for i in range(3) for face in ((0, 2, 1), (0, 3, 2))]
    camera = Camera.look_at((0, 0.9, 5.0), (0, 0, 0), yfov=0.7, width=480, height=270)
    return Scene(np.array(corners, float), faces), camera, DirectionalLight((0.02, -1.0, 0.01))


# --- Numbers ---


def evaluate(view: View, method: Method, truth: Coverage) -> dict[str, Any]:
    """How far a filter is from the truth, and `leak`, the mean light of the pixels that are wholly
    dark in truth, as are those around them."""
    found = render_shadows(*view, method)
    comparison = compare(found, truth)
    from scipy.ndimage import binary_erosion

    dark = binary_erosion(truth.visibility == 0.0, np.ones((3, 3))) & comparison.covered
    return {
        "leak": float(found[dark].mean(dtype=np.float64)) if dark.any() else None,
        **comparison.as_dict(),
    }


def summary(table: pandas.DataFrame) -> pandas.DataFrame:
    """Means over the views of the folder, or of the two roofs without one, by filter and radius."""
    views = table[table["scene"] != LEAKING] if (table["scene"] != LEAKING).any() else table
    names = ["mean_absolute_error", "rmse", "ssim", "rate_beyond", "leak"]
    means = views.groupby(["filter", "radius"], sort=False)[names].mean()
    # As text shows two places.
    return (1e3 * means).rename(columns=lambda name: f"1000 {name}").reset_index()


def draw(table: pandas.DataFrame, path: Path, command: str) -> None:
    """Error and leaks against the radius, a line for each filter."""
    figure = needs("matplotlib.figure", "plot").Figure((9, 3.8), layout="constrained")
    views = table[table["scene"] != LEAKING] if (table["scene"] != LEAKING).any() else table
    error, leak = figure.subplots(1, 2)
    _draw_series(error, views, "mean_absolute_error")
    error.set_ylabel("mean absolute error")
    _draw_series(leak, table[table["scene"] == LEAKING], "leak")
    leak.set_ylabel("light in the shadow of two roofs")
    error.legend(fontsize=8)
    plots.save(figure, path, command, dpi=90)


def _draw_series(axes: Axes, table: pandas.DataFrame, column: str) -> None:
    means = table.groupby(["filter", "radius"], sort=False)[column].mean()
    for name in dict.fromkeys(table["filter"]):
        of_filter = means[name]
        if name in UNFILTERED:
            style = UNFILTERED[name]
            axes.axhline(of_filter.iloc[0], linestyle=style, color="gray", label=name)
        else:
            axes.plot(of_filter.index, of_filter, marker=".", label=name)
    axes.set_xscale("log", base=2)
    axes.set_xticks(RADII, [f"{radius:g}" for radius in RADII])
    axes.set_xlabel("radius in texels")
