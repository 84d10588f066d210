"""Measure how time and memory grow: with triangles, pixels, threads, and where much lies together.

Each method has a process by itself for each step of a series. Objects on a floor come in finer and
finer triangles, in larger and larger images, and on more threads; their floor lies on wider and
wider ones, so that they are ever smaller beside what the light's map or grid must cover; and a heap
of triangles has a thousandth of the width of what is seen.
"""

from __future__ import annotations

import argparse
import math
import os
import statistics
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .. import _core
from ..arguments import needs
from ..camera import Camera
from ..compare import compare
from ..frame import render_shadows
from ..light import DirectionalLight, Light
from ..methods import DesiredView, Exact, Method, RayTraced, RectilinearWarp
from ..reference import reference
from ..scene import Scene, joined
from ..scenes import floor, objects_on_floor
from .options import add_output, natural
from .own_process import in_own_process, peak_megabytes
from .report import progress, table as as_text
from .result_tables import append, read, resume
from .timing import moved_by_a_hair, wall_and_processor_ms, wall_ms

if TYPE_CHECKING:
    import pandas

METHODS: Mapping[str, Method] = {
    "exact": Exact(),
    "ray_traced": RayTraced(),
    "desired_view": DesiredView(resolution=2048),
    "rtw": RectilinearWarp(resolution=2048),
}

SUBDIVISIONS = 4
"""Of the objects where something else grows: 1.1 million triangles."""

SIZE = (1280, 800)
"""Of the image where something else grows."""

PATIENCE = 10.0
"""Seconds: what takes long is timed less often, so that all frames of a method take about as long,
but once at least."""

DROP = 0.5
"""World units from a floor down to the one below it, so that they do not coincide."""

HEAP_FLOOR = 500.0
"""Half the width of the floor below a heap, whose side is 1."""


class Step(NamedTuple):
    """A scene of a series, its image, and the threads of a frame; None: as many as there are."""

    series: str
    make: Callable[..., Scene]
    argument: float
    size: tuple[int, int] = SIZE
    threads: int | None = None

    @property
    def grows(self) -> float:
        """What is another in each step of the series."""
        of_series = {"pixels": self.size[0] * self.size[1], "threads": self.threads}
        return float(of_series.get(self.series) or self.argument)


class View(NamedTuple):
    """Of a scene whose arrays are in files."""

    camera: Camera
    light: Light


def objects(subdivisions: float) -> Scene:
    """Objects on a floor; each subdivision has four times as many triangles."""
    return objects_on_floor(subdivisions=int(subdivisions))


def on_wider_floor(times: float) -> Scene:
    """Objects on a floor that lies on one so many times as wide, or on none for 1."""
    scene = objects(SUBDIVISIONS)
    if times <= 1.0:
        return scene
    half = times * float(scene.bounds[1][0])
    below, faces = floor(half, half)
    wider = joined([(scene.vertices, scene.faces), (below - (0.0, DROP, 0.0), faces)])
    wider.cameras, wider.lights = scene.cameras, scene.lights
    return wider


def heap(count: float) -> Scene:
    """So many triangles at random in a cube of side 1, over the middle of a floor a thousand times
    as wide, all of which is seen."""
    random = np.random.default_rng(0)
    number = int(count)
    middles = random.uniform((-0.5, 0.05, -0.5), (0.5, 1.05, 0.5), (number, 3))
    # The more there are, the smaller they are.
    corners = middles[:, None] + random.normal(size=(number, 3, 3)) * number ** (-1 / 3)
    faces = np.arange(3 * number).reshape(-1, 3)
    scene = joined([floor(HEAP_FLOOR, HEAP_FLOOR), (corners.reshape(-1, 3), faces)])
    eye = (0.0, 1.2 * HEAP_FLOOR, 0.9 * HEAP_FLOOR)
    scene.cameras["default"] = Camera.look_at(eye, (0, 0, 0), yfov=0.9, width=1920, height=1080)
    scene.lights["default"] = DirectionalLight((0.55, -0.7, -0.35))
    return scene


def thread_counts() -> list[int]:
    """Powers of two up to the cores, and the cores."""
    cores = os.cpu_count() or 1
    return sorted({cores, *(2**n for n in range(cores.bit_length()) if 2**n <= cores)})


SERIES: tuple[Step, ...] = (
    *(
        Step("pixels", objects, SUBDIVISIONS, size)
        for size in ((640, 400), (1280, 800), (2560, 1600), (3840, 2160))
    ),
    *(Step("threads", objects, SUBDIVISIONS, (1920, 1080), count) for count in thread_counts()),
    *(Step("floor", on_wider_floor, times) for times in (1.0, 10.0, 100.0, 1000.0)),
    *(Step("heap", heap, count) for count in (10_000.0, 100_000.0, 1_000_000.0)),
    # The longest last.
    *(Step("triangles", objects, n) for n in (0, 1, 2, 3, 4, 5, 6)),
)

