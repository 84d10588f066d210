"""The triangles of one primitive of a mesh, in the space of the mesh."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..contents import Faces, Positions
from .accessors import Array, accessor
from .compression import DRACO, DracoMesh
from .document import Document, Object, extension_of

_TRIANGLES, _STRIP, _FAN = 4, 5, 6
MODES_WITHOUT_TRIANGLES = (0, 1, 2, 3)
"""Points and lines."""


class Primitive:
    """Positions, triangles and attributes of a primitive."""

    def __init__(self, document: Document, entry: Object, weights: list[float]) -> None:
        self.entry = entry
        self._document = document
        compressed = extension_of(entry, DRACO)
        self._draco: DracoMesh | None = None
        if compressed is not None:
            content, _ = document.view(compressed["bufferView"])
            self._draco = DracoMesh(bytes(content), compressed["attributes"])
        self.positions = self._positions(weights)
        self.faces = self._faces()

    def attribute(self, name: str) -> Array | None:
        """The values of an attribute, one row for each vertex; None where it has none."""
        values = self._draco.attribute(name) if self._draco else None
        index = self.entry["attributes"].get(name)
        if index is None:
            return values
        if values is None:
            return accessor(self._document, index)
        promised = self._document.item("accessors", index)["count"]
        if promised != len(values):
            raise ValueError(f"its Draco data have {len(values)} of {promised} {name} values")
        return values

    def _positions(self, weights: list[float]) -> Positions:
        """The vertices, moved by the targets whose weight is not zero."""
        values = self.attribute("POSITION")
        if values is None:
            raise ValueError("it has no POSITION")
        positions = np.array(values, dtype=np.float64)
        if positions.ndim != 2 or positions.shape[1] != 3:
            raise ValueError(f"its POSITION must have 3 components, got {positions.shape[1]}")
        for target, weight in zip(self.entry.get("targets", []), weights, strict=False):
            if weight and "POSITION" in target:
                offsets = accessor(self._document, target["POSITION"])
                if offsets.shape != positions.shape:
                    raise ValueError(
                        f"a morph target has {len(offsets)} vertices, and it has {len(positions)}"
                    )
                positions += weight * offsets
        bad = np.flatnonzero(~np.isfinite(positions).all(axis=1))
        if len(bad):
            raise ValueError(f"vertex {bad[0]} is not finite: {positions[bad[0]].tolist()}")
        return positions

    def _faces(self) -> Faces:
        count = len(self.positions)
        if self._draco:
            faces = self._draco.faces
            promised = self.entry.get("indices")
            if promised is not None:
                corners = self._document.item("accessors", promised)["count"]
                if corners != faces.size:
                    raise ValueError(f"its Draco data have {faces.size} of {corners} indices")
        else:
            corners = np.arange(count)
            if "indices" in self.entry:
                values = accessor(self._document, self.entry["indices"])
                if values.dtype.kind != "u" or values.shape[1] != 1:
                    raise ValueError("its indices must be unsigned whole numbers")
                corners = values[:, 0].astype(np.int64)
            faces = triangles_of(corners, self.entry.get("mode", _TRIANGLES))
        if faces.size and faces.max() >= count:
            raise ValueError(f"it has index {faces.max()}, and {count} vertices, counted from 0")
        return faces


def triangles_of(corners: npt.NDArray[np.int64], mode: Any) -> Faces:
    """Corners one after another as triangles, (m, 3), each turned as the standard says."""
    if mode == _TRIANGLES:
        return corners[: len(corners) // 3 * 3].reshape(-1, 3)
    steps = np.arange(max(0, len(corners) - 2))
    if mode == _STRIP:
        # Every other triangle is turned back.
        odd = steps % 2
        return np.stack([corners[steps], corners[steps + 1 + odd], corners[steps + 2 - odd]], 1)
    if mode == _FAN:
        if not len(steps):
            return np.zeros((0, 3), dtype=np.int64)
        first = np.full(len(steps), corners[0])
        return np.stack([corners[steps + 1], corners[steps + 2], first], 1)
    raise ValueError(f"its mode must be a whole number from 0 to 6, got {mode!r}")
