"""Wavefront OBJ."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from .contents import Contents, Faces, FileError, Part, Positions
from .mtl import Materials
from .polygons import triangulated
from .text import name_of, plain
from .words import Places, Words

_FREE_FORM = {b"curv", b"curv2", b"surf", b"cstype"}
_RULES = {
    b"v": "three numbers",
    b"f": "indices of vertices, counted from 1 or back from -1",
}

_MEND = "mend that line, or export it again"


def read(path: Path) -> Contents:
    """The polygons of a file, a part for each object, group and material."""
    return _Reader(plain(path.read_bytes()), path.parent).contents


class _Run(NamedTuple):
    """Polygons that go by one name, up to those of the next run."""

    begin: int
    name: str = ""
    material: str | None = None


class _Reader:
    def __init__(self, text: bytes, folder: Path) -> None:
        self.contents = Contents()
        self._materials = Materials(folder, self.contents.leave_out)
        self._words = _bare(Words(text))
        first = self._words.first
        counts = np.diff(first)
        lines = np.flatnonzero(counts)
        kinds = self._words.are(first[lines], b"v", b"f", b"vt", b"vn")
        self._v, self._f, self._vt, _ = (lines[kind] for kind in kinds)
        self._runs = [_Run(0)]
        self._take_others(lines[~np.any(kinds, axis=0)])
        self._sizes = counts[self._f] - 1
        self._positions = self._points()
        self._corners = self._corners_from_zero()
        self._divide()

    def _take_others(self, lines: Places) -> None:
        """Names, and what is left out."""
        names = {b"o": b"", b"g": b"", b"usemtl": b""}
        polygons_before = np.searchsorted(self._f, lines).tolist()
        for number, before in zip(lines.tolist(), polygons_before, strict=True):
            line = self._words.line(number).strip()
            word = line.split(None, 1)[0]
            if word in names:
                names[word] = line[len(word) :].strip()
                name = name_of(names[b"o"] or names[b"g"])
                if self._runs[-1].begin == before:
                    self._runs.pop()
                self._runs.append(_Run(before, name, name_of(names[b"usemtl"]) or None))
            elif word == b"mtllib":
                self._materials.add(name_of(line[len(word) :].strip()))
            elif word in (b"l", b"p"):
                self.contents.leave_out("points and lines, which cast no shadow")
            elif word in _FREE_FORM:
                self.contents.leave_out("free-form curves and surfaces; export them as polygons")

    def _points(self) -> Positions:
        firsts = self._words.first[self._v]
        try:
            if len(self._v) and (self._words.first[self._v + 1] - firsts).min() < 4:
                raise ValueError
            return self._words.reals((firsts[:, None] + [1, 2, 3]).ravel()).reshape(-1, 3)
        except ValueError:
            raise self._blame(self._v) from None

    def _blame(self, lines: Places) -> FileError:
        """The first of these lines that cannot be read."""
        for number in lines.tolist():
            line = self._words.line(number)
            words = line.split()
            try:
                if words[0] == b"v":
                    _ = float(words[1]), float(words[2]), float(words[3])
                else:
                    _ = [int(word.partition(b"/")[0]) for word in words[1:]]
            except (ValueError, IndexError):
                break
        return FileError(
            f"line {number + 1}: {name_of(words[0])} must be followed by {_RULES[words[0]]}, "
            f"got {name_of(line[:80].strip())!r}",
            _MEND,
        )

    def _fields(self, field: int) -> npt.NDArray[np.int64]:
        """Of each corner what stands after so many slashes."""
        firsts = self._words.first[self._f]
        corners = np.repeat(firsts + 1 - (np.cumsum(self._sizes) - self._sizes), self._sizes)
        return self._words.whole(corners + np.arange(len(corners)), field)

    def _corners_from_zero(self) -> npt.NDArray[np.int64]:
        """Indices that count from 0; FileError where there is no such vertex."""
        try:
            given = self._fields(0)
        except ValueError:
            raise self._blame(self._f) from None
        before = np.repeat(np.searchsorted(self._v, self._f), self._sizes)
        corners = np.where(given > 0, given - 1, before + given)
        bad = np.flatnonzero((corners < 0) | (corners >= len(self._v)) | (given == 0))
        if len(bad):
            line = np.repeat(self._f, self._sizes)[bad[0]]
            raise FileError(
                f"line {line + 1}: f refers to vertex {given[bad[0]]}, and the file has "
                f"{len(self._v)}, counted from 1, {before[bad[0]]} of them before that line",
                _MEND,
            )
        return corners

    def _divide(self) -> None:
        """Into parts, each with the vertices that it uses."""
        if len(self._sizes) and self._sizes.min() < 3:
            self.contents.leave_out("faces of fewer than three corners")
        if len(self._vt) and any(run.material for run in self._runs):
            self._materials.name_missing()
        names = dict.fromkeys(run.material for run in self._runs)
        known = {name: self._materials.of(name) for name in names}
        places = self._texture_places() if any(known.values()) else None
        positions, corners = self._positions, self._corners
        if places is not None:
            # Corners at one point may show different texels.
            positions, corners = positions[corners], np.arange(len(corners))
        faces, owners = triangulated(positions, corners, self._sizes)
        begins = [run.begin for run in self._runs]
        bounds = np.searchsorted(owners, [*begins, len(self._sizes)]).tolist()
        for run, first, last in zip(self._runs, bounds[:-1], bounds[1:], strict=True):
            material, mask = known[run.material], None
            if first < last:
                own = faces[first:last]
                if material is not None and places is not None:
                    mask = material.mask(places[own])
                part = Part(positions, own, run.name, run.material, mask)
                self.contents.parts.append(part)
        if len(self.contents.parts) > 1:
            self.contents.parts = _apart(self.contents.parts, positions, faces)

    def _texture_places(self) -> npt.NDArray[np.float64]:
        """(u, v) of each corner, 0 where it has none."""
        firsts, count = self._words.first[self._vt], len(self._vt)
        known = np.zeros((count + 1, 2))
        try:
            known[1:, 0] = self._words.reals(firsts + 1)
            has_v = self._words.first[self._vt + 1] - firsts > 2
            known[1:, 1][has_v] = self._words.reals(firsts[has_v] + 2)
            given = self._fields(1)
        except (ValueError, IndexError):
            given = np.full(len(self._corners), count + 1)
        before = np.repeat(np.searchsorted(self._vt, self._f), self._sizes)
        rows = np.where(given >= 0, given, before + given + 1)
        wrong = (rows < 0) | (rows > count) | ((rows == 0) & (given < 0))
        if wrong.any() or not np.isfinite(known).all():
            self.contents.leave_out("texture coordinates that are no numbers or not in the file")
            known, rows = np.nan_to_num(known), np.where(wrong, 0, rows)
        return known[rows]


def _apart(parts: list[Part], positions: Positions, faces: Faces) -> list[Part]:
    """Parts that share positions, each with those that it uses, in the order of the file."""
    counts = [len(part.faces) for part in parts]
    numbers = np.repeat(np.arange(len(parts)), counts) * len(positions)
    kept, places = np.unique(faces + numbers[:, None], return_inverse=True)
    begins = np.searchsorted(kept, np.arange(len(parts) + 1) * len(positions))
    places = places.reshape(-1, 3) - np.repeat(begins[:-1], counts)[:, None]
    points = positions[kept % len(positions)]
    bounds, ends = begins.tolist(), np.cumsum(counts).tolist()
    return [
        Part(points[bounds[i] : bounds[i + 1]], places[end - count : end], *part[2:])
        for i, (part, count, end) in enumerate(zip(parts, counts, ends, strict=True))
    ]


def _bare(words: Words) -> Words:
    """Vertices and faces without comments and each on a line of its own; lines keep their numbers.

    Names may hold the signs of both.
    """
    lines = words.lines_with(b"#\\")
    lines = lines[words.first[lines] < words.first[lines + 1]]
    firsts = words.first[lines]
    if not np.any(words.are(firsts, b"v", b"f")):
        return words
    bare, held, empty = list[bytes](), b"", 0
    given = words.text.split(b"\n")[1:]
    for number, line in enumerate(given, 1):
        whole, held = held + line, b""
        if whole.split(None, 1)[:1] in ([b"v"], [b"f"]):
            whole = whole.partition(b"#")[0].rstrip()
            if whole.endswith(b"\\") and number < len(given):
                held = whole[:-1] + b" "
                empty += 1
                continue
        bare += [whole, *empty * [b""]]
        empty = 0
    return Words(b"\n".join(bare))
