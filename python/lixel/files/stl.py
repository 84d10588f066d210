"""STL, binary and as text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .contents import COPY_AGAIN, Contents, FileError, Part, Positions
from .polygons import triangulated
from .text import name_of, numbers, plain

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

# A name runs to the end of its line, or to the first facet where all is on one line.
_NAME = re.compile(rb"solid\b[ \t]*(.*?)[ \t]*(?:(?=[ \t]facet[ \t]+normal)|$)", re.I | re.M)
_BEGIN = re.compile(rb"outer\s+loop", re.I)
_TRIANGLE_END = re.compile(rb"endloop", re.I)
_CORNER = re.compile(rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)\s+|(endloop)", re.I)

_TRIANGLE = "facet normal . . . outer loop" + 3 * " vertex . . ." + " endloop endfacet"
_WORDS = [word.encode() for word in _TRIANGLE.split()]
_COORDINATES = [*range(8, 11), *range(12, 15), *range(16, 19)]
"""Where the coordinates are among the words of a facet with three corners."""


def read(path: Path) -> Contents:
    """The triangles of a file, a part for each solid."""
    content = path.read_bytes()
    triangles = int.from_bytes(content[80:_HEADER], "little")
    exact = len(content) == _HEADER + _RECORD.itemsize * triangles
    # The header of a binary file may begin with any word.
    if not exact and _is_text(content):
        return _text(plain(content))
    return _binary(content, triangles)


def _is_text(content: bytes) -> bool:
    head = plain(content[:4096]).lstrip().lower()
    return head.startswith(b"solid") and b"\0" not in head


def _binary(content: bytes, triangles: int) -> Contents:
    if len(content) < _HEADER:
        raise FileError(
            f"it is cut off: a binary STL file starts with 84 bytes, got {len(content)}",
            COPY_AGAIN,
        )
    there = (len(content) - _HEADER) // _RECORD.itemsize
    if triangles > there:
        raise FileError(
            f"it is cut off, or no STL file: it promises {triangles} triangles, and has {there}",
            COPY_AGAIN,
        )
    records = np.frombuffer(content, _RECORD, triangles, _HEADER)
    corners = records["corners"].astype(np.float64).reshape(-1, 3)
    name = content[:80].partition(b"\0")[0].strip()
    return Contents([_part(corners, np.full(triangles, 3), name)])


def _text(text: bytes) -> Contents:
    names, bodies = list[bytes](), list[list[bytes]]()
    at = 0
    for word, begin, end in _headers(text):
        if bodies:
            bodies[-1].append(text[at:begin])
        if word == b"solid":
            name = _NAME.match(text, begin)
            names.append(name[1] if name else b"")
            bodies.append([])
            end = name.end() if name else end
        at = end
    if bodies:
        bodies[-1].append(text[at:])
    return Contents(
        [_solid(b"\n".join(body), name) for body, name in zip(bodies, names, strict=True)]
    )


def _headers(text: bytes) -> Iterator[tuple[bytes, int, int]]:
    """The lines that begin with `solid` or `endsolid`: that word, its place, the line's end."""
    lowered = text.lower()
    for found in re.finditer(rb"solid\b", lowered):
        line = lowered.rfind(b"\n", 0, found.start()) + 1
        word = lowered[line : found.end()].strip()
        if word in (b"solid", b"endsolid"):
            end = lowered.find(b"\n", line)
            yield word, found.end() - len(word), end if end >= 0 else len(text)


def _solid(text: bytes, name: bytes) -> Part:
    try:
        corners = _triangles(text.lower().split())
        sizes = np.full(0 if corners is None else len(corners) // 9, 3)
        if corners is None:
            corners, sizes = _facets(text, name_of(name))
    except FileError:
        raise
    except ValueError as error:
        raise FileError(f"a vertex of solid {name_of(name)!r} is no number: {error}") from None
    return _part(corners.reshape(-1, 3), sizes, name)


def _triangles(words: list[bytes]) -> npt.NDArray[np.float64] | None:
    """The coordinates of facets, if each is a triangle and nothing stands between them."""
    count, rest = divmod(len(words), len(_WORDS))
    if rest or any(
        words[i :: len(_WORDS)].count(word) != count
        for i, word in enumerate(_WORDS)
        if word != b"."
    ):
        return None
    columns = [numbers(words[i :: len(_WORDS)]) for i in _COORDINATES]
    return np.stack(columns, axis=1).ravel()


def _facets(text: bytes, name: str) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]:
    """The coordinates of facets of any number of corners, and that number for each."""
    begun, ended = len(_BEGIN.findall(text)), len(_TRIANGLE_END.findall(text))
    if begun != ended:
        raise FileError(
            f"it is cut off: solid {name!r} begins {begun} facets and ends {ended}", COPY_AGAIN
        )
    found = _CORNER.findall(text)
    is_end = np.array([bool(end) for *_, end in found], dtype=bool)
    sizes = np.diff(np.flatnonzero(is_end), prepend=-1) - 1
    corners = numbers([word for *corner, end in found if not end for word in corner])
    if 3 * sizes.sum() != len(corners):
        raise FileError(f"solid {name!r} has vertices outside of its facets")
    return corners, sizes


def _part(corners: Positions, sizes: npt.NDArray[np.int64], name: bytes) -> Part:
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=1))
    if len(bad):
        facet = int(np.searchsorted(np.cumsum(sizes), bad[0], side="right"))
        raise FileError(f"a vertex of facet {facet}, counted from 0, is not finite")
    faces, _ = triangulated(corners, np.arange(len(corners)), sizes)
    return Part(corners, faces, name_of(name))
