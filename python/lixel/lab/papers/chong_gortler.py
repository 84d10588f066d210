"""Tables 1 to 3 of H. Y. Chong, S. J. Gortler, "Scene optimized shadow mapping", Harvard TR-07-07,
2007.

Objects on a floor, a viewer that stands slightly above it, random directional lights on the upper
hemisphere. Table 1: misclassified pixels over all lights, and over the tenth of them that is worst
for a method. The paper's truth was a focused map of ten times the resolution, ours is the ray-cast
reference; each fit of a method has a row, and some methods are added. Tables 2 and 3: time by the
number of lights and the size of the map, and where it goes.
"""

from __future__ import annotations

import itertools
import math
import statistics
from collections.abc import Mapping, Sequence
from functools import partial
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
from .. import passes
from ..report import progress, table as as_text
from ..result_tables import append, resume, write
from ..timing import wall_ms
from ..views import scene_and_views
from .figures import CHONG, middle, rows_of
from .tables import method_of

SEED = 2007

COLUMNS = ("Optimal", "Focused", "LiSPSM", "Plane Opt.", "Normal")
"""Of Table 1, as the paper calls them. Rows: all lights, then the tenth of the lights that is worst
for each column."""

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

# Lights, and texels along a side of the map, by the names of the rows of Table 2.
SIZES = {
    f"{lights} light{'s' if lights > 1 else ''}, {side}²": (lights, side)
    for lights in (1, 2, 3, 4)
    for side in (500, 700, 1000)
}


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


def random_lights(count: int) -> list[DirectionalLight]:
    """Directions evenly spread over the upper hemisphere, the same at every call."""
    random = np.random.default_rng(SEED)
    towards = random.normal(size=(count, 3))
    towards[:, 1] = np.abs(towards[:, 1])
    return [DirectionalLight(-vector) for vector in towards]


def _scene(quick: bool, side: int) -> tuple[Scene, Camera]:
    """Objects on a floor, a quarter of the triangles where quick, and a square image of them."""
    scene = objects_on_floor(subdivisions=3) if quick else objects_on_floor()
    return scene, scene.cameras["default"].resized(side, side)


def misclassified(
    quick: bool = False,
    folder: Path | None = None,
    *,
    lights: int | None = None,
    scene: str | None = None,
    views: Path | None = None,
) -> list[dict[str, Any]]:
    """Table 1.

    The paper has 500 lights, images of 750², maps of 400² and 1.14 million triangles; `quick` has
    10, 375², 200² and about 290,000. `lights` sets their number; `scene`, a file or the name of a
    built-in scene, is in place of objects on a floor, and seen by the first camera of `views` or
    its own. In the folder ``chong-1.parquet`` keeps the misclassified pixels of each light and
    method: what is there is not measured again, and a table of another scene or size is refused.

    First come rows for each method: misclassified pixels over all lights, how many percent more
    these are than those of the first row, and the mean over the tenth of the lights that is worst
    for it. Then the rows of the paper's table, with the paper's fits and with the best ones: mean
    misclassified pixels, percent more than optimal, and the paper's percentage in brackets.
    """
    command = f"lixel lab papers chong-1{' --quick' if quick else ''}"
    side, resolution = (375, 200) if quick else (750, 400)
    if scene is None:
        seen, camera = _scene(quick, side)
    else:
        seen, named = scene_and_views(scene, views)
        camera = named.camera(None, seen).resized(side, side)
        command += f" --scene {Path(scene).name}"
        command += f" --views {views.name}" if views is not None else ""
    rows = methods(resolution)
    chosen = random_lights((10 if quick else 500) if lights is None else lights)
    path = None if folder is None else folder / "chong-1.parquet"
    before = [] if path is None else resume(path, command)
    known = {(int(row["light"]), row["method"]): int(row["misclassified"]) for row in before}
    wrong = np.zeros((len(rows), len(chosen)))
    for column, light in enumerate(progress(chosen, "lights")):
        missing = [name for name in rows if (column, name) not in known]
        if missing:
            truth = reference(seen, camera, light)
            measured: list[dict[str, Any]] = []
            for name in missing:
                found = compare(render_shadows(seen, camera, light, rows[name]), truth)
                known[column, name] = count = found.misclassified_count
                row = {"light": column, "method": name, "misclassified": count}
                measured.append({**row, "covered": found.covered_count})
            if path is not None:
                append(path, command, measured)
        wrong[:, column] = [known[column, name] for name in rows]
    names = list(rows)
    return [*summary(names, wrong), *layout(names, wrong)]


