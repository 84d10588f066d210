"""A small scene in place of that of Figure 2 of Vanek et al. 2011: an object behind a fence that is
a texture with holes."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ...camera import Camera
from ...light import HemisphereLight
from ...masks import AlphaMask
from ...scene import Scene, joined
from ...scenes import created, floor, moved

LENGTH, HEIGHT = 12.0, 2.0
"""Of the fence, in world units; it stands along the x axis."""

MESHES_PER_UNIT = 2.0
"""Openings between the wires, along each side."""


def wire_mesh(size: int = 32) -> npt.NDArray[np.bool_]:
    """One opening, and the wires around it: where the fence is there."""
    places = (np.arange(size) + 0.5) / size
    across = np.abs(places[:, None] + places - 1.0), np.abs(places[:, None] - places)
    return np.minimum(*across) < 0.09


def fence() -> Scene:
    """A box behind a fence, seen from the ground near the shadow, by a lamp behind the box, out of
    view, that shines on one hemisphere."""
    solid = joined([floor(7.0, 6.0), moved(created("box"), scale=2.0, to=(0.0, 1.0, -3.0))])
    x = LENGTH / 2
    corners = np.array([[-x, 0, 0], [x, 0, 0], [x, HEIGHT, 0], [-x, HEIGHT, 0]])
    quad = np.array([[0, 1, 2], [0, 2, 3]])
    scene = Scene(
        np.concatenate([solid.vertices, corners]),
        np.concatenate([solid.faces, quad + len(solid.vertices)]),
        uv=np.concatenate([np.zeros((len(solid.vertices), 2)), corners[:, :2] * MESHES_PER_UNIT]),
        alpha=AlphaMask(wire_mesh()),
        face_alpha=np.repeat([-1, 0], [len(solid.faces), len(quad)]),
    )
    scene.name = "fence"
    eye, target = (2.6, 2.4, 5.6), (0.2, 0.0, 1.0)
    scene.cameras["default"] = Camera.look_at(eye, target, yfov=0.9, width=1600, height=1200)
    place = np.array([-4.0, 7.5, -10.0])
    scene.lights["default"] = HemisphereLight(place, -place)
    return scene
