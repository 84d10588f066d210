"""How frames are timed: each from a camera of its own, and by turns."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ..camera import Camera
from ..scene import Scene


def moved_by_a_hair(camera: Camera, scene: Scene, random: np.random.Generator) -> Camera:
    """The camera a millionth of the scene's diagonal away: the image is the same, but nothing that
    is kept from frame to frame for one camera can be used."""
    low, high = scene.bounds
    pose = camera.pose.copy()
    pose[:3, 3] += 1e-6 * float(np.linalg.norm(high - low)) * random.standard_normal(3)
    return camera.posed(pose)


def wall_ms(call: Callable[[], object]) -> float:
    """Milliseconds from a call to its return."""
    start = time.perf_counter()
    call()
    return 1e3 * (time.perf_counter() - start)


def wall_and_processor_ms(call: Callable[[], object]) -> tuple[float, float]:
    """Milliseconds from a call to its return, and of all processors meanwhile."""
    before = time.process_time()
    wall = wall_ms(call)
    return wall, 1e3 * (time.process_time() - before)
