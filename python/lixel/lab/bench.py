"""Time every method on a device, and the other renderers beside it, into one file to send.

A frame goes from a new camera to a visibility image as a numpy array. The views are a scene from
its first camera in its first light, in a point light among its objects, and, for methods that take
neither, in a spot light there. Misclassified pixels are counted against the float64 reference.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .. import _core
from ..arguments import count
from ..compare import compare
from ..frame import FrameParts, frame_parts
from ..info import SOFTWARE, system
from ..light import Light, PointLight, SpotLight
from ..methods import METHODS, Method, method_from
from ..pictures.display import milliseconds
from ..reference import Reference, reference
from ..scene import Scene
from . import peers
from .options import DEFAULT_SCENE, SCENE_HELP, add_methods, add_output, add_size, device_of
from .report import progress, status, table
from .result_tables import provenance
from .study import cell
from .timing import moved_by_a_hair
from .views import SIZE, scene_and_views

PATIENCE = 20.0
"""Seconds, about, that the timed frames of a method may take in all."""

MIN_FRAMES = 3

PLACE = (0.53, 0.6, 0.52)
"""Where in the box around the scene the point light is."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel bench`."""
    parser.add_argument(
        "scene", nargs="?", default=DEFAULT_SCENE, metavar="FILE",
        help=f"{SCENE_HELP}; default: {DEFAULT_SCENE}",
    )  # fmt: skip
    add_size(parser, "1920x1080", SIZE)
    add_methods(parser)
    parser.add_argument(
        "--repeats", type=int, default=15, metavar="N",
        help="timed frames of each method; slow ones get fewer; default: 15",
    )  # fmt: skip
    parser.add_argument(
        "--gpu", action="store_true",
        help="a hardware GPU or nothing; a software driver only where --device names it",
    )  # fmt: skip
    parser.add_argument("--no-peers", action="store_true", help="lixel alone")
    add_output(parser, "write all that was measured into one file, .json", (".json",))


def run(options: argparse.Namespace) -> None:
    """Measure, print, and write the file."""
    if options.gpu:
        options.device = gpu(options.device)
    with device_of(options):
        scene, views = scene_and_views(options.scene, None)
        camera = views.camera(None, scene).resized(*options.size)
        methods = [method_from(name) for name in options.method or METHODS]
        found: list[dict[str, Any]] = []
        report = {
            **provenance(options.line),
            "versions": system(),
            "adapter": _core.device(),
            "cpu": _core.device("cpu"),
            "scene": Path(options.scene).stem,
            "views": found,
        }
        for name, light, fitting in lights_for(methods, scene, views.light(None)):
            status(f"reference: casting rays on the CPU ({name} light)")
            truth = reference(scene, camera, light)
            rows = measure(truth, fitting, options.repeats)
            view = {"light": name, "kind": type(light).__name__, **facts(truth), "methods": rows}
            found.append(view)
            print(f"{name} light\n\n{table([line(row) for row in rows])}\n")
            # Another renderer may end the process.
            write(options.output, report)
            view["peers"] = [] if options.no_peers else beside_methods(truth, options.repeats)
            write(options.output, report)
    if options.output is not None:
        status(f"{options.output}: attach it to a report; the page Who renders says where")


def lights_for(
    methods: Sequence[Method], scene: Scene, first: Light
) -> Iterator[tuple[str, Light, list[Method]]]:
    """The lights by name, and the methods that are timed in each."""
    low, high = scene.bounds
    place = low + PLACE * (high - low)
    rest = list(methods)
    for name, light in (("first", first), ("lamp", PointLight(place))):
        if fitting := [method for method in methods if method.takes(light)]:
            yield name, light, fitting
        rest = [method for method in rest if not method.takes(light)]
    if rest:
        yield "spot", SpotLight(place, (0.1, -1.0, 0.4), 1.0), rest


def write(file: Path | None, report: Mapping[str, Any]) -> None:
    """What is known until now, as JSON; nowhere without a file."""
    if file is not None:
        file.parent.mkdir(parents=True, exist_ok=True)
        text = json.dumps(report, indent=1, allow_nan=False)
        file.write_text(text + "\n", encoding="utf-8")


def gpu(name: str | None) -> str:
    """The name of a GPU: a software driver is none, unless it is named.

    Raises
    ------
    DeviceError, ValueError
        There is none.
    """
    device = _core.device(name or "gpu")
    is_named = name is not None and name.lower() not in ("gpu", "cpu")
    if device["type"] == "Cpu engine" or (device["type"] in SOFTWARE and not is_named):
        known = ", ".join(adapter["name"] for adapter in _core.adapters()) or "none"
        raise _core.DeviceError(
            f"--gpu needs a hardware GPU; the adapters are {known}; "
            "--device NAME names a software driver"
        )
    return name or "gpu"


