"""Count the misclassified pixels in the scenes of a folder, in their lights and in random ones.

Every scene, from each camera and in each light that its scenes.json lists, and in random lights by
a seed: directional, point and spot, in and outside of the view. By default the methods are those
that sample nothing from the light, and Embree's float32 rays. Ties of the reference are not
counted. The table is written view by view, and the same command goes on where the last one stopped.
"""

from __future__ import annotations

import argparse
import itertools
import zlib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .._core import DeviceError
from ..arguments import needs
from ..camera import Camera
from ..compare import compare
from ..frame import frame_parts
from ..light import DirectionalLight, Light, PointLight, SpotLight
from ..load import load
from ..methods import Method, method_from
from ..receivers import Receivers
from ..reference import Reference, reference
from ..scene import Scene
from .options import MORE, add_output, add_size, method_with, natural, parameter
from .random_views import random_lights
from .rays import embree_scene, ray_offset
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .views import Views, listed_in

if TYPE_CHECKING:
    import pandas

METHODS = ("exact", "ray_traced", "shadow_volumes")
KINDS = {"directional": DirectionalLight, "point": PointLight, "spot": SpotLight}
EMBREE = "embree float32"

SEED = 6

# Where `casts_shadow_edges` looks, and how often a light is drawn before the last is taken.
SIZE_OF_LOOK = (160, 90)
MAX_DRAWS = 100


