"""Wavefront OBJ."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .contents import Contents, Faces, FileError, Part
from .polygons import triangulated
from .text import name_of, plain

_FREE_FORM = {b"curv", b"curv2", b"surf", b"cstype"}
_RULES = {
    b"v": "three numbers",
    b"f": "indices of vertices, counted from 1 or back from -1",
}

_NUMERIC = ([b"v"], [b"f"])


def read(path: Path) -> Contents:
    """The polygons of a file, a part for each object, group and material."""
    return _Reader().read(path.read_bytes())


class _Reader:
    def __init__(self) -> None:
        self._coordinates: list[float] = []
        # Of the polygons: corners one after another, how many, line, and vertices before it.
        self._corners: list[int] = []
        self._sizes: list[int] = []
        self._lines: list[int] = []
        self._before: list[int] = []
        self._names = {b"o": b"", b"g": b"", b"usemtl": b""}
        # The polygon at which each run begins, its name and its material.
        self._runs: list[tuple[int, str, str | None]] = [(0, "", None)]
        self._contents = Contents()

    def read(self, content: bytes) -> Contents:
        lines = plain(content).split(b"\n")
        coordinates, corners, held = self._coordinates, self._corners, b""
        for number, line in enumerate(lines, 1):
            if held or b"\\" in line or b"#" in line:
                line, held = held + line, b""
                # Names may hold both signs.
                if line.split(None, 1)[:1] in _NUMERIC:
                    line = line.partition(b"#")[0].rstrip()
                    if line.endswith(b"\\") and number < len(lines):
                        held = line[:-1] + b" "
                        continue
            words = line.split()
            if not words:
                continue
            try:
                if words[0] == b"v":
                    coordinates += float(words[1]), float(words[2]), float(words[3])
                elif words[0] == b"f":
                    corners += [int(word.partition(b"/")[0]) for word in words[1:]]
                    self._sizes.append(len(words) - 1)
                    self._lines.append(number)
                    self._before.append(len(coordinates) // 3)
                else:
                    self._take(words[0], line)
            except (ValueError, IndexError) as error:
                raise FileError(
                    f"line {number}: {name_of(words[0])} must be followed by {_RULES[words[0]]}, "
                    f"got {name_of(line[:80].strip())!r}"
                ) from error
        self._divide()
        return self._contents

    def _take(self, word: bytes, line: bytes) -> None:
        if word in self._names:
            self._names[word] = line.strip()[len(word) :].strip()
            self._begin_run()
        elif word in (b"l", b"p"):
            self._contents.leave_out("points and lines, which cast no shadow")
        elif word in _FREE_FORM:
            self._contents.leave_out("free-form curves and surfaces; export them as polygons")

    def _begin_run(self) -> None:
        name = self._names[b"o"] or self._names[b"g"]
        run = (len(self._sizes), name_of(name), name_of(self._names[b"usemtl"]) or None)
        if self._runs[-1][0] == run[0]:
            self._runs.pop()
        self._runs.append(run)

    def _corners_from_zero(self, vertex_count: int, sizes: Faces) -> Faces:
        """Indices that count from 0; FileError where there is no such vertex."""
        given = np.array(self._corners, dtype=np.int64)
        before = np.repeat(np.array(self._before, dtype=np.int64), sizes)
        corners = np.where(given > 0, given - 1, before + given)
        bad = np.flatnonzero((corners < 0) | (corners >= vertex_count) | (given == 0))
        if len(bad):
            line = np.repeat(np.array(self._lines, dtype=np.int64), sizes)[bad[0]]
            raise FileError(
                f"line {line}: f refers to vertex {given[bad[0]]}, and the file has "
                f"{vertex_count}, counted from 1, {before[bad[0]]} of them before that line"
            )
        return corners

    def _divide(self) -> None:
        """Into parts, each with the vertices that it uses."""
        positions = np.array(self._coordinates, dtype=np.float64).reshape(-1, 3)
        sizes = np.array(self._sizes, dtype=np.int64)
        if len(sizes) and sizes.min() < 3:
            self._contents.leave_out("faces of fewer than three corners")
        corners = self._corners_from_zero(len(positions), sizes)
        faces, owners = triangulated(positions, corners, sizes)
        starts = [start for start, _, _ in self._runs]
        bounds = np.searchsorted(owners, [*starts, len(sizes)])
        for (_, name, material), first, last in zip(
            self._runs, bounds[:-1], bounds[1:], strict=True
        ):
            if first < last:
                used, places = positions, faces[first:last]
                if len(self._runs) > 1:
                    kept, places = np.unique(places, return_inverse=True)
                    used, places = positions[kept], places.reshape(-1, 3)
                self._contents.parts.append(Part(used, places, name, material))