def facts(truth: Reference) -> dict[str, Any]:
    """What a view is, in numbers."""
    return {
        "triangles": truth.scene.triangle_count,
        "width": truth.camera.width,
        "height": truth.camera.height,
        "covered": int(np.count_nonzero(truth.covered)),
        "ties": int(np.count_nonzero(truth.tie | truth.float32_tie)),
    }


@dataclass
class _Contender:
    """A method, and what was measured of it."""

    method: Method
    repeats: int = 0
    wall: list[float] = field(default_factory=list)
    passes: list[dict[str, float]] = field(default_factory=list)
    misclassified: dict[str, int] = field(default_factory=dict)
    error: str | None = None


def measure(truth: Reference, methods: Sequence[Method], repeats: int = 15) -> list[dict[str, Any]]:
    """A row for each method, all of which take the light: each frame from a camera of its own.

    Parameters
    ----------
    truth : Reference
        Of the view.
    methods : sequence of Method
    repeats : int
        Timed frames; slow methods get fewer, at least 3.

    Returns
    -------
    list of dict
        ``method`` and ``resolution``; ``frames``, ``wall_ms`` (median, least and greatest), and
        ``pass_ms``, the medians of passes; ``misclassified``, ``false_lit`` and ``false_shadow``
        pixels; or ``error``, why it could not be rendered.
    """
    repeats = count("repeats", repeats)
    random = np.random.default_rng(0)

    def shot(method: Method) -> tuple[float, FrameParts]:
        camera = moved_by_a_hair(truth.camera, truth.scene, random)
        start = time.perf_counter()
        parts = frame_parts(truth.scene, camera, truth.light, method)
        return 1e3 * (time.perf_counter() - start), parts

    contenders = [_Contender(method) for method in methods]
    for contender in progress(contenders, "making ready"):
        try:
            at_rest = frame_parts(truth.scene, truth.camera, truth.light, contender.method)
            ms, _ = shot(contender.method)
        except (_core.DeviceError, ValueError) as error:
            contender.error = str(error)
            continue
        found = compare(at_rest.visibility, truth, other_surfaces="count")
        contender.misclassified = {
            "misclassified": found.misclassified_count,
            "false_lit": found.false_lit_count,
            "false_shadow": found.false_shadow_count,
        }
        contender.repeats = min(repeats, max(MIN_FRAMES, int(PATIENCE / (1e-3 * ms))))
    for turn in progress(range(repeats), "round"):
        for contender in contenders:
            if turn < contender.repeats:
                ms, parts = shot(contender.method)
                contender.wall.append(ms)
                contender.passes.append(dict(parts.timings))
    return [_row(contender) for contender in contenders]


def _row(contender: _Contender) -> dict[str, Any]:
    method, wall, passes = contender.method, contender.wall, contender.passes
    row = {"method": method.spelling, "resolution": cell(method.map_resolution)}
    if contender.error is not None:
        return {**row, "error": contender.error}
    labels = dict.fromkeys(label for each in passes for label in each)
    return {
        **row,
        "frames": len(wall),
        "wall_ms": {
            "median": statistics.median(wall), "least": min(wall), "greatest": max(wall),
        },
        # A pass that a frame did not need took no time in it.
        "pass_ms": {
            label: statistics.median(each.get(label, 0.0) for each in passes) for label in labels
        },
        **contender.misclassified,
    }  # fmt: skip


def line(row: dict[str, Any]) -> dict[str, Any]:
    """Of the printed table."""
    named = {"method": row["method"], "resolution": row["resolution"]}
    if "error" in row:
        return {**named, "error": row["error"]}
    return {
        **named,
        "frame, ms": row["wall_ms"]["median"],
        "passes, ms": sum(row["pass_ms"].values()),
        "misclassified": row["misclassified"],
        "ms per pass": milliseconds(row["pass_ms"]),
    }


def beside_methods(truth: Reference, repeats: int) -> list[dict[str, Any]]:
    """The other renderers that are installed, and beside them lixel in the same rounds."""
    if not isinstance(truth.light, peers.CAST):
        return []
    view = truth.scene, truth.camera, truth.light
    methods = [method for name in peers.METHODS if (method := method_from(name)).takes(truth.light)]
    rows = peers.measure(*view, methods, repeats=repeats)
    # JSON has no NaN.
    return [
        {name: None if value != value else value for name, value in row.items()} for row in rows
    ]
