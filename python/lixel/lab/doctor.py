"""Try every engine and adapter of this machine, and print a report that can be sent.

A small suite of views and methods is rendered by the CPU engine and by each adapter, each in a
process of its own, so that a driver that crashes costs itself alone. What they render is compared
with the float64 reference, and with the CPU engine.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from multiprocessing.connection import Connection
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from .. import _core, scenes
from ..compare import compare
from ..frame import frame_parts
from ..info import SOFTWARE, system
from ..light import PointLight
from ..methods import Method, method_from
from ..pictures.display import milliseconds
from ..reference import Reference, reference
from ..scene import Scene
from .report import waiting

Value = TypeVar("Value")
Found: TypeAlias = tuple[int, int, int, int, Mapping[str, float], str | None]

PATIENCE = 600.0
"""Seconds that a device may take."""

SIZE = (160, 90)

SCENES: Mapping[str, Callable[[], Scene]] = {
    "colonnade": lambda: scenes.colonnade(columns=4, detail=12),
    "city": lambda: scenes.city(blocks=8),
    "objects": lambda: scenes.objects_on_floor(count=25, subdivisions=2),
}

METHODS: Mapping[str, Method] = {
    **{
        name: method_from(name, resolution=256)
        for name in (
            "desired_view", "lispsm", "scene_optimized", "cascades", "rtw", "notw", "cube",
            "cube+notw", "dual_paraboloid", "improved_paraboloid",
        )
    },
    "desired_view, depths": method_from("desired_view", resolution=256, lookup="depth"),
    "desired_view, linear": method_from("desired_view", resolution=256, rasterization="linear"),
    **{name: method_from(name) for name in ("exact", "ray_traced", "shadow_volumes")},
}  # fmt: skip
"""One for each kind of map, of warp, of rasterization and of lookup, and those without a map."""

NEVER_WRONG = ("exact", "ray_traced")
"""They misclassify no pixel that is no tie, on any device."""

MAX_SHARE = 0.02
"""The greatest share of misclassified pixels of the others; on the CPU engine they have at most a
half of it."""


class Row(NamedTuple):
    """A method in one view."""

    scene: str
    light: str
    method: str
    covered: int
    wrong: int
    wrong_on_cpu: int
    differing: int
    """Pixels that the CPU engine answers otherwise."""
    timings: Mapping[str, float]
    error: str | None = None

    def fault(self) -> str | None:
        """What is wrong with it, in words."""
        where = f"{self.method}, {self.scene}, {self.light}"
        if self.error is not None:
            return f"{where}: {self.error}"
        # Float32 rounds otherwise on each device: some pixels at edges fall on the other side.
        most = min(MAX_SHARE * self.covered, 1.1 * self.wrong_on_cpu + 5)
        most = 0 if self.method in NEVER_WRONG else int(most)
        if self.wrong > most:
            return f"{where}: {self.wrong} pixels misclassified, at most {most} expected"
        return None


class Report(NamedTuple):
    """What was found of an engine or an adapter."""

    device: Mapping[str, Any]
    rows: Sequence[Row]
    faults: Sequence[str]

    def __str__(self) -> str:
        """In Markdown's form."""
        facts = dict(self.device)
        name, kind = facts.pop("name"), facts.pop("type")
        words = {"Cpu engine": "lixel's own engine", **dict.fromkeys(SOFTWARE, "software driver")}
        missing = facts.get("missing_features")
        verdict = "wrong" if self.faults else "cannot be used" if missing else "right"
        lines = [f"### {name} ({words.get(kind, kind)}): {verdict}", ""]
        lines += [f"- **wrong**: {fault}" for fault in self.faults]
        lines += [f"- {key}: {_text(value)}" for key, value in facts.items()]
        return "\n".join([*lines, *_table(self.rows)])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel doctor`."""
    parser.add_argument(
        "names", nargs="*", metavar="NAME",
        help="cpu, or a part of an adapter's name; default: the CPU engine and every adapter",
    )  # fmt: skip


def run(options: argparse.Namespace) -> None:
    """Try the devices, and print a report."""
    reports = [examined(device) for device in devices(options.names)]
    print("## lixel doctor\n")
    print("\n".join(f"- {name}: {value}" for name, value in system().items()))
    for report in reports:
        print(f"\n{report}")
    wrong = [report.device["name"] for report in reports if report.faults]
    if wrong:
        raise _core.DeviceError(f"the report above says what is wrong with {', '.join(wrong)}")


def devices(names: Sequence[str] = ()) -> list[dict[str, Any]]:
    """The CPU engine and the adapters; of these those that are named, ``"cpu"`` or by a part.

    Adapters of one name, backend and driver cannot be told apart, and are one.
    """
    known = {("cpu", "", ""): _core.device("cpu")}
    for adapter in _core.adapters():
        known.setdefault(_identity(adapter), adapter)
    for name in names:
        if not any(name.lower() in of.lower() for of, *_ in known):
            listed = ", ".join(of for of, *_ in known)
            raise ValueError(f"NAME must be a part of one of {listed}, got {name!r}")
    return [
        device
        for (of, *_), device in known.items()
        if not names or any(name.lower() in of.lower() for name in names)
    ]


def _identity(device: Mapping[str, Any]) -> tuple[str, str, str]:
    return device["name"], device["backend"], device["driver"]


def examined(device: Mapping[str, Any]) -> Report:
    """An engine or an adapter, in a process of its own."""
    if device.get("missing_features"):
        return Report(device, [], [])
    try:
        with waiting(f"trying {device['name']}"):
            rows = apart(suite, device)
    except (ChildProcessError, TimeoutError) as error:
        return Report(device, [], [str(error)])
    return Report(device, rows, [fault for row in rows if (fault := row.fault()) is not None])


# --- A process of its own ---


def apart(function: Callable[..., Value], *arguments: Any, patience: float = PATIENCE) -> Value:
    """What a function returns in a fresh process, which a driver may crash or stop.

    Raises
    ------
    ChildProcessError
        The process ended without an answer.
    TimeoutError
        There was none within so many seconds.
    """
    context = multiprocessing.get_context("spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_answer, args=(theirs, function, arguments), daemon=True)
    process.start()
    theirs.close()
    try:
        if not ours.poll(patience):
            raise TimeoutError(f"no answer within {patience:.0f} s")
        answer: Value = ours.recv()
    except (EOFError, BrokenPipeError):
        process.join()
        code = process.exitcode
        raise ChildProcessError(f"the process ended with the exit code {code}") from None
    finally:
        process.kill()
        process.join()
    return answer


def _answer(connection: Connection, function: Callable[..., Any], arguments: Any) -> None:
    connection.send(function(*arguments))


# --- The suite ---


def suite(device: Mapping[str, Any]) -> list[Row]:
    """Every method in every view that it takes, on a device."""
    name = "cpu"
    if device["type"] != "Cpu engine":
        # Of adapters of one name the one of this backend.
        os.environ["WGPU_BACKEND"], name = device["backend"], device["name"]
    rows = []
    for scene_name, make in SCENES.items():
        scene = make()
        camera = scene.cameras["default"].resized(*SIZE)
        low, high = scene.bounds
        lights = {
            "sun": scene.lights["default"],
            "lamp": PointLight(low + (high - low) * (0.45, 0.6, 0.55)),
        }
        for light_name, light in lights.items():
            truth = reference(scene, camera, light)
            for label, method in METHODS.items():
                if method.takes(light):
                    found = _found(truth, method, name, _identity(device))
                    rows.append(Row(scene_name, light_name, label, *found))
    return rows


def _found(truth: Reference, method: Method, name: str, identity: tuple[str, str, str]) -> Found:
    """What `Row` has of a view whose truth is known."""
    view = truth.scene, truth.camera, truth.light
    covered = int(np.count_nonzero(truth.covered))
    try:
        # The first one makes ready.
        _, frame = (frame_parts(*view, method, device=name) for _ in range(2))
        if _identity(frame.adapter) != identity:
            raise ChildProcessError(f"{frame.adapter['name']} rendered in its place")
        on_cpu = frame if name == "cpu" else frame_parts(*view, method, device="cpu")
        by_cpu = on_cpu.visibility
        wrong, wrong_on_cpu = (
            compare(image, truth, other_surfaces="count").misclassified_count
            for image in (frame.visibility, by_cpu)
        )
    # A core that panics raises what is no Exception.
    except BaseException as error:
        words = f"{type(error).__name__}: {' '.join(str(error).split())}"
        return covered, 0, 0, 0, {}, words
    differs = (frame.visibility != by_cpu) & ~(np.isnan(frame.visibility) & np.isnan(by_cpu))
    differing = int(np.count_nonzero(differs))
    return covered, wrong, wrong_on_cpu, differing, dict(frame.timings), None


# --- The report ---


def _text(value: Any) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{name} {text}" for name, text in value.items())
    if isinstance(value, (list, tuple)):
        return ", ".join(map(str, value)) or "none"
    return str(value)


def _table(rows: Sequence[Row]) -> Iterator[str]:
    """A line for each method and kind of light, of all scenes together."""
    if not rows:
        return
    yield ""
    yield "| light | method | covered | misclassified | by the CPU engine | differing | ms |"
    yield "|---|---|---|---|---|---|---|"
    for light, method in dict.fromkeys((row.light, row.method) for row in rows):
        own = [row for row in rows if (row.light, row.method) == (light, method)]
        timings: dict[str, float] = {}
        for row in own:
            for label, ms in row.timings.items():
                timings[label] = timings.get(label, 0.0) + ms
        counts = (
            sum(getattr(row, name) for row in own)
            for name in ("covered", "wrong", "wrong_on_cpu", "differing")
        )
        cells = [light, method, *map(str, counts), milliseconds(timings)]
        yield f"| {' | '.join(cells)} |"
