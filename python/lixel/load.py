"""Scenes from files."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Literal, SupportsIndex, TypeAlias

import numpy as np
import numpy.typing as npt

from .arguments import count, did_you_mean
from .files import dae, gltf, obj, off, others, ply, stl
from .files.contents import EXPORT_AGAIN, Contents, FileError, Part, words_of
from .scene import Scene, joined, labels_of_parts

Up: TypeAlias = Literal["y", "z"]

_READERS = {
    ".obj": obj.read,
    ".ply": ply.read,
    ".stl": stl.read,
    ".off": off.read,
    ".dae": dae.read,
}

FORMATS = (".glb", ".gltf", *_READERS, *others.ENDINGS)

_WORLD_FROM_FILE: dict[str, npt.NDArray[np.float64]] = {
    "y": np.eye(4),
    # A turn about x by -90 degrees, in whole numbers, so that coordinates keep their bits.
    "z": np.array([[1, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]], dtype=np.float64),
}


def load(path: str | PathLike[str], *, height: SupportsIndex = 1080, up: Up = "y") -> Scene:
    """The triangles of a file, with the cameras and lights of a glTF file.

    Transforms of nodes are applied in float64, and no vertex is merged or moved. Skins and morph
    targets are in the pose of the file's own joints and weights; hidden nodes are left out.
    Files may come from strangers: nothing outside the file's own folder is opened.

    Parameters
    ----------
    path : str or path
        A .glb, .gltf, .obj, .ply, .stl, .off or .dae file, or another that trimesh reads: .3mf,
        .3dxml, .xaml, .step. What needs more packages says so.
    height : int
        glTF cameras have an aspect ratio but no size: the height of their images in pixels. Where
        a camera has no aspect ratio, 16:9. ``Camera.resized`` changes it later.
    up : str
        ``"z"`` for a file whose Z axis points up, as CAD and maps have it: everything is turned
        so that Y points up. It is (x, z, -y) of the file's (x, y, z). A .dae file says itself
        which axis that is.

    Returns
    -------
    Scene
        `cameras` and `lights` (``KHR_lights_punctual``) go by the name of the node that holds them.
        What the file holds and lixel does not take is named in `unsupported`, and in a warning.

    Raises
    ------
    FileNotFoundError
        There is no such file.
    ValueError
        It has another ending, cannot be read, or holds no triangle; the message names the file.
    """
    file = Path(path)
    height = count("height", height)
    if up not in _WORLD_FROM_FILE:
        raise ValueError(f"up must be 'y' or 'z', got {up!r}")
    suffix = file.suffix.lower()
    if not file.is_file():
        raise FileNotFoundError(_missing(file))
    if suffix not in FORMATS:
        raise ValueError(
            f"path must end in {', '.join(FORMATS)}, got {str(file)!r}; export it as one of them"
        )
    # A broken file fails anywhere in the loaders, with any error there is.
    try:
        contents = _read(file, height, up)
        parts = _shown(contents)
        scene = joined([(p.positions, p.faces) for p in parts], [p.mask for p in parts])
    except MemoryError:
        raise
    except Exception as error:
        remedy = "" if isinstance(error, FileError) else f"; {EXPORT_AGAIN}, or as .glb"
        raise ValueError(
            f"path must be a {suffix} file with triangles, got {str(file)!r}: "
            f"{words_of(error)}{remedy}"
        ) from error
    counts = [len(part.faces) for part in parts]
    scene.objects, scene.object_id = labels_of_parts([part.name for part in parts], counts)
    materials = ["" if part.material is None else str(part.material) for part in parts]
    scene.materials, scene.material_id = labels_of_parts(materials, counts)
    scene.cameras, scene.lights = contents.cameras, contents.lights
    scene.name = file.name
    scene.unsupported = tuple(contents.unsupported)
    if scene.unsupported:
        warnings.warn(f"{file.name} is read without {_listed(scene.unsupported)}", stacklevel=2)
    return scene


def _missing(file: Path) -> str:
    if file.is_dir():
        return f"path must be a file, got the folder {str(file)!r}; name a file in it"
    beside = sorted(path.name for path in file.parent.glob("*") if path.suffix.lower() in FORMATS)
    remedy = did_you_mean(file.name, beside) or "; check its name and folder"
    return f"path must be a file, got {str(file)!r}, and there is none{remedy}"


def _read(file: Path, height: int, up: Up) -> Contents:
    if file.suffix.lower() in (".glb", ".gltf"):
        return gltf.read(file, height, _WORLD_FROM_FILE[up])
    contents = _READERS.get(file.suffix.lower(), others.read)(file)
    if "z" in (up, contents.up):
        turn = _WORLD_FROM_FILE["z"][:3, :3].T
        contents.parts = [p._replace(positions=p.positions @ turn) for p in contents.parts]
    return contents


def _shown(contents: Contents) -> list[Part]:
    parts = [part for part in contents.parts if len(part.faces)]
    if not parts:
        why = f" that can be read: {_listed(contents.unsupported)}" if contents.unsupported else ""
        raise FileError(
            f"it must hold at least one triangle, and has none{why}", "export its surfaces, too"
        )
    return parts


def _listed(words: Sequence[str], most: int = 5) -> str:
    more = f"; and {len(words) - most} more (scene.unsupported)" if len(words) > most else ""
    return "; ".join(words[:most]) + more
