"""What the page of `lixel view` shows of a view: pictures, times, errors, maps."""

from __future__ import annotations

import base64
import io
import threading
import time
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from ...camera import Camera
from ...compare import FALSE_LIT, FALSE_SHADOW, compare
from ...frame import FrameParts, Output, frame_parts
from ...image_files import light_of, light_record
from ...light import Light
from ...methods import METHODS, Method, method_from
from ...methods.base import Lookup
from ...pictures.display import BACKGROUND, LIT, SHADOW, png_bytes
from ...pictures.warp_plots import grid_lines, unwarped_depths
from ...reference import reference
from ...scene import Scene
from ...scenes import GENERATORS
from ..options import method_with

Request: TypeAlias = Mapping[str, Any]
Picture: TypeAlias = npt.NDArray[np.uint8]

MAX_SIZE = 4096
"""Pixels along a side of an image that is asked for."""

LINES = 25
"""Of the grid of texels, along each axis."""

MAPS: tuple[Output, ...] = ("shadow_map", "importance_map", "warp_map")

PANEL = 320
"""Pixels along a side of the pictures of maps, at most."""


class Viewer:
    """One scene, whatever view of it is asked for.

    A view is a dictionary: ``camera`` (``eye``, ``target``, ``up``, ``yfov``, ``width``,
    ``height``), ``light`` as in a file's metadata, ``method``, and if it has them ``resolution``
    and ``lookup``; ``truth``, ``"exact"`` or ``"reference"``, marks the pixels that it contradicts.
    """

    def __init__(
        self, name: str, scene: Scene, camera: Camera, light: Light, *, up: str = "y"
    ) -> None:
        self._name, self._scene, self._up = name, scene, up
        self._camera, self._light = camera, light
        corners = scene.vertices[scene.faces]
        normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        length = np.linalg.norm(normal, axis=1, keepdims=True)
        self._normal = (normal / np.where(length > 0.0, length, 1.0)).astype(np.float32)
        self._centre = corners.mean(axis=1).astype(np.float32)
        # One render at a time, so that times are its own; what is packed meanwhile is not timed.
        self._turn = threading.Lock()

    # --- What is asked for ---

    def scene_record(self) -> dict[str, Any]:
        """What there is to choose from, and the view to begin with."""
        scene, camera = self._scene, self._camera
        low, high = scene.bounds
        forward, up = -camera.pose[:3, 2], camera.pose[:3, 1]
        # What turns stands in the middle of the view, as far as the scene's own middle is.
        distance = max(
            float(((low + high) / 2 - camera.eye) @ forward),
            0.05 * float(np.linalg.norm(high - low)),
        )
        lights = {"light": self._light, **scene.lights}
        return {
            "name": self._name,
            "triangles": scene.triangle_count,
            "size": float(np.linalg.norm(high - low)),
            "camera": {
                "eye": camera.eye.tolist(),
                "target": (camera.eye + distance * forward).tolist(),
                "up": [0.0, 1.0, 0.0] if abs(up[1]) > 1e-3 else up.tolist(),
                "yfov": 1.0 if camera.is_orthographic else camera.yfov,
                "width": 960,
                "height": 540,
            },
            "lights": {name: light_record(light) for name, light in lights.items()},
            "methods": {
                name: {
                    "resolution": _own(method(), "resolution"),
                    "lookup": _own(method(), "lookup"),
                    "lights": [kind.__name__ for kind in method.lights],
                }
                for name, method in METHODS.items()
            },
            "lookups": list(get_args(Lookup)),
        }

    def frame(self, view: Request) -> tuple[bytes, dict[str, Any]]:
        """A picture as JPEG, and its numbers: milliseconds of each pass and of all, pixels."""
        camera, light, method = _camera_of(view), light_of(view), _method_of(view)
        with self._turn:
            start = time.perf_counter()
            parts = frame_parts(self._scene, camera, light, method, ("triangle_id",))
            rendered = time.perf_counter()
        picture, numbers = self._picture(parts, camera, light), {}
        if view.get("truth") is not None:
            numbers = self._mark(picture, parts, (camera, light), str(view["truth"]))
        content = _jpeg(picture)
        numbers |= {
            "passes": parts.timings,
            "render_ms": 1e3 * (rendered - start),
            "device": parts.adapter["name"],
            "method": parts.method.spelling,
        }
        return content, numbers

    def map(self, view: Request) -> dict[str, Any]:
        """The first layer's maps as pictures, the lines of its grid, and the call in Python."""
        camera, light, method = _camera_of(view), light_of(view), _method_of(view)
        with self._turn:
            found: Any = frame_parts(self._scene, camera, light, method, MAPS).outputs
        has_map, importance, warps = len(found.shadow_map), found.importance_map, found.warp_map
        lines = grid_lines(warps[0] if len(warps) else None, LINES) if has_map else []
        cells = np.ma.masked_equal(importance[0], 0.0) if len(importance) else None
        return {
            "layers": has_map,
            "shadow_map": _panel(unwarped_depths(found)) if has_map else None,
            "importance_map": None if cells is None else _panel(cells),
            "lines": [np.round(line[:: max(len(line) // 128, 1)], 4).tolist() for line in lines],
            "call": self.call(camera, light, method),
        }

    def call(self, camera: Camera, light: Light, method: Method) -> str:
        """A program that renders the view."""
        is_built_in = self._name in GENERATORS
        turned = f", up={self._up!r}" if self._up != "y" else ""
        path = str(Path(self._name).resolve())
        scene = f"lx.scenes.{self._name}()" if is_built_in else f"lx.load({path!r}{turned})"
        kind: Any = type(method)
        default = kind()
        changed = [
            f"{field.name}={getattr(method, field.name)!r}"
            for field in fields(method)
            if getattr(method, field.name) != getattr(default, field.name)
        ]
        return (
            "import math\n\nimport lixel as lx\n\n"
            f"scene = {scene}\ncamera = lx.{camera!r}\nlight = lx.{light!r}\n"
            f"method = lx.{type(method).__name__}({', '.join(changed)})\n"
            "visibility = lx.render_shadows(scene, camera, light, method)\n"
        )

    # --- Pictures ---

    def _picture(self, parts: FrameParts, camera: Camera, light: Light) -> Picture:
        """(H, W, 4): as that of a frame, but each triangle has one shade: fast enough to move."""
        triangle: Any = parts.outputs.triangle_id
        count = len(self._normal)
        is_seen = np.zeros(count + 1, bool)
        is_seen[triangle] = True  # the last one, -1, is that of no triangle
        seen = np.flatnonzero(is_seen[:count])
        normal, centre = self._normal[seen], self._centre[seen]
        sight = camera.eye.astype(np.float32) - centre
        facing = np.einsum("nc,nc->n", normal, sight)
        to_light = light.vectors_from(centre).astype(np.float32)
        cosine = np.einsum("nc,nc->n", normal, to_light) * np.sign(facing)
        cosine /= np.maximum(np.linalg.norm(to_light, axis=1), 1e-30)
        shade = 0.45 + 0.25 * np.abs(facing) / np.maximum(np.linalg.norm(sight, axis=1), 1e-30)
        # Four bytes a colour, so that a pixel is one number; the last pair is the background's.
        table = np.empty((count + 1, 2, 4), np.uint8)
        table[seen, 0, :3] = shade[:, None] * np.array(SHADOW)
        table[seen, 1, :3] = (shade + 0.3 * np.clip(cosine, 0.0, 1.0))[:, None] * np.array(LIT)
        table[count, :, :3] = BACKGROUND
        colours = table.reshape(-1, 4).view(np.uint32)[:, 0]
        shown = colours.take(2 * triangle + (parts.visibility >= 0.5), mode="wrap")
        picture: Picture = shown[..., None].view(np.uint8)
        return picture

    def _mark(
        self, picture: Picture, parts: FrameParts, view: tuple[Camera, Light], truth: str
    ) -> dict[str, Any]:
        """Misclassified pixels in red, and their numbers."""
        if truth not in ("exact", "reference"):
            raise ValueError(f"truth must be 'exact' or 'reference', got {truth!r}")
        right: Any
        with self._turn:
            start = time.perf_counter()
            if truth == "exact":
                right = frame_parts(self._scene, *view, "exact").visibility
            else:
                right = reference(self._scene, *view)
            seconds = time.perf_counter() - start
        found = compare(parts.visibility, right, other_surfaces="count")
        picture[found.false_lit, :3] = FALSE_LIT
        picture[found.false_shadow, :3] = FALSE_SHADOW
        return {
            "truth": truth,
            "truth_ms": 1e3 * seconds,
            "misclassified": found.misclassified_count,
            "covered": found.covered_count,
        }


def _camera_of(view: Request) -> Camera:
    given = dict(view["camera"])
    camera = Camera.look_at(given.pop("eye"), given.pop("target"), **given)
    if max(camera.width, camera.height) > MAX_SIZE:
        raise ValueError(
            f"width and height must be at most {MAX_SIZE}, got {camera.width} x {camera.height}"
        )
    return camera


def _method_of(view: Request) -> Method:
    name = str(view["method"])
    known = {field.name for field in fields(method_from(name))}
    given = {key: view[key] for key in ("resolution", "lookup") if view.get(key) is not None}
    return method_with(name, None, [(key, given[key]) for key in given if key in known])


def _own(method: Method, name: str) -> Any:
    return method.parameters().get(name)


def _jpeg(picture: Picture) -> bytes:
    from PIL import Image

    height, width, _ = picture.shape
    image = Image.frombuffer("RGBX", (width, height), picture, "raw", "RGBX", 0, 1)
    stream = io.BytesIO()
    # Colours as finely as greys: a single red pixel stays red.
    image.save(stream, format="jpeg", quality=88, subsampling=0)
    return stream.getvalue()


def _panel(values: np.ma.MaskedArray[Any, Any]) -> str:
    """A map as an address that holds a small grey PNG picture, large values dark, masked white."""
    step = max(1, -(-max(values.shape) // PANEL))
    shown = values[::step, ::step]
    # By rank: whatever their range, values differ to the eye.
    ranks = np.unique(shown.compressed())
    share = np.searchsorted(ranks, shown.data) / max(len(ranks), 1)
    grey = np.where(np.ma.getmaskarray(shown), 255, 235 - 110 * share).clip(0, 255)
    png = png_bytes(grey.astype(np.uint8))
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")
