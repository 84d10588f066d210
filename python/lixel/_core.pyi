"""The compiled core: arrays in, arrays out. Use the names in `lixel`, which wrap these."""

from collections.abc import Callable, Sequence
from typing import Any, Literal, final

import numpy as np
import numpy.typing as npt

__all__ = [
    "Camera",
    "DeviceError",
    "Light",
    "Rendered",
    "Scene",
    "__version__",
    "adapters",
    "brute_force",
    "check_parameters",
    "clear_cache",
    "count_samples",
    "device",
    "engine",
    "facing",
    "labels",
    "methods",
    "parameters",
    "reference",
    "render",
    "sampled_points",
    "shadows_at",
    "surface",
]

__version__: str

class DeviceError(RuntimeError):
    """The machine cannot do it: no adapter, a missing feature, a limit, a lost device."""

@final
class Scene:
    """Triangles in world space, validated once: `lixel.Scene` without its cameras and lights."""

    def __new__(
        cls,
        vertices: npt.NDArray[np.float64],
        faces: npt.NDArray[np.int64],
        masks: tuple[object, ...] | None = None,
    ) -> Scene:
        """`masks`: of each face the number of its alpha image, -1 where it is opaque (int32); of
        the corners of the others u, v and a factor of alpha, (k, 3, 3); and a list of images, each
        with its wraps along u and v and its cutoff."""
    @property
    def vertices(self) -> npt.NDArray[np.float64]:
        """(n, 3) float64: a copy of the corner positions."""
    @property
    def faces(self) -> npt.NDArray[np.uint32]:
        """(m, 3) uint32: a copy of the triangles."""
    @property
    def bounds(self) -> npt.NDArray[np.float64]:
        """(2, 3) float64: least and greatest corner of the box around all triangles."""
    @property
    def triangle_count(self) -> int: ...
    @property
    def degenerate_count(self) -> int:
        """How many triangles have zero area; they neither cast nor receive."""
    @property
    def masked_count(self) -> int:
        """How many triangles have holes."""
    def update_vertices(self, vertices: npt.NDArray[np.float64]) -> None:
        """Move the vertices, (n, 3), in their old order; the triangles stay."""

@final
class Camera:
    """A validated camera, a pinhole or orthographic.

    `focal` and `centre` are (x, y) in pixels, `focal` of an orthographic camera in pixels per world
    unit, `size` is (width, height), `depth_range` is
    (znear, zfar). `pose` is camera-to-world, (4, 4), looking along its -Z.
    """

    def __new__(
        cls,
        pose: npt.NDArray[np.float64],
        focal: tuple[float, float],
        centre: tuple[float, float],
        size: tuple[int, int],
        depth_range: tuple[float, float],
        is_orthographic: bool = False,
    ) -> Camera: ...

@final
class Light:
    """A validated light."""

    @staticmethod
    def directional(direction: npt.NDArray[np.float64]) -> Light:
        """`direction` (3,) points from the light towards the scene, any length but zero."""

    @staticmethod
    def point(position: npt.NDArray[np.float64]) -> Light:
        """Rays from `position` (3,) to all sides."""

    @staticmethod
    def spot(
        position: npt.NDArray[np.float64], direction: npt.NDArray[np.float64], outer: float
    ) -> Light:
        """Rays within the angle `outer`, radians, of `direction`."""

    @staticmethod
    def hemisphere(position: npt.NDArray[np.float64], axis: npt.NDArray[np.float64]) -> Light:
        """Rays to the side of `axis`."""

def methods() -> list[dict[str, Any]]:
    """The one list: `name`, `title`, `citation`, and `parameters` (see `parameters`) of each."""

def parameters(method: str) -> list[dict[str, Any]]:
    """What the parameters of a method are, of a filter such as ``"pcf"`` or of ``"auto"``.

    Of each its `name`, `default`, `unit` (empty where it has none), `is_optional` (whether None is
    a value, too), `rule` (``"flag"``, ``"count"``, ``"number"``, ``"choice"``, ``"lookup"``,
    ``"product"``, ``"weights"``, ``"matrix"``, ``"functions"``, ``"samples"`` or ``"maps"``),
    `choices` (the words of a choice, a lookup or a product), `max` (of a count or a number, None
    where there is none) and `must_be`, the words of the errors.
    """

def check_parameters(method: str, values: dict[str, Any]) -> dict[str, Any]:
    """The values as the core keeps them: numbers of numpy become Python's, weights a float32 array.

    Raises
    ------
    TypeError
        A value of the wrong kind.
    ValueError
        A value out of range, an unknown parameter or method, or values that do not go together.
    """

def labels() -> list[str]:
    """Every key that `timings` may have: the passes, and what the CPU does for them."""

