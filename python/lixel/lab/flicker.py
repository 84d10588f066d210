"""Measure how much the shadows of each method flicker while the camera or the light moves.

A pixel flickers where it turns from right to wrong, or back, between two frames: where its change
is not the reference's. Pixels of two frames are matched by the point that they see: the surface in
the middle of a pixel is looked up in the frame before, where the pixel that it falls in must see
the same triangle.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from .. import scenes
from ..arguments import count, did_you_mean
from ..camera import Camera
from ..compare import compare
from ..frame import render, render_shadows
from ..light import DirectionalLight
from ..methods import (
    METHODS as ALL_METHODS,
    Cascades,
    DesiredView,
    Exact,
    Focused,
    Method,
    MinimalShadowMap,
    NonOrthogonalWarp,
    RectilinearWarp,
    SceneOptimized,
    ShadowMapMethod,
    Uniform,
    method_from,
)
from ..reference import Reference, reference
from ..scene import Scene
from ..scenes import rotation
from .options import add_methods, add_output, show
from .report import progress
from .views import View

Match: TypeAlias = tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]

WIDTH, HEIGHT = 192, 108

FRAMES, QUICK = 120, 24
"""Of each motion, by default and where an answer is wanted within a minute."""

RESOLUTION = 128
"""Texels along each side of the maps: a pixel or two wide, so that there is flicker to see."""


def _scene() -> Scene:
    return scenes.objects_on_floor(count=9, subdivisions=1)


def _camera(eye: Any, target: Any = (0.2, 0.3, 0.1)) -> Camera:
    return Camera.look_at(eye, target, yfov=0.8, width=WIDTH, height=HEIGHT)


def _pan(scene: Scene, frame: int) -> View:
    """The image is a window that moves over a wide picture, a pixel at a time."""
    still = _camera((-3.1, 2.3, 4.2))
    across, down = still.centre
    return scene, still._replaced(centre=(across + 60 - frame, down)), scene.lights["default"]


def _walk(scene: Scene, frame: int) -> View:
    """Past the scene and towards it, about a pixel at a time."""
    camera = _camera((-3.1 + 0.022 * frame, 2.3 - 0.004 * frame, 4.2 - 0.006 * frame))
    return scene, camera, scene.lights["default"]


def _light(scene: Scene, frame: int) -> View:
    """The camera stands still, the light turns by a tenth of a degree at a time."""
    light = scene.lights["default"]
    assert isinstance(light, DirectionalLight)
    turned = rotation(-math.radians(0.1 * frame)) @ light.direction
    return scene, _camera((-3.1, 2.3, 4.2)), DirectionalLight(turned)


MOTIONS: Mapping[str, Callable[[Scene, int], View]] = MappingProxyType(
    {"pan": _pan, "walk": _walk, "light": _light}
)
"""What moves, by name."""

METHODS: tuple[tuple[Method, bool], ...] = (
    (Uniform(), False),
    (DesiredView(), False),
    (DesiredView(snap=True), False),
    (MinimalShadowMap(), False),
    (Focused(), False),
    (Focused(snap=True), False),
    (Cascades(), False),
    (Cascades(snap=True), False),
    (SceneOptimized(), False),
    (SceneOptimized(), True),
    (RectilinearWarp(), False),
    (RectilinearWarp(snap=True), False),
    (RectilinearWarp(snap=True, blend=0.9), True),
    (NonOrthogonalWarp(), False),
    (NonOrthogonalWarp(snap=True), False),
    (NonOrthogonalWarp(snap=True, blend=0.9), True),
    (Exact(), False),
)
"""Methods, and whether each frame is given the one before as `previous`."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab flicker`."""
    add_methods(parser)
    parser.add_argument(
        "--frames", type=int, metavar="N", help=f"of each motion; default: {FRAMES}, quick {QUICK}"
    )
    parser.add_argument(
        "--quick", action="store_true", help="the first frames of each motion alone"
    )
    add_output(parser, "write a table, .csv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Measure, save and print the table."""
    names = {method_from(name).name for name in options.method or ALL_METHODS}
    chosen = [pair for pair in METHODS if pair[0].name in names]
    usual = QUICK if options.quick else FRAMES
    frames = usual if options.frames is None else options.frames
    show(options, measure(methods=chosen, frames=frames))


def measure(
    motions: Iterable[str] | None = None,
    methods: Iterable[tuple[Method, bool]] = METHODS,
    frames: int = FRAMES,
) -> list[dict[str, Any]]:
    """Pixels that flicker: a row for each motion and method.

    `methods` are pairs of a method and whether each frame is given the one before; maps get
    `RESOLUTION` texels along each side. A row has motion, method, `snap`, and `blend` where the
    frame before was given; then, as means over the frames: `flicker`, pixels that turn from right
    to wrong or back from one frame to the next; `truth`, pixels that change in the reference;
    `compared`, pixels that two frames both see and no tie settles; `misclassified` pixels of a
    frame. An unknown motion and fewer than two frames are a `ValueError`.
    """
    names = list(MOTIONS) if motions is None else list(motions)
    for name in names:
        if name not in MOTIONS:
            raise ValueError(
                f"motion must be one of {', '.join(MOTIONS)}, got {name!r}"
                f"{did_you_mean(name, MOTIONS)}"
            )
    frames = count("frames", frames, least=2)
    chosen = list(methods)
    rows = []
    for name in names:
        scene = _scene()
        views = [MOTIONS[name](scene, frame) for frame in range(frames)]
        truths = [reference(*view) for view in views]
        matches = [_match(old, new) for old, new in itertools.pairwise(truths)]
        changed = _changed([truth.visibility for truth in truths], matches)
        for method, follows in progress(chosen, name):
            wrong = _misclassified(views, truths, method, follows)
            rows.append(
                {
                    "motion": name,
                    "method": method.spelling,
                    "snap": bool(getattr(method, "snap", False)),
                    "blend": getattr(method, "blend", 1.0) if follows else None,
                    "frames": frames,
                    "flicker": _changed(wrong, matches),
                    "truth": changed,
                    "compared": float(np.mean([here.size for here, _ in matches])),
                    "misclassified": float(np.mean([of_frame.sum() for of_frame in wrong])),
                }
            )
    return rows


def _misclassified(
    views: list[View], truths: list[Reference], method: Method, follows: bool
) -> list[npt.NDArray[np.bool_]]:
    """The misclassified pixels of each frame."""
    if isinstance(method, ShadowMapMethod):
        method = replace(method, resolution=RESOLUTION)
    wrong = []
    for view, truth in zip(views, truths, strict=True):
        if follows:
            frame = render(*view, method)
            visibility = frame.visibility
            method = cast(Method, replace(cast(Any, method), previous=frame))
        else:
            visibility = render_shadows(*view, method)
        found = compare(visibility, truth, other_surfaces="count")
        wrong.append(found.misclassified)
    return wrong


def _changed(images: Sequence[npt.NDArray[Any]], matches: Sequence[Match]) -> float:
    """How many matching pixels differ between two images, one after the other, in the mean."""
    return float(
        np.mean(
            [
                np.count_nonzero(old.ravel()[there] != new.ravel()[here])
                for (old, new), (here, there) in zip(
                    itertools.pairwise(images), matches, strict=True
                )
            ]
        )
    )


def _match(old: Reference, new: Reference) -> Match:
    """Pixels of the new picture, and those of the old one that see the same place; no ties."""
    of_old, of_new = (~truth.tie & ~truth.triangle_tie for truth in (old, new))
    here, there = new.pixels_seen_by(old)
    is_sure = of_new.ravel()[here] & of_old.ravel()[there]
    return here[is_sure], there[is_sure]
