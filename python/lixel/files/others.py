"""Formats that trimesh reads."""

from __future__ import annotations

import re
import zipfile
from collections import defaultdict
from pathlib import Path

import numpy as np

from ..scene import meshes_of, moved
from .contents import Contents, FileError, Part, Room
from .xml import refuse_entities

ENDINGS = (".3mf", ".3dxml", ".xaml", ".step", ".stp")

_MOST_BYTES, _MOST_RATIO = 1 << 28, 100
"""An archive may unpack to so many bytes, or to so many times its own."""

_MOST_COPIES = 1 << 20


def read(path: Path) -> Contents:
    """The meshes of a file, where its nodes stand."""
    import trimesh

    kind = path.suffix.lower()[1:]
    if kind not in trimesh.available_formats():
        package = "cascadio" if kind in ("step", "stp") else "'lixel[formats]'"
        raise FileError(
            f"trimesh reads .{kind} files with packages that are not installed",
            f"pip install {package}, or export it as .glb",
        )
    if zipfile.is_zipfile(path):
        _check_archive(path)
    # Nothing is merged or repaired, so that vertices keep their bits. No reference is followed.
    with path.open("rb") as file:
        scene = trimesh.load_scene(file, file_type=kind, process=False, skip_materials=True)
    contents, room = Contents(), Room(path.stat().st_size)
    for name, mesh, world_from_mesh in meshes_of(scene):
        room.take(mesh.faces, mesh.vertices)
        positions = moved(world_from_mesh, np.asarray(mesh.vertices, np.float64))
        contents.parts.append(Part(positions, np.asarray(mesh.faces, np.int64), name))
    return contents


def _check_archive(path: Path) -> None:
    """FileError where an archive would unpack to more than it may, in bytes or in copies."""
    with zipfile.ZipFile(path) as archive:
        size = sum(entry.file_size for entry in archive.infolist())
        if size > max(_MOST_BYTES, _MOST_RATIO * path.stat().st_size):
            raise FileError(f"it unpacks to {size:,} bytes", "split it, or export it as .glb")
        held: dict[bytes, list[bytes]] = defaultdict(list)
        for name in archive.namelist():
            if name.lower().endswith((".model", ".xml", ".3dxml", ".rels")):
                content = archive.read(name)
                refuse_entities(content)
                for model_object in re.findall(
                    rb"<(?:\w+:)?object\b.*?</(?:\w+:)?object>", content, re.S
                ):
                    identifier = re.search(rb'\bid\s*=\s*["\']([^"\']*)', model_object)
                    inner = re.findall(rb'\bobjectid\s*=\s*["\']([^"\']*)', model_object)
                    held[identifier[1] if identifier else b""] += inner
    _copies(held)


def _copies(held: dict[bytes, list[bytes]]) -> None:
    """FileError where objects hold one another in a circle or more often than is allowed."""
    counts: dict[bytes, int] = {}
    pending = list(held)
    open_now: set[bytes] = set()
    while pending:
        name = pending[-1]
        missing = [inner for inner in held[name] if inner in held and inner not in counts]
        if name in counts or not missing:
            counts[name] = 1 + sum(counts.get(inner, 1) for inner in held[name])
            open_now.discard(pending.pop())
            if counts[name] > _MOST_COPIES:
                raise FileError(
                    f"its objects hold more than {_MOST_COPIES:,} copies of others", "split it"
                )
        elif name in open_now:
            raise FileError("its objects hold one another in a circle")
        else:
            open_now.add(name)
            pending += missing
