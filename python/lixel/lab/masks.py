"""Measure what holes in triangles cost, and how many pixels they leave wrong.

In a fence of two triangles whose image repeats, and in a scene whose plants get the image of a leaf
on each of their cards: files often lack it. Each method renders the scene with holes, and the same
triangles without, by turns. Pixels are counted against `lixel.reference`, and some of them against
brute force in numpy, which shares nothing with it.
"""

from __future__ import annotations

import argparse
import statistics
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..compare import compare
from ..frame import render, render_shadows
from ..light import DirectionalLight, Light
from ..masks import AlphaMask
from ..methods import DesiredView, Exact, Method, NonOrthogonalWarp, RayTraced
from ..reference import Reference, reference
from ..scene import Scene
from .brute_force import Triangles, cast
from .leaves import leafy
from .options import SCENE_HELP, add_output, add_view, natural, path_ending_in, show, view_of
from .report import progress, waiting
from .timing import moved_by_a_hair, wall_and_processor_ms

METHODS: Mapping[str, Method] = {
    "exact": Exact(),
    "ray_traced": RayTraced(),
    "desired_view": DesiredView(resolution=2048),
    "notw": NonOrthogonalWarp(resolution=2048),
}

SIZE = (1920, 1080)

PICTURE_WIDTH = 480


class Case(NamedTuple):
    """A scene with holes, its arrays, and its view."""

    name: str
    triangles: Triangles
    camera: Camera
    light: Light

    def scene(self) -> Scene:
        """With the holes."""
        vertices, faces, uv, face_alpha, masks = self.triangles
        return Scene(vertices, faces, uv=uv, alpha=masks, face_alpha=face_alpha)

    def solid(self) -> Scene:
        """The same triangles without them."""
        return Scene(self.triangles.vertices, self.triangles.faces)


