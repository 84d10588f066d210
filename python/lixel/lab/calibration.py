"""Calibrate `lixel.Auto`: how wrong the finer of two maps is, and what methods cost.

Generated scenes with random cameras and lights give the model; scenes of a folder, which it has not
seen, tell how well it holds. Rows are appended view by view, so a run that was stopped goes on.
"""

from __future__ import annotations

import argparse
import itertools
import json
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .. import auto
from ..camera import Camera
from ..compare import compare
from ..frame import frame_parts
from ..light import DirectionalLight, Light
from ..load import load
from ..methods import Exact, Method, RayTraced
from ..reference import reference
from ..scene import Scene
from ..scenes import GENERATORS
from . import passes
from .options import add_output, natural
from .random_views import random_camera, random_lights
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .views import listed_in

if TYPE_CHECKING:
    import pandas

GENERATED: dict[str, dict[str, Any]] = {
    "plane_and_box": {},
    "objects_on_floor": {"count": 60, "subdivisions": 3},
    "colonnade": {"columns": 10, "detail": 20},
    "city": {},
    "grass": {"blades": 20_000},
    "needles": {"count": 800},
    "terrain": {"cells": 200},
}

SIZES = ((480, 270), (640, 360), (960, 540))

# The part of calibrated pairs of maps whose error is within the bound.
QUANTILE = 0.98
# Differing pixels that are added, so that the bound of maps that do not differ is not zero.
SLACK = 3


