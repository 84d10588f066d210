"""Calibrates `lixel.Auto`: how wrong the finer of two maps is, and what methods cost.

Generated scenes with random cameras and lights give the model; scenes of a folder, which it has not
seen, tell how well it holds. Rows are appended view by view, so a run that was stopped goes on.

    python -m lixel.calibration FOLDER -o docs/results/auto/llvmpipe.csv --write
"""

from __future__ import annotations

import argparse
import csv
import json
import shlex
import sys
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import auto
from ..camera import Camera
from ..compare import compare
from ..frame import render_outputs
from ..light import DirectionalLight, Light
from ..load import load
from ..methods import Exact, Method, RayTraced
from ..reference import reference
from ..scene import Scene
from ..scenes import GENERATORS
from .random_views import random_camera, random_lights
from .report import progress
from .report import table as as_text
from .result_tables import append, provenance
from .views import Views

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

COLUMNS = (
    "set", "scene", "view", "width", "height", "triangles", "light", "method", "resolution",
    "layers", "covered", "differing", "misclassified", "gpu_ms", "visibility_ms", "build_ms",
    "device", "driver", "date", "command",
)  # fmt: skip

Row = Mapping[str, str]


def scenes(folder: Path) -> Iterator[tuple[str, str, Scene, list[Camera]]]:
    """Set, name, scene and its own cameras: the generated ones, then those of the folder."""
    for name, arguments in GENERATED.items():
        scene = GENERATORS[name](**arguments)
        yield "generated", name, scene, list(scene.cameras.values())
    for entry in json.loads((folder / "scenes.json").read_text(encoding="utf-8")):
        cameras = Views.read(folder / "scenes.json", entry["file"]).cameras
        yield (
            "held out",
            Path(entry["file"]).stem,
            load(folder / entry["file"]),
            [*cameras.values()],
        )


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
    """A row for each map and each method without a wrong pixel."""
    truth = reference(scene, camera, light)
    # Finer maps around a lamp cost more than rays.
    is_sun = isinstance(light, DirectionalLight)
    resolutions = auto.RESOLUTIONS if is_sun else auto.RESOLUTIONS[:-1]
    methods: list[Method] = [auto.map_for(light, n) for n in resolutions]
    coarse = None
    for method in (*methods, Exact(), RayTraced()):
        _, results = render_outputs(scene, camera, light, method, ("visibility",))
        visibility = results["visibility"]
        is_map = method.map_resolution is not None
        judged = compare(visibility, truth)
        timings = dict(results["timings"])
        built = [timings.pop(key, None) for key in ("hierarchy (CPU)", "acceleration structure")]
        yield {
            "method": method.name,
            "resolution": method.map_resolution,
            "layers": results["stats"]["layers"],
            "covered": judged.covered_count,
            "differing": None if coarse is None else auto.differing(coarse, visibility),
            "misclassified": judged.misclassified_count,
            "visibility_ms": timings.pop("visibility", None),
            "build_ms": next((ms for ms in built if ms is not None), None),
            "gpu_ms": sum(timings.values()),
        }
        coarse = visibility if is_map and method is not methods[-1] else None


def collect(folder: Path, output: Path, counts: Mapping[str, int], command: str) -> None:
    """Measure the views that the table does not have yet, and append them."""
    if not output.exists():
        append(output, COLUMNS, [])
    done = {(row["set"], row["scene"], row["view"]) for row in read(output)}
    for place, (of_set, name, scene, cameras) in enumerate(scenes(folder)):
        numbers = [n for n in range(counts[of_set]) if (of_set, name, str(n)) not in done]
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
                **provenance(command),
            }
            rows = [{**shared, **row} for row in measure(scene, camera, light)]
            append(output, COLUMNS, rows)


