"""Arrays of a glTF file: plain, strided, normalized, sparse, or in a compressed buffer view."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from .compression import MESHOPT, decompressed
from .document import Document, Object, extension_of, whole

Array = npt.NDArray[Any]

_TYPES = {5120: "i1", 5121: "u1", 5122: "i2", 5123: "u2", 5125: "u4", 5126: "f4", 5130: "f8"}
_COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}

_FEWEST_ZEROS = 1 << 20
"""An array of zeros takes no byte of the file: it has at most as many as the file has bytes, and
may always have this many."""

_MOST_KEPT = 8
"""Decompressed buffer views that are kept, the last ones: primitives share those of their
attributes and indices. A bound, since a few bytes may stand for many."""


def accessor(document: Document, index: Any) -> Array:
    """The values of an accessor, (count, components): integers as they are, or, where it says that
    they are normalized, as fractions."""
    entry = document.item("accessors", index)
    count = whole(entry["count"], "an accessor's count")
    shape = (count, _COMPONENTS[_known(entry["type"], _COMPONENTS, "type")])
    dtype = _dtype(entry["componentType"])
    if "bufferView" in entry:
        start = whole(entry.get("byteOffset", 0), "an accessor's byteOffset")
        values = _elements(document, entry["bufferView"], start, shape, dtype)
    else:
        if count > max(_FEWEST_ZEROS, document.size):
            raise ValueError(f"an accessor has {count} elements and no bytes in the file for them")
        values = np.zeros(shape, dtype)
    if "sparse" in entry:
        values = _replaced(document, entry["sparse"], values)
    return _fractions(values) if entry.get("normalized") is True else values


def _known(key: Any, known: dict[Any, Any], what: str) -> Any:
    if not isinstance(key, (int, str)) or key not in known:
        raise ValueError(f"an accessor's {what} must be one of {', '.join(map(str, known))}")
    return key


def _dtype(code: Any) -> np.dtype[Any]:
    return np.dtype("<" + _TYPES[_known(code, _TYPES, "componentType")])


def _elements(
    document: Document, view: Any, start: int, shape: tuple[int, int], dtype: np.dtype[Any]
) -> Array:
    """Elements of a buffer view, which lie `byteStride` apart where it has one."""
    content, entry = _content(document, view)
    size = shape[1] * dtype.itemsize
    stride = whole(entry.get("byteStride", 0), "a buffer view's byteStride") or size
    end = start + stride * (shape[0] - 1) + size if shape[0] else 0
    if end > len(content):
        raise ValueError(
            f"an accessor ends at byte {end} of buffer view {view}, which has {len(content)} bytes"
        )
    elements: Array = np.ndarray(shape, dtype, content, start, (stride, dtype.itemsize))
    return elements


def _content(document: Document, index: Any) -> tuple[bytes | memoryview, Object]:
    """The bytes of a buffer view, decompressed."""
    view = document.item("bufferViews", index)
    for name in MESHOPT:
        compressed = extension_of(view, name)
        if compressed is not None:
            kept = document.decompressed
            if index not in kept:
                if len(kept) == _MOST_KEPT:
                    del kept[next(iter(kept))]
                content = document.slice(compressed, f"buffer view {index}")
                kept[index] = decompressed(bytes(content), compressed, name)
            return kept[index], view
    return document.view(index)


def _replaced(document: Document, sparse: Object, values: Array) -> Array:
    """An array with some of its elements replaced."""
    count = whole(sparse["count"], "the count of a sparse accessor")
    if count > len(values):
        raise ValueError(f"a sparse accessor replaces {count} of {len(values)} elements")
    places, new = sparse["indices"], sparse["values"]
    rows = _elements(
        document,
        places["bufferView"],
        whole(places.get("byteOffset", 0), "the byteOffset of sparse indices"),
        (count, 1),
        _dtype(places["componentType"]),
    )[:, 0]
    if count and rows.max() >= len(values):
        raise ValueError(
            f"a sparse accessor replaces element {rows.max()} of {len(values)}, counted from 0"
        )
    values = values.copy()
    values[rows] = _elements(
        document,
        new["bufferView"],
        whole(new.get("byteOffset", 0), "the byteOffset of sparse values"),
        (count, values.shape[1]),
        values.dtype,
    )
    return values


def _fractions(values: Array) -> Array:
    if values.dtype.kind == "f":
        return values
    fractions = values / float(np.iinfo(values.dtype).max)
    return np.asarray(np.maximum(fractions, -1.0))