def summary(names: Sequence[str], wrong: npt.NDArray[np.float64]) -> list[dict[str, Any]]:
    """A row for each method from the misclassified pixels, (methods, lights)."""
    worst = max(1, wrong.shape[1] // 10)
    totals = wrong.sum(axis=1)
    return [
        {
            "method": name,
            "misclassified": int(total),
            "% more": _percent_more(total, totals[0]),
            "mean of the worst tenth": float(np.sort(counts)[-worst:].mean()),
        }
        for name, total, counts in zip(names, totals, wrong, strict=True)
    ]


def layout(names: Sequence[str], wrong: npt.NDArray[np.float64]) -> list[dict[str, Any]]:
    """The rows of the paper's Table 1 from the misclassified pixels, (methods, lights)."""
    worst = max(1, wrong.shape[1] // 10)
    rows = []
    for fits, methods_of_fits in FITS.items():
        counts = wrong[[names.index(name) for name in methods_of_fits]]
        chosen = [np.arange(wrong.shape[1])]
        chosen += [np.argsort(of_method)[-worst:] for of_method in counts]
        for (place, figures), columns in zip(
            rows_of(CHONG, "Table 1").items(), chosen, strict=True
        ):
            means = counts[:, columns].mean(axis=1)
            row: dict[str, Any] = {"fits": fits, "lights": place}
            for name, mean in zip(COLUMNS, means, strict=True):
                more, theirs = _percent_more(mean, means[0]), figures[f"{name}, % more"]
                row[name] = f"{mean:,.0f}, {more:+.0f} % ({theirs:+.0f} %)"
            rows.append(row)
    return rows


def _percent_more(wrong: float, first: float) -> float:
    """Not a number where the first misclassifies none."""
    return 100.0 * (float(wrong) / float(first) - 1.0) if first else math.nan


def running_times(quick: bool = False, folder: Path | None = None) -> list[dict[str, Any]]:
    """Table 2: time by the number of lights and the size of the map.

    `quick` has images and maps of half the size, about 290,000 triangles and one frame each;
    ``chong-2.csv`` goes into the folder. For each number of lights and texels along a side:
    milliseconds of a frame by each method, the median of five that take turns, and its time over
    that of `focused`, with the paper's in brackets.
    """
    part = 2 if quick else 1
    scene, camera = _scene(quick, 1150 // part)
    lit_by = random_lights(4)
    rows = []
    figures = rows_of(CHONG, "Table 2")
    for name, (count, side) in progress(list(SIZES.items()), "rows"):
        chosen: dict[str, Method] = {
            "Optimal": method_of("scene_optimized@published", resolution=side // part),
            "Focused": method_of("focused@published", resolution=side // part),
            "LiSPSM": method_of("lispsm@published", resolution=side // part),
        }
        ms = _medians(scene, camera, lit_by[:count], chosen, _repeats(quick))
        paper = {column: 1e3 / middle(fps) for column, fps in figures[name].items()}
        row: dict[str, Any] = {"lights": count, "map": side // part}
        for column, own in ms.items():
            row[f"{column}, ms"] = f"{own:.1f} ({paper[column]:.1f})"
            of_focused = (own / ms["Focused"], paper[column] / paper["Focused"])
            row[f"{column} / Focused"] = "{:.2f} ({:.2f})".format(*of_focused)
        rows.append(row)
    _save(rows, folder, "chong-2")
    return rows


def stages(quick: bool = False, folder: Path | None = None) -> list[dict[str, Any]]:
    """Table 3: where the time of a frame with four lights and maps of 750² goes.

    For the optimized and the plain map: milliseconds of the whole, of the optimization on the CPU
    and of the rest, and their shares in percent, each with the paper's. The convex hull is part of
    the optimization, here as there, and has no time of its own here. `quick` and `folder` are those
    of `running_times`.
    """
    part = 2 if quick else 1
    scene, camera = _scene(quick, 750 // part)
    chosen = {
        "Optimal": method_of("scene_optimized@published", resolution=750 // part),
        "Normal": method_of("focused@published", resolution=750 // part),
    }
    lit_by = random_lights(4)
    repeats = _repeats(quick)
    wholes = _medians(scene, camera, lit_by, chosen, repeats)
    rows = []
    for name, method in chosen.items():
        frames = [
            [render(scene, camera, light, method).timings for light in lit_by]
            for _ in range(repeats)
        ]
        fits = [sum(ms.get(passes.FIT_LIGHT_MATRIX, 0.0) for ms in frame) for frame in frames]
        fit, whole = statistics.median(fits), wholes[name]
        ours = {"Total scene": whole, "Optimization": fit, "Render & Wait": whole - fit}
        for stage, figures in rows_of(CHONG, "Table 3").items():
            ms = ours.get(stage)
            rows.append(
                {
                    "map": name,
                    "stage": stage,
                    "ours, ms": ms,
                    "paper, ms": figures[name],
                    "ours, %": None if ms is None else 100.0 * ms / whole,
                    "paper, %": figures[f"{name}, % total"],
                }
            )
    _save(rows, folder, "chong-3")
    return rows


def _repeats(quick: bool) -> int:
    """Frames that are timed."""
    return 1 if quick else 5


def _medians(
    scene: Scene,
    camera: Camera,
    lit_by: Sequence[Light],
    methods: Mapping[str, Method],
    repeats: int,
) -> dict[str, float]:
    """Milliseconds of a frame with each method: the median of some, by turns, once all have run."""
    times: dict[str, list[float]] = {name: [] for name in methods}
    for turn in range(repeats + 1):
        for name, method in methods.items():
            ms = wall_ms(partial(render_shadows, scene, camera, list(lit_by), method))
            if turn:
                times[name].append(ms)
    return {name: statistics.median(own) for name, own in times.items()}


def _save(rows: Sequence[Mapping[str, Any]], folder: Path | None, name: str) -> None:
    if folder is not None:
        write(folder / f"{name}.csv", f"lixel lab papers {name}", rows)


def print_rows(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print rows as tables, one for each set of columns."""
    for _, group in itertools.groupby(rows, key=list):
        print(as_text(list(group)))
