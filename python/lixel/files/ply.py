"""PLY, binary and as text."""

from __future__ import annotations

import re
import struct
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from .contents import COPY_AGAIN, Contents, FileError, Part
from .polygons import triangulated
from .text import are_numbers, name_of, numbers, plain

_TYPES = {
    "char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4",
    "float": "f4", "double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2",
    "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_HEADER = re.compile(rb"ply[ \t]*(\r\n|\r|\n).*?end_header[ \t]*(\r\n|\r|\n|$)", re.S)

Array = npt.NDArray[Any]


@dataclass
class _Property:
    name: str
    type: str
    count_type: str = ""  # of a list


@dataclass
class _Element:
    name: str
    count: int
    properties: list[_Property] = field(default_factory=list)

    @cached_property
    def lists(self) -> list[str]:
        return [p.name for p in self.properties if p.count_type]


def read(path: Path) -> Contents:
    """The polygons and triangle strips of a file."""
    content = path.read_bytes()
    header = _HEADER.match(content)
    if header is None:
        raise FileError("it has no PLY header, from a line 'ply' to a line 'end_header'")
    order, elements = _elements(header[0].decode("latin-1"))
    # A header of CR alone ends with one byte, even if the data begin with a line feed.
    start = header.end() - (header[1] == b"\r" and header[2] == b"\r\n")
    rest = content[start:]
    body = _Binary(rest, order) if order else _Text(rest, elements)
    columns = {element.name: body.rows(element) for element in elements}
    return _contents(columns)


def _elements(header: str) -> tuple[str, list[_Element]]:
    """The order of bytes, empty for text, and what the header declares."""
    order, elements = None, list[_Element]()
    for line in header.splitlines()[1:]:
        match line.split():
            case ["format", name, *_] if name in _FORMATS:
                order = _FORMATS[name]
            case ["element", name, number] if number.isdecimal():
                elements.append(_Element(name, int(number)))
            case ["property", "list", count, kind, name] if (
                elements and kind in _TYPES and _TYPES.get(count, "f")[0] != "f"
            ):
                elements[-1].properties.append(_Property(name, _TYPES[kind], _TYPES[count]))
            case ["property", kind, name] if elements and kind in _TYPES:
                elements[-1].properties.append(_Property(name, _TYPES[kind]))
            # Blender 2.4 leaves out the word `comment`.
            case ["comment" | "obj_info" | "end_header" | "Created", *_] | []:
                pass
            case _:
                raise FileError(f"its header has a line that cannot be understood: {line[:80]!r}")
    if order is None:
        raise FileError(f"its header must name a format, one of {', '.join(_FORMATS)}")
    return order, elements


class _Body:
    """Rows of numbers one after another; `_at` counts units: bytes, or words of a text."""

    _at = 0
    _units = 0

    def rows(self, element: _Element) -> dict[str, Any]:
        """The columns of an element by name: an array each, and for a list (values, sizes)."""
        sizes = [self._size(p.count_type or p.type) for p in element.properties]
        left = self._units - self._at
        if element.count * sum(sizes) > left:
            raise FileError(
                f"it is cut off: it promises {element.count} rows of {element.name!r}, and there "
                f"is not enough for more than {left // sum(sizes)}",
                COPY_AGAIN,
            )
        if not element.count or not sizes:
            return {}
        if not element.lists:
            table = self._table(element, {}, element.count)
            self._at += element.count * sum(sizes)
            return table
        return self._uniform(element) or self._mixed(element, element.count)

    def _uniform(self, element: _Element) -> dict[str, Any] | None:
        """Rows whose lists are as long as those of the first, as nearly all files have them."""
        start = self._at
        lengths = {name: len(values) for name, (values, _) in self._mixed(element, 1).items()}
        row = self._at - start
        self._at = start
        if row * element.count > self._units - start:
            return None
        table = self._table(element, lengths, element.count)
        for name, length in lengths.items():
            if not (table[name + "#"] == length).all():
                return None
            sizes = np.full(element.count, length, dtype=np.int64)
            table[name] = (table[name].reshape(-1), sizes)
            del table[name + "#"]
        self._at += row * element.count
        return table

    def _mixed(self, element: _Element, count: int) -> dict[str, Any]:
        """Row by row; of the columns only the lists."""
        found: dict[str, tuple[list[int], list[int]]] = {n: ([], []) for n in element.lists}
        steps = [
            (p.name, self._size(p.count_type), p.count_type, self._size(p.type))
            if p.count_type
            else (None, self._size(p.type), "", 0)
            for p in element.properties
        ]
        at = self._at
        for row in range(count):
            for name, size, count_type, item in steps:
                if name is None:
                    at += size
                    continue
                length = self._whole(at, count_type) if at + size <= self._units else 0
                begin = at + size
                at = begin + length * item
                if length < 0 or at > self._units:
                    raise FileError(
                        f"it is cut off: row {row} of {element.count} of {element.name!r} has a "
                        f"list of {length}, which is not there",
                        COPY_AGAIN,
                    )
                found[name][0].append(begin)
                found[name][1].append(length)
            if at > self._units:
                raise FileError(f"it is cut off in row {row} of {element.name!r}", COPY_AGAIN)
        self._at = at
        kinds = {p.name: p.type for p in element.properties}
        return {
            name: (self._gathered(begins, lengths, kinds[name]), np.array(lengths, dtype=np.int64))
            for name, (begins, lengths) in found.items()
        }

    def _gathered(self, begins: list[int], lengths: list[int], kind: str) -> Array:
        """The values of lists that begin at these units."""
        first, sizes = np.array(begins, dtype=np.int64), np.array(lengths, dtype=np.int64)
        within = np.arange(sizes.sum()) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        return self._values(np.repeat(first, sizes) + within * self._size(kind), kind)

    def _size(self, kind: str) -> int:
        raise NotImplementedError

    def _whole(self, at: int, kind: str) -> int:
        raise NotImplementedError

    def _values(self, places: npt.NDArray[np.int64], kind: str) -> Array:
        raise NotImplementedError

    def _table(self, element: _Element, lengths: dict[str, int], count: int) -> dict[str, Any]:
        """Rows of equal length as columns; `name#` is the column of a list's lengths."""
        raise NotImplementedError


class _Binary(_Body):
    def __init__(self, content: bytes, order: str) -> None:
        self._content, self._order, self._units = content, order, len(content)

    def _size(self, kind: str) -> int:
        return int(kind[1])

    def _whole(self, at: int, kind: str) -> int:
        (value,) = struct.unpack_from(self._order + np.dtype(kind).char, self._content, at)
        return int(value)

    def _values(self, places: npt.NDArray[np.int64], kind: str) -> Array:
        size = self._size(kind)
        every = np.frombuffer(self._content, np.uint8)
        found = every[places[:, None] + np.arange(size)]
        return np.ascontiguousarray(found).view(self._order + kind)[:, 0]

    def _table(self, element: _Element, lengths: dict[str, int], count: int) -> dict[str, Any]:
        fields: list[Any] = []
        for p in element.properties:
            if p.count_type:
                fields.append((p.name + "#", self._order + p.count_type))
                fields.append((p.name, self._order + p.type, (lengths[p.name],)))
            else:
                fields.append((p.name, self._order + p.type))
        rows = np.frombuffer(self._content, np.dtype(fields), count, self._at)
        return {name: rows[name] for name in rows.dtype.names or ()}


class _Text(_Body):
    def __init__(self, content: bytes, elements: list[_Element]) -> None:
        rows = [row for line in plain(content).split(b"\n") if (row := line.split())]
        if len(rows) == sum(element.count for element in elements):
            # Some programs write more into a line than they declare.
            kinds = (element for element in elements for _ in range(element.count))
            rows = [_declared(row, kind) for row, kind in zip(rows, kinds, strict=True)]
        words = [word for row in rows for word in row]
        try:
            self._numbers = numbers(words)
        except ValueError as error:
            number = next(i for i, held in enumerate(rows) if not are_numbers(held))
            shown = name_of(b" ".join(rows[number])[:80])
            raise FileError(
                f"row {number} after its header, counted from 0, holds what is no number: {shown!r}"
            ) from error
        self._units = len(words)

    def _size(self, kind: str) -> int:
        return 1

    def _whole(self, at: int, kind: str) -> int:
        value = float(self._numbers[at])
        return int(value) if value.is_integer() else -1

    def _values(self, places: npt.NDArray[np.int64], kind: str) -> Array:
        return self._numbers[places]

    def _table(self, element: _Element, lengths: dict[str, int], count: int) -> dict[str, Any]:
        columns: dict[str, Any] = {}
        names: list[tuple[str, int]] = []
        for p in element.properties:
            names += (
                [(p.name + "#", 0), (p.name, lengths[p.name])] if p.count_type else [(p.name, 0)]
            )
        width = sum(length if name in lengths else 1 for name, length in names)
        rows = self._numbers[self._at : self._at + width * count].reshape(count, width)
        at = 0
        for name, length in names:
            columns[name] = rows[:, at : at + length] if name in lengths else rows[:, at]
            at += length if name in lengths else 1
        return columns


def _declared(row: list[bytes], element: _Element) -> list[bytes]:
    """As many words of a line as the header declares."""
    if not element.lists:
        return row[: len(element.properties)]
    at = 0
    for p in element.properties:
        length = row[at] if p.count_type and at < len(row) else b""
        at += 1 + (int(length) if length.isdigit() else 0)
    return row[:at]


def _contents(columns: dict[str, dict[str, Any]]) -> Contents:
    vertices = columns.get("vertex", {})
    if not {"x", "y", "z"} <= set(vertices):
        raise FileError("it has no vertices with x, y and z")
    positions = np.stack([vertices[axis].astype(np.float64) for axis in "xyz"], axis=1)
    contents = Contents()
    for element in ("face", "tristrips"):
        lists = {n: v for n, v in columns.get(element, {}).items() if isinstance(v, tuple)}
        if not lists:
            continue
        # Usually vertex_indices or vertex_index; other lists hold texture coordinates and the like.
        values, sizes = lists[min(lists, key=lambda name: not name.startswith("vert"))]
        corners = _indices(values, sizes, len(positions), element)
        if element == "face":
            faces, _ = triangulated(positions, corners, sizes)
        else:
            faces = _strips(corners, sizes)
        contents.parts.append(Part(positions, faces))
    if not contents.parts:
        contents.leave_out(f"a cloud of {len(positions)} points without faces")
    return contents


def _indices(
    values: Array, sizes: npt.NDArray[np.int64], count: int, element: str
) -> npt.NDArray[np.int64]:
    """Rows of vertices; strips may begin anew at -1."""
    least = -1 if element == "tristrips" else 0
    with np.errstate(invalid="ignore"):
        corners = np.asarray(values).astype(np.int64)
    bad = np.flatnonzero((corners < least) | (corners >= count) | (corners != values))
    if len(bad):
        row = int(np.searchsorted(np.cumsum(sizes), bad[0], side="right"))
        raise FileError(
            f"row {row} of {element!r}, counted from 0, has index {values[bad[0]]}, and there are "
            f"{count} vertices, counted from 0"
        )
    return corners


def _strips(corners: npt.NDArray[np.int64], sizes: npt.NDArray[np.int64]) -> npt.NDArray[np.int64]:
    """The triangles of strips; each strip, and each -1, begins anew."""
    begins = np.cumsum(sizes) - sizes
    corners = np.insert(corners, begins, -1)
    triples = np.stack([corners[:-2], corners[1:-1], corners[2:]], axis=1)
    # Which triangle it is since the last beginning: every other one is turned back.
    places = np.arange(len(corners))
    last = np.maximum.accumulate(np.where(corners < 0, places, 0))
    odd = (places[:-2] - last[:-2]) % 2 == 0
    triples[odd] = triples[odd][:, [1, 0, 2]]
    return triples[(triples >= 0).all(axis=1)]
