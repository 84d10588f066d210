"""Rank the papers' methods as published by their misclassified pixels, over scenes and lights.

Three claims are tried. That of Milet et al. that non-orthogonal warps misclassify less than
rectilinear ones: both with straight edges between warped corners, as published, and with each
texel's own ray, by the smoothing of the functions. That of Vanek et al. that a paraboloid cut
around the view misclassifies less than two whole ones, by lights outside of the view. And Rosen's,
that a warped map is about as good as a conventional one of four times as many texels along a side.

Scenes are built-in ones and those of a folder. Random lights are drawn by a seed, those by which
the camera sees no edge of a shadow again. The table is written view by view, one light of every
scene before the second of any, and the same command goes on where the last one stopped.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arguments import needs
from ..camera import Camera
from ..light import DirectionalLight, Light, PointLight
from ..load import load
from ..methods import Method
from ..pictures import plots
from ..pictures.plots import axes_or_new
from ..scene import Scene
from ..scenes import GENERATORS
from .accuracy import MAX_DRAWS, evaluate, with_shadow_edges
from .options import PICTURES, add_output, add_size, natural, path_ending_in
from .papers.tables import method_of
from .random_views import random_lights
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .views import first_cameras

if TYPE_CHECKING:
    import pandas
    from matplotlib.axes import Axes

SEED = 2015

BUILT_IN: Mapping[str, Mapping[str, Any]] = {
    "objects_on_floor": {"count": 160, "subdivisions": 3},
    "colonnade": {"columns": 10},
    "city": {"blocks": 26},
    "grass": {"blades": 20_000},
    "needles": {},
    "terrain": {"cells": 162},
}
"""Generated scenes, with fewer triangles than by default."""

SMOOTHINGS = (4.0, 8.0, 16.0, 64.0)
"""Standard deviations, in cells of 256. The papers set theirs by hand."""

AUTOMATIC = "notw automatic"
"""With ``smoothing="automatic"``, which differs from view to view."""

RESOLUTION = 256
"""Texels along a side, for images of about as many pixels."""

RASTERIZATIONS: Mapping[str, Mapping[str, Any]] = {
    # 2.5 % is what Rosen calls a good balance; Milet et al. do not say theirs.
    "straight": {"rasterization": "linear", "tessellation": 0.025},
    "exact": {"rasterization": "exact"},
}
FIXED_BIAS = 1 / 500
"""Of the diagonal of the scene. The papers fix theirs by hand; without a number a method's own bias
is one of its texels, so that a finer map has a smaller one."""


def biases_of(scene: Scene) -> Mapping[str, Mapping[str, Any]]:
    """A texel, and one for all maps."""
    low, high = scene.bounds
    fixed = FIXED_BIAS * float(np.linalg.norm(high - low))
    return {"": {}, ", fixed bias": {"constant_bias": fixed}}


def sun_methods(scene: Scene) -> dict[str, Method]:
    """What is compared in directional lights: a name for each method."""
    methods = {name: method_of(name, resolution=RESOLUTION) for name in ("rtw", "notw")}
    for of_bias, bias in biases_of(scene).items():
        own = {"resolution": RESOLUTION, **bias}
        methods[f"uniform{of_bias}"] = method_of("uniform@published", **own)
        large = {**own, "resolution": 4 * RESOLUTION}
        methods[f"uniform, 4 times{of_bias}"] = method_of("uniform@published", **large)
        for words, rasterization in RASTERIZATIONS.items():
            end, warped = f", {words}{of_bias}", {**own, **rasterization}
            methods[f"rtw{end}"] = method_of("rtw@milet-2015", **warped)
            focused = {**warped, "fit": "desired_view"}
            methods[f"rtw in the view{end}"] = method_of("rtw@milet-2015", **focused)
            for smoothing in SMOOTHINGS:
                name = f"notw {smoothing:g}{end}"
                methods[name] = method_of("notw@published", smoothing=smoothing, **warped)
        chosen = {**own, **RASTERIZATIONS["straight"], "smoothing": "automatic"}
        methods[f"{AUTOMATIC}, straight{of_bias}"] = method_of("notw@published", **chosen)
    return methods


def lamp_methods(scene: Scene) -> dict[str, Method]:
    """What is compared in point lights outside of the view."""
    methods = {}
    for of_bias, bias in biases_of(scene).items():
        for words, rasterization in RASTERIZATIONS.items():
            own = {"resolution": RESOLUTION, **rasterization, **bias}
            end = f", {words}{of_bias}"
            methods[f"two paraboloids{end}"] = method_of("dual_paraboloid@vanek-2011", **own)
            methods[f"cut of the frustum{end}"] = method_of("improved_paraboloid@published", **own)
            if words == "exact":
                for cut in ("cone", "receivers"):
                    other = method_of("improved_paraboloid@published", cut=cut, **own)
                    methods[f"cut of the {cut}{end}"] = other
    return methods


METHODS: Mapping[str, Callable[[Scene], dict[str, Method]]] = {
    "sun": sun_methods,
    "lamp": lamp_methods,
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab rankings`."""
    parser.add_argument(
        "folder", type=Path, nargs="?", help="with a scenes.json and the files that it lists"
    )
    add_size(parser, "320x180", (320, 180))
    parser.add_argument(
        "--lights", type=natural, default=20, metavar="N", help="of each kind in each scene"
    )
    add_output(parser, "table of every view, .csv or .parquet", required=True)
    parser.add_argument(
        "--plot", type=path_ending_in(*PICTURES), metavar="FILE",
        help="picture of non-orthogonal against rectilinear warps by smoothing",
    )  # fmt: skip


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet, append it, and print the sums."""
    before = resume(options.output, options.line)
    done = {(row["scene"], row["kind"], int(row["light"]), row["method"]) for row in before}
    scenes = {name: (scene, camera) for name, scene, camera in _scenes(options.folder)}
    wanted = [
        (name, kind, number)
        for number in range(options.lights)
        for name, (scene, _) in scenes.items()
        for kind, methods in METHODS.items()
        if any((name, kind, number, method) not in done for method in methods(scene))
    ]
    for name, kind, number in progress(wanted, "views"):
        scene, camera = scenes[name]
        sized = camera.resized(*options.size)
        light = light_of(name, kind, number, scene, sized)
        methods = {
            method: own
            for method, own in METHODS[kind](scene).items()
            if (name, kind, number, method) not in done
        }
        counted = evaluate(scene, sized, light, methods)
        shared = {"scene": name, "kind": kind, "light": number}
        rows = [{**shared, "method": method, **counts} for method, counts in counted]
        append(options.output, options.line, rows)
    table = read(options.output)
    for rows in (sums(table).to_dict("records"), by_smoothing(table), by_scene(table)):
        print(as_text(rows), end="\n\n")
    if options.plot is not None:
        figure = needs("matplotlib.figure", "plot").Figure((6.5, 4.2), layout="constrained")
        plot(table, figure.subplots())
        plots.save(figure, options.plot, options.line)


def _scenes(folder: Path | None) -> Iterator[tuple[str, Scene, Camera]]:
    for name, arguments in BUILT_IN.items():
        scene = GENERATORS[name](**arguments)
        yield name, scene, scene.cameras["default"]
    for name, file, camera in first_cameras(folder):
        if name not in BUILT_IN:
            yield name, load(file), camera


def light_of(name: str, kind: str, number: int, scene: Scene, camera: Camera) -> Light:
    """A random light of a scene, the same at every call: a directional one, or a lamp in the
    scene's box made half as large again, but not in the camera's pyramid."""
    random = np.random.default_rng((SEED, zlib.crc32(f"{name} {kind}".encode()), number))
    # The second of two lamps is outside of the view.
    kinds = [DirectionalLight] if kind == "sun" else [PointLight, PointLight]
    draws = (random_lights(random, scene, camera, len(kinds), kinds)[-1] for _ in range(MAX_DRAWS))
    return with_shadow_edges(scene, camera, draws)


def sums(table: pandas.DataFrame) -> pandas.DataFrame:
    """Misclassified pixels by method and kind of light, in percent of the covered ones, and in how
    many views each of the methods failed."""
    groups = table.groupby(["kind", "method"], sort=False)
    found = groups.agg(
        views=("misclassified", "count"),
        failed=("misclassified", lambda counts: int(counts.isna().sum())),
        misclassified=("misclassified", "sum"),
        covered=("covered", "sum"),
    ).reset_index()
    share = 100.0 * found["misclassified"] / found["covered"].clip(lower=1)
    return found.assign(**{"% of covered": share.astype(float)})


# --- What follows from a table ---


def by_view(table: pandas.DataFrame, kind: str) -> pandas.DataFrame:
    """Misclassified pixels by scene and light, a column for each method; views in which a method
    failed are left out."""
    own = table[table["kind"] == kind]
    wrong = own.pivot_table(
        index=["scene", "light"], columns="method", values="misclassified", sort=False
    )
    return wrong.dropna()


def ratio(wrong: pandas.DataFrame, first: str, second: str) -> float:
    """Of all misclassified pixels of two methods."""
    return float(wrong[first].sum() / wrong[second].sum())


def share_of_views(wrong: pandas.DataFrame, first: str, second: str) -> str:
    """In how many views the first of two methods misclassifies less, "10 of 25"."""
    return f"{int((wrong[first] < wrong[second]).sum())} of {len(wrong)}"


def by_smoothing(table: pandas.DataFrame, bias: str = "") -> list[dict[str, Any]]:
    """For each smoothing, the misclassified pixels of non-orthogonal warps over those of the
    rectilinear one, and in how many views they are fewer; last, with the automatic smoothing, and
    with the best of the others in each view, as by hand."""
    wrong = by_view(table, "sun")
    names = [f"notw {smoothing:g}" for smoothing in SMOOTHINGS]
    for words in RASTERIZATIONS:
        ends = [f"{name}, {words}{bias}" for name in names]
        wrong[f"best, {words}{bias}"] = wrong[ends].min(axis=1)
    rows = []
    for name in (*names, AUTOMATIC, "best"):
        row: dict[str, Any] = {"smoothing, cells": name.removeprefix("notw ")}
        for words in RASTERIZATIONS:
            pair = (f"{name}, {words}{bias}", f"rtw, {words}{bias}")
            is_there = pair[0] in wrong
            row[f"{words}: notw / rtw"] = ratio(wrong, *pair) if is_there else None
            row[f"{words}: fewer in"] = share_of_views(wrong, *pair) if is_there else ""
        rows.append(row)
    return rows


def by_scene(table: pandas.DataFrame, smoothing: float = 16.0) -> list[dict[str, Any]]:
    """For each scene: non-orthogonal over rectilinear warps by their rasterization; a warped map
    over a conventional one of four times the side; and the cut of the frustum over two whole
    paraboloids."""
    suns, lamps = by_view(table, "sun"), by_view(table, "lamp")
    pairs = {
        f"notw / rtw, {words}": (f"notw {smoothing:g}, {words}", f"rtw, {words}")
        for words in RASTERIZATIONS
    }
    pairs["rtw / 4 times"] = ("rtw, straight", "uniform, 4 times")
    pairs["rtw / 4 times, fixed bias"] = (
        "rtw, straight, fixed bias", "uniform, 4 times, fixed bias",
    )  # fmt: skip
    cuts = {
        f"cut / whole{bias}": (
            f"cut of the frustum, straight{bias}",
            f"two paraboloids, straight{bias}",
        )
        for bias in ("", ", fixed bias")
    }
    rows: list[dict[str, Any]] = []
    for scene in dict.fromkeys(table["scene"]):
        own: dict[str, Any] = {"scene": scene}
        for of, wrong in ((pairs, suns), (cuts, lamps)):
            if scene in wrong.index:
                own |= {name: ratio(wrong.loc[[scene]], *pair) for name, pair in of.items()}
        rows.append(own)
    whole = {name: ratio(suns, *pair) for name, pair in pairs.items()}
    whole |= {name: ratio(lamps, *pair) for name, pair in cuts.items()}
    return [*rows, {"scene": "all", **whole}]


def plot(table: pandas.DataFrame, ax: Axes | None = None) -> Axes:
    """Non-orthogonal over rectilinear warps by smoothing: a thin line for each scene, a thick one
    for all, solid where each texel takes its own ray."""
    ax = axes_or_new(ax)
    wrong = by_view(table, "sun")
    styles = {"straight": ("#D55E00", "--", "s"), "exact": ("#0072B2", "-", "o")}
    for words, (colour, line, marker) in styles.items():
        of_scenes = [(group, 0.6, None) for _, group in wrong.groupby("scene")]
        for group, width, label in (*of_scenes, (wrong, 3.0, f"{words}, all scenes")):
            ratios = [
                ratio(group, f"notw {smoothing:g}, {words}", f"rtw, {words}")
                for smoothing in SMOOTHINGS
            ]
            shown: dict[str, Any] = {
                "color": colour,
                "linestyle": line,
                "linewidth": width,
                "label": label,
            }
            ax.plot(SMOOTHINGS, ratios, marker=marker if label else None, **shown)
    ax.axhline(1.0, color="0.4", linewidth=0.8)
    ax.set(xscale="log", yscale="log", xlabel="smoothing, cells of 256")
    ax.set(ylabel="misclassified pixels, notw / rtw", xticks=SMOOTHINGS)
    ax.set_xticklabels([f"{smoothing:g}" for smoothing in SMOOTHINGS])
    ax.set_yticks([0.5, 1.0, 2.0, 4.0], ["0.5", "1", "2", "4"])
    ax.minorticks_off()
    ax.legend(fontsize="small")
    return ax
