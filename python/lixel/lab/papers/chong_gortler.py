"""Tables 1 to 3 of H. Y. Chong, S. J. Gortler, "Scene optimized shadow mapping", Harvard TR-07-07,
2007.

Objects on a floor, a viewer that stands slightly above it, random directional lights on the upper
hemisphere. Table 1: wrong pixels over all lights, and over the tenth of them that is worst for a
method. The paper's truth was a focused map of ten times the resolution, ours is the ray-cast
reference; each fit of a method has a row, and some methods are added. Tables 2 and 3: time by the
number of lights and the size of the map, and where it goes.

`lixel papers chong-1 chong-2 chong-3` measures them; Table 1 for other scenes and more lights:

    python -m lixel.paper_tables.chong_gortler --scene sponza.glb --views scenes.json --lights 100
        -o results
"""

from __future__ import annotations

import argparse
import itertools
import math
import statistics
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ...camera import Camera
from ...compare import compare
from ...frame import render, render_shadows
from ...light import DirectionalLight, Light
from ...methods import (
    Cascades,
    DesiredView,
    Focused,
    LightSpacePerspective,
    Method,
    NonOrthogonalWarp,
    PerspectiveShadowMap,
    PlaneOptimal,
    RectilinearWarp,
    SceneOptimized,
    Uniform,
)
from ...reference import reference
from ...scene import Scene
from ...scenes import objects_on_floor
from ..report import progress, say
from ..report import table as as_text
from ..result_tables import append, resume, write
from ..views import scene_and_views

SEED = 2007

COLUMNS = ("optimal", "focused", "lispsm", "plane optimal", "normal")
"""Of Table 1, as the paper calls them."""

# Percent more wrong pixels than the first column's; rows: all lights, then the tenth of the lights
# that is worst for each column.
PAPER = np.array(
    [
        [0.0, 27.65, 55.33, 315.09, 186.60],
        [0.0, 32.37, 6.47, 64.16, 276.21],
        [0.0, 84.00, 34.38, 41.60, 356.53],
        [0.0, 66.73, 49.12, 61.40, 321.70],
        [0.0, 28.12, 15.96, 630.43, 307.39],
        [0.0, 64.24, 24.04, 91.20, 379.44],
    ]
)

FITS = {
    "the paper's": (
        "scene optimized, boundary samples", "focused, frustum", "lispsm, frustum",
        "plane optimal, frustum", "uniform",
    ),
    "the best": (
        "scene optimized", "focused, receivers", "lispsm, receivers", "plane optimal, receivers",
        "uniform",
    ),
}  # fmt: skip
"""The rows that stand for the columns of Table 1."""

# Frames per second at 1150 x 1150 pixels, by lights and texels along a side of the map.
PAPER_FPS = {
    (1, 500): (56.7, 67.3, 69.3), (1, 700): (55.1, 65.3, 66.7), (1, 1000): (51.9, 60.7, 62.4),
    (2, 500): (39.3, 44.4, 45.7), (2, 700): (36.7, 41.7, 43.0), (2, 1000): (33.8, 37.9, 39.4),
    (3, 500): (29.2, 32.5, 33.3), (3, 700): (27.1, 30.2, 31.5), (3, 1000): (24.8, 27.1, 28.3),
    (4, 500): (22.8, 25.2, 25.9), (4, 700): (21.1, 23.2, 24.2), (4, 1000): (19.4, 21.2, 22.0),
}  # fmt: skip