@final
class Rendered:
    """What one light's frame has to show; None where it was not asked for."""

    @property
    def visibility(self) -> npt.NDArray[np.float32]:
        """(H, W): 1 lit, 0 in shadow, NaN where no surface is seen."""
    @property
    def triangle_id(self) -> npt.NDArray[np.int32] | None:
        """(H, W): -1 where no surface is seen."""
    @property
    def shadow_map(self) -> npt.NDArray[np.float32] | None:
        """(layers, h, w): depth in [0, 1], 1 where empty."""
    @property
    def importance_map(self) -> npt.NDArray[np.float32] | None:
        """(layers, h, w)."""
    @property
    def warp_map(self) -> npt.NDArray[np.float32] | None:
        """(layers, 2, functions, cells + 1), or (layers, h, w, 2) of a warp by samples."""
    @property
    def light_matrix(self) -> npt.NDArray[np.float64] | None:
        """(layers, 4, 4): before any warp, (column, row, depth, w) in texels from world."""
    @property
    def projections(self) -> list[dict[str, Any]] | None:
        """Of each layer: its kind, scale and centre, and the planes of its region."""
    @property
    def aliasing_error(self) -> npt.NDArray[np.float32] | None:
        """(H, W)."""
    @property
    def largest_aliasing_error(self) -> float | None: ...
    @property
    def max_effective_resolution(self) -> tuple[float, float] | None:
        """(width, height) in texels."""
    @property
    def pages(self) -> npt.NDArray[np.int32] | None:
        """(pages, 6): layer, face, level, column, row, and 1 where the page was kept."""
    @property
    def page_levels(self) -> npt.NDArray[np.int32] | None:
        """(H, W): -1 where a pixel looks into no page."""
    @property
    def timings(self) -> dict[str, float]:
        """Milliseconds of each pass."""
    @property
    def stats(self) -> dict[str, Any]: ...
    @property
    def adapter(self) -> dict[str, Any]: ...

def render(
    scene: Scene,
    camera: Camera,
    lights: Sequence[Light],
    method: tuple[str, dict[str, Any]],
    outputs: Sequence[str],
    *,
    culling: bool = True,
    on: tuple[str | None, int | None] = ...,
) -> list[Rendered]:
    """Frames by one method, a name with parameters, one for each light, with what `outputs` names.

    The lights share the pass that finds what the camera sees; on a GPU they submit their work
    together. They are rendered on a device, as for `engine`, and so many threads of the CPU engine.
    `outputs` are names of attributes of `Rendered` that may be None; the others are always there.
    Without `culling` nothing is left out, not even what cannot change a picture.
    """

def surface(
    scene: Scene, camera: Camera, triangle_id: npt.NDArray[np.int32]
) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float32], npt.NDArray[np.float64]]:
    """Position (H, W, 3) float64, normal towards the camera (H, W, 3) float32 and depth along the
    viewing direction (H, W) float64 where each pixel's centre ray meets its triangle's plane;
    NaN where no surface."""

def facing(
    scene: Scene, camera: Camera, light: Light, triangle_id: npt.NDArray[np.int32]
) -> npt.NDArray[np.bool_]:
    """(H, W): where the side of the surface that is seen faces the light, within its cone, decided
    in float64."""

def reference(scene: Scene, camera: Camera, light: Light) -> dict[str, Any]:
    """The truth, float64 on the CPU: `visibility` (H, W) float32 (1 lit, 0 in shadow, NaN no
    surface), `tie` (H, W) bool, `triangle_id` (H, W) int32, `triangle_tie` (H, W) bool,
    `float32_tie` (H, W) bool."""

def brute_force(
    scene: Scene, camera: Camera, light: Light, pixels: Sequence[int]
) -> dict[str, Any]:
    """As `reference`, over all triangles, for some pixels (row * width + column): (n,) arrays."""

def count_samples(
    scene: Scene,
    camera: Camera,
    light: Light,
    places: Sequence[tuple[float, float]],
    threads: int | None = None,
) -> dict[str, Any]:
    """Exact shadows of several samples in each pixel, on the CPU engine.

    `places` are columns and rows from a pixel's centre, 1 to 64 of them, within half a pixel. Of
    each pixel how many samples are `lit` and how many are `seen`, (H, W) uint8; `timings`,
    milliseconds of each pass; and `effort`: pixels that are ``whole_pixels`` (all samples see one
    triangle), those of them that are ``open_pixels`` (their samples were tested one by one), the
    ``mixed_pixels``, and ``tested_samples``, what was tested one by one.

    Raises
    ------
    ValueError
        Other places, or an image too large.
    """

def clear_cache() -> None:
    """Free the scratch memory on devices that no frame is using."""

def adapters() -> list[dict[str, Any]]:
    """Every adapter: name, type, backend, driver, features, limits. Empty where there is none."""

def engine(device: str | None) -> Literal["cpu", "gpu"]:
    """The engine that renders: that of a device, of ``LIXEL_DEVICE`` or the best.

    Raises
    ------
    ValueError
        An unknown device.
    TypeError
        A device that is no text.
    DeviceError
        No adapter is there or gives a device.
    """

def device(device: str | None = None) -> dict[str, Any]:
    """What `engine` chooses: name, type, backend and driver.

    Of an adapter also its limits and the features used; of the CPU engine its lanes and its
    threads. Raises as `engine` does.
    """

def sampled_points(
    samples: npt.ArrayLike, points: npt.NDArray[np.float64], is_inverse: bool
) -> npt.NDArray[np.float64]:
    """Where a warp by samples (h, w, 2) takes points (n, 2), or with `is_inverse` where it takes
    them from; NaN where it does not reach.

    Raises
    ------
    TypeError, ValueError
        Samples that are no warp.
    """

def shadows_at(
    scene: Scene,
    points: tuple[npt.NDArray[np.float64], float],
    normals: npt.NDArray[np.float64] | None,
    lights: Sequence[Light],
    threads: int | None,
    advance: Callable[[int], object],
    *,
    by_rays: bool | None = None,
) -> npt.NDArray[np.float32]:
    """(lights, n): 1 where a light reaches a point, else 0.

    `points` are (n, 3), and what may have been rounded of a coordinate, as a share of it. After
    each piece of work `advance` is called with the number of answers. `by_rays` says whether rays
    through the hierarchy find them, or grids of each light; None: what is expected sooner.
    """