# --- The command ---


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab calibration`."""
    parser.add_argument("folder", type=Path, help="with a scenes.json and the files that it lists")
    for name, views in (("--generated", 12), ("--held-out", 6)):
        parser.add_argument(
            name, type=natural, default=views, metavar="N",
            help=f"views of each scene; default: {views}",
        )  # fmt: skip
    add_output(parser, "table of every view, .csv or .parquet", required=True)
    parser.add_argument(
        "--write", action="store_true", help="replace the model that lixel.Auto uses"
    )


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet; print the model, and how often it held."""
    counts = {"generated": options.generated, "held out": options.held_out}
    collect(options.folder, options.output, counts, options.line)
    table = read(options.output)
    model = fit(table)
    print(json.dumps(model, indent=2))
    print(as_text(how_often_it_held(table, model)))
    if options.write:
        path = Path(auto.__file__).with_name("auto_model.json")
        path.write_text(json.dumps(model, indent=2) + "\n", encoding="utf-8")


# --- What is measured ---


def scenes(folder: Path) -> Iterator[tuple[str, str, Scene, list[Camera]]]:
    """Set, name, scene and its own cameras: the generated ones, then those of the folder."""
    for name, arguments in GENERATED.items():
        scene = GENERATORS[name](**arguments)
        yield "generated", name, scene, list(scene.cameras.values())
    for file, views in listed_in(folder):
        yield "held out", Path(file).stem, load(folder / file), list(views.cameras.values())


def view_of(
    scene: Scene, cameras: Sequence[Camera], seed: tuple[int, int], number: int
) -> tuple[Camera, Light]:
    """The scene's cameras and random ones by turns, each with a random light."""
    random = np.random.default_rng((*seed, number))
    width, height = SIZES[number % len(SIZES)]
    camera = random_camera(random, scene, width, height)
    if number % 2 and cameras:
        camera = cameras[number // 2 % len(cameras)].resized(width, height)
    return camera, random_lights(random, scene, camera, 6)[number % 6]


def measure(scene: Scene, camera: Camera, light: Light) -> Iterator[dict[str, Any]]:
    """A row for each map and for each method that misclassifies no pixel."""
    truth = reference(scene, camera, light)
    # Finer maps around a point light cost more than rays.
    is_directional = isinstance(light, DirectionalLight)
    resolutions = auto.RESOLUTIONS if is_directional else auto.RESOLUTIONS[:-1]
    methods: list[Method] = [auto.map_for(light, n) for n in resolutions]
    coarse = None
    for method in (*methods, Exact(), RayTraced()):
        parts = frame_parts(scene, camera, light, method)
        visibility = parts.visibility
        is_map = method.map_resolution is not None
        found = compare(visibility, truth)
        timings = dict(parts.timings)
        built = [timings.pop(label, None) for label in passes.BUILD]
        yield {
            "method": method.name,
            "resolution": method.map_resolution,
            "layers": parts.stats["layers"],
            "covered": found.covered_count,
            "differing": None if coarse is None else auto.differing(coarse, visibility),
            "misclassified": found.misclassified_count,
            "visibility_ms": timings.pop(passes.VISIBILITY, None),
            "build_ms": next((ms for ms in built if ms is not None), None),
            "gpu_ms": sum(timings.values()),
        }
        coarse = visibility if is_map and method is not methods[-1] else None


def collect(folder: Path, output: Path, counts: Mapping[str, int], command: str) -> None:
    """Measure the views that the table does not have yet, and append them."""
    done = {(row["set"], row["scene"], row["view"]) for row in resume(output, command)}
    for place, (of_set, name, scene, cameras) in enumerate(scenes(folder)):
        numbers = [n for n in range(counts[of_set]) if (of_set, name, n) not in done]
        for number in progress(numbers, name):
            camera, light = view_of(scene, cameras, (2, place), number)
            shared = {
                "set": of_set,
                "scene": name,
                "view": number,
                "width": camera.width,
                "height": camera.height,
                "triangles": scene.triangle_count,
                "light": type(light).__name__,
            }
            rows = [{**shared, **row} for row in measure(scene, camera, light)]
            append(output, command, rows)


def fit(table: pandas.DataFrame) -> dict[str, Any]:
    """The model, from the generated scenes."""
    generated = table[table["set"] == "generated"]
    pairs = generated[generated["differing"].notna()]
    shares = pairs["misclassified"] / (pairs["differing"] + SLACK)
    # How the difference falls from one pair of maps to the next finer one.
    falls = []
    for _, view in pairs.groupby(["scene", "view"]):
        by_size = dict(zip(view["resolution"], view["differing"] + SLACK, strict=True))
        falls += [by_size[2 * n] / by_size[n] for n in by_size if 2 * n in by_size]
    times = defaultdict(list)
    for row in generated.to_dict("records"):
        kind = "directional" if row["light"] == "DirectionalLight" else "positional"
        by_rays = row["method"] == "ray_traced"
        size = row["triangles"], row["width"] * row["height"]
        texels = 0 if math.isnan(row["resolution"]) else int(row["resolution"]) ** 2
        features = auto.features(*size, texels, by_rays=by_rays)
        key = row["method"] if by_rays else f"{row['method']}, {kind}"
        times[key].append((features, row["gpu_ms"]))
        if not math.isnan(row["visibility_ms"]):
            times["visibility"].append((auto.features(*size, 0), row["visibility_ms"]))
    build = generated["build_ms"] / (1e-6 * generated["triangles"])
    return {
        **table.attrs,
        "error": {
            "share": round(float(np.quantile(shares, QUANTILE)), 4),
            "slack": SLACK,
            "falloff": round(float(np.median(falls)), 4),
        },
        # Of `auto.features`; "build" of millions of triangles.
        "ms": {
            **{key: _least_squares(samples) for key, samples in sorted(times.items())},
            "build": [round(float(build.median()), 4)],
        },
    }


def _least_squares(samples: Sequence[tuple[Sequence[float], float]]) -> list[float]:
    """Coefficients that are not negative, for the least relative error."""
    known, times = np.array([s[0] for s in samples]), np.array([s[1] for s in samples])
    kept = [i for i in range(known.shape[1]) if known[:, i].any()]
    while True:
        found, *_ = np.linalg.lstsq(
            known[:, kept] / times[:, None], np.ones(len(times)), rcond=None
        )
        if (found >= 0).all():
            break
        kept = [column for column, value in zip(kept, found, strict=True) if value > 0]
    coefficients = np.zeros(known.shape[1])
    coefficients[kept] = found
    return [round(float(value), 4) for value in coefficients]


def how_often_it_held(table: pandas.DataFrame, model: Mapping[str, Any]) -> list[dict[str, Any]]:
    """How often the bound of two maps held, for each set and each error that may be asked for."""
    share, slack = model["error"]["share"], model["error"]["slack"]
    pairs = table[table["differing"].notna()]
    rows = []
    for (of_set, of_pairs), most in itertools.product(
        pairs.groupby("set"), (0.0003, 0.001, 0.003, 0.01, 0.03)
    ):
        is_accepted = share * (of_pairs["differing"] + slack) <= most * of_pairs["covered"]
        errors = (of_pairs["misclassified"] / of_pairs["covered"])[is_accepted]
        kept = int((errors <= most).sum())
        rows.append(
            {
                "set": of_set,
                "max_error": f"{most:g}",
                "pairs": len(of_pairs),
                "accepted": len(errors),
                "kept": kept,
                "kept %": 100.0 * kept / max(len(errors), 1),
                "worst, times max_error": errors.max() / most if len(errors) else 0.0,
            }
        )
    return rows
