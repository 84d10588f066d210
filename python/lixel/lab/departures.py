"""What each departure of a default from its paper gains, in misclassified pixels.

Every method that a paper runs is rendered as published, with the defaults, and as published but
for one departure at a time: in built-in scenes and in those of a folder, by random lights by which
the camera sees an edge of a shadow. Maps have the same size in all of them.
"""

from __future__ import annotations

import argparse
import zlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arguments import needs
from ..camera import Camera
from ..light import DirectionalLight, Light, PointLight
from ..load import load
from ..methods import PUBLISHED, Method, NonOrthogonalWarp, method_from
from ..reference import reference
from ..scene import Scene
from ..scenes import GENERATORS
from .accuracy import MAX_DRAWS, counts_of, with_shadow_edges
from .options import MORE, add_output, add_size, natural
from .random_views import random_lights
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .views import first_cameras

if TYPE_CHECKING:
    import pandas

SEED = 28

SCENES: Mapping[str, Mapping[str, Any]] = {
    "colonnade": {"columns": 10, "detail": 16},
    "city": {"blocks": 12},
    "objects_on_floor": {"count": 64, "subdivisions": 2},
    "terrain": {"cells": 80},
    "grass": {"blades": 2000},
}
"""Built-in scenes of moderate size, with the arguments that make them."""

GROUPS = (("lookup", "bias", "constant_bias"), ("rasterization", "tessellation"))
"""Parameters that are one choice."""

ALL = "all"
"""The departure to the defaults."""

SHARED_FUNCTIONS = 16
"""Those of `notw` where none are asked for and rasterization is exact."""

RESOLUTION = 256


def departures(name: str, resolution: int) -> dict[str, Method]:
    """By name of what departs: the method as published but for that; first, without a name, as
    published, and last the default."""
    size: dict[str, Any] = {"resolution": resolution}
    published = replace(method_from(f"{name}@published"), **size)
    default = replace(method_from(name), **size)
    differing = [
        parameter
        for parameter, value in default.parameters().items()
        if published.parameters()[parameter] != value
    ]
    found: dict[str, Method] = {"": published}
    for parameter in differing:
        group = next((group for group in GROUPS if parameter in group), (parameter,))
        changes = {own: getattr(default, own) for own in group}
        if isinstance(published, NonOrthogonalWarp) and "rasterization" in group:
            # As many functions as before, which is another departure.
            changes["function_count"] = resolution
            found["function_count"] = replace(published, function_count=SHARED_FUNCTIONS)
        if isinstance(published, NonOrthogonalWarp) and parameter == "importance_resolution":
            changes["function_count"] = resolution
        found.setdefault(group[0], replace(published, **changes))
    return {**found, ALL: default}


def runs() -> list[str]:
    """The methods and compositions that have parameters in a paper."""
    return [name for name, papers in PUBLISHED.items() if any(papers.values())]


def views(
    scenes: Mapping[str, tuple[Scene, Camera]], lights: int
) -> Iterator[tuple[str, Scene, Camera, str, Light]]:
    """Suns, and point lights of which every other one is in the view."""
    for name, (scene, camera) in scenes.items():
        random = np.random.default_rng((SEED, zlib.crc32(name.encode())))
        for kind in (DirectionalLight, PointLight):
            for number in range(lights):
                draws = (
                    random_lights(random, scene, camera, number + 1, (kind,))[number]
                    for _ in range(MAX_DRAWS)
                )
                light = with_shadow_edges(scene, camera, draws)
                yield name, scene, camera, f"{kind.__name__} {number}", light


def is_for(name: str, light: Light) -> bool:
    """Whether a method is measured by the light: methods for lights with a position by such a one,
    and the others by a sun."""
    method = method_from(name)
    is_around = not method.takes(DirectionalLight((0.0, -1.0, 0.0)))
    is_around |= method.name == "improved_paraboloid"
    return is_around == isinstance(light, PointLight)


def measure(
    scene: Scene, camera: Camera, light: Light, names: Sequence[str]
) -> Iterator[dict[str, Any]]:
    """Misclassified pixels of the departures of methods in one view."""
    if not names:
        return
    truth = reference(scene, camera, light)
    for name in names:
        for departure, method in departures(name, RESOLUTION).items():
            counts = counts_of(scene, camera, light, method, truth)
            yield {
                "method": name,
                "departure": departure or "published",
                "misclassified": counts.get("misclassified"),
                "error": counts.get("error"),
            }


def summary(table: pandas.DataFrame) -> pandas.DataFrame:
    """By method and departure: views, misclassified pixels as published and with the departure, and
    the median over the views of what is left of them."""
    rows = []
    for method, own in table.groupby("method", sort=False):
        counts = own.pivot_table(
            index=["scene", "light"], columns="departure", values="misclassified", sort=False
        )
        # Views that the device could not do in all ways are left out.
        counts = counts.reindex(columns=own["departure"].unique()).dropna()
        published = counts.pop("published")
        some = published > 0
        for departure, left in counts.items():
            rows.append(
                {
                    "method": method,
                    "departure": departure,
                    "views": len(counts),
                    "published": int(published.sum()),
                    "departed": int(left.sum()),
                    "median ratio": float((left[some] / published[some]).median()),
                }
            )
    return needs("pandas", "study").DataFrame(rows)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab departures`."""
    parser.add_argument(
        "folder", nargs="?", type=Path,
        help="with a scenes.json, whose scenes are seen by their first camera, beside the built-in",
    )  # fmt: skip
    add_size(parser, "240x135", (240, 135))
    parser.add_argument("--scene", action="append", metavar="NAME", help=f"of the folder; {MORE}")
    parser.add_argument(
        "--lights", type=natural, default=2, metavar="N", help="random lights of each kind; 2"
    )
    parser.add_argument(
        "--method", action="append", metavar="NAME", choices=runs(),
        help="of those that a paper runs; default: all",
    )  # fmt: skip
    add_output(parser, "table of every view, .csv or .parquet", required=True)


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet, append it, and print the sums."""
    before = resume(options.output, options.line)
    done = {(row["scene"], row["light"], row["method"]) for row in before}
    scenes: dict[str, tuple[Scene, Camera]] = {}
    for name, arguments in SCENES.items():
        scene = GENERATORS[name](**arguments)
        scenes[name] = scene, scene.cameras["default"].resized(*options.size)
    for name, file, camera in first_cameras(options.folder, options.scene):
        scenes[name] = load(file), camera.resized(*options.size)
    # The first light of every scene, then the second: what is there after a stop is of all scenes.
    chosen = sorted(views(scenes, options.lights), key=lambda view: view[3].split()[-1])
    for name, scene, camera, light_name, light in progress(chosen, "views"):
        missing = [
            method
            for method in options.method or runs()
            if is_for(method, light) and (name, light_name, method) not in done
        ]
        counts = measure(scene, camera, light, missing)
        rows = [{"scene": name, "light": light_name, **row} for row in counts]
        if rows:
            append(options.output, options.line, rows)
    print(as_text(summary(read(options.output)).to_dict("records")))
