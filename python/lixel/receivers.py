"""What the camera sees: a triangle for each pixel, and the exact point on it."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _core, image_files
from .arguments import count
from .camera import Camera
from .light import Light
from .scene import Scene


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class SeenSurface:
    """The surface in each pixel, as a camera sees it; arrays are (H, W, ...) with row 0 at the top.

    Points, normals and depths are computed on first use, in float64 on the CPU.

    Attributes
    ----------
    triangle_id : (H, W) int32
        Row of the scene's `faces`, -1 where no surface is seen.
    scene, camera, light
        What is rendered.
    """

    triangle_id: npt.NDArray[np.int32]
    scene: Scene
    camera: Camera
    light: Light
    _generation: int = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_generation", self.scene._generation)

    @property
    def is_current(self) -> bool:
        """Whether the scene's vertices are still those that were rendered."""
        return self.scene._generation == self._generation

    def _check_is_current(self) -> None:
        if not self.is_current:
            raise RuntimeError(
                "the scene's vertices were updated after this was rendered; read position, normal, "
                "depth and facing before that, or render again"
            )

    def _made_by(self) -> dict[str, Any]:
        """What files tell of it."""
        view = (self.scene, self.camera, self.light)
        return image_files.view_record(*view, is_current=self.is_current)

    @cached_property
    def _surface(
        self,
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float32], npt.NDArray[np.float64]]:
        self._check_is_current()
        return _core.surface(self.scene._core, self.camera._core_for(self.scene), self.triangle_id)

    @property
    def position(self) -> npt.NDArray[np.float64]:
        """(H, W, 3) float64: where the ray of the pixel's centre meets its triangle's plane, in
        world space; NaN where no surface is seen."""
        return self._surface[0]

    @property
    def normal(self) -> npt.NDArray[np.float32]:
        """(H, W, 3) float32: the triangle's unit normal in world space, on the camera's side; NaN
        where no surface is seen."""
        return self._surface[1]

    @property
    def depth(self) -> npt.NDArray[np.float64]:
        """(H, W) float64: distance along the view, not along the ray, in world units; NaN where no
        surface is seen."""
        return self._surface[2]

    @property
    def object_id(self) -> npt.NDArray[np.int32]:
        """(H, W) int32: which of the scene's `objects` is seen, -1 where none is."""
        # The last one, -1, is that of no triangle.
        return np.append(self.scene.object_id, np.int32(-1))[self.triangle_id]

    @property
    def covered(self) -> npt.NDArray[np.bool_]:
        """(H, W) bool: where a surface is seen."""
        return self.triangle_id >= 0

    @cached_property
    def facing(self) -> npt.NDArray[np.bool_]:
        """(H, W) bool: where the side of the surface that is seen faces the light and is within
        its cone, if it has one, decided in float64. All other pixels are in shadow without
        asking; so is a surface in whose plane the light lies."""
        self._check_is_current()
        return _core.facing(
            self.scene._core,
            self.camera._core_for(self.scene),
            self.light._core,
            self.triangle_id,
        )

    @cached_property
    def footprint(self) -> npt.NDArray[np.float64]:
        """(H, W) float64: the area of the surface that a pixel covers, in square world units; NaN
        where no surface is seen."""
        sights = self.camera.sights_of(self.position)
        along = sights @ -self.camera.pose[:3, 2]
        across = np.einsum("...c,...c->...", sights, self.normal)
        # As wide as the beam is where a camera of parallel rays sees it.
        width = 1.0 if self.camera.is_orthographic else self.depth
        (fx, fy) = self.camera.focal
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(width**2 / (fx * fy) * np.abs(along / across))

    def pixels_seen_by(
        self, other: SeenSurface
    ) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]:
        """Pixels, row by row, whose place another image shows, and the pixels of that image.

        The surface in the middle of a pixel is looked up in the other image, where the pixel that
        it falls in must see the same triangle.
        """
        here = np.flatnonzero(self.covered)
        camera = other.camera
        places = camera.project(self.position.reshape(-1, 3)[here])
        column, row = np.floor(places[:, :2].T)
        inside = (column >= 0) & (column < camera.width)
        inside &= (row >= 0) & (row < camera.height)
        here = here[inside]
        there = (row[inside] * camera.width + column[inside]).astype(np.int64)
        is_same = other.triangle_id.ravel()[there] == self.triangle_id.ravel()[here]
        return here[is_same], there[is_same]

    def visibility_in(self, frame: Receivers) -> npt.NDArray[np.float32]:
        """(H, W) float32: what another frame, say the one before, found at the place that each
        pixel shows: 1 lit, 0 in shadow; NaN where that frame does not show it."""
        found = np.full(self.triangle_id.shape, np.nan, np.float32)
        here, there = self.pixels_seen_by(frame)
        found.ravel()[here] = frame._shares.ravel()[there]
        return found

    def every(self, step: SupportsIndex) -> SeenSurface:
        """The same of every so many pixels along both axes, beginning in the middle of the first
        block: nothing is computed for the others."""
        stride = count("step", step)
        first = min(stride // 2, self.camera.width - 1, self.camera.height - 1)
        triangle_id = np.ascontiguousarray(self.triangle_id[first::stride, first::stride])
        (fx, fy), (cx, cy) = self.camera.focal, self.camera.centre
        height, width = triangle_id.shape
        camera = self.camera._replaced(
            focal=(fx / stride, fy / stride),
            centre=((cx - first - 0.5) / stride + 0.5, (cy - first - 0.5) / stride + 0.5),
            width=width,
            height=height,
        )
        self._check_is_current()
        return SeenSurface(
            triangle_id=triangle_id, scene=self.scene, camera=camera, light=self.light
        )


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Receivers(SeenSurface):
    """The surface in each pixel, and whether the light reaches it; arrays are (H, W, ...) with row
    0 at the top.

    Points, normals and depths are computed on first use, in float64 on the CPU.

    Attributes
    ----------
    visibility : (H, W) float32
        1 lit, 0 in shadow, NaN where no surface is seen.
    triangle_id : (H, W) int32
        Row of the scene's `faces`, -1 where no surface is seen.
    scene, camera, light
        What was rendered.
    """

    visibility: npt.NDArray[np.float32]

    @property
    def visibility_in_range(self) -> npt.NDArray[np.float32]:
        """(H, W) float32: `visibility`, and 0 beyond the `range` of the light, where it has one."""
        beyond = self.covered & ~self.light.reaches(self.position)
        return np.where(beyond, np.float32(0.0), self._shares)

    @property
    def _shares(self) -> npt.NDArray[np.float32]:
        """`visibility` as float32, NaN where no surface is seen, if it is one of bytes, too."""
        if self.visibility.dtype != np.uint8:
            return self.visibility
        shares = np.divide(self.visibility, 255.0, dtype=np.float32)
        shares[~self.covered] = np.nan
        return shares
