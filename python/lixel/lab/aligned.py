"""Count the misclassified pixels of lights that run along walls, and of the same lights turned.

For the first camera of every scene of a folder: suns at azimuths 0, 45, ... 315 degrees, from 1
degree above the floor to straight above, each against that sun turned by a degree; and point lights
in the planes of walls, each against one that is a degree before the plane. A sun along an axis is
rendered with what sine and cosine round, and without; the worse of both counts. The table is
written light by light, and the same command goes on where the last one stopped.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ..arguments import needs
from ..camera import Camera
from ..compare import compare
from ..frame import frame_parts
from ..light import DirectionalLight, Light, PointLight
from ..load import load
from ..methods import METHODS, Exact, Method, RayTraced, ShadowMapMethod
from ..reference import Reference, reference
from ..scene import Scene
from .hard_views import sun_at
from .options import MORE, add_output, add_size
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .views import first_cameras

if TYPE_CHECKING:
    import pandas

Pair: TypeAlias = tuple[str, Sequence[Light], Light]
"""A name, a light along walls in one or two ways of rounding, and the same turned."""

RESOLUTION = 512

AZIMUTHS = range(0, 360, 45)
ELEVATIONS = (1.0, 15.0, 45.0, 89.9)

TURN = 1.0
"""Degrees."""

WALLS, LAMPS = 4, 2
"""Planes that the camera sees most of, and point lights in each."""

SEED = 24


# --- The command ---


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab aligned`."""
    parser.add_argument("folder", type=Path, help="with a scenes.json and the files that it lists")
    add_size(parser, "240x135", (240, 135))
    parser.add_argument("--scene", action="append", metavar="NAME", help=f"of the folder; {MORE}")
    add_output(parser, "table of every light and method, .csv or .parquet", required=True)


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet, append it, and print the sums."""
    before = resume(options.output, options.line)
    done = {(row["scene"], row["light"]) for row in before}
    methods = all_methods()
    for name, file, first in first_cameras(options.folder, options.scene):
        scene, camera = load(file), first.resized(*options.size)
        missing = [pair for pair in pairs_of(scene, camera) if (name, pair[0]) not in done]
        for pair in progress(missing, name):
            rows = [{"scene": name, **row} for row in evaluate(scene, camera, pair, methods)]
            append(options.output, options.line, rows)
    if options.output.exists():
        print(as_text(summary(read(options.output)).to_dict("records")))


def all_methods() -> dict[str, Method]:
    """Every method with a map, and those that have no error."""
    maps = {
        name: make(resolution=RESOLUTION)
        for name, make in METHODS.items()
        if issubclass(make, ShadowMapMethod)
    }
    return {**maps, "exact": Exact(), "ray_traced": RayTraced()}


def summary(table: pandas.DataFrame) -> pandas.DataFrame:
    """Sums by method, kind of light and scene: misclassified pixels under aligned lights and under
    turned ones, and the first over the second."""
    whole = needs("pandas", "study").concat([table, table.assign(scene="all")])
    sums = whole.groupby(["scene", "kind", "method"], sort=False)[["aligned", "turned"]].sum()
    sums["ratio"] = (sums["aligned"] / sums["turned"].where(sums["turned"] > 0)).round(2)
    return sums.reset_index()


# --- The lights ---


def pairs_of(scene: Scene, camera: Camera) -> Iterator[Pair]:
    """The suns, and point lights in planes that the camera sees."""
    yield from _suns()
    yield from _lamps(scene, camera)


def _suns() -> Iterator[Pair]:
    straight_above = (90.0, 0)
    for elevation, azimuth in [*itertools.product(ELEVATIONS, AZIMUTHS), straight_above]:
        name = f"sun at {azimuth} degrees, {elevation:g} above the floor"
        turned = sun_at(azimuth + TURN, min(elevation, 90.0 - TURN))
        sun = sun_at(azimuth, elevation)
        exact = np.where(np.abs(sun.direction) < 1e-9, 0.0, sun.direction)
        suns = [sun] if azimuth % 90 else [sun, DirectionalLight(exact)]
        yield name, suns, turned


def _lamps(scene: Scene, camera: Camera) -> Iterator[Pair]:
    random = np.random.default_rng(SEED)
    low, high = scene.bounds
    seen = reference(scene, camera, sun_at(30.0, 60.0))
    planes = _largest_planes(seen, float(np.linalg.norm(high - low)))
    for wall, (normal, point) in enumerate(planes):
        for lamp in range(LAMPS):
            place = random.uniform(low, high)
            place -= ((place - point) @ normal) * normal
            away = math.tan(math.radians(TURN)) * float(np.linalg.norm(place - point))
            name = f"point light {lamp} in the plane of wall {wall}"
            yield name, [PointLight(place)], PointLight(place + away * normal)


def _largest_planes(
    seen: Reference, size: float
) -> list[tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]]:
    """Unit normals of the planes that the camera sees most of, and the middle of what it sees."""
    position = seen.position[seen.covered]
    normal = seen.normal[seen.covered].astype(np.float64)
    height = (position * normal).sum(axis=1, keepdims=True)
    rounded = np.round(np.hstack([normal, height / size]), 4)
    _, group, count = np.unique(rounded, axis=0, return_inverse=True, return_counts=True)
    largest = np.argsort(-count, kind="stable")[:WALLS]
    found = []
    for plane in largest:
        own = group.reshape(-1) == plane
        unit = normal[own].mean(axis=0)
        found.append((unit / np.linalg.norm(unit), position[own].mean(axis=0)))
    return found


# --- One pair of lights ---


def evaluate(
    scene: Scene, camera: Camera, pair: Pair, methods: Mapping[str, Method]
) -> Iterator[dict[str, Any]]:
    """A row for each method that is made for the light."""
    name, aligned, turned = pair
    truths = [(light, reference(scene, camera, light)) for light in (*aligned, turned)]
    for method_name, method in methods.items():
        if not method.takes(turned):
            continue
        images = (frame_parts(scene, camera, light, method).visibility for light, _ in truths)
        counts = [
            compare(image, truth).misclassified_count
            for image, (_, truth) in zip(images, truths, strict=True)
        ]
        yield {
            "light": name,
            "kind": name.split(" ", 1)[0],
            "method": method_name,
            "aligned": max(counts[:-1]),
            "turned": counts[-1],
            "covered": int(truths[-1][1].covered.sum()),
        }
