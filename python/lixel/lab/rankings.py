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
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..camera import Camera
from ..light import DirectionalLight, Light, PointLight
from ..load import load
from ..methods import Method
from ..scene import Scene
from ..scenes import GENERATORS
from .accuracy import casts_shadow_edges, evaluate
from .options import add_output, add_size, natural
from .papers.published import method_of
from .random_views import is_in_view, random_lights
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .views import listed_in

if TYPE_CHECKING:
    import pandas

SEED = 2015
MAX_DRAWS = 100

BUILT_IN: Mapping[str, Mapping[str, Any]] = {
    "objects_on_floor": {"count": 160, "subdivisions": 3},
    "colonnade": {"columns": 10},
    "city": {"blocks": 26},
    "grass": {"blades": 20_000},
    "needles": {},
    "terrain": {"cells": 162},
}
"""Generated scenes, with fewer triangles than by default."""

SMOOTHINGS = (4.0, 8.0, 16.0, 32.0, 64.0)
"""Standard deviations, in cells of 256."""

RESOLUTION = 256
"""Texels along a side, for images of about as many pixels."""


STRAIGHT: Mapping[str, Any] = {"rasterization": "linear", "tessellation": 0.025}
EXACT: Mapping[str, Any] = {"rasterization": "exact"}
PLANE: Mapping[str, Any] = {"bias": "receiver_plane"}


def sun_methods() -> dict[str, Method]:
    """What is compared in directional lights: a name for each method."""
    shared = {"resolution": RESOLUTION, "importance_resolution": RESOLUTION}
    methods = {
        "uniform": method_of("uniform@published", resolution=RESOLUTION),
        "uniform, 4 times": method_of("uniform@published", resolution=4 * RESOLUTION),
        "rtw, lixel": method_of("rtw", **shared),
        "notw, lixel": method_of("notw", **shared),
    }
    for words, rasterization in (("straight", STRAIGHT), ("exact", EXACT)):
        own = {**shared, **rasterization}
        methods[f"rtw, {words}"] = method_of("rtw@published", **own)
        methods[f"rtw, {words}, plane"] = method_of("rtw@published", **own, **PLANE)
        methods[f"notw 16, {words}, plane"] = method_of("notw@published", **own, **PLANE)
        for smoothing in SMOOTHINGS:
            name = f"notw {smoothing:g}, {words}"
            methods[name] = method_of("notw@published", smoothing=smoothing, **own)
    return methods


def lamp_methods() -> dict[str, Method]:
    """What is compared in point lights outside of the view."""
    methods = {}
    for words, rasterization in (("straight", STRAIGHT), ("exact", EXACT)):
        own = {"resolution": RESOLUTION, **rasterization}
        for name in ("dual_paraboloid", "improved_paraboloid"):
            methods[f"{name}, {words}"] = method_of(f"{name}@published", **own)
            methods[f"{name}, {words}, plane"] = method_of(f"{name}@published", **own, **PLANE)
    for cut in ("cone", "receivers"):
        name = f"improved_paraboloid, cut {cut}"
        own = {"resolution": RESOLUTION, "cut": cut, **EXACT}
        methods[f"{name}, exact"] = method_of("improved_paraboloid@published", **own)
        methods[f"{name}, exact, plane"] = method_of(
            "improved_paraboloid@published", **own, **PLANE
        )
    return methods


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


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet, append it, and print the sums."""
    before = resume(options.output, options.line)
    done = {(row["scene"], row["kind"], int(row["light"])) for row in before}
    scenes = {name: (scene, camera) for name, scene, camera in _scenes(options.folder)}
    wanted = [
        (name, kind, number)
        for number in range(options.lights)
        for name in scenes
        for kind in ("sun", "lamp")
        if (name, kind, number) not in done
    ]
    methods = {"sun": sun_methods(), "lamp": lamp_methods()}
    for name, kind, number in progress(wanted, "views"):
        scene, camera = scenes[name]
        sized = camera.resized(*options.size)
        light = light_of(name, kind, number, scene, sized)
        counted = evaluate(scene, sized, light, methods[kind])
        shared = {"scene": name, "kind": kind, "light": number}
        rows = [{**shared, "method": method, **counts} for method, counts in counted]
        append(options.output, options.line, rows)
    print(as_text(sums(read(options.output)).to_dict("records")))


def _scenes(folder: Path | None) -> Iterator[tuple[str, Scene, Camera]]:
    for name, arguments in BUILT_IN.items():
        scene = GENERATORS[name](**arguments)
        yield name, scene, scene.cameras["default"]
    for file, views in [] if folder is None else listed_in(folder):
        if folder is not None and Path(file).stem not in BUILT_IN:
            yield Path(file).stem, load(folder / file), next(iter(views.cameras.values()))


def light_of(name: str, kind: str, number: int, scene: Scene, camera: Camera) -> Light:
    """A random light of a scene, the same at every call: a directional one, or a lamp in the
    scene's box made half as large again, but not in the camera's pyramid."""
    random = np.random.default_rng((SEED, zlib.crc32(f"{name} {kind}".encode()), number))
    for _ in range(MAX_DRAWS):
        if kind == "sun":
            (light,) = random_lights(random, scene, camera, 1, [DirectionalLight])
        else:
            # The second of two is outside of the view.
            _, light = random_lights(random, scene, camera, 2, [PointLight])
            if isinstance(light, PointLight) and is_in_view(camera, light.position):
                continue
        if casts_shadow_edges(scene, camera, light):
            break
    return light


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
