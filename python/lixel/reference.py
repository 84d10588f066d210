"""The reference that every method is compared with."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from . import _core
from .camera import Camera
from .frame import check_view
from .light import Light
from .pictures import display
from .receivers import Receivers
from .scene import Scene


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Reference(Receivers):
    """The right answer for each pixel, and where there is none; (H, W), row 0 at the top.

    `position`, `normal`, `depth` and `facing` are computed on first use.

    Attributes
    ----------
    visibility : (H, W) float32
        1 lit, 0 in shadow, NaN where no surface is seen.
    tie : (H, W) bool
        Where float64 leaves open whether the pixel is lit: an edge or a contact is within its
        rounding.
    triangle_id : (H, W) int32
        The first triangle on the pixel's centre ray, -1 where there is none.
    triangle_tie : (H, W) bool
        Where another triangle, or none, may be the first within the rounding of float32.
    float32_tie : (H, W) bool
        Where such a triangle has another visibility, and float64 knows which of them is first. From
        where float32 cannot tell anything there are none: what is judged there must be better.
    """

    tie: npt.NDArray[np.bool_]
    triangle_tie: npt.NDArray[np.bool_]
    float32_tie: npt.NDArray[np.bool_]

    def __repr__(self) -> str:
        height, width = self.visibility.shape
        ties = int(np.count_nonzero(self.tie | self.triangle_tie))
        return (
            f"<lixel.Reference: {width} x {height}, {int(np.count_nonzero(self.covered)):,} "
            f"pixels covered, {int(np.count_nonzero(self.visibility == 1.0)):,} lit, {ties:,} ties>"
        )

    def _repr_png_(self) -> bytes:
        return display.png_bytes(display.shadow_picture(self.visibility))


def reference(scene: Scene, camera: Camera, light: Light) -> Reference:
    """Trace one ray to the light from every visible point, in float64 on all cores of the CPU.

    The points are those of the visibility buffer: where the ray of the pixel's centre meets the
    triangle's plane. The intersection test is watertight, and a triangle never shadows itself. A
    surface that shows the camera the side away from the light is in shadow.

    Parameters
    ----------
    scene : Scene
    camera : Camera
    light : DirectionalLight

    Returns
    -------
    Reference

    Raises
    ------
    TypeError
        An argument of another type.
    """
    check_view(scene, camera, light)
    results = _core.reference(scene._core, camera._core_for(scene), light._core)
    return Reference(scene=scene, camera=camera, light=light, **results)