def read(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def fit(rows: Sequence[Row]) -> dict[str, Any]:
    """The model, from the generated scenes."""
    rows = [row for row in rows if row["set"] == "generated"]
    pairs = [row for row in rows if row["differing"]]
    shares = [int(row["misclassified"]) / (int(row["differing"]) + SLACK) for row in pairs]
    # How the difference falls from one pair of maps to the next finer one.
    by_view: dict[tuple[str, str], dict[int, int]] = defaultdict(dict)
    for row in pairs:
        by_view[row["scene"], row["view"]][int(row["resolution"])] = int(row["differing"])
    falls = [
        (of_view[2 * n] + SLACK) / (of_view[n] + SLACK)
        for of_view in by_view.values()
        for n in of_view
        if 2 * n in of_view
    ]
    times = defaultdict(list)
    for row in rows:
        kind = "sun" if row["light"] == "DirectionalLight" else "lamp"
        of_all_lights = row["method"] == "ray_traced"
        key = row["method"] if of_all_lights else f"{row['method']}, {kind}"
        times[key].append((_features(row), float(row["gpu_ms"])))
        if row["visibility_ms"]:
            known = auto.features(int(row["triangles"]), _pixels(row), None)
            times["visibility"].append((known, float(row["visibility_ms"])))
    build = [
        float(row["build_ms"]) / (1e-6 * int(row["triangles"])) for row in rows if row["build_ms"]
    ]
    return {
        "device": rows[0]["device"],
        "driver": rows[0]["driver"],
        "date": rows[0]["date"],
        "command": rows[0]["command"],
        "error": {
            "share": round(float(np.quantile(shares, QUANTILE)), 4),
            "slack": SLACK,
            "falloff": round(float(np.median(falls)), 4),
        },
        # Of `auto.features`; "build" of millions of triangles.
        "ms": {
            **{key: _least_squares(samples) for key, samples in sorted(times.items())},
            "build": [round(float(np.median(build)), 4)],
        },
    }


def _pixels(row: Row) -> int:
    return int(row["width"]) * int(row["height"])


def _features(row: Row) -> list[float]:
    resolution = int(row["resolution"]) if row["resolution"] else None
    by_rays = row["method"] == "ray_traced"
    return auto.features(int(row["triangles"]), _pixels(row), resolution, by_rays=by_rays)


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


def judged(rows: Iterable[Row], model: Mapping[str, Any]) -> list[dict[str, Any]]:
    """How often the bound of two maps held, for each set and each error that may be asked for."""
    share, slack = model["error"]["share"], model["error"]["slack"]
    pairs = [row for row in rows if row["differing"]]
    told = []
    for of_set in ("generated", "held out"):
        for most in (0.0003, 0.001, 0.003, 0.01, 0.03):
            accepted = [
                int(row["misclassified"]) / int(row["covered"])
                for row in pairs
                if row["set"] == of_set
                and share * (int(row["differing"]) + slack) <= most * int(row["covered"])
            ]
            kept = sum(error <= most for error in accepted)
            told.append(
                {
                    "set": of_set,
                    "max_error": f"{most:g}",
                    "pairs": sum(row["set"] == of_set for row in pairs),
                    "accepted": len(accepted),
                    "kept": kept,
                    "kept %": 100.0 * kept / max(len(accepted), 1),
                    "worst, times max_error": max(accepted, default=0.0) / most,
                }
            )
    return told


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="python -m lixel.calibration", description=(__doc__ or "").splitlines()[0]
    )
    parser.add_argument("folder", type=Path, help="with a scenes.json and the files that it lists")
    parser.add_argument(
        "--generated", type=int, default=12, metavar="N", help="views of each scene"
    )
    parser.add_argument("--held-out", type=int, default=6, metavar="N", help="views of each scene")
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="FILE.csv")
    parser.add_argument(
        "--write", action="store_true", help="replace the model that lixel.Auto uses"
    )
    given = list(sys.argv[1:] if arguments is None else arguments)
    options = parser.parse_args(given)
    # The folder's name, not where it lies on this machine.
    told = [options.folder.name if word == str(options.folder) else word for word in given]
    command = f"python -m lixel.calibration {shlex.join(told)}"
    counts = {"generated": options.generated, "held out": options.held_out}
    collect(options.folder, options.output, counts, command)
    rows = read(options.output)
    model = fit(rows)
    print(json.dumps(model, indent=2))
    print(as_text(judged(rows, model)))
    if options.write:
        path = Path(auto.__file__).with_name("auto_model.json")
        path.write_text(json.dumps(model, indent=2) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