def methods(resolution: int) -> dict[str, Method]:
    """The rows by name. Depth lookup with the receiver's plane, as plain as the paper's."""
    shared: dict[str, Any] = {
        "resolution": resolution,
        "lookup": "depth",
        "bias": "receiver_plane",
    }
    halved = {**shared, "resolution": resolution // 2}
    rows: dict[str, Method] = {
        "scene optimized": SceneOptimized(**shared),
        "scene optimized, boundary samples": SceneOptimized(samples="boundary", **shared),
        "scene optimized, all that face the light": SceneOptimized(samples="facing", **shared),
        "scene optimized, simplex": SceneOptimized(optimizer="simplex", **shared),
    }
    fits: tuple[Literal["receivers", "frustum"], ...] = ("receivers", "frustum")
    for fit in fits:
        rows[f"focused, {fit}"] = Focused(fit=fit, **shared)
        rows[f"lispsm, {fit}"] = LightSpacePerspective(fit=fit, **shared)
        rows[f"psm, {fit}"] = PerspectiveShadowMap(fit=fit, **shared)
        rows[f"plane optimal, {fit}"] = PlaneOptimal(fit=fit, **shared)
    return {
        **rows,
        "uniform": Uniform(**shared),
        "desired view": DesiredView(**shared),
        "rtw": RectilinearWarp(**shared),
        "notw": NonOrthogonalWarp(**shared),
        "scene optimized + notw": NonOrthogonalWarp(fit="scene_optimized", **shared),
        "cascades, 4 of half the resolution": Cascades(layers=4, **halved),
    }


def lights(count: int) -> list[DirectionalLight]:
    """Directions evenly spread over the upper hemisphere, the same at every call."""
    random = np.random.default_rng(SEED)
    towards = random.normal(size=(count, 3))
    towards[:, 1] = np.abs(towards[:, 1])
    return [DirectionalLight(-vector) for vector in towards]


def misclassified(
    quick: bool = False,
    folder: Path | None = None,
    *,
    count: int | None = None,
    scene: Scene | None = None,
    camera: Camera | None = None,
    command: str | None = None,
) -> list[dict[str, Any]]:
    """Table 1.

    Parameters
    ----------
    quick : bool
        25 lights, 375² pixels, a 200² map and about 290,000 triangles, in place of the paper's 500,
        750², 400² and 1.14 million.
    folder : Path, optional
        Where ``chong-1.csv`` goes: the wrong pixels of each light and method. What is there
        already is not measured again.
    count : int, optional
        Lights, if not as many.
    scene : Scene, optional
        Another scene.
    camera : Camera, optional
        What looks at it, the scene's first if None.
    command : str, optional
        What the rows of the folder say made them, if not `lixel papers`; rows of another command
        are refused.

    Returns
    -------
    list of dict
        First a row for each method: its name, the wrong pixels over all lights, how many percent
        more these are than those of the first row, and the mean over the tenth of the lights that
        is worst for it. Then the rows of the paper's table, with the paper's fits and with the best
        ones: mean wrong pixels, percent more than optimal, and the paper's percentage in brackets.
    """
    if scene is None:
        scene = objects_on_floor(subdivisions=3) if quick else objects_on_floor()
    command = command or f"lixel papers chong-1{' --quick' if quick else ''}"
    side, resolution = (375, 200) if quick else (750, 400)
    camera = (camera or next(iter(scene.cameras.values()))).resized(side, side)
    rows = methods(resolution)
    chosen = lights(count or (25 if quick else 500))
    path = None if folder is None else folder / "chong-1.csv"
    before = [] if path is None else resume(path, command)
    known = {(int(row["light"]), row["method"]): int(row["wrong"]) for row in before}
    wrong = np.zeros((len(rows), len(chosen)))
    for column, light in enumerate(progress(chosen, "lights")):
        missing = [name for name in rows if (column, name) not in known]
        if missing:
            truth = reference(scene, camera, light)
            measured: list[dict[str, Any]] = []
            for name in missing:
                found = compare(render_shadows(scene, camera, light, rows[name]), truth)
                known[column, name] = found.misclassified_count
                measured.append(
                    {
                        "light": column,
                        "method": name,
                        "wrong": found.misclassified_count,
                        "covered": found.covered_count,
                    }
                )
            if path is not None:
                append(path, command, measured)
        wrong[:, column] = [known[column, name] for name in rows]
    names = list(rows)
    return [*summary(names, wrong), *layout(names, wrong)]


def summary(names: Sequence[str], wrong: npt.NDArray[np.float64]) -> list[dict[str, Any]]:
    """A row for each method from the wrong pixels, (methods, lights)."""
    worst = max(1, wrong.shape[1] // 10)
    totals = wrong.sum(axis=1)
    return [
        {
            "method": name,
            "wrong pixels": int(total),
            "% more": _percent_more(total, totals[0]),
            "mean of the worst tenth": float(np.sort(counts)[-worst:].mean()),
        }
        for name, total, counts in zip(names, totals, wrong, strict=True)
    ]


def layout(names: Sequence[str], wrong: npt.NDArray[np.float64]) -> list[dict[str, Any]]:
    """The rows of the paper's Table 1 from the wrong pixels, (methods, lights)."""
    worst = max(1, wrong.shape[1] // 10)
    rows = []
    for fits, methods_of_fits in FITS.items():
        counts = wrong[[names.index(name) for name in methods_of_fits]]
        chosen = [np.arange(wrong.shape[1])]
        chosen += [np.argsort(of_method)[-worst:] for of_method in counts]
        places = ["all lights", *(f"worst tenth of {name}" for name in COLUMNS)]
        for place, columns, paper in zip(places, chosen, PAPER, strict=True):
            means = counts[:, columns].mean(axis=1)
            row: dict[str, Any] = {"fits": fits, "lights": place}
            for name, mean, theirs in zip(COLUMNS, means, paper, strict=True):
                more = _percent_more(mean, means[0])
                row[name] = f"{mean:,.0f}, {more:+.0f} % ({theirs:+.0f} %)"
            rows.append(row)
    return rows


def _percent_more(wrong: float, first: float) -> float:
    """Not a number where the first has no wrong pixels."""
    return 100.0 * (float(wrong) / float(first) - 1.0) if first else math.nan


def running_times(quick: bool = False, folder: Path | None = None) -> list[dict[str, Any]]:
    """Table 2: time by the number of lights and the size of the map.

    Parameters
    ----------
    quick : bool
        Images and maps of half the size, a scene of about 290,000 triangles.
    folder : Path, optional
        Where ``chong-2.csv`` goes.

    Returns
    -------
    list of dict
        Lights, texels along a side of the map; for each method the milliseconds of a frame, the
        median of five that are taken by turns, and its time over that of `focused`, with the
        paper's in brackets.
    """
    scene = objects_on_floor(subdivisions=3) if quick else objects_on_floor()
    part = 2 if quick else 1
    camera = scene.cameras["default"].resized(1150 // part, 1150 // part)
    suns = lights(4)
    rows = []
    for (count, side), fps in progress(list(PAPER_FPS.items()), "rows"):
        chosen: dict[str, Method] = {
            "optimal": SceneOptimized(samples="boundary", resolution=side // part),
            "focused": Focused(fit="frustum", resolution=side // part),
            "lispsm": LightSpacePerspective(fit="frustum", resolution=side // part),
        }
        ms = _medians(scene, camera, suns[:count], chosen)
        row: dict[str, Any] = {"lights": count, "map": side // part}
        for name, own in zip(chosen, fps, strict=True):
            row[f"{name}, ms"] = ms[name]
            row[f"{name} / focused"] = f"{ms[name] / ms['focused']:.2f} ({fps[1] / own:.2f})"
        rows.append(row)
    _save(rows, folder, "chong-2")
    return rows


def stages(quick: bool = False, folder: Path | None = None) -> list[dict[str, Any]]:
    """Table 3: where the time of a frame with four lights and maps of 750² goes.

    Parameters
    ----------
    quick, folder
        As for `running_times`.

    Returns
    -------
    list of dict
        For the optimized and the plain map: milliseconds of the whole, of the optimization on the
        CPU, and its share in percent, with the paper's. The paper's hull is part of its
        optimization; so is ours.
    """
    scene = objects_on_floor(subdivisions=3) if quick else objects_on_floor()
    part = 2 if quick else 1
    camera = scene.cameras["default"].resized(750 // part, 750 // part)
    chosen: dict[str, tuple[Method, float]] = {
        "optimal": (SceneOptimized(samples="boundary", resolution=750 // part), 12.43),
        "normal": (Focused(fit="frustum", resolution=750 // part), 0.40),
    }
    suns = lights(4)
    wholes = _medians(scene, camera, suns, {name: method for name, (method, _) in chosen.items()})
    rows = []
    for name, (method, paper) in chosen.items():
        frames = [[render(scene, camera, sun, method).timings for sun in suns] for _ in range(5)]
        fits = [sum(ms.get(FIT, 0.0) for ms in frame) for frame in frames]
        fit = statistics.median(fits)
        rows.append(
            {
                "map": name,
                "whole, ms": wholes[name],
                "optimization, ms": fit,
                "optimization, %": 100.0 * fit / wholes[name],
                "paper, %": paper,
            }
        )
    _save(rows, folder, "chong-3")
    return rows


FIT = "fit light matrix (CPU)"


def _medians(
    scene: Scene, camera: Camera, suns: Sequence[Light], methods: Mapping[str, Method]
) -> dict[str, float]:
    """Milliseconds of a frame with each method: the median of five, by turns, once all have run."""
    times: dict[str, list[float]] = {name: [] for name in methods}
    for turn in range(6):
        for name, method in methods.items():
            start = time.perf_counter()
            render_shadows(scene, camera, list(suns), method)
            if turn:
                times[name].append(1e3 * (time.perf_counter() - start))
    return {name: statistics.median(own) for name, own in times.items()}


def _save(rows: Sequence[Mapping[str, Any]], folder: Path | None, name: str) -> None:
    if folder is not None:
        write(folder / f"{name}.csv", f"lixel papers {name}", rows)


def say_rows(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print rows as tables, one for each set of columns."""
    for _, group in itertools.groupby(rows, key=list):
        print(as_text(list(group)))


EXPERIMENTS: Mapping[str, tuple[str, Callable[[bool, Path | None], list[dict[str, Any]]]]] = {
    "chong-1": ("Wrong pixels, Table 1; the paper's percentages in brackets", misclassified),
    "chong-2": ("Running time, Table 2; the paper's ratios in brackets", running_times),
    "chong-3": ("Share of the optimization in a frame, Table 3", stages),
}
"""Title and measurement, by the names that `lixel papers` gives them."""


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure Table 1 and print it."""
    parser = argparse.ArgumentParser(
        description="Table 1 of Scene optimized shadow mapping, again."
    )
    parser.add_argument("--quick", action="store_true", help="smaller images and maps, 25 lights")
    parser.add_argument("--lights", type=int, metavar="N", help="default: 500, quick 25")
    parser.add_argument("--scene", metavar="SCENE", help="in place of objects on a floor")
    parser.add_argument(
        "--views", type=Path, metavar="FILE", help="with the scene's cameras, as for `lixel render`"
    )
    parser.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER",
        help="write what was counted for each light into this folder, and go on there after a stop",
    )  # fmt: skip
    options = parser.parse_args(arguments)
    if options.lights is not None and options.lights < 1:
        parser.error(f"--lights must be at least 1, got {options.lights}")
    if options.views is not None and options.scene is None:
        parser.error("--views must come with --scene")
    scene, camera, command = None, None, None
    if options.scene is not None:
        scene, views = scene_and_views(options.scene, options.views)
        camera = views.camera(None, scene)
        command = "python -m lixel.paper_tables.chong_gortler"
        command += f" --scene {Path(options.scene).name}"
        command += f" --views {options.views.name}" if options.views is not None else ""
        command += " --quick" if options.quick else ""
    say("percentages are over the first row; the paper's are over its own optimized maps")
    rows = misclassified(
        options.quick,
        options.output,
        count=options.lights,
        scene=scene,
        camera=camera,
        command=command,
    )
    say_rows(rows)


if __name__ == "__main__":
    main()
