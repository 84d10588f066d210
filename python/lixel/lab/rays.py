"""Rays for other ray casters: through the pixels of a camera, and from surfaces to a light."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..scene import Scene


def ray_directions(camera: Camera) -> npt.NDArray[np.float64]:
    """(H * W, 3) float64: directions of the rays through the pixels' centres in world space, at
    depth 1. All of them start at the camera's eye."""
    if camera.is_orthographic:
        raise ValueError("camera must be a pinhole here, got an orthographic one")
    x = (np.arange(camera.width) + 0.5 - camera.centre[0]) / camera.focal[0]
    y = (np.arange(camera.height) + 0.5 - camera.centre[1]) / camera.focal[1]
    right, up, back = camera.pose[:3, :3].T
    directions = x[None, :, None] * right - y[:, None, None] * up - back
    return np.asarray(directions.reshape(-1, 3))


def refuse_holes(scene: Scene) -> None:
    """ValueError where triangles have holes, which other renderers would draw as solid."""
    if scene.masked_count:
        raise ValueError(
            f"scene must have no triangles with holes, got {scene.masked_count}: the other "
            "renderers are not told of them"
        )


def embree_scene(scene: Scene) -> Any:
    """Of embreex: runs float32 rays through the triangles."""
    refuse_holes(scene)
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    traced = EmbreeScene()
    TriangleMesh(traced, scene.vertices.astype(np.float32), scene.faces.astype(np.int32))
    return traced


def ray_offset(scene: Scene) -> float:
    """How far shadow rays start above the surface, in world units, so that it does not shadow
    itself: a few float32 steps of the largest coordinate."""
    return 1e-6 * float(np.abs(scene.bounds).max())
