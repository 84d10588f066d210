"""COLLADA, by pycollada."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..arguments import needs
from ..scene import moved
from .contents import Contents, FileError, Part, Room, words_of
from .polygons import triangulated
from .xml import refuse_entities

_MOST_NODES = 1 << 16


def read(path: Path) -> Contents:
    """The polygons of a file's scene; `up` is what the file says."""
    collada = needs("collada", "formats")
    content = path.read_bytes()
    refuse_entities(content)
    document = collada.Collada(
        io.BytesIO(content), ignore=[collada.common.DaeError], aux_file_loader=_no_file
    )
    contents = Contents(up="z" if document.assetInfo.upaxis == "Z_UP" else "y")
    if document.scene is None:
        raise FileError("it has no scene")
    room, known = Room(len(content)), dict[int, Part]()
    for geometry, name, world_from_node in _geometries(document.scene.nodes, collada, contents):
        for primitive in geometry.primitives:
            try:
                if id(primitive) not in known:
                    known[id(primitive)] = _part(primitive, name)
            except (ValueError, IndexError, AttributeError, TypeError) as error:
                contents.leave_out(f"a primitive of {name!r}: {words_of(error)}")
                continue
            part = known[id(primitive)]
            room.take(part.faces, part.positions)
            positions = moved(world_from_node, part.positions)
            contents.parts.append(part._replace(positions=positions))
    for broken in document.errors:
        contents.leave_out(str(broken))
    return contents


def _no_file(name: str) -> bytes:
    raise OSError(f"{name} is not read")


def _geometries(
    nodes: list[Any], collada: Any, contents: Contents
) -> Iterator[tuple[Any, str, np.typing.NDArray[np.float64]]]:
    """Geometries of a scene, the name of each, and world from geometry."""
    kinds = collada.scene
    pending = [(node, np.eye(4)) for node in reversed(nodes)]
    seen = 0
    while pending:
        node, world = pending.pop()
        seen += 1
        if seen > _MOST_NODES:
            raise FileError(f"its nodes refer to one another more than {_MOST_NODES:,} times")
        if isinstance(node, kinds.GeometryNode):
            yield node.geometry, str(node.geometry.name or node.geometry.id), world
        elif isinstance(node, kinds.ControllerNode):
            contents.leave_out("skins and morphs; export the posed mesh")
        elif isinstance(node, kinds.NodeNode):
            pending.append((node.node, world @ np.asarray(node.matrix, np.float64)))
        elif isinstance(node, kinds.Node):
            world = world @ np.asarray(node.matrix, np.float64)
            pending += [(child, world) for child in reversed(node.children)]


def _part(primitive: Any, name: str) -> Part:
    if not hasattr(primitive, "vertex_index") or primitive.vertex is None:
        raise ValueError("it has no triangles")
    index = np.asarray(primitive.vertex_index, dtype=np.int64)
    # Triangles come in rows of three; polygons one after another, with their sizes.
    if hasattr(primitive, "vcounts"):
        sizes = np.asarray(primitive.vcounts, dtype=np.int64)
    elif index.ndim == 2 and index.shape[1] == 3:
        sizes = np.full(len(index), 3)
    else:
        raise ValueError("points and lines, which cast no shadow")
    index = index.reshape(-1)
    positions = np.asarray(primitive.vertex, dtype=np.float64)
    if index.size and not (index.min() >= 0 and index.max() < len(positions)):
        raise ValueError(f"it has an index beyond its {len(positions)} vertices")
    if index.size != sizes.sum():
        raise ValueError(f"it has {index.size} of {sizes.sum()} indices")
    faces, _ = triangulated(positions, index, sizes)
    return Part(positions, faces, name, primitive.material)
