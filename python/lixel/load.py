"""Scenes from files."""

from __future__ import annotations

import io
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, SupportsIndex

from .arguments import count
from .gltf import Document
from .scene import Scene

if TYPE_CHECKING:
    import trimesh

FORMATS = (".glb", ".gltf", ".obj", ".ply", ".stl")


def load(path: str | PathLike[str], *, height: SupportsIndex = 1080) -> Scene:
    """The triangles of a file, with the cameras and lights of a glTF file.

    Transforms of nodes are applied in float64, and no vertex is merged or moved. Materials,
    normals and transparency are left out; skins and morph targets stay in their rest shape.

    Parameters
    ----------
    path : str or path
        A .glb, .gltf, .obj, .ply or .stl file.
    height : int
        glTF cameras have an aspect ratio but no size: the height of their images in pixels. Where
        a camera has no aspect ratio, 16:9. ``Camera.resized`` changes it later.

    Returns
    -------
    Scene
        `cameras` and `lights` (``KHR_lights_punctual``) go by the name of the node that holds them;
        kinds that lixel does not have are named in `unsupported`.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It has another ending, cannot be read, or holds no triangle; the message names the file.
    """
    file = Path(path)
    height = count("height", height)
    suffix = file.suffix.lower()
    if not file.is_file():
        raise FileNotFoundError(f"path must be a file, got {str(file)!r}, and there is none")
    if suffix not in FORMATS:
        raise ValueError(f"path must end in {', '.join(FORMATS)}, got {str(file)!r}")
    try:
        if suffix in (".glb", ".gltf"):
            document = Document.read(file)
            document.refuse_unread_geometry()
            scene = Scene.from_trimesh(_trimesh(file, document.without_cameras()))
            scene.cameras, scene.lights, scene.unsupported = document.cameras_and_lights(height)
            return scene
        return Scene.from_trimesh(_trimesh(file, None))
    # A broken file fails anywhere in the loaders, with any error there is.
    except MemoryError:
        raise
    except Exception as error:
        raise ValueError(
            f"path must be a {suffix} file with triangles, got {str(file)!r}: "
            f"{error or type(error).__name__}"
        ) from error


def _trimesh(file: Path, content: bytes | None) -> trimesh.Scene:
    import trimesh

    # Nothing is merged or repaired, so that vertices keep their bits.
    if content is None:
        return trimesh.load_scene(file, process=False, skip_materials=True)
    return trimesh.load_scene(
        io.BytesIO(content),
        file_type=file.suffix.lower()[1:],
        resolver=trimesh.resolvers.FilePathResolver(str(file)),
        process=False,
        skip_materials=True,
    )
