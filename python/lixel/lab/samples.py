"""The samples of a study: timed frames of its cases, and the journal that keeps them."""

from __future__ import annotations

import json
import time
import traceback
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from datetime import datetime, timezone
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from .._core import DeviceError
from ..camera import Camera
from ..compare import compare
from ..frame import Frame, frame_parts, render
from ..light import Light
from ..methods import Method, OwnMethod
from ..reference import Reference, reference
from ..scene import Scene
from .cases import Case, Source, made_scene
from .timing import moved_by_a_hair

Record: TypeAlias = dict[str, Any]


class Journal:
    """The samples measured so far, and a file that outlives the process."""

    def __init__(self, path: Path | None, wanted: set[str]) -> None:
        self.path = path
        self.records: dict[str, dict[int, Record]] = defaultdict(dict)
        if path is None or not path.exists():
            return
        content = path.read_bytes()
        # A process that was killed may have left half a line.
        whole = content[: content.rfind(b"\n") + 1]
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                record = json.loads(line)
                case, turn = record["case"], record["turn"]
            except (ValueError, KeyError, TypeError):
                raise ValueError(
                    f"journal must hold samples of a study, got {str(path)!r}, line {number}"
                ) from None
            if case in wanted:
                self.records[case][turn] = record
        if len(whole) < len(content):
            with path.open("r+b") as file:
                file.truncate(len(whole))

    def has(self, case: str, turn: int) -> bool:
        found = self.records.get(case, {})
        # A case that cannot be rendered has no further samples.
        return turn in found or any("error" in record for record in found.values())

    def of(self, case: str) -> list[Record]:
        return [record for _, record in sorted(self.records.get(case, {}).items())]

    def add(self, records: Iterable[Record]) -> None:
        records = list(records)
        for record in records:
            self.records[record["case"]][record["turn"]] = record
        if self.path is not None:
            # What a device could not do today it may do tomorrow.
            lines = [json.dumps(r) + "\n" for r in records if not r.get("transient")]
            with self.path.open("a", encoding="utf-8") as file:
                file.write("".join(lines))


def sample(case: Case, turn: int) -> Record:
    """One timed frame of a case; the first sample also compares it with the reference."""
    record: Record = {"case": case.key, "turn": turn}
    try:
        loaded = _loaded(case.source)
        if turn == 0:
            record["comparison"] = _compared(case, loaded.scene)
        elif case.key not in loaded.rendered:
            frame_parts(loaded.scene, case.camera, case.light, case.method, device=case.device)
        loaded.rendered.add(case.key)
        # Elsewhere for each case, too: a camera that was just seen would cost nothing.
        random = np.random.default_rng((turn, int(case.key, 16)))
        camera = moved_by_a_hair(case.camera, loaded.scene, random)
        start = time.perf_counter()
        parts = frame_parts(loaded.scene, camera, case.light, case.method, device=case.device)
        record["wall_ms"] = 1e3 * (time.perf_counter() - start)
        record["pass_ms"] = parts.timings
        if turn == 0:
            record["stats"] = parts.stats
        adapter = parts.adapter
        record["date"] = datetime.now(timezone.utc).date().isoformat()
        record["device"], record["driver"] = adapter.get("name", ""), adapter.get("driver", "")
    except (ValueError, DeviceError) as error:
        record["error"] = f"{type(error).__name__}: {error}{_place(case.method, error)}"
        record["transient"] = isinstance(error, DeviceError)
    return record


def _place(method: Method, error: Exception) -> str:
    """Where a method of one's own raised an error."""
    if not isinstance(method, OwnMethod):
        return ""
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f" ({last.filename}, line {last.lineno}, in {last.name})"


@dataclass(frozen=True)
class _LoadedScene:
    """A scene, and the cases that were rendered since it was made: their pipelines are compiled,
    their memory is allocated."""

    scene: Scene
    rendered: set[str] = field(default_factory=set)


# A study goes through the scenes one by one, and through the views of each in the same order.
@lru_cache(maxsize=2)
def _loaded(source: Source) -> _LoadedScene:
    return _LoadedScene(made_scene(source.origin))


@lru_cache(maxsize=2)
def _truth(source: Source, camera: Camera, light: Light) -> Reference:
    return reference(_loaded(source).scene, camera, light)


def _compared(case: Case, scene: Scene) -> Record:
    frame = render(scene, case.camera, case.light, case.method, device=case.device)
    truth = _truth(case.source, case.camera, case.light)
    aliasing = frame.aliasing_error[truth.facing]
    return {
        **compare(frame, truth).as_dict(),
        "aliasing_largest": frame.largest_aliasing_error,
        **_aliasing(aliasing[~np.isnan(aliasing)]),
        **_max_effective_resolution(frame),
        # The core stores depth and triangle of a texel in 64 bits.
        "map_bytes": 8 * frame.shadow_map.size + frame.warp_map.nbytes,
    }


def _max_effective_resolution(frame: Frame) -> dict[str, float | None]:
    """None where a method has no map."""
    return {
        f"max_effective_resolution_{axis}": float(texels) if np.isfinite(texels) else None
        for axis, texels in zip("xy", frame.max_effective_resolution, strict=True)
    }


def _aliasing(errors: npt.NDArray[np.float32]) -> dict[str, float | None]:
    if not errors.size:
        return dict.fromkeys(("aliasing_median", "aliasing_p95", "aliasing_above_1"))
    # By rank, not interpolated: errors may be infinite.
    median, p95 = np.percentile(errors, (50, 95), method="higher")
    return {
        "aliasing_median": float(median),
        "aliasing_p95": float(p95),
        "aliasing_above_1": float(np.mean(errors > 1.0)),
    }
