"""Cameras and lights of a glTF file."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...camera import Camera, pose_of
from ...light import DirectionalLight, Light, PointLight, SpotLight
from .document import Object
from .nodes import Matrix

LIGHTS = "KHR_lights_punctual"

_ROUNDING = 1e-6
"""An angle that went through float32 may be this much too large."""


def camera_of(camera: Object, world_from_node: Matrix, height: int) -> Camera:
    """A camera; ValueError where its numbers make none."""
    if camera["type"] == "orthographic":
        return _orthographic(camera["orthographic"], world_from_node, height)
    perspective = camera["perspective"]
    aspect = float(perspective.get("aspectRatio", 16 / 9))
    if not 0.0 < aspect < math.inf:
        raise ValueError(f"aspectRatio must be above 0 and finite, got {aspect}")
    return Camera(
        _pose(world_from_node),
        yfov=perspective["yfov"],
        width=max(1, round(aspect * height)),
        height=height,
        znear=perspective["znear"],
        zfar=perspective.get("zfar", math.inf),
    )


def _orthographic(camera: Object, world_from_node: Matrix, height: int) -> Camera:
    halves = float(camera["xmag"]), float(camera["ymag"])
    if not all(0.0 < half < math.inf for half in halves):
        raise ValueError(f"xmag and ymag must be above 0 and finite, got {halves[0]}, {halves[1]}")
    return Camera.orthographic(
        _pose(world_from_node),
        xmag=halves[0],
        ymag=halves[1],
        width=max(1, round(halves[0] / halves[1] * height)),
        height=height,
        znear=camera["znear"],
        zfar=camera["zfar"],
    )


def light_of(light: Object, world_from_node: Matrix) -> Light:
    """A directional, point or spot light; ValueError where its numbers make none."""
    intensity, place = light.get("intensity", 1.0), world_from_node[:3, 3]
    # Some programs write 0 for a light without end.
    reach = light.get("range", math.inf) or math.inf
    match light["type"]:
        case "directional":
            return DirectionalLight(-_axis(world_from_node, 2), intensity=intensity)
        case "point":
            return PointLight(place, intensity=intensity, range=reach)
        case _:
            outer, inner = _cone(light.get("spot", {}))
            axis = -_axis(world_from_node, 2)
            return SpotLight(place, axis, outer, inner, intensity=intensity, range=reach)


def _cone(cone: Any) -> tuple[float, float]:
    """Outer and inner angle. A cone without an edge that fades, as many programs write it, fades
    over the least angle there is."""
    outer = float(cone.get("outerConeAngle", math.pi / 4))
    inner = float(cone.get("innerConeAngle", 0.0))
    if math.pi / 2 < outer <= math.pi / 2 + _ROUNDING:
        outer = math.pi / 2
    if outer <= inner <= outer + _ROUNDING:
        inner = math.nextafter(outer, 0.0)
    return outer, inner


def _pose(world_from_node: Matrix) -> Matrix:
    # A camera has no scale or mirror, whatever the nodes above it have: keep view and up.
    forward, up = -_axis(world_from_node, 2), _axis(world_from_node, 1)
    side = np.cross(forward, up)
    length = float(np.linalg.norm(side))
    if not length > 0.0:
        raise ValueError("its nodes leave it no direction upwards")
    return pose_of(world_from_node[:3, 3], forward, side / length)


def _axis(matrix: Matrix, column: int) -> Matrix:
    """A unit vector along one of the axes of a node."""
    axis = matrix[:3, column]
    length = float(np.linalg.norm(axis))
    if not 0.0 < length < math.inf:
        raise ValueError("its node is scaled to nothing, so that it looks nowhere")
    return np.asarray(axis / length)
