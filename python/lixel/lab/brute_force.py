"""Shadows of some pixels by brute force: every triangle against every ray, in float64 with numpy.

It shares nothing with the engines nor with `lixel.reference`: no hierarchy, no visibility buffer,
no code of the core. So it is slow, and says whether these are right.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..light import DirectionalLight, Light
from ..masks import AlphaMask
from .rays import ray_directions

Floats = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]


class Triangles(NamedTuple):
    """Arrays of a scene: places of the vertices, the faces, the texture coordinates of each of
    their corners (n, 3, 2), and of each face the number of its image, -1 where it is opaque."""

    vertices: Floats
    faces: Integers
    uv: Floats
    face_alpha: Integers
    masks: tuple[AlphaMask, ...]


def cast(
    triangles: Triangles, camera: Camera, light: Light, pixels: npt.ArrayLike
) -> npt.NDArray[np.float32]:
    """(n,): 1 lit, 0 in shadow, NaN where nothing is seen, of pixels (row, column).

    A triangle does not shadow itself; a surface that shows the camera the side away from the light
    is in shadow. For directional lights and points.
    """
    rows, columns = np.asarray(pixels, np.int64).T
    directions = ray_directions(camera)[rows * camera.width + columns]
    found = [_lit(triangles, camera.eye, direction, light) for direction in directions]
    return np.array(found, np.float32)


def _lit(triangles: Triangles, eye: Floats, direction: Floats, light: Light) -> float:
    numbers, distances = _hits(triangles, eye, direction)
    in_front = distances > 0.0
    if not in_front.any():
        return np.nan
    nearest = np.flatnonzero(in_front)[np.argmin(distances[in_front])]
    own = numbers[nearest]
    point = eye + distances[nearest] * direction
    if isinstance(light, DirectionalLight):
        to_light, reach = -np.asarray(light.direction), np.inf
    else:
        to_light, reach = np.asarray(light.position) - point, 1.0
    a, b, c = triangles.vertices[triangles.faces[own]]
    normal = np.cross(b - a, c - a)
    if (normal @ to_light) * (normal @ -direction) <= 0.0:
        return 0.0
    numbers, distances = _hits(triangles, point, to_light)
    # A neighbour on the same plane touches the ray where it begins.
    is_between = (distances > 1e-12) & (distances < reach) & (numbers != own)
    return float(not is_between.any())


def _hits(triangles: Triangles, origin: Floats, direction: Floats) -> tuple[Integers, Floats]:
    """Numbers of the triangles that the line through a point meets where they are no hole, and how
    often the direction it is there."""
    numbers = _near(triangles, origin, direction)
    a, b, c = np.moveaxis(triangles.vertices[triangles.faces[numbers]], 1, 0)
    v, w, s = b - a, c - a, origin - a
    p, q = np.cross(direction, w), np.cross(s, v)
    with np.errstate(divide="ignore", invalid="ignore"):
        # T. Moller, B. Trumbore, "Fast, minimum storage ray-triangle intersection", 1997, Eq. 6.
        over = 1.0 / np.einsum("tk,tk->t", p, v)
        of_b = np.einsum("tk,tk->t", s, p) * over
        of_c = (q @ direction) * over
        distances = np.einsum("tk,tk->t", q, w) * over
    met = (of_b >= 0.0) & (of_c >= 0.0) & (of_b + of_c <= 1.0)
    numbers, distances = numbers[met], distances[met]
    shares = np.stack([1.0 - of_b - of_c, of_b, of_c], axis=1)[met]
    there = np.ones(len(numbers), bool)
    for image in np.unique(triangles.face_alpha[numbers]):
        own = np.flatnonzero(triangles.face_alpha[numbers] == image)
        if image >= 0:
            uv = np.einsum("tk,tkc->tc", shares[own], triangles.uv[numbers[own]])
            there[own] = alpha_at(triangles.masks[image], uv) >= triangles.masks[image].cutoff
    return numbers[there], distances[there]


def _near(triangles: Triangles, origin: Floats, direction: Floats) -> Integers:
    """Numbers of the triangles with corners on both sides of two planes through a ray."""
    first = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    numbers = np.arange(len(triangles.faces))
    for across in (first, np.cross(direction, first)):
        side = triangles.vertices @ across >= origin @ across
        a, b, c = side[triangles.faces[numbers]].T
        numbers = numbers[(a != b) | (b != c)]
    return numbers


def alpha_at(mask: AlphaMask, uv: Floats) -> Floats:
    """(n,): alpha of an image, from 0 to 1, at places (u, v) (n, 2)."""
    height, width = mask.image.shape
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    if mask.sampling == "nearest":
        x, y = np.floor(x + 0.5), np.floor(y + 0.5)
    total = np.zeros(len(uv))
    for i in (0, 1):
        for j in (0, 1):
            column, row = np.floor(x).astype(np.int64) + i, np.floor(y).astype(np.int64) + j
            texel = mask.image[
                _wrapped(row, height, mask.wrap[1]), _wrapped(column, width, mask.wrap[0])
            ]
            total += (1.0 - np.abs(x - column)) * (1.0 - np.abs(y - row)) * texel / 255.0
    return total


def _wrapped(index: Integers, count: int, wrap: str) -> Integers:
    if wrap == "clamp":
        return np.clip(index, 0, count - 1)
    if wrap == "repeat":
        return index % count
    return np.where(index // count % 2 == 0, index % count, count - 1 - index % count)
