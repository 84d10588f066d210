"""Section 6.4 of P. Rosen, "Rectilinear texture warping for fast adaptive shadow mapping", I3D
2012: times along a path through a town, Figure 9.

The figure is a curve without numbers. What the text says of it is held against the medians:
cascades are faster than a tessellated warp, and about as fast as one that is not.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ...camera import Camera
from ...compare import compare
from ...frame import frame_parts
from ...methods import Method
from ...reference import reference
from ...scene import Scene
from ...scenes import GENERATORS
from ..report import progress
from ..result_tables import append, resume
from .measuring import QUICK
from .rosen import TOWN
from .tables import method_of

FRAMES = 2400
"""Of the whole path, as in the paper."""

STEP = 8
"""Every eighth of them is rendered."""

COUNTED = 20
"""Frames, evenly along the path, whose misclassified pixels are counted."""


def methods(part: int) -> dict[str, Method]:
    """The curves of Figure 9, and lixel's own; maps are smaller by a part."""
    side = 2048 // part
    return {
        "conventional": method_of("uniform@published", resolution=side),
        "RTW": method_of("rtw@published", resolution=side, tessellation=None),
        "RTW, tessellated, 5 %": method_of("rtw@published", resolution=side, tessellation=0.05),
        "CSM, 4 cascades": method_of("cascades@published", resolution=side),
        "RTW, lixel": method_of("rtw", resolution=side),
        "CSM, lixel": method_of("cascades", resolution=side, layers=4),
    }


def cameras(scene: Scene, size: tuple[int, int], numbers: range) -> Iterator[Camera]:
    """Around the middle of the town, at a height of people on a roof, looking ahead and a little
    down and to the inside."""
    low, high = scene.bounds
    middle, reach = (low + high) / 2, 0.3 * (high - low)[0]
    height = low[1] + 0.4 * (high - low)[1]
    for number in numbers:
        angle = 2 * np.pi * number / FRAMES
        out = np.array([np.cos(angle), 0.0, np.sin(angle)])
        ahead = np.array([-np.sin(angle), -0.25, np.cos(angle)]) - 0.3 * out
        eye = np.array([middle[0], height, middle[2]]) + reach * out
        width, rows = size
        yield Camera.look_at(eye, eye + ahead, yfov=np.radians(60), width=width, height=rows)


def along_a_path(quick: bool = False, folder: Path | None = None) -> list[dict[str, Any]]:
    """Times of each method over the path, and misclassified pixels of some of its frames.

    `quick` renders 12 frames of a quarter of the size, with maps of a quarter of the size. In the
    folder ``rosen-figure-9.parquet`` keeps each frame, and the next call goes on there.
    """
    command = f"lixel lab papers rosen-figure-9{' --quick' if quick else ''}"
    part = QUICK if quick else 1
    scene = GENERATORS[TOWN.generator](**{**TOWN.arguments, **(TOWN.quick if quick else {})})
    light = scene.lights["default"]
    numbers = range(0, FRAMES, FRAMES // 12 if quick else STEP)
    path = None if folder is None else folder / "rosen-figure-9.parquet"
    frames = [] if path is None else resume(path, command)
    done = {int(row["frame"]) for row in frames}
    chosen = methods(part)
    counted = set(numbers[:: max(1, len(numbers) // COUNTED)])
    views = zip(numbers, cameras(scene, (1920 // part, 1080 // part), numbers), strict=True)
    for number, camera in progress([view for view in views if view[0] not in done], "frames"):
        truth = reference(scene, camera, light) if number in counted else None
        measured: list[dict[str, Any]] = []
        for name, method in chosen.items():
            parts = frame_parts(scene, camera, light, method)
            found = None if truth is None else compare(parts.visibility, truth)
            row = {"frame": number, "method": name, "ms": sum(parts.timings.values())}
            measured.append({**row, "misclassified": found and found.misclassified_count})
        if path is not None:
            append(path, command, measured)
        frames += measured
    return summary(frames)


def summary(frames: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """A row for each method; medians over those of a conventional map."""
    rows: list[dict[str, Any]] = []
    for name in dict.fromkeys(row["method"] for row in frames):
        own = [row for row in frames if row["method"] == name]
        ms = [float(row["ms"]) for row in own]
        median = statistics.median(ms)
        # Not a number where a table was read again.
        counts = [float(c) for c in (row["misclassified"] for row in own) if c is not None]
        rows.append(
            {
                "method": name,
                "frames": len(own),
                "least ms": min(ms),
                "median ms": median,
                "largest ms": max(ms),
                "ratio": median / (rows[0]["median ms"] if rows else median),
                "misclassified": int(np.nansum(counts)),
            }
        )
    return rows
