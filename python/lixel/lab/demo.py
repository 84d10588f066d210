"""Render a built-in scene with every method: what each costs, and what it misclassifies."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from .. import image_files, scenes
from ..camera import Camera
from ..compare import compare
from ..frame import FrameParts, frame_parts, render
from ..light import Light, PointLight
from ..methods import METHODS, Method, method_from, resolution_text
from ..pictures import display
from ..reference import reference
from ..scene import Scene
from .options import add_output, add_size, keep
from .report import progress, status, table, waiting
from .study import cell
from .views import SIZE

AROUND_A_POINT_LIGHT = ("cube", "cube+rtw", "dual_paraboloid", "improved_paraboloid", "ray_traced")


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel demo`."""
    parser.add_argument(
        "--out", type=Path, default=Path("out"), metavar="FOLDER", help="default: out"
    )
    add_output(parser, "write the tables, with device, date and command, .csv or .parquet")
    add_size(parser, "1920x1080", SIZE)


def run(options: argparse.Namespace) -> None:
    """Measure and print the tables, write the pictures, and keep the tables."""
    keep(options, measure(options.out, *options.size))


def measure(folder: Path, width: int, height: int) -> list[dict[str, Any]]:
    """Render the colonnade with every method, at `width` x `height` pixels, into pictures in the
    folder, and print two tables.

    The rows of both are returned, as from `evaluate`, each with its light: ``"directional"`` or
    ``"point"``.
    """
    scene = scenes.colonnade()
    camera, light = scene.cameras["default"].resized(width, height), scene.lights["default"]
    low, high = scene.bounds
    point_light = PointLight(low + (0.53, 0.6, 0.52) * (high - low))
    status(f"a colonnade of {scene.triangle_count:,} triangles, {width} x {height} pixels")
    every = [method() for method in METHODS.values()]
    methods = [method for method in every if method.takes(light)]
    around = [method_from(name) for name in AROUND_A_POINT_LIGHT]
    tables = {
        "directional": evaluate(scene, camera, light, methods, folder / "directional", 3),
        "point": evaluate(scene, camera, point_light, around, folder / "point", 3),
    }
    render(scene, camera, light, "exact").save(folder / "shadows.png")
    for kind, rows in tables.items():
        print(f"{kind} light\n")
        show(rows)
        print()
    print(f"pictures in {folder}: shadows.png, and one for each row with its misclassified pixels")
    return [{"light": kind, **row} for kind, rows in tables.items() for row in rows]


def evaluate(
    scene: Scene,
    camera: Camera,
    light: Light,
    methods: Sequence[Method],
    folder: Path | None = None,
    repeats: int = 1,
) -> list[dict[str, Any]]:
    """Render with each method, and compare with the reference.

    The frames of the methods, `repeats` of each, take turns; the one with the median time counts.
    Pictures with misclassified pixels in red go into the folder, named by method and resolution.
    A row has the method's name and resolution, milliseconds in all and per pass, misclassified
    pixels, and the device.
    """
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)

    def shadows(seen_by: Camera, method: Method) -> FrameParts:
        # As `render_shadows`: nothing is drawn that the picture does not need.
        return frame_parts(scene, seen_by, light, method)

    # In small first: pipelines are compiled on first use, and a machine that cannot do something
    # says so before the reference takes its time.
    with waiting("making ready"):
        for method in methods:
            shadows(camera.resized(64, 64), method)
    # The first frame, in which what depends on the camera alone runs.
    first = shadows(camera, methods[0])
    rendered = [shadows(camera, method) for method in progress([*methods] * repeats, "render")]
    frames = []
    for i in range(len(methods)):
        of_method = sorted(rendered[i :: len(methods)], key=lambda f: sum(f.timings.values()))
        frames.append(of_method[len(of_method) // 2])
    status("reference: casting rays on the CPU")
    truth = reference(scene, camera, light)
    view = image_files.view_record(scene, camera, light)
    # What ran only once counts for every frame.
    shared = {k: ms for k, ms in first.timings.items() if k not in frames[0].timings}
    rows = []
    for method, frame in zip(methods, frames, strict=True):
        name, resolution = method.spelling, method.map_resolution
        timings = {**shared, **frame.timings}
        found = compare(frame.visibility, truth)
        if folder is not None:
            size = "" if resolution is None else f"-{resolution_text(resolution)}"
            made_by = {
                **view,
                "method": image_files.method_record(method),
                "device": frame.adapter["name"],
                "driver": frame.adapter["driver"],
                "misclassified": found.misclassified_count,
            }
            image_files.save_picture(folder / f"{name}{size}.png", found.picture(), made_by)
        rows.append(
            {
                "method": name,
                "resolution": "" if resolution is None else cell(resolution),
                "ms": sum(timings.values()),
                "misclassified": found.misclassified_count,
                "% of covered": 100.0 * found.rate_covered,
                "false lit": found.false_lit_count,
                "false shadow": found.false_shadow_count,
                "ms per pass": display.milliseconds(timings),
                "device": frame.adapter["name"],
                "driver": frame.adapter["driver"],
            }
        )
    return rows


def show(rows: Sequence[Mapping[str, Any]]) -> None:
    """Print rows of `evaluate`, and below them the device that rendered them."""
    device = ("device", "driver")
    print(table([{k: v for k, v in row.items() if k not in device} for row in rows]))
    print("on {device}, driver {driver}".format(**rows[0]))
