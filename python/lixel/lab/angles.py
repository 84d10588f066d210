"""Measure the largest perspective aliasing error of a view by the angle between light and view.

The sweep of Lloyd et al., "Warping and partitioning for low error shadow maps", 2006, and
"Logarithmic perspective shadow maps", 2008: a view 60 degrees wide from a near to a far plane, and
a directional light from straight above it to along it. Each map holds all of the view and has as
many texels as there are pixels, so that 1 is a texel for each pixel wherever a surface may be.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from ..camera import Camera
from ..frame import render
from ..light import DirectionalLight
from ..scene import Scene
from .options import add_output, show

METHODS = ("focused", "psm", "lispsm", "trapezoidal", "log_psm")

DEGREES = (90, 75, 60, 45, 30, 15, 1)
"""From a light above a view along the ground to one behind the viewer."""

FAR_OVER_NEAR = (10, 100, 1000)

SIDE = 128
"""Pixels and texels along each side."""

HALF_WIDTH = math.tan(math.radians(30))
"""Of the view at a depth of 1."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab angles`."""
    add_output(parser, "write a table, .csv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Measure, save and print the table."""
    show(options, list(measure()))


def measure() -> Iterator[dict[str, Any]]:
    """The error of each method: a row for each ratio of far over near and each angle."""
    for ratio in FAR_OVER_NEAR:
        scene, camera = view_to(ratio)
        for angle in DEGREES:
            light = light_at(angle)
            errors = {
                name: render(
                    scene, camera, light, name, fit="frustum", margin=0.0, resolution=SIDE
                ).largest_aliasing_error
                for name in METHODS
            }
            yield {"far_over_near": ratio, "degrees": angle, **errors}


def light_at(degrees: float) -> DirectionalLight:
    """A light at that angle to the view, which it comes to from above."""
    angle = math.radians(degrees)
    return DirectionalLight((0.0, -math.sin(angle), -math.cos(angle)))


def view_to(far: float) -> tuple[Scene, Camera]:
    """A camera that sees a small plate at a depth of 1 before a wall at that depth."""
    wide = 1.5 * far * HALF_WIDTH
    low = -0.5 * HALF_WIDTH
    vertices = [
        *((x, y, -far) for x, y in ((-wide, -wide), (wide, -wide), (wide, wide), (-wide, wide))),
        *((x, low, z) for x, z in ((-0.02, -1.0), (0.02, -1.0), (0.02, -1.1), (-0.02, -1.1))),
    ]
    faces = np.array([(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)])
    camera = Camera.look_at(
        (0, 0, 0),
        (0, 0, -1),
        yfov=math.radians(60),
        width=SIDE,
        height=SIDE,
        znear=0.999,
        zfar=1.001 * far,
    )
    return Scene(vertices, faces), camera
