"""Random lights and cameras of a scene, by a seed: what calibration and accuracy tables try."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..light import DirectionalLight, Light, PointLight, SpotLight
from ..scene import Scene

KINDS: tuple[type[Light], ...] = (DirectionalLight, PointLight, SpotLight)


def random_lights(
    random: np.random.Generator,
    scene: Scene,
    camera: Camera,
    count: int,
    kinds: Sequence[type[Light]] = KINDS,
) -> list[Light]:
    """Directional, point and spot lights, or some of these, by turns; of those with a position
    every other one is in the camera's view.

    Directional lights come from above the horizon. Lights outside the view are anywhere else in the
    scene's box, made half as large again; spots point to a place in the box.
    """
    lights: list[Light] = []
    for number in range(count):
        kind = kinds[number % len(kinds)]
        if kind is DirectionalLight:
            x, y, z = random.normal(size=3)
            lights.append(DirectionalLight((x, -abs(y) - 0.05, z)))
            continue
        place = _in_view if number % 2 == 0 else _out_of_view
        position = place(random, scene, camera)
        if kind is PointLight:
            lights.append(PointLight(position))
        else:
            direction = _in_box(random, scene, 0.8) - position
            lights.append(SpotLight(position, direction, outer=random.uniform(0.3, 1.2)))
    return lights


def random_camera(random: np.random.Generator, scene: Scene, width: int, height: int) -> Camera:
    """In or around the scene, towards a place in it, a little from above."""
    target = _in_box(random, scene, 0.6)
    size = scene.bounds[1] - scene.bounds[0]
    away = random.normal(size=3)
    away[1] = 0.7 * abs(away[1]) + 0.1
    distance = random.uniform(0.1, 0.7) * float(np.linalg.norm(size))
    eye = target + away / np.linalg.norm(away) * distance
    return Camera.look_at(
        eye, target, yfov=math.radians(random.uniform(40, 70)), width=width, height=height
    )


def _in_box(random: np.random.Generator, scene: Scene, share: float) -> npt.NDArray[np.float64]:
    """Anywhere in the scene's box, made larger or smaller around its middle."""
    low, high = scene.bounds
    return np.asarray((low + high) / 2 + random.uniform(-0.5, 0.5, 3) * share * (high - low))


def is_in_view(camera: Camera, position: npt.NDArray[np.float64]) -> bool:
    """Whether a position is inside the camera's pyramid, however far away."""
    column, row, _ = camera.project(position[None])[0]
    return bool(0 <= column < camera.width and 0 <= row < camera.height)


def _out_of_view(
    random: np.random.Generator, scene: Scene, camera: Camera
) -> npt.NDArray[np.float64]:
    """Anywhere in the scene's box but in the camera's pyramid, which may hold nearly all of it."""
    for _ in range(100):
        position = _in_box(random, scene, 1.5)
        if not is_in_view(camera, position):
            return position
    return np.asarray(2 * camera.eye - _in_view(random, scene, camera))


def _in_view(random: np.random.Generator, scene: Scene, camera: Camera) -> npt.NDArray[np.float64]:
    """Inside the camera's pyramid, no farther than the scene is large."""
    column, row = random.uniform(0, 1, 2) * (camera.width, camera.height)
    (fx, fy), (cx, cy) = camera.focal, camera.centre
    low, high = scene.bounds
    depth = random.uniform(0.02, 0.5) * float(np.linalg.norm(high - low))
    width = 1.0 if camera.is_orthographic else depth
    place = np.array([width * (column - cx) / fx, width * (cy - row) / fy, -depth])
    return np.asarray(camera.eye + camera.pose[:3, :3] @ place)
