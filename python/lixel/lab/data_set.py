"""Many pictures of a scene with masks of their shadows, as data sets have them."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from .._core import __version__
from ..camera import Camera
from ..frame import Frame, render
from ..image_files import light_of, light_record
from ..light import Light
from ..methods import Method
from ..scene import Scene
from .report import progress
from .views import Views

HELP = """orbit:N: the camera once around the scene in N pictures; light:N: the light once around
it; views: each camera of the scene or of --views in each light. -o is a folder then: a picture and
a mask for each, and coco.json with the shadow on each object"""


class Step(NamedTuple):
    """What one picture is of."""

    name: str
    camera: Camera
    light: Light


def write_sequence(
    kind: str, scene: Scene, views: Views, start: tuple[Camera, Light], method: Method, folder: Path
) -> int:
    """Write the pictures, the masks and coco.json; how many pictures there are."""
    steps = list(steps_of(kind, scene, views, *start))
    folder.mkdir(parents=True, exist_ok=True)
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for step in progress(steps, "pictures"):
        frame = render(scene, step.camera, step.light, method)
        frame.save(folder / f"{step.name}.png")
        frame.save(folder / f"{step.name}.mask.png")
        height, width = frame.visibility.shape
        image = {"id": len(images) + 1, "file_name": f"{step.name}.png"}
        images.append({**image, "width": width, "height": height})
        for annotation in shadows_of(frame):
            numbers = {"id": len(annotations) + 1, "image_id": image["id"]}
            annotations.append({**numbers, **annotation})
    content = {
        "info": {"description": "shadows on objects", "contributor": f"lixel {__version__}"},
        "images": images,
        "categories": [
            {"id": number + 1, "name": name, "supercategory": "shadow"}
            for number, name in enumerate(scene.objects)
        ],
        "annotations": annotations,
    }
    (folder / "coco.json").write_text(json.dumps(content), encoding="utf-8")
    return len(steps)


def steps_of(kind: str, scene: Scene, views: Views, camera: Camera, light: Light) -> Iterator[Step]:
    """The pictures that `HELP` says; ValueError for another kind."""
    if kind == "views":
        lights = views.lights or {"light": light}
        for camera_name, seen in (views.cameras or {"camera": camera}).items():
            for light_name, lit in lights.items():
                name = re.sub(r"[^\w.-]+", "-", f"{camera_name}-{light_name}")
                yield Step(name, seen.resized(camera.width, camera.height), lit)
        return
    found = re.fullmatch(r"(orbit|light):([1-9]\d{0,5})", kind)
    if found is None:
        raise ValueError(f"sequence must be orbit:N, light:N or views, got {kind!r}")
    middle = scene.bounds.mean(axis=0)
    count = int(found[2])
    for i in range(count):
        turn = _turn(2.0 * math.pi * i / count, middle)
        name = f"{i:0{max(4, len(str(count - 1)))}d}"
        if found[1] == "orbit":
            yield Step(name, camera.posed(turn @ camera.pose), light)
        else:
            yield Step(name, camera, _turned(light, turn))


def shadows_of(frame: Frame) -> Iterator[dict[str, Any]]:
    """COCO's annotations: for each object that is seen, its pixels that are in shadow."""
    is_dark = frame.visibility < 0.5  # False where no surface is seen
    object_id = frame.object_id
    for number in np.unique(object_id[is_dark]).tolist():
        mask = is_dark & (object_id == number)
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        left, top = int(columns[0]), int(rows[0])
        yield {
            "category_id": number + 1,
            "iscrowd": 1,  # of any shape, and with holes
            "area": int(np.count_nonzero(mask)),
            "bbox": [left, top, int(columns[-1]) - left + 1, int(rows[-1]) - top + 1],
            "segmentation": {"size": list(mask.shape), "counts": run_lengths(mask)},
        }


def run_lengths(mask: npt.NDArray[np.bool_]) -> list[int]:
    """COCO's: of pixels outside and inside in turn, down the columns, outside first."""
    flat = mask.ravel(order="F")
    ends = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    lengths: list[int] = np.diff([0, *ends.tolist(), flat.size]).tolist()
    return [0, *lengths] if flat[0] else lengths


def _turn(angle: float, middle: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """Around the upright axis through a point."""
    turn = np.eye(4)
    cosine, sine = math.cos(angle), math.sin(angle)
    turn[:3, :3] = [[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]]
    turn[:3, 3] = middle - turn[:3, :3] @ middle
    return turn


def _turned(light: Light, turn: npt.NDArray[np.float64]) -> Light:
    record = light_record(light)
    for name in ("direction", "axis"):
        if name in record:
            record[name] = (turn[:3, :3] @ record[name]).tolist()
    if "position" in record:
        record["position"] = (turn[:3, :3] @ record["position"] + turn[:3, 3]).tolist()
    return light_of({"light": record})
