"""The nodes of a glTF scene, and where they stand."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..contents import FileError, words_of
from .document import Document, Object, extension_of

Matrix = npt.NDArray[np.float64]


class Node(NamedTuple):
    """A node of the scene: its number, what the file says of it, world from node, and whether it is
    shown."""

    number: int
    entry: Object
    world_from_node: Matrix
    visible: bool

    @property
    def name(self) -> str:
        """Its name, or its index in words."""
        return str(self.entry.get("name") or f"node {self.number}")


def nodes_of(document: Document, world_from_file: Matrix) -> Iterator[Node]:
    """Every node of the file's scene, parents first."""
    pending = [(root, world_from_file, True) for root in reversed(_roots(document))]
    seen: set[int] = set()
    while pending:
        index, world_from_parent, visible = pending.pop()
        try:
            entry = document.item("nodes", index)
        except ValueError as error:
            raise FileError(f"its scene is broken: {error}") from None
        if index in seen:
            raise FileError(f"node {index} has two parents or is its own ancestor")
        seen.add(index)
        try:
            world_from_node = world_from_parent @ parent_from_node(entry)
            shown = extension_of(entry, "KHR_node_visibility") or {}
            visible = visible and shown.get("visible", True) is not False
        except (ValueError, TypeError) as error:
            raise FileError(f"node {index} has no transform: {words_of(error)}") from None
        yield Node(index, entry, world_from_node, visible)
        children = entry.get("children", [])
        if not isinstance(children, list):
            raise FileError(f"the children of node {index} must be an array")
        pending += [(child, world_from_node, visible) for child in reversed(children)]


def _roots(document: Document) -> list[int]:
    scenes = document.items("scenes")
    if not scenes:
        # A library of nodes: those that no other holds.
        entries = [e for e in document.items("nodes") if isinstance(e, dict)]
        held = {child for e in entries for child in e.get("children", [])}
        return [i for i in range(len(document.items("nodes"))) if i not in held]
    try:
        roots = document.item("scenes", document.tree.get("scene", 0)).get("nodes", [])
    except ValueError as error:
        raise FileError(f"it has no scene to show: {error}") from None
    return list(roots)


def parent_from_node(entry: Object) -> Matrix:
    """The transform of a node."""
    if "matrix" in entry:  # columns after one another
        return np.asarray(np.reshape(entry["matrix"], (4, 4)).T, dtype=np.float64)
    return composed(
        entry.get("translation", (0, 0, 0)),
        entry.get("rotation", (0, 0, 0, 1)),
        entry.get("scale", (1, 1, 1)),
    )


def composed(translation: npt.ArrayLike, rotation: npt.ArrayLike, scale: npt.ArrayLike) -> Matrix:
    """Scale, then rotate by a quaternion x, y, z, w, then move."""
    matrix = np.eye(4)
    x, y, z, w = np.asarray(rotation, dtype=np.float64)
    square = x * x + y * y + z * z + w * w
    # Divided by the square of the norm: a quaternion that went through float32 is not a unit one.
    s = 2.0 / square if square > 0.0 else 0.0
    matrix[:3, :3] = [
        [1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)],
        [s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)],
        [s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)],
    ]
    matrix[:3, :3] *= np.asarray(scale, dtype=np.float64).reshape(3)
    matrix[:3, 3] = translation
    return matrix
