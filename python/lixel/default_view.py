"""What looks at a scene, and what lights it, where neither is given."""

from __future__ import annotations

import math

import numpy as np

from .camera import Camera
from .light import DirectionalLight
from .scene import Scene

DEFAULT_LIGHT = DirectionalLight((0.4, -0.8, -0.45))
"""A directional light from above."""


def see_all(scene: Scene, width: int = 1920, height: int = 1080) -> Camera:
    """A camera that looks down at the scene's box, all of it in view.

    Parameters
    ----------
    scene : Scene
    width, height : int
        Size of the image in pixels.

    Returns
    -------
    Camera
    """
    low, high = scene.bounds
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    yfov = 0.8
    away = np.array((0.5, 0.45, 0.75))
    eye = centre + away / np.linalg.norm(away) * (radius or 1.0) / math.sin(yfov / 2)
    return Camera.look_at(eye, centre, yfov=yfov, width=width, height=height)
