"""Methods that warp a fitted map."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ..light import Light
from .base import BoxMethod, RotatedMethod
from .given import LightMatrix
from .omnidirectional import Cube, DualParaboloid, Spot

Analysis: TypeAlias = Literal["backward", "forward", "hybrid"]
Fit: TypeAlias = Literal[
    "desired_view",
    "uniform",
    "min_sm",
    "principal_axes",
    "cascades",
    "focused",
    "psm",
    "plane_optimal",
    "lispsm",
    "log_psm",
    "trapezoidal",
    "scene_optimized",
    "cube",
    "dual_paraboloid",
    "improved_paraboloid",
    "spot",
]

_LIGHTS_OF_FITS: dict[str, tuple[type[Light], ...]] = {
    method.name: method.lights for method in (Cube, DualParaboloid, Spot)
}
"""The kinds of light of those fits that are not for all of them."""


class OldMaps(NamedTuple):
    """What a warp keeps of the frame before: `WarpMethod.previous`."""

    importance: npt.NDArray[np.float32]
    """(layers, h, w): importance maps."""
    matrices: npt.NDArray[np.float64]
    """(layers, 4, 4): x and y from 0 to 1 in the map, depth and w, from a point in the world."""


@dataclass(frozen=True, kw_only=True)
class FittedWarp(BoxMethod, RotatedMethod):
    """The base class of what warps a fitted map.

    Parameters
    ----------
    fit : str or LightMatrix
        The map, or the layers, that are warped. ``"desired_view"`` is that of `DesiredView`, and
        ``"uniform"`` that of `Uniform`, as Rosen has it (4.1): what no receiver falls in gets no
        texel by its importance alone;
        ``"min_sm"`` rotates it as `MinimalShadowMap` does, ``"principal_axes"`` along the principal
        axes of the receivers. ``"cascades"``, ``"focused"``, ``"psm"``, ``"plane_optimal"``,
        ``"lispsm"``, ``"log_psm"``, ``"trapezoidal"`` and ``"scene_optimized"`` are the maps of
        `Cascades`, `Focused`, `PerspectiveShadowMap`, `PlaneOptimal`, `LightSpacePerspective`,
        `LogPerspective`, `Trapezoidal` and `SceneOptimized` with their defaults; ``"cube"``,
        ``"dual_paraboloid"``, ``"improved_paraboloid"`` and ``"spot"`` are those methods' layers,
        each cut to the box of its receivers. A `LightMatrix` is warped as it is.
    snap : bool
        Texel snapping of the map that is warped, see `BoxMethod`; with the fits
        ``"desired_view"``, ``"cascades"``, ``"cube"``, ``"dual_paraboloid"`` and ``"spot"``; that
        of ``"uniform"`` holds still anyway.
    rotation : float, optional
        Of the map that is warped, see `RotatedMethod`; with the fits ``"desired_view"``,
        ``"uniform"`` and ``"cascades"``.

    The others are those of `ShadowMapMethod`.
    """

    fit: Fit | LightMatrix = "desired_view"

    def takes(self, light: Light) -> bool:
        """Whether the method, with its parameters, is made for the light."""
        return isinstance(light, _LIGHTS_OF_FITS.get(self._fit_name, self.lights))

    @property
    def composition(self) -> str:
        """Its name, or a composition such as ``"cube+notw"``, whatever its other parameters."""
        fit = self._fit_name
        return self.name if fit == "desired_view" else f"{fit}+{self.name}"

    @property
    def _fit_name(self) -> str:
        return self.fit if isinstance(self.fit, str) else self.fit.name


@dataclass(frozen=True, kw_only=True)
class WarpMethod(FittedWarp):
    """The base class of the warps that are made from the importance of receivers.

    Parameters
    ----------
    importance : str or sequence of str
        A product of functions, ``"distance*normal"`` or ``("distance", "normal")``; each method
        names those that it knows.

        - ``"desired_view"`` (rtw) or ``"count"`` (notw): 1 for every receiver.
        - ``"distance"`` (rtw): one over its distance along the viewing direction (Rosen, 5.2),
          times the width of the texel that the fit gives it: a perspective has done its part.
          Rosen's 1 - depth is in proportion to 1/z - 1/zfar, which is the same for a far ``zfar``.
        - ``"shadow_edge"``: 1 where the depth seen from the light differs by more than `edge_bias`
          from that of one of the eight texels around, `edge_floor` elsewhere (5.3).
        - ``"normal"``: 1 + `normal_bonus` times the cosine between normal and view (5.4), of each
          pixel's own ray; Rosen takes one viewing direction. In forward analysis a surface that
          faces away from the camera counts as one that faces it; Rosen clamps the cosine to 0.
        - ``"boundary"``: `boundary_weight` for receivers within 4 to 8 pixels of the boundary of a
          shadow, 1 elsewhere; a first pass without a warp finds the boundaries (after Chong and
          Gortler). It does harm where the first pass misses the shadows.
    normal_bonus : float
        Rosen's beta.
    analysis_resolution : int
        Texels along each side of the light's depth image, and of the first pass's map.
    edge_bias : float, optional
        In world units along the light's ray. None: the width of two texels of the depth image.
    edge_floor : float
        Rosen's alpha, from 0 to 1.
    boundary_weight : float
        Of a receiver near a boundary.
    pixel_weights : (H, W) array, optional
        One more factor for each pixel of the image; finite, not negative.
    map_weights : (h, w) array, optional
        One more factor for each cell of a grid of any size over the fitted map (every layer's), row
        0 at its top; finite, not negative.
    importance_resolution : int, optional
        Cells along each side of the importance map. None: as many as the map has texels along its
        longer side.
    previous : Frame, optional
        The previous frame, of the same method. Its importance maps are blended in, so that the warp
        follows the view slowly (Rosen, 5.5). Each layer uses the old layer that lies nearest; what
        was outside of that had no importance. Not for paraboloids, nor for ``"log_psm"``. `lixel
        lab flicker` measures no less flicker with it.
    blend : float
        The share of the previous frame, from 0 to 1.

    The others are those of `FittedWarp`. The comparison of two methods ignores their arrays of
    weights and their previous frames.
    """

    importance: str | Sequence[str]
    normal_bonus: float = 2.0
    analysis_resolution: int = 512
    edge_bias: float | None = None
    edge_floor: float = 0.001
    boundary_weight: float = 20.0
    pixel_weights: npt.ArrayLike | None = field(default=None, compare=False, repr=False)
    map_weights: npt.ArrayLike | None = field(default=None, compare=False, repr=False)
    importance_resolution: int | None = 512
    previous: Any = field(default=None, compare=False, repr=False)
    blend: float = 0.5

    def __post_init__(self) -> None:
        object.__setattr__(self, "previous", _old_maps(type(self), self.previous))
        super().__post_init__()


def _old_maps(method: type[WarpMethod], previous: Any) -> Any:
    """Of a frame; None where the frame had no layer, anything else as it is."""
    of_frame = getattr(previous, "method", None)
    if of_frame is None:
        return previous
    if type(of_frame) is not method:
        raise ValueError(
            f"previous must be a frame of the method {method.name!r}, got {of_frame.spelling!r}"
        )
    if len(previous.importance_map) == 0:
        return None
    width, height = of_frame.map_size
    sides = np.array([1.0 / width, 1.0 / height, 1.0, 1.0])
    return OldMaps(previous.importance_map, previous.light_matrix * sides[:, None])


@dataclass(frozen=True, kw_only=True)
class RectilinearWarp(WarpMethod):
    """A map whose rows and columns are spread where importance is high.

    An importance map over the fitted map holds in each cell the greatest importance of the
    receivers in it. The maxima of its rows and of its columns are blurred; texels are given out in
    proportion:

    .. math:: x' = \\sum_{j < k} I_j / \\sum_{j} I_j \\quad \\text{at the boundary of cell } k

    (Eq. 1), linear in between. Rasterization is exact: each texel takes its own light ray.

    Limits: what is important in one row takes texels in its columns in every row, where they may be
    wasted.

    Parameters
    ----------
    importance : str or sequence of str
        A product of ``"desired_view"``, ``"distance"``, ``"normal"``, ``"shadow_edge"`` and
        ``"boundary"``, see `WarpMethod`.
    analysis : {"backward", "forward", "hybrid"}
        Where importance comes from (4.1): the receivers; the light's depth image, which cannot tell
        ``"boundary"`` nor `pixel_weights`; or the receivers with ``"shadow_edge"`` from the light.
    blur : float
        Standard deviation of the Gaussian blur of the maxima, in cells.

    The others are those of `WarpMethod`.

    References
    ----------
    P. Rosen, "Rectilinear texture warping for fast adaptive shadow mapping", I3D 2012.

    Examples
    --------
    >>> RectilinearWarp(importance="distance*normal").normal_bonus
    2.0
    """

    name: ClassVar[str] = "rtw"

    importance: str | Sequence[str] = "distance"
    analysis: Analysis = "backward"
    blur: float = 3.0


@dataclass(frozen=True, kw_only=True)
class NonOrthogonalWarp(WarpMethod):
    """A map over whose texels the receivers are spread evenly.

    The receivers are counted in cells of the fitted map. Each row gets a function that
    equalizes its histogram, from the prefix sums of its counts:

    .. math:: x' = X_i(x) = g_i(x) / N_i

    (Eq. 1-5). The receivers are counted again where the rows' functions put them, and each column
    gets its function :math:`Y_j(y)` in the same way; :math:`i = \\lfloor y w \\rfloor`,
    :math:`j = \\lfloor x' w \\rfloor` (Eq. 6). Rasterization is exact: each texel takes its own
    light ray.

    This differs from the papers in three ways. Rows share functions, `function_count` in all,
    because the map has a seam wherever neighbouring functions differ. Counts are taken to the power
    `exponent`. And a part of each function, `even_share`, is the identity. The reason for the
    power: of ``n`` pixels that share ``s`` texels, between ``n s**(-1/2)`` (depth tests) and ``n /
    s`` (triangle tests) are wrong along edges. The sum is least for ``s`` in proportion to
    ``n**(2/3)`` or ``n**(1/2)``; in proportion to ``n`` too few texels are left for what few
    receivers cover.

    Limits: where neighbouring functions differ the map has a seam. The lookup continues across a
    seam, at the nearest texel there, but a texel on the seam itself sees one side only. The
    analysis and the rasterization take longer than those of `RectilinearWarp`.

    Parameters
    ----------
    importance : str or sequence of str
        A product of ``"count"``, ``"normal"``, ``"shadow_edge"`` and ``"boundary"``, see
        `WarpMethod`: what each receiver counts.
    importance_resolution : int, optional
        Cells along each side of the map where receivers are counted, and of each function. None,
        the papers': as many as the map has texels.
    function_count : int, optional
        Functions along each axis, at most `importance_resolution`, which is the papers'. None: 16,
        or as many as there are cells; with ``rasterization="linear"`` all of them, because its
        straight edges follow the warp only where neighbouring functions are alike. More functions
        leave fewer misclassified pixels and take longer; a larger map gains more for the same time.
    smoothing : float or "automatic", optional
        Standard deviation, in cells, of the weighted average of counts among neighbouring rows
        (columns). None: a thirty-second of `importance_resolution`, less the rows that share a
        function. The papers set it by hand. ``"automatic"``, with ``rasterization="linear"``, takes
        the one that suits the view, see `automatic_smoothing`; ``frame.stats["smoothing"]`` is the
        number.
    exponent : float
        From 0 to 1: a cell counts as this power of its receivers. 1 is the papers'; less gives more
        texels to what few receivers cover.
    even_share : float
        From 0 to 1: the part of each function that is the identity, so that nothing shrinks to less
        than this part of its size. 0 is the papers'.

    The others are those of `WarpMethod`.

    References
    ----------
    T. Milet, J. Navrátil, P. Zemčík, "An improved non-orthogonal texture warping for better shadow
    rendering", WSCG 2015; J. Navrátil's doctoral thesis, Brno University of Technology,
    chapter 4, Eq. 4.1-4.6.

    Examples
    --------
    >>> NonOrthogonalWarp(smoothing=8).smoothing
    8.0
    """

    name: ClassVar[str] = "notw"

    importance: str | Sequence[str] = "count"
    function_count: int | None = None
    smoothing: float | Literal["automatic"] | None = None
    exponent: float = 0.5
    even_share: float = 0.1


@dataclass(frozen=True, kw_only=True)
class GivenWarp(FittedWarp):
    """A fitted map with a warp of one's own: by functions along rows and columns, or by samples.

    **By functions**: those :math:`X_i` of bands of rows take places along ``x``, then those
    :math:`Y_j` of bands of columns take them along ``y``, as `warp_points` does it:

    .. math:: x' = X_i(x),\\; i = \\lfloor y n \\rfloor, \\qquad
              y' = Y_j(y),\\; j = \\lfloor x' n \\rfloor

    `warp_map` returns such functions, of `RectilinearWarp` with n = 1 and of `NonOrthogonalWarp`.

    **By samples**: any warp of the plane that has an inverse, as a table of where the ray of each
    texel is before it. ``samples[i, j]`` is the place (x, y) of the fitted map, from 0 to 1 from
    its left and its top, that the warp takes to ``((j + 0.5) / w, (i + 0.5) / h)``. With as many
    samples as texels each texel has its own ray. Between four samples the warp is linear in two
    triangles, as in any other `resolution`, and half a step beyond the outermost ones it goes on
    straight. So the lookup's inverse is exact.

    Limits: the warp belongs to the maps that it was made for. With n > 1 functions the map has a
    seam wherever neighbouring ones differ. Samples are for the CPU engine, and for
    ``rasterization="exact"``; what they do not reach is beside the map, and lit.

    Parameters
    ----------
    functions : (2, n, cells + 1) or (layers, 2, n, cells + 1) array, optional
        Along x and along y, n functions each: values at the boundaries of any number of cells,
        linear in between; from 0 to 1, and nowhere falling. At most as many functions as cells. One
        array for all layers, or one for each that the fit makes in the view.
    samples : (h, w, 2) or (layers, h, w, 2) array, optional
        In place of functions: places (x, y) from 0 to 1. No two texels may have the same place, nor
        may the table be folded over or torn: where between two neighbours the plane slips
        sideways by more than four samples it is torn. It may be a mirror image, turned, or reach
        only a part of the fitted map.

    The others are those of `FittedWarp`. The comparison of two methods ignores their arrays.

    Raises
    ------
    ValueError
        Neither or both given, another shape, functions that fall, or samples without an inverse,
        by their row and column. From `render`: another number of layers than the fit makes.
    DeviceError
        From `render`: samples, where a GPU is asked for.

    Examples
    --------
    >>> twice_as_fine_on_the_left = [[[0, 2 / 3, 1]], [[0, 1 / 2, 1]]]
    >>> GivenWarp(twice_as_fine_on_the_left, fit="min_sm").composition
    'min_sm+given_warp'
    >>> centres = (np.arange(8) + 0.5) / 8
    >>> a_quarter_turn = np.stack(np.meshgrid(1 - centres, centres, indexing="ij"), axis=-1)
    >>> GivenWarp(samples=a_quarter_turn).samples.shape
    (8, 8, 2)
    """

    name: ClassVar[str] = "given_warp"

    functions: npt.ArrayLike | None = field(default=None, kw_only=False, compare=False, repr=False)
    samples: npt.ArrayLike | None = field(default=None, compare=False, repr=False)

    def __post_init__(self) -> None:
        if (self.functions is None) == (self.samples is None):
            got = "neither" if self.functions is None else "both"
            raise ValueError(f"functions or samples must be given, got {got}")
        super().__post_init__()
