"""Table 1 of H. Y. Chong, S. J. Gortler, "Scene optimized shadow mapping", Harvard TR-07-07, 2007.

Objects on a floor, a viewer that stands slightly above it, random directional lights on the upper
hemisphere: wrong pixels over all lights, and over the tenth of them that is worst for a method. The
paper's truth was a focused map of ten times the resolution, ours is the ray-cast reference; its
plain rows are repeated, each fit of a method has a row, and some methods are added.

    python -m lixel.paper_tables.chong_gortler --quick
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from ..compare import compare
from ..frame import render
from ..light import DirectionalLight
from ..methods import (
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
from ..reference import reference
from ..report import progress, say
from ..report import table as as_text
from ..scenes import objects_on_floor

SEED = 2007

# Percent more wrong pixels than scene optimized, over all lights; of the fits that the paper used.
PAPER = {
    "scene optimized, boundary samples": 0.0,
    "focused, frustum": 27.65,
    "lispsm, frustum": 55.33,
    "uniform": 186.60,
    "plane optimal, frustum": 315.09,
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


def lights(count: int) -> list[DirectionalLight]:
    """Directions evenly spread over the upper hemisphere, the same at every call."""
    random = np.random.default_rng(SEED)
    towards = random.normal(size=(count, 3))
    towards[:, 1] = np.abs(towards[:, 1])
    return [DirectionalLight(-vector) for vector in towards]


def table(quick: bool = False, count: int | None = None) -> list[dict[str, Any]]:
    """Measure the table.

    Parameters
    ----------
    quick : bool
        25 lights, 375² pixels, a 200² map and about 290,000 triangles, in place of the paper's 500,
        750², 400² and 1.14 million.
    count : int, optional
        Lights, if not as many.

    Returns
    -------
    list of dict
        For each method its name, the wrong pixels over all lights, how many percent more these are
        than those of the first row, the paper's percentage where it has one, and the mean of the
        wrong pixels of the method over the tenth of the lights that is worst for it.
    """
    scene = objects_on_floor(subdivisions=3) if quick else objects_on_floor()
    side, resolution = (375, 200) if quick else (750, 400)
    camera = scene.cameras["default"].resized(side, side)
    rows = methods(resolution)
    chosen = lights(count or (25 if quick else 500))
    wrong = np.zeros((len(rows), len(chosen)))
    for column, light in enumerate(progress(chosen, "lights")):
        truth = reference(scene, camera, light)
        for row, method in enumerate(rows.values()):
            frame = render(scene, camera, light, method)
            wrong[row, column] = compare(frame, truth).misclassified_count
    return summary(list(rows), wrong)


def summary(names: Sequence[str], wrong: npt.NDArray[np.float64]) -> list[dict[str, Any]]:
    """Rows of the table from the wrong pixels, (methods, lights)."""
    worst = max(1, wrong.shape[1] // 10)
    totals = wrong.sum(axis=1)
    return [
        {
            "method": name,
            "wrong pixels": int(total),
            "% more": float(100.0 * (total / totals[0] - 1.0)),
            "paper, % more": PAPER.get(name),
            "mean of the worst tenth": float(np.sort(counts)[-worst:].mean()),
        }
        for name, total, counts in zip(names, totals, wrong, strict=True)
    ]


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure the table and print it."""
    parser = argparse.ArgumentParser(
        description="Table 1 of Scene optimized shadow mapping, again."
    )
    parser.add_argument("--quick", action="store_true", help="smaller images and maps, 25 lights")
    parser.add_argument("--lights", type=int, metavar="N", help="default: 500, quick 25")
    options = parser.parse_args(arguments)
    if options.lights is not None and options.lights < 1:
        parser.error(f"--lights must be at least 1, got {options.lights}")
    rows = table(options.quick, options.lights)
    say("percentages are over the first row; the paper's are over its own optimized maps")
    print(as_text(rows))


if __name__ == "__main__":
    main()
