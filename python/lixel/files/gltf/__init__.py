"""glTF 2: triangles, cameras and lights."""

from __future__ import annotations

from pathlib import Path

from ..contents import Contents
from .document import Document
from .nodes import Matrix
from .scene import read_scene


def read(path: Path, height: int, world_from_file: Matrix) -> Contents:
    """The scene of a .glb or .gltf file; its cameras have images of this height."""
    return read_scene(Document.read(path), height, world_from_file)