QUICK: tuple[Step, ...] = (
    *(Step("triangles", objects, n, (160, 100)) for n in (0, 1)),
    *(Step("pixels", objects, 0, size) for size in ((160, 100), (320, 200))),
    *(Step("threads", objects, 0, (320, 200), count) for count in (1, 2)),
    *(Step("heap", heap, count, (160, 100)) for count in (1_000.0, 4_000.0)),
)
"""As little as shows that all is measured."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab growth`."""
    parser.add_argument(
        "--repeats", type=natural, default=7, metavar="N", help="timed frames at most; 7"
    )
    parser.add_argument("--quick", action="store_true", help="a few small steps")
    add_output(parser, "table of every step, .csv or .parquet", required=True)


def run(options: argparse.Namespace) -> None:
    """Measure what the table does not have yet, append it step by step, and print the table."""
    steps = QUICK if options.quick else SERIES
    before = resume(options.output, options.line)
    done = {(row["series"], float(row["step"])) for row in before}
    missing = [step for step in steps if (step.series, step.grows) not in done]
    for step in progress(missing, "steps", len(steps), len(done)):
        append(options.output, options.line, measure(step, max(1, options.repeats)))
    print(as_text(with_rates(read(options.output)).to_dict("records")))


def with_rates(table: pandas.DataFrame) -> pandas.DataFrame:
    """The table with two more columns: ``exponent`` of the time since the step before, to what
    grows; ``speed-up``, the time on one thread over this one."""
    rows = table.to_dict("records")
    last: dict[tuple[str, str], dict[str, Any]] = {}
    for row in rows:
        row["exponent"] = row["speed-up"] = math.nan
        before = last.get((row["series"], row["method"]))
        if before is not None and row["series"] == "threads":
            row["speed-up"] = before["ms"] / row["ms"]
            continue
        if before is not None and row["series"] in ("triangles", "pixels"):
            steps_of = row[row["series"]] / before[row["series"]]
            row["exponent"] = math.log(row["ms"] / before["ms"]) / math.log(steps_of)
        last[row["series"], row["method"]] = row
    return needs("pandas", "study").DataFrame(rows)


def measure(step: Step, repeats: int) -> list[dict[str, Any]]:
    """A row for each method.

    ``ms`` and ``processor ms``, of all threads, are medians of up to `repeats` frames of cameras
    that moved; ``ms with building`` is that of frames whose vertices moved, where what follows from
    them is made again. ``MB of scene`` is the most memory that the process has had once there is a
    scene, ``MB`` once there were frames, in 10^6 bytes.
    """
    scene = step.make(step.argument)
    view = View(scene.cameras["default"].resized(*step.size), scene.lights["default"])
    truth = reference(scene, *view)
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        np.save(Path(folder) / "vertices.npy", scene.vertices)
        np.save(Path(folder) / "faces.npy", scene.faces)
        for name, method in METHODS.items():
            found, visibility = in_own_process(
                _measured, Path(folder), view, method, step.threads, repeats
            )
            counted = compare(visibility, truth)
            rows.append(
                {
                    "series": step.series,
                    "step": step.grows,
                    "method": name,
                    "triangles": scene.triangle_count,
                    "pixels": visibility.size,
                    **found,
                    "misclassified": counted.misclassified_count,
                    "ties": counted.tie_count,
                    "covered": counted.covered_count,
                }
            )
    return rows


def _measured(
    folder: Path, view: View, method: Method, threads: int | None, repeats: int
) -> tuple[dict[str, Any], npt.NDArray[np.float32]]:
    """Times and memory of a method, and its image. Nothing else is in this process."""
    scene = Scene(np.load(folder / "vertices.npy"), np.load(folder / "faces.npy"))
    of_scene = peak_megabytes()
    random = np.random.default_rng(0)

    def frame() -> None:
        seen_by = moved_by_a_hair(view.camera, scene, random)
        render_shadows(scene, seen_by, view.light, method, threads=threads)

    def frame_of_moved() -> None:
        scene.update_vertices(scene.vertices)
        frame()

    frame()
    seconds = wall_ms(frame) / 1e3
    times = [wall_and_processor_ms(frame) for _ in range(_count(repeats, seconds))]
    of_frames = peak_megabytes()
    found = {
        "threads": threads or _core.device("cpu")["threads"],
        "ms": statistics.median(wall for wall, _ in times),
        "processor ms": statistics.median(processor for _, processor in times),
        "ms with building": _building_ms(frame_of_moved, repeats),
        "MB of scene": of_scene,
        "MB": of_frames,
    }
    return found, render_shadows(scene, view.camera, view.light, method, threads=threads)


def _building_ms(call: Callable[[], object], repeats: int) -> float:
    first = wall_ms(call)
    # The first one took what the others need of memory.
    more = _count(repeats, first / 1e3) - 1
    return statistics.median([wall_ms(call) for _ in range(more)] or [first])


def _count(repeats: int, seconds: float) -> int:
    """How often something is timed that takes so long."""
    return min(repeats, max(1, int(PATIENCE / seconds)))
