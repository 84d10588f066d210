"""STL, binary and as text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .contents import Contents, FileError, Part, Positions
from .polygons import triangulated
from .text import name_of, numbers, plain

_HEADER = 84
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])

# A name runs to the end of its line, or to the first facet where all is on one line.
_SOLID = re.compile(rb"^[ \t]*solid\b(.*?)(?=[ \t]facet[ \t]+normal|$)", re.I | re.M)
_END = re.compile(rb"^[ \t]*endsolid\b.*?$", re.I | re.M)
_BEGIN = re.compile(rb"outer\s+loop", re.I)
_TRIANGLE_END = re.compile(rb"endloop", re.I)
_THREE_NUMBERS = rb"vertex\s+(\S+)\s+(\S+)\s+(\S+)\s+"
_TRIANGLE = re.compile(rb"loop\s+" + 3 * _THREE_NUMBERS + rb"endloop", re.I)
_CORNER = re.compile(_THREE_NUMBERS + rb"|(endloop)", re.I)


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
            f"it is cut off: a binary STL file starts with 84 bytes, got {len(content)}"
        )
    there = (len(content) - _HEADER) // _RECORD.itemsize
    if triangles > there:
        raise FileError(
            f"it is cut off, or no STL file: it promises {triangles} triangles, and has {there}"
        )
    records = np.frombuffer(content, _RECORD, triangles, _HEADER)
    corners = records["corners"].astype(np.float64).reshape(-1, 3)
    name = content[:80].partition(b"\0")[0].strip()
    return Contents([_part(corners, np.full(triangles, 3), name)])


def _text(text: bytes) -> Contents:
    text = _END.sub(b"", text)
    solids = list(_SOLID.finditer(text))
    ends = [solid.start() for solid in solids[1:]] + [len(text)]
    return Contents(
        [
            _solid(text[solid.end() : end], solid[1].strip())
            for solid, end in zip(solids, ends, strict=True)
        ]
    )


def _solid(text: bytes, name: bytes) -> Part:
    begun, ended = len(_BEGIN.findall(text)), len(_TRIANGLE_END.findall(text))
    if begun != ended:
        raise FileError(
            f"it is cut off: solid {name_of(name)!r} begins {begun} facets and ends {ended}"
        )
    found = _TRIANGLE.findall(text)
    sizes = np.full(len(found), 3)
    if len(found) != begun:
        # Some facets are no triangles.
        found = _CORNER.findall(text)
        is_end = np.array([bool(end) for *_, end in found], dtype=bool)
        found = [corner for *corner, end in found if not end]
        sizes = np.diff(np.flatnonzero(is_end), prepend=-1) - 1
    try:
        corners = numbers([word for corners in found for word in corners]).reshape(-1, 3)
    except ValueError as error:
        raise FileError(f"a vertex of solid {name_of(name)!r} is no number: {error}") from None
    if sizes.sum() != len(corners):
        raise FileError(f"solid {name_of(name)!r} has vertices outside of its facets")
    return _part(corners, sizes, name)


def _part(corners: Positions, sizes: np.typing.NDArray[np.int64], name: bytes) -> Part:
    bad = np.flatnonzero(~np.isfinite(corners).all(axis=1))
    if len(bad):
        facet = int(np.searchsorted(np.cumsum(sizes), bad[0], side="right"))
        raise FileError(f"a vertex of facet {facet}, counted from 0, is not finite")
    faces, _ = triangulated(corners, np.arange(len(corners)), sizes)
    return Part(corners, faces, name_of(name))
