"""Measure how time and work grow with triangles and with pixels.

One scene, objects on a floor, in finer and finer triangles, and in larger and larger images: where
time doubles with what doubles, the exponent between two rows is 1. `exact` comes with the warp
that balances its lists, and without.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ..methods import DesiredView, Exact, Method, RayTraced
from . import passes
from .options import add_output, show
from .study import study

METHODS: Mapping[str, Method] = {
    "desired_view": DesiredView(resolution=1024),
    "ray_traced": RayTraced(),
    "exact": Exact(warp="notw"),
    "exact without a warp": Exact(warp="none"),
}

SUBDIVISIONS = (1, 2, 3, 4, 5, 6)
"""Four times as many triangles at each step, 18 thousand to 18 million."""

SIZES = ((640, 400), (1280, 800), (2560, 1600), (3840, 2160))
"""0.26 to 8.3 million pixels."""

SUBDIVISION, SIZE = 4, (1280, 800)
"""What stays while the other grows."""

COUNTERS = {
    "items": f"stats.{passes.CASTER_TESTS}.work_items",
    "tests": f"stats.{passes.CASTER_TESTS}.tests",
    "longest list": f"stats.{passes.RECEIVER_LISTS}.longest_list",
    "longest walk": f"stats.{passes.SHADOW_RAYS}.longest_walk",
}


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab growth`."""
    parser.add_argument("--repeats", type=int, default=3, metavar="N", help="timed frames")
    add_output(parser, "write a table, .csv or .parquet")
    parser.add_argument("--journal", type=Path, metavar="FILE", help="go on there after a stop")


def run(options: argparse.Namespace) -> None:
    """Measure, print and save both series."""
    show(options, measure(options.repeats, options.journal))


def measure(repeats: int = 3, journal: Path | None = None) -> list[dict[str, Any]]:
    """Times and counters of both series: a row for each step of a series (``grows``: triangles or
    pixels) and method.

    ``gpu_ms`` is the median of `repeats` timed frames, in milliseconds; ``exponent`` is that of the
    time since the step before; then come ``misclassified`` pixels and counters. The journal is that
    of `study`.
    """
    series = {
        "triangles": [(step, SIZE) for step in SUBDIVISIONS],
        "pixels": [(SUBDIVISION, size) for size in SIZES],
    }
    rows: list[dict[str, Any]] = []
    for grows, steps in series.items():
        before: dict[str, dict[str, Any]] = {}
        for step, size in steps:
            found = study(
                {"objects_on_floor": ("objects_on_floor", {"subdivisions": step})},
                methods=list(METHODS.values()),
                size=size,
                repeats=repeats,
                journal=journal,
            )
            for name, (_, case) in zip(METHODS, found.iterrows(), strict=True):
                row = {
                    "grows": grows,
                    "method": name,
                    "triangles": case["triangles"],
                    "pixels": case["width"] * case["height"],
                    "gpu_ms": case["gpu_ms"],
                    "exponent": math.nan,
                    "misclassified": case["misclassified_count"],
                    **{key: case.get(column, math.nan) for key, column in COUNTERS.items()},
                }
                if name in before:
                    times, steps_of = (row[of] / before[name][of] for of in ("gpu_ms", grows))
                    row["exponent"] = math.log(times) / math.log(steps_of)
                before[name] = row
                rows.append(row)
    return rows
