"""Compare an image of visibility with another one, or with the reference of a scene."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..compare import compare
from ..image_files import (
    VISIBILITY_ENDINGS,
    camera_of,
    light_of,
    read_metadata,
    read_visibility,
    save_picture,
    view_record,
)
from ..reference import Reference, reference
from .report import table, waiting
from .views import scene_and_views


def compare_image(options: argparse.Namespace) -> None:
    """Print what `lixel.compare` says of two files, and write a picture into the folder of `-o`."""
    image = read_visibility(options.scene)
    truth: Reference | npt.NDArray[np.float32]
    if options.truth.lower().endswith(VISIBILITY_ENDINGS):
        truth = read_visibility(options.truth)
        made_by = {}
    else:
        truth = _reference(options, image.shape)
        made_by = view_record(truth.scene, truth.camera, truth.light)
    found = compare(image, truth, other_surfaces=options.other_surfaces)
    print(found)
    print(table([{"measure": name, "value": _text(v)} for name, v in found.as_dict().items()]))
    if options.output is not None:
        options.output.mkdir(parents=True, exist_ok=True)
        picture = options.output / f"{Path(options.scene).stem}-misclassified.png"
        made_by |= {"command": options.line, "misclassified": found.misclassified_count}
        save_picture(picture, found.picture(), made_by)
        print(f"misclassified pixels in red: {picture}")


def _reference(options: argparse.Namespace, shape: tuple[int, ...]) -> Reference:
    """That of the scene, seen and lit as the image's file says where the options say nothing."""
    scene, views = scene_and_views(options.truth, options.views, options.up)
    record = _record(options.scene)
    height, width = shape
    from_file = options.camera is None and options.views is None and "camera" in record
    camera = camera_of(record) if from_file else views.camera(options.camera, scene)
    from_file = options.light is None and options.views is None and "light" in record
    light = light_of(record) if from_file else views.light(options.light)
    if (camera.width, camera.height) != (width, height):
        camera = camera.resized(width, height)
    with waiting("reference: casting rays on the CPU"):
        truth = reference(scene, camera, light)
    ours = view_record(scene, camera, light)["scene"]["sha256"]
    if record.get("scene", {}).get("sha256") not in (None, ours):
        words = f"{options.scene} was made of another scene than {options.truth}"
        warnings.warn(words, stacklevel=2)
    return truth


def _text(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:,}" if isinstance(value, int) else f"{value:.6g}"


def _record(path: str) -> dict[str, Any]:
    """What the file says of itself; nothing where it is not lixel's."""
    try:
        return read_metadata(path)
    except ValueError:
        return {}
