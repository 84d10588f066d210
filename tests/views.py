"""Small scenes of every generator, and cameras that look at them from where it is hard."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import lixel as lx
from lixel.scenes import GENERATORS

WIDTH, HEIGHT = 160, 90

SMALL = {
    "plane_and_box": {},
    "objects_on_floor": {"count": 25, "subdivisions": 2},
    "colonnade": {"columns": 4, "detail": 12},
    "city": {"blocks": 8},
    "grass": {"blades": 4000},
    "needles": {"count": 400},
    "terrain": {"cells": 120},
}
"""Arguments of each generator for a scene of at most some ten thousand triangles."""


def small(name: str) -> lx.Scene:
    return GENERATORS[name](**SMALL[name])


def soup(seed: int, count: int = 40, size: float = 1.0) -> lx.Scene:
    """Triangles of all sizes and tilts around the origin, with nothing regular about them."""
    random = np.random.default_rng(seed)
    middles = random.uniform(-1, 1, (count, 1, 3))
    corners = middles + random.normal(size=(count, 3, 3)) * random.uniform(0.01, 1, (count, 1, 1))
    return lx.Scene(size * corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))


def cameras(scene: lx.Scene) -> Iterator[tuple[str, lx.Camera]]:
    """By name: from outside and inside, close to a surface, cut by the near and the far plane."""
    low, high = scene.bounds
    centre, size = (low + high) / 2, float(np.linalg.norm(high - low))
    image = {"width": WIDTH, "height": HEIGHT}
    default = scene.cameras.get("default")
    if default is not None:
        yield "default", default.resized(WIDTH, HEIGHT)
    outside = centre + size * np.array([0.5, 0.4, 0.7])
    yield "outside", lx.Camera.look_at(outside, centre, yfov=0.8, **image)
    ahead, up = np.array([1, -0.1, 0.3]), np.array([0, size, 0])
    yield "inside", lx.Camera.look_at(centre, centre + ahead, yfov=1.2, **image)
    yield "above", lx.Camera.look_at(centre + up, centre, (0, 0, 1), yfov=0.9, **image)
    yield "below", lx.Camera.look_at(centre - up, centre, (1, 0, 0), yfov=0.9, **image)
    yield (
        "wide, at the corner",
        lx.Camera.look_at(low + 0.02 * (high - low), centre, yfov=2.4, **image),
    )
    # Planes of depth that cut the scene, and many of its triangles, in slices.
    distance = float(np.linalg.norm(centre - outside))
    yield (
        "slice",
        lx.Camera.look_at(
            outside,
            centre,
            yfov=0.8,
            znear=0.9 * distance,
            zfar=1.1 * distance,
            **image,
        ),
    )
    # An image that is not centred on the axis, with pixels that are not square.
    pose = lx.Camera.look_at(outside, centre, yfov=0.8, **image).pose
    yield "skewed", lx.Camera(pose, focal=(90.0, 240.0), centre=(20.0, 70.0), **image)


def write_folder(folder: Path, scene: lx.Scene, lights: Sequence[Mapping[str, Any]]) -> None:
    """A scenes.json with one file, seen by one camera in some lights."""
    camera = {"eye": [4, 5, 8], "target": [0, 0.5, 0], "fov_y_deg": 50}
    entry = {"file": "boxes.obj", "cameras": [camera], "lights": list(lights)}
    (folder / "scenes.json").write_text(json.dumps([entry]))
    lines = [f"v {x} {y} {z}" for x, y, z in scene.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (scene.faces + 1).tolist()]
    (folder / "boxes.obj").write_text("\n".join(lines))
