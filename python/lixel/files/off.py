"""OFF, as text."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from .contents import COPY_AGAIN, Contents, FileError, Part
from .polygons import triangulated
from .text import are_numbers, name_of, numbers, plain

_WORD = re.compile(rb"(ST)?C?N?(4?n?)OFF", re.I)


def read(path: Path) -> Contents:
    """The polygons of a file; colours, normals and texture coordinates are left out."""
    rows = [line.partition(b"#")[0].strip() for line in plain(path.read_bytes()).split(b"\n")]
    rows = [row for row in rows if row]
    word = _WORD.match(rows[0]) if rows else None
    if word is None:
        raise FileError("it does not start with the word OFF")
    if word[2]:
        raise FileError("its points are not in three dimensions", "export it as plain OFF")
    # The counts may follow the word on its line.
    rows[0] = rows[0][word.end() :].strip()
    rows = rows[not rows[0] :]
    if not rows or rows[0].upper().startswith(b"BINARY"):
        raise FileError("it is no text, or ends after its first word", "export it as text")
    try:
        vertex_count, face_count = (int(count) for count in rows[0].split()[:2])
    except ValueError:
        raise FileError(f"it must begin with its counts, got {name_of(rows[0][:80])!r}") from None
    if min(vertex_count, face_count) < 0 or vertex_count + face_count > len(rows) - 1:
        raise FileError(
            f"it is cut off: it promises {vertex_count} vertices and {face_count} faces, and has "
            f"{len(rows) - 1} lines for them",
            COPY_AGAIN,
        )
    points = [row.split()[:3] for row in rows[1 : 1 + vertex_count]]
    try:
        positions = numbers([word for point in points for word in point]).reshape(vertex_count, 3)
    except ValueError:
        number = next(i for i, point in enumerate(points) if not are_numbers(point, 3))
        shown = name_of(b" ".join(points[number])[:80])
        raise FileError(
            f"vertex {number}, counted from 0, must have three numbers, got {shown!r}"
        ) from None
    corners, sizes = [], []
    for number, row in enumerate(rows[1 + vertex_count : 1 + vertex_count + face_count]):
        words = row.split()
        try:
            size = int(words[0])
            corner = [int(word) for word in words[1 : 1 + size]]
        except ValueError:
            raise FileError(f"face {number}, counted from 0, must be whole numbers") from None
        if len(corner) != size or not all(0 <= index < vertex_count for index in corner):
            raise FileError(
                f"face {number} must be {size} indices below {vertex_count}, counted from 0, "
                f"got {name_of(row[:80])!r}"
            )
        corners += corner
        sizes.append(size)
    faces, _ = triangulated(positions, np.array(corners, np.int64), np.array(sizes, np.int64))
    return Contents([Part(positions, faces)])