def fence() -> Case:
    """Bars across a floor, as on the page about triangles with holes."""
    y, x = np.mgrid[0:32, 0:32]
    lattice = AlphaMask((x < 6) | (y < 6))
    floor = [[-6, 0, 6], [6, 0, 6], [6, 0, -6], [-6, 0, -6]]
    bars = [[-3, 0, 0], [3, 0, 0], [3, 1.6, 0], [-3, 1.6, 0]]
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    places = np.array([[0, 0]] * 4 + [[0, 2], [8, 2], [8, 0], [0, 0]], np.float64)
    triangles = Triangles(
        np.array(floor + bars, np.float64),
        faces,
        places[faces],
        np.array([-1, -1, 0, 0]),
        (lattice,),
    )
    camera = Camera.look_at((2.2, 3.3, 5.5), (0.5, 0.4, 0), yfov=0.7, width=SIZE[0], height=SIZE[1])
    return Case("fence", triangles, camera, DirectionalLight((0.35, -0.6, -0.45)))


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab masks`."""
    parser.add_argument(
        "scene", nargs="?", metavar="FILE",
        help=f"a scene with plants, beside the fence: {SCENE_HELP}",
    )  # fmt: skip
    add_view(parser)
    parser.add_argument(
        "--repeats", type=natural, default=7, metavar="N", help="timed frames; default: 7"
    )
    parser.add_argument(
        "--rays", type=natural, default=2000, metavar="N",
        help="pixels of each scene that are cast by brute force, half of them where the holes "
        "change the shadow; default: 2000",
    )  # fmt: skip
    parser.add_argument(
        "--picture", type=path_ending_in(".png"), metavar="FILE", help="draw the view with plants"
    )
    add_output(parser, "write the table, .csv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Measure, print and save."""
    cases = [fence()]
    if options.size is not None:
        cases[0] = cases[0]._replace(camera=cases[0].camera.resized(*options.size))
    if options.scene is not None:
        scene, camera, light = view_of(options)
        cases.append(Case(Path(options.scene).stem, leafy(scene), camera, light))
    show(
        options,
        [row for case in cases for row in measure(case, max(1, options.repeats), options.rays)],
    )
    if options.picture is not None:
        last = cases[-1]
        height = round(PICTURE_WIDTH * last.camera.height / last.camera.width)
        camera = last.camera.resized(PICTURE_WIDTH, height)
        render(last.scene(), camera, last.light, Exact()).save(options.picture)


def measure(case: Case, repeats: int = 7, rays: int = 2000) -> list[dict[str, Any]]:
    """A row for each method, and one for the reference.

    ``ms`` and ``processor ms``, of all threads, are medians of frames from a moved camera, and
    ``solid`` is said of the same triangles without holes. ``wrong of rays`` are pixels, out of
    ``rays``, of which brute force says something else; ties of the reference are not among them.
    """
    scene, solid = case.scene(), case.solid()
    with waiting("reference: casting rays on the CPU"):
        truth = reference(scene, case.camera, case.light)
        without = reference(solid, case.camera, case.light)
    pixels = _pixels(truth, without, rays)
    with waiting(f"brute force: {len(pixels)} pixels"):
        known = cast(case.triangles, case.camera, case.light, pixels)
    shared = {
        "scene": case.name,
        "triangles": scene.triangle_count,
        "with holes": scene.masked_count,
        "pixels": case.camera.width * case.camera.height,
    }
    changed = int(np.count_nonzero(_differs(truth.visibility, without.visibility)))
    rows: list[dict[str, Any]] = [
        {
            **shared,
            "method": "reference",
            "covered": int(truth.covered.sum()),
            "ties": int(np.count_nonzero(truth.covered & (truth.tie | truth.float32_tie))),
            "changed by holes": changed,
            "rays": len(pixels),
            "wrong of rays": _wrong(truth.visibility, known, pixels),
        }
    ]
    for name, method in progress(list(METHODS.items()), case.name):
        visibility = render_shadows(scene, case.camera, case.light, method)
        found = compare(visibility, truth)
        rows.append(
            {
                **shared,
                "method": name,
                **_times(case, (scene, solid), method, repeats),
                "misclassified": found.misclassified_count,
                "false lit": found.false_lit_count,
                "rays": len(pixels),
                "wrong of rays": _wrong(visibility, known, pixels),
            }
        )
    return rows


def _pixels(truth: Reference, without: Reference, count: int) -> npt.NDArray[np.int64]:
    """(n, 2): rows and columns of pixels without a tie, as many where the holes change something as
    elsewhere."""
    random = np.random.default_rng(0)
    judged = truth.covered & ~truth.tie & ~truth.float32_tie
    changed = _differs(truth.visibility, without.visibility)
    chosen = []
    for of_kind in (judged & changed, judged & ~changed):
        places = np.argwhere(of_kind)
        chosen.append(random.permutation(places)[: count // 2])
    return np.concatenate(chosen)


def _differs(
    first: npt.NDArray[np.float32], second: npt.NDArray[np.float32]
) -> npt.NDArray[np.bool_]:
    is_seen = np.isnan(first) != np.isnan(second)
    return np.asarray(is_seen | ((first > 0.5) != (second > 0.5)))


def _wrong(
    visibility: npt.NDArray[np.float32],
    known: npt.NDArray[np.float32],
    pixels: npt.NDArray[np.int64],
) -> int:
    return int(np.count_nonzero(_differs(visibility[tuple(pixels.T)], known)))


def _times(
    case: Case, scenes: tuple[Scene, Scene], method: Method, repeats: int
) -> dict[str, float]:
    """Of a scene with holes and of one without, by turns."""
    random = np.random.default_rng(0)
    walls: tuple[list[float], list[float]] = ([], [])
    processors: tuple[list[float], list[float]] = ([], [])
    for turn in range(-2, repeats):
        for scene, wall, processor in zip(scenes, walls, processors, strict=True):
            camera = moved_by_a_hair(case.camera, scene, random)
            took = wall_and_processor_ms(
                lambda: render_shadows(scene, camera, case.light, method)  # noqa: B023
            )
            # The first two warm up.
            if turn >= 0:
                wall.append(took[0])
                processor.append(took[1])
    return {
        "ms": statistics.median(walls[0]),
        "ms, solid": statistics.median(walls[1]),
        "processor ms": statistics.median(processors[0]),
        "processor ms, solid": statistics.median(processors[1]),
    }