# --- The command ---


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab accuracy`."""
    parser.add_argument("folder", type=Path, help="with a scenes.json and the files that it lists")
    add_size(parser, "480x270", (480, 270))
    parser.add_argument(
        "--random", type=natural, default=6, metavar="N", help="random lights from each camera"
    )
    parser.add_argument(
        "--shadow-edges", action="store_true",
        help="draw a random light again by which a camera sees no edge of a shadow",
    )  # fmt: skip
    parser.add_argument("--kind", action="append", choices=KINDS, help=f"of lights; {MORE}")
    parser.add_argument("--scene", action="append", metavar="NAME", help=f"of the folder; {MORE}")
    parser.add_argument("--camera", action="append", metavar="NAME", help=f"of a scene; {MORE}")
    parser.add_argument(
        "--method", action="append", type=_named_method, metavar="NAME[:PARAMETER=VALUE,...]",
        help=f"instead of those that sample nothing from the light; {MORE}",
    )  # fmt: skip
    add_output(parser, "table of every view, .csv or .parquet", required=True)


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet, append it, and print the sums."""
    before = resume(options.output, options.line)
    done = {(row["scene"], str(row["camera"]), str(row["light"])) for row in before}
    methods = dict(options.method or ((name, method_from(name)) for name in METHODS))
    for file, listed in listed_in(options.folder):
        name = Path(file).stem
        if options.scene and name not in options.scene:
            continue
        scene = load(options.folder / file)
        embree = None if options.method else Embree(scene)
        kinds = [KINDS[kind] for kind in options.kind or KINDS]
        views = views_of(
            file, listed, scene, options.size, options.random, kinds, options.shadow_edges
        )
        missing = [
            view
            for view in views
            if (name, view[0], view[2]) not in done
            and (not options.camera or view[0] in options.camera)
        ]
        for camera_name, camera, light_name, light in progress(missing, name):
            shared = {
                "scene": name,
                "camera": camera_name,
                "light": light_name,
                "light_kind": type(light).__name__,
                "width": camera.width,
                "height": camera.height,
                "triangles": scene.triangle_count,
            }
            rows = [
                {**shared, "method": method, **counts}
                for method, counts in evaluate(scene, camera, light, methods, embree)
            ]
            # A view is written whole or not at all; a light that no method is made for has no row.
            if rows:
                append(options.output, options.line, rows)
    if options.output.exists():
        print(as_text(summary(read(options.output)).to_dict("records")))


def _named_method(text: str) -> tuple[str, Method]:
    """A method from its name, and parameters after a colon, ``"cube+notw:lookup=depth"``; with the
    text."""
    name, _, given = text.partition(":")
    try:
        parameters = [parameter(part) for part in given.split(",") if part]
        return text, method_with(name, None, parameters)
    except (TypeError, ValueError) as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def summary(table: pandas.DataFrame) -> pandas.DataFrame:
    """Sums by scene and method: views, those that the device could not do, covered pixels, ties
    of float64 and of float32, misclassified pixels, and the most of them in one view."""
    whole = needs("pandas", "study").concat([table, table.assign(scene="all")])
    groups = whole.groupby(["scene", "method"], sort=False)
    sums = groups.agg(
        views=("misclassified", "count"),
        failed=("misclassified", lambda counts: counts.isna().sum()),
        covered=("covered", "sum"),
        ties=("ties", "sum"),
        float32_ties=("float32_ties", "sum"),
        misclassified=("misclassified", "sum"),
        most=("misclassified", "max"),
        false_lit=("false_lit", "sum"),
        false_shadow=("false_shadow", "sum"),
    )
    return sums.convert_dtypes().reset_index()


# --- The views, and what is measured in one ---


class Embree:
    """Shadow rays of Embree, in float32 from float32 points a hair above the surface."""

    def __init__(self, scene: Scene) -> None:
        needs("embreex", "peers")
        self.traced = embree_scene(scene)
        self.offset = ray_offset(scene)

    def shadows(self, seen: Receivers) -> npt.NDArray[np.float32]:
        """The visibility image of what the camera sees."""
        visibility = np.where(seen.covered, 0.0, np.nan).astype(np.float32)
        asking = seen.facing
        points = seen.position[asking] + self.offset * seen.normal[asking]
        to_light = seen.light.vectors_from(points)
        distance = np.linalg.norm(to_light, axis=1)
        is_parallel = isinstance(seen.light, DirectionalLight)
        reach = np.full(len(points), 3e38) if is_parallel else distance
        hit = self.traced.run(
            points.astype(np.float32),
            (to_light / distance[:, None]).astype(np.float32),
            dists=reach.astype(np.float32),
            query="OCCLUDED",
        )
        visibility[asking] = np.asarray(hit) < 0
        return visibility


def views_of(
    file: str,
    listed: Views,
    scene: Scene,
    size: tuple[int, int],
    count: int,
    kinds: Sequence[type[Light]],
    shadow_edges: bool,
) -> Iterator[tuple[str, Camera, str, Light]]:
    """Names and values of every camera and light of a scene; random lights differ by camera.

    With `shadow_edges` a random light by which the camera sees no edge of a shadow is drawn again.
    """
    for camera_name, camera in listed.cameras.items():
        sized = camera.resized(*size)
        for light_name, light in listed.lights.items():
            if type(light) in kinds:
                yield camera_name, sized, light_name, light
        seed = (SEED, zlib.crc32(f"{file} {camera_name}".encode()))
        random = np.random.default_rng(seed)
        for number, light in enumerate(random_lights(random, scene, sized, count, kinds)):
            if shadow_edges:
                others = (
                    random_lights(random, scene, sized, number + 1, kinds)[number]
                    for _ in range(MAX_DRAWS)
                )
                light = with_shadow_edges(scene, camera, itertools.chain([light], others))
            yield camera_name, sized, f"random {number}", light


def with_shadow_edges(scene: Scene, camera: Camera, lights: Iterable[Light]) -> Light:
    """The first of some lights by which a camera sees an edge of a shadow; else the last."""
    for light in lights:
        if casts_shadow_edges(scene, camera, light):
            break
    return light


def casts_shadow_edges(scene: Scene, camera: Camera, light: Light) -> bool:
    """Whether a small image has both: what is lit, and what faces the light in shadow."""
    truth = reference(scene, camera.resized(*SIZE_OF_LOOK), light)
    visibility = truth.visibility[truth.facing]
    return bool((visibility == 1).any() and (visibility == 0).any())


def evaluate(
    scene: Scene,
    camera: Camera,
    light: Light,
    methods: Mapping[str, Method],
    embree: Embree | None = None,
) -> Iterator[tuple[str, dict[str, Any]]]:
    """By method, the counts of one view; methods that are not made for the light have none."""
    truth = reference(scene, camera, light)
    for name, method in methods.items():
        if not method.takes(light) or (scene.masked_count and not method.takes_holes()):
            continue
        yield name, counts_of(scene, camera, light, method, truth)
    if embree is not None:
        yield EMBREE, _counts(embree.shadows(truth), truth)


def counts_of(
    scene: Scene, camera: Camera, light: Light, method: Method, truth: Reference
) -> dict[str, Any]:
    """The counts of a method in one view; an ``error`` where the device could not do it."""
    try:
        found = frame_parts(scene, camera, light, method)
    except DeviceError as error:
        # Pieces of a triangle that do not get short enough, for one.
        return {"error": str(error)}
    return _counts(found.visibility, truth)


def _counts(visibility: npt.NDArray[np.float32], truth: Reference) -> dict[str, Any]:
    result = compare(visibility, truth)
    return {
        "covered": result.covered_count,
        "ties": result.tie_count,
        "float32_ties": result.float32_tie_count,
        "misclassified": result.misclassified_count,
        "false_lit": result.false_lit_count,
        "false_shadow": result.false_shadow_count,
    }
