"""List what each method leaves out, and prove that it changes no pixel.

Each view is rendered twice, so that what is kept from frame to frame is left out as well, and once
more with nothing left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterable, Sequence
from typing import Any

from ..frame import FrameParts, frame_parts
from ..light import DirectionalLight
from . import passes
from .hard_views import PLAIN, Case, made, methods_for
from .options import add_methods, add_output, show
from .report import progress
from .views import View


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab culling`."""
    add_methods(parser)
    add_output(parser, "write a table, .csv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Measure, save and print the table."""
    show(options, measure(options.method))


def measure(methods: Iterable[str] | None = None, repeats: int = 3) -> list[dict[str, Any]]:
    """What each method leaves out because it cannot change the picture: a row for each view and
    method.

    `rasterized`, `culled_outside` and `culled_by_depth` count triangles of all layers; `items` are
    small triangles and tiles of large ones, and `whole_items` those with nothing left out. Then
    come `layers` and `skipped_layers`, the `skipped` stages, `settled` receivers, which `exact`
    need not list, milliseconds of the fastest of `repeats` frames, `gpu_ms` and `whole_ms`, and
    whether the pictures are the `same`.
    """
    names = None if methods is None else list(methods)
    below = Case("", "from below the floor", _lit_from_below)
    views = [*(Case("", lit_by, plain) for lit_by, plain in PLAIN.items()), below]
    rows = []
    for case in progress(views, "views"):
        for method in methods_for(case, names):
            view = made(case.make)
            # A map that nobody wants to see is not drawn whole.
            frame_parts(*view, method)
            frames = [frame_parts(*view, method) for _ in range(repeats)]
            whole = [frame_parts(*view, method, culling=False) for _ in range(repeats)]
            rows.append({"view": case.name, "method": method.name, **_skipped(frames, whole)})
    return rows


def _lit_from_below() -> View:
    scene, camera, _ = PLAIN["directional light"]()
    return scene, camera, DirectionalLight((0.1, 1.0, 0.2))


def _skipped(frames: Sequence[FrameParts], whole: Sequence[FrameParts]) -> dict[str, Any]:
    stats = frames[-1].stats
    map_stats, whole_map = (f.stats.get(passes.SHADOW_MAP, {}) for f in (frames[-1], whole[-1]))
    lists = (f.stats.get(passes.RECEIVER_LISTS, {}) for f in (frames[-1], whole[-1]))
    listed = [of_frame.get("receivers") for of_frame in lists]
    return {
        "rasterized": map_stats.get("rasterized"),
        "culled_outside": map_stats.get("culled_outside"),
        "culled_by_depth": map_stats.get("culled_by_depth"),
        "items": map_stats.get("work_items"),
        "whole_items": whole_map.get("work_items"),
        "layers": stats["layers"],
        "skipped_layers": stats["skipped_layers"],
        "skipped": ", ".join(stats["skipped"]),
        "settled": None if None in listed else listed[1] - listed[0],
        "gpu_ms": min(sum(frame.timings.values()) for frame in frames),
        "whole_ms": min(sum(frame.timings.values()) for frame in whole),
        "same": frames[-1].visibility.tobytes() == whole[-1].visibility.tobytes(),
    }
