"""Images of shadows as files, and what made them, which is written inside.

=============  =======================================================================
``.png``       a picture to look at
``.mask.png``  `visibility` in 16 bits of grey: 0 no surface, 1 shadow, 65535 lit
``.npy``       `visibility` alone, float32: 1 lit, 0 shadow, NaN no surface
``.npz``       `visibility`, `triangle_id`, `object_id`, `depth` and `normal`
``.exr``       the same as channels ``Y``, ``triangle``, ``object``, ``Z`` and ``N.X`` to
               ``N.Z``, depths in float32; the extra ``exr``
=============  =======================================================================

All but .npy hold the scene, the camera, the light, the method, the device and lixel's version, as
JSON: in a text chunk of PNG named ``lixel``, in an array ``lixel`` of .npz, and in an attribute
``lixel`` of EXR.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import needs
from .camera import Camera
from .light import LIGHTS, Light
from .methods import Method
from .pictures import display
from .scene import Scene

MASK = ".mask.png"
ENDINGS = (".png", ".npy", ".npz", ".exr")
"""Of files that a frame writes; a mask ends in .png, too."""

VISIBILITY_ENDINGS = (MASK, ".npy", ".npz", ".exr")
"""Of files that `read_visibility` reads."""

KEY = "lixel"
"""Under which the record stands in a file."""

_MASK_LIT = 65535
_MASK_SHADOW = 1

Layers = Mapping[str, npt.NDArray[Any]]


# --- Write ---


def save(
    path: str | Path,
    picture: Callable[[], npt.NDArray[np.uint8]],
    layers: Callable[[], Layers],
    made_by: Callable[[], Mapping[str, Any]],
) -> None:
    """Write a picture or layers, whichever the ending names, and what made them; only what is
    written is asked for."""
    target = Path(path)
    match MASK if is_mask(target) else target.suffix.lower():
        case ".png":
            save_picture(target, picture(), made_by())
        case ".mask.png":
            mask = mask_of(layers()["visibility"])
            target.write_bytes(display.png_bytes(mask, chunks(made_by())))
        case ".npy":
            np.save(target, layers()["visibility"])
        case ".npz":
            with target.open("wb") as file:  # to a name numpy might add an ending
                arrays = {**layers(), KEY: np.array(_text(made_by()))}
                np.savez_compressed(file, **arrays)  # type: ignore[arg-type]
        case ".exr":
            _save_exr(target, layers(), _text(made_by()))
        case _:
            words = f"{', '.join(ENDINGS[:-1])} or {ENDINGS[-1]}"
            raise ValueError(f"path must end in {words}, got {str(path)!r}")


def save_picture(
    path: str | Path, picture: npt.NDArray[np.uint8], made_by: Mapping[str, Any]
) -> None:
    """Write a picture to a .png file, and into it what made it."""
    if Path(path).suffix.lower() != ".png":
        raise ValueError(f"path must end in .png, got {str(path)!r}")
    Path(path).write_bytes(display.png_bytes(picture, chunks(made_by)))


def is_mask(path: str | Path) -> bool:
    """Whether a file is a mask, by its name."""
    return Path(path).name.lower().endswith(MASK)


def mask_of(visibility: npt.NDArray[np.float32]) -> npt.NDArray[np.uint16]:
    """(H, W) uint16: 0 no surface, 1 shadow, 65535 lit, partly lit in between."""
    steps = np.nan_to_num(visibility) * (_MASK_LIT - _MASK_SHADOW) + _MASK_SHADOW
    return np.where(np.isnan(visibility), 0, np.rint(steps)).astype(np.uint16)


def chunks(made_by: Mapping[str, Any]) -> dict[str, str]:
    """Text chunks of a PNG file."""
    return {"Software": f"lixel {_core.__version__}", KEY: _text(made_by)}


def _text(made_by: Mapping[str, Any]) -> str:
    return json.dumps({"lixel": _core.__version__, **made_by})


def _save_exr(target: Path, layers: Layers, record: str) -> None:
    exr = needs("OpenEXR", "exr")
    channels = {"Y": layers["visibility"]}
    if "depth" in layers:
        channels["Z"] = layers["depth"].astype(np.float32)
        channels |= {f"N.{axis}": layers["normal"][..., i] for i, axis in enumerate("XYZ")}
    for name in ("triangle", "object"):
        # Unsigned: -1, no surface, is 4294967295.
        channels[name] = layers[f"{name}_id"].astype(np.uint32)
    header = {"compression": exr.ZIP_COMPRESSION, "type": exr.scanlineimage, KEY: record}
    whole = {name: np.ascontiguousarray(values) for name, values in channels.items()}
    with exr.File(header, whole) as file:
        file.write(str(target))


# --- Read ---


def read_visibility(path: str | Path) -> npt.NDArray[np.float32]:
    """The visibility image in a file that lixel wrote, or in an array that numpy did.

    Parameters
    ----------
    path : path
        A .npy, .npz, .exr or .mask.png file. In a .npz file it is the array ``visibility``, or the
        only one; in an .exr file the channel ``Y``.

    Returns
    -------
    (H, W) float32
        1 lit, 0 in shadow, NaN where no surface is seen.

    Raises
    ------
    ValueError
        Another ending, or a file without such an image; the message names it.
    """
    target = Path(path)
    if not str(target.name).lower().endswith(VISIBILITY_ENDINGS):
        words = f"{', '.join(VISIBILITY_ENDINGS[:-1])} or {VISIBILITY_ENDINGS[-1]}"
        raise ValueError(f"path must end in {words}, got {str(path)!r}")
    if is_mask(target):
        return _visibility_of_mask(target)
    ending = target.suffix.lower()
    if ending == ".exr":
        found = _exr_channels(target).get("Y")
    else:
        try:
            loaded = np.load(target, allow_pickle=False)
        except (ValueError, EOFError) as error:
            raise ValueError(f"path must be an array, got {str(path)!r}: {error}") from None
        found = loaded
        if ending == ".npz":
            with loaded:
                names = [name for name in loaded.files if name != KEY]
                name = names[0] if len(names) == 1 else "visibility"
                found = loaded[name] if name in names else None
    if found is None or found.ndim != 2 or found.dtype.kind not in "fiub":
        what = "none" if found is None else f"{found.dtype} {found.shape}"
        raise ValueError(f"path must hold an image (H, W) of visibility, got {what} in {target}")
    return np.asarray(found, np.float32)


def read_metadata(path: str | Path) -> dict[str, Any]:
    """What made a file that lixel wrote: scene, camera, light, method, device, version.

    Parameters
    ----------
    path : path
        A .png, .npz or .exr file.

    Returns
    -------
    dict
        ``lixel`` is the version. A picture of a frame has ``scene`` (name, number of triangles, and
        the SHA-256 of its geometry), ``camera``, ``light`` and ``method`` by their parameters, and
        ``device`` with its ``driver``; a plot has the ``command`` that drew it.

    Raises
    ------
    ValueError
        Another ending, or a file without metadata of lixel; the message names it.
    """
    target = Path(path)
    match target.suffix.lower():
        case ".png":
            from PIL import Image

            with Image.open(target) as image:
                image.load()  # chunks may follow the pixels
                found = image.info.get(KEY)
        case ".npz":
            with np.load(target, allow_pickle=False) as arrays:
                found = str(arrays[KEY]) if KEY in arrays.files else None
        case ".exr":
            with needs("OpenEXR", "exr").File(str(target), header_only=True) as file:
                found = file.header().get(KEY)
        case _:
            raise ValueError(f"path must end in .png, .npz or .exr, got {str(path)!r}")
    record = None if found is None else json.loads(found)
    if not isinstance(record, dict):
        raise ValueError(
            f"path must be a file that lixel wrote, got {str(path)!r} without metadata"
        )
    return record


def _visibility_of_mask(target: Path) -> npt.NDArray[np.float32]:
    from PIL import Image

    with Image.open(target) as image:
        steps = np.asarray(image)
    if steps.dtype not in (np.uint16, np.int32) or steps.ndim != 2:
        raise ValueError(f"path must hold 16 bits of grey, got {steps.dtype} in {target}")
    share = (steps.astype(np.float64) - _MASK_SHADOW) / (_MASK_LIT - _MASK_SHADOW)
    return np.where(steps == 0, np.nan, share).astype(np.float32)


def _exr_channels(target: Path) -> dict[str, npt.NDArray[Any]]:
    with needs("OpenEXR", "exr").File(str(target), separate_channels=True) as file:
        return {name: channel.pixels for name, channel in file.channels().items()}


# --- What made an image, in words and numbers that JSON has ---


def view_record(
    scene: Scene, camera: Camera, light: Light, *, is_current: bool = True
) -> dict[str, Any]:
    """Scene, camera and light by what makes their shadows; without the geometry's hash where the
    scene has moved since."""
    digest = hashlib.sha256()
    for part in scene._bytes() if is_current else ():
        digest.update(part)
    of_camera = {field.name: _plain(getattr(camera, field.name)) for field in fields(camera)}
    if math.isinf(camera.zfar):
        del of_camera["zfar"]
    return {
        "scene": {
            "name": scene.name,
            "triangles": scene.triangle_count,
            "sha256": digest.hexdigest() if is_current else None,
        },
        "camera": {name: value for name, value in of_camera.items() if value is not None},
        "light": light_record(light),
    }


def light_record(light: Light) -> dict[str, Any]:
    """A light by its kind and parameters."""
    return {
        "kind": type(light).__name__,
        **dict(zip(light._fields, light._values(), strict=True)),
        **light._options(),
    }


def method_record(method: Method) -> dict[str, Any]:
    """A method by its name and parameters."""
    return {
        "name": method.spelling,
        "parameters": {name: _plain(value) for name, value in method.parameters().items()},
    }


def camera_of(record: Mapping[str, Any]) -> Camera:
    """The camera of a file's metadata."""
    given = dict(record["camera"])
    return Camera(given.pop("pose"), **given)


def light_of(record: Mapping[str, Any]) -> Light:
    """The light of a file's metadata."""
    given = dict(record["light"])
    kinds = {kind.__name__: kind for kind in LIGHTS}
    return kinds[given.pop("kind")](**given)


def _plain(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return repr(value)
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, np.ndarray):
        return value.tolist() if value.size <= 64 else f"array {value.shape} {value.dtype}"
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if is_dataclass(value):
        return {name: _plain(item) for name, item in vars(value).items()}
    return type(value).__name__
