"""The shadow methods: a name, or an object that holds a method's parameters.

The set is closed. It is listed once, in the core (`lixel._core.methods()`); the classes here give
it types and documentation, and a test holds them to that list.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, ClassVar, Literal, TypeAlias, cast, get_args

import numpy as np
import numpy.typing as npt

from .arguments import count, real, reals

Bias: TypeAlias = Literal["auto", "constant", "slope", "receiver_plane"]
Lookup: TypeAlias = Literal["auto", "depth", "triangle", "triangle_1x1", "triangle_5x5"]
Fit: TypeAlias = Literal["desired_view", "min_sm", "principal_axes"]
Analysis: TypeAlias = Literal["backward", "forward", "hybrid"]


def _check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")


def _check_not_negative(method: ShadowMethod, *parameters: str) -> None:
    for parameter in parameters:
        value = getattr(method, parameter)
        if value is not None and not 0.0 <= value < math.inf:
            raise ValueError(f"{parameter} must be finite and not negative, got {value}")


@dataclass(frozen=True, kw_only=True)
class ShadowMethod:
    """What all methods share."""

    name: ClassVar[str]

    def parameters(self) -> dict[str, Any]:
        """Every parameter by name."""
        return dataclasses.asdict(self)

    @property
    def map_resolution(self) -> int | None:
        """Texels along each side of the map, None where a method has no map."""
        return self.parameters().get("resolution")


def _check_fraction(method: ShadowMapMethod, parameter: str) -> None:
    value = getattr(method, parameter)
    if not 0.0 <= value <= 1.0:
        raise ValueError(f"{parameter} must be from 0 to 1, got {value}")


@dataclass(frozen=True, kw_only=True)
class ShadowMapMethod(ShadowMethod):
    """What the methods share that look up a depth in a shadow map.

    Parameters
    ----------
    resolution : int
        Texels along each side of the map.
    lookup : {"auto", "depth", "triangle", "triangle_1x1", "triangle_5x5"}
        How a receiver is compared with the map.

        - ``"depth"``: with the depth in its texel.
        - ``"triangle"``: the receiver's own light ray is tested against the triangles stored in the
          3 x 3 texels around it (or in one, or in 5 x 5). There is no false shadow; a caster that
          none of these texels saw is missed, as many are where triangles are smaller than texels.
        - ``"auto"``: in shadow if a triangle of the 3 x 3 is hit, or if at least seven of the nine
          depth tests there say so, which finds casters smaller than a texel.
    bias : {"auto", "constant", "slope", "receiver_plane"}
        How far a receiver may lie behind the depth of its texel and still be lit.

        - ``"constant"``: `constant_bias` everywhere.
        - ``"slope"``: `constant_bias`, and `slope_bias` times the texel's width times the slope of
          the receiver against the light.
        - ``"receiver_plane"``: the receiver's plane is evaluated on the texel's own ray, so that a
          plane never shadows itself; `constant_bias` on top.
        - ``"auto"``: the receiver's plane, the width of a texel and a bound of the rounding errors;
          `constant_bias` and `slope_bias` are not read.
    constant_bias : float, optional
        In world units along the light's ray. None: the width of one texel for ``"constant"``, 0 for
        the others.
    slope_bias : float
        In texel widths per unit of slope; only ``bias="slope"`` reads it.

    Raises
    ------
    TypeError
        An unknown parameter, or one of the wrong kind.
    ValueError
        A value out of range; the message names the parameter, the rule and the value.
    """

    resolution: int = 1024
    lookup: Lookup = "auto"
    bias: Bias = "auto"
    constant_bias: float | None = None
    slope_bias: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "resolution", count("resolution", self.resolution, "texels"))
        _check_choice("lookup", self.lookup, get_args(Lookup))
        _check_choice("bias", self.bias, get_args(Bias))
        if self.constant_bias is not None:
            object.__setattr__(self, "constant_bias", real("constant_bias", self.constant_bias))
        object.__setattr__(self, "slope_bias", real("slope_bias", self.slope_bias))
        _check_not_negative(self, "constant_bias", "slope_bias")


@dataclass(frozen=True, kw_only=True)
class Uniform(ShadowMapMethod):
    """One map over all casters, each texel as large as the next.

    The light's orthographic box holds every triangle of the scene, so the map does not depend on
    the camera. With ``x, y`` across and ``z`` along the light, texel and depth of a point are

    .. math:: u = r (x - x_0) / (x_1 - x_0), \\quad v = r (y - y_0) / (y_1 - y_0), \\quad
              d = (z - z_0) / (z_1 - z_0)

    where the box is the scene's and ``r`` the resolution. A receiver is in shadow where its depth
    exceeds the one stored in its texel by more than the bias.

    Limits: most texels fall where no pixel looks; in a large scene a texel spans many pixels and
    shadow edges turn into stairs.

    Parameters are those of `ShadowMapMethod`.

    References
    ----------
    L. Williams, "Casting curved shadows on curved surfaces", SIGGRAPH 1978.

    Examples
    --------
    >>> Uniform(resolution=2048).parameters()["resolution"]
    2048
    """

    name: ClassVar[str] = "uniform"


@dataclass(frozen=True, kw_only=True)
class DesiredView(ShadowMapMethod):
    """One map over what the camera sees lit: the box of the receivers that face the light.

    As `Uniform`, but the box across the light holds only the visible receivers that face the light
    (all others are in shadow without a map), found from the visibility buffer. No texel lies
    outside what is seen, and casters that can reach no receiver are left out:

    .. math:: x_0 = \\min_i x_i, \\quad x_1 = \\max_i x_i \\quad \\text{over receivers } i,

    likewise ``y``; depth is the receivers', reached back to the light.

    Limits: within the box texels are still uniform, so that near receivers get too few when far
    ones widen the box; the map moves with the camera, and its texels flicker.

    Parameters are those of `ShadowMapMethod`.

    References
    ----------
    P. Rosen, "Rectilinear texture warping for fast adaptive shadow mapping", I3D 2012, section 5
    (desired view); S. Brabec, T. Annen, H.-P. Seidel, "Practical shadow mapping", Journal of
    Graphics Tools 7(4), 2002.

    Examples
    --------
    >>> DesiredView().name
    'desired_view'
    """

    name: ClassVar[str] = "desired_view"


@dataclass(frozen=True, kw_only=True)
class MinimalShadowMap(ShadowMapMethod):
    """One map over the smallest rectangle around the visible receivers that face the light.

    As `DesiredView`, and turned around the light's direction: the convex hull of the receivers
    across the light gives the smallest rectangle that holds them, one of whose sides lies along an
    edge of the hull (rotating calipers):

    .. math:: \\min_{\\varphi} \\; w(\\varphi) \\, w(\\varphi + \\pi/2), \\quad
              w(\\varphi) = \\max_i \\langle p_i, e_\\varphi \\rangle
              - \\min_i \\langle p_i, e_\\varphi \\rangle.

    The near plane reaches every caster before them, the far
    plane is the last receiver's.

    Limits: those of `DesiredView`; the map turns as the camera moves.

    Parameters are those of `ShadowMapMethod`.

    References
    ----------
    M. Stamminger, G. Drettakis, "Perspective shadow maps", SIGGRAPH 2002; with rotating calipers T.
    Milet, J. Navrátil, P. Zemčík, WSCG 2015, section 3.2.

    Examples
    --------
    >>> method_from("min_sm+notw") == NonOrthogonalWarp(fit="min_sm")
    True
    """

    name: ClassVar[str] = "min_sm"


@dataclass(frozen=True, kw_only=True)
class WarpMethod(ShadowMapMethod):
    """What the warps share: a fit, and what receivers are worth.

    Parameters
    ----------
    importance : str or sequence of str
        A product of functions, ``"distance*normal"`` or ``("distance", "normal")``; each method
        names those that it knows.

        - ``"desired_view"`` (rtw) or ``"count"`` (notw): 1 for every receiver.
        - ``"distance"`` (rtw): one over its distance along the viewing direction (Rosen, 5.2).
        - ``"shadow_edge"``: 1 where the depth seen from the light differs by more than `edge_bias`
          from that of one of the eight texels around, `edge_floor` elsewhere (5.3).
        - ``"normal"``: 1 + `normal_bonus` times the cosine between normal and view (5.4).
        - ``"boundary"``: `boundary_weight` for receivers within 4 to 8 pixels of the boundary of a
          shadow, 1 elsewhere; a first pass without a warp finds the boundaries (after Chong and
          Gortler). It mostly helps, and where the first pass misses the shadows it does harm.
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
    importance_resolution : int
        Cells along each side of the importance map.
    fit : {"desired_view", "min_sm", "principal_axes"}
        How the map is turned before it is warped: not at all, as `MinimalShadowMap`, or along the
        principal axes of the receivers across the light.

    The others are those of `ShadowMapMethod`. Two methods are equal whatever their weights' arrays.
    """

    functions: ClassVar[tuple[str, ...]]

    importance: str | Sequence[str]
    normal_bonus: float = 2.0
    analysis_resolution: int = 512
    edge_bias: float | None = None
    edge_floor: float = 0.001
    boundary_weight: float = 20.0
    pixel_weights: npt.ArrayLike | None = field(default=None, compare=False, repr=False)
    map_weights: npt.ArrayLike | None = field(default=None, compare=False, repr=False)
    importance_resolution: int = 512
    fit: Fit = "desired_view"

    def __post_init__(self) -> None:
        super().__post_init__()
        parts = self.importance
        parts = [p.strip() for p in parts.split("*")] if isinstance(parts, str) else list(parts)
        known = ", ".join(map(repr, self.functions))
        unknown = [part for part in parts if part not in self.functions]
        if unknown or not parts:
            wrong = repr(unknown[0]) if unknown else repr(self.importance)
            raise ValueError(f"importance must be a product of {known}, got {wrong}")
        product = "*".join(name for name in self.functions if name in parts)
        object.__setattr__(self, "importance", product)
        _check_choice("fit", self.fit, get_args(Fit))
        for parameter, unit in (
            ("importance_resolution", "cells"),
            ("analysis_resolution", "texels"),
        ):
            value = count(parameter, getattr(self, parameter), unit)
            object.__setattr__(self, parameter, value)
        for parameter in ("normal_bonus", "edge_floor", "boundary_weight"):
            object.__setattr__(self, parameter, real(parameter, getattr(self, parameter)))
        if self.edge_bias is not None:
            object.__setattr__(self, "edge_bias", real("edge_bias", self.edge_bias))
        _check_not_negative(self, "normal_bonus", "edge_bias", "boundary_weight")
        _check_fraction(self, "edge_floor")
        for parameter in ("pixel_weights", "map_weights"):
            weights = getattr(self, parameter)
            if weights is not None:
                object.__setattr__(self, parameter, _weights(parameter, weights))

    def parameters(self) -> dict[str, Any]:
        return {entry.name: getattr(self, entry.name) for entry in dataclasses.fields(self)}


def _weights(name: str, value: npt.ArrayLike) -> npt.NDArray[np.float32]:
    weights = reals(name, value, "h", "w").astype(np.float32)
    if weights.size == 0:
        raise ValueError(f"{name} must hold at least one weight, got shape {weights.shape}")
    if not (np.isfinite(weights) & (weights >= 0)).all():
        wrong = weights[~(np.isfinite(weights) & (weights >= 0))][0]
        raise ValueError(f"{name} must be finite and not negative, got {wrong}")
    weights.flags.writeable = False
    return weights


@dataclass(frozen=True, kw_only=True)
class RectilinearWarp(WarpMethod):
    """The desired view's map with its rows and columns moved apart where it matters.

    An importance map over the desired view's map takes, in each cell, the greatest importance of
    the receivers in it. The maxima of its rows and of its columns, blurred, share out the texels:

    .. math:: x' = \\sum_{j < k} I_j / \\sum_{j} I_j \\quad \\text{at the boundary of cell } k

    (Eq. 1), linear in between. Rasterization is exact: each texel takes its own light ray.

    Limits: what is important in one row makes the columns that it spans important in every row.

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

    functions: ClassVar[tuple[str, ...]] = (
        "desired_view",
        "distance",
        "normal",
        "shadow_edge",
        "boundary",
    )

    importance: str | Sequence[str] = "distance"
    analysis: Analysis = "backward"
    blur: float = 3.0

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_choice("analysis", self.analysis, get_args(Analysis))
        object.__setattr__(self, "blur", real("blur", self.blur))
        _check_not_negative(self, "blur")


@dataclass(frozen=True, kw_only=True)
class NonOrthogonalWarp(WarpMethod):
    """The desired view's map with the receivers spread evenly over its texels.

    The receivers are counted in cells of the desired view's map. Each row gets a function of its
    own that equalizes its histogram, from the prefix sums of its counts:

    .. math:: x' = X_i(x) = g_i(x) / N_i

    (Eq. 1-5). The receivers are counted again where the rows' functions put them, and each column
    gets its function :math:`Y_j(y)` in the same way; :math:`i = \\lfloor y w \\rfloor`,
    :math:`j = \\lfloor x' w \\rfloor` (Eq. 6). Rasterization is exact: each texel takes its own
    light ray.

    Beyond the papers, counts are taken to the power `exponent` and a part of each function,
    `even_share`, is the identity. Of ``n`` pixels that share ``s`` texels, about ``n s**(-1/2)``
    are wrong along edges, which is least in total for ``s`` in proportion to ``n**(2/3)``; equal
    counts take too much from what is thinly covered.

    Limits: neighbouring functions differ, and where they differ much a texel's footprint is torn,
    which costs accuracy that the even spread had won. The analysis and the rasterization take
    longer than those of `RectilinearWarp`.

    Parameters
    ----------
    importance : str or sequence of str
        A product of ``"count"``, ``"normal"``, ``"shadow_edge"`` and ``"boundary"``, see
        `WarpMethod`: what each receiver counts.
    importance_resolution : int
        Functions along each axis, and cells of each.
    smoothing : float, optional
        Standard deviation, in functions, of the weighted average among neighbouring functions.
        None: a thirty-second of `importance_resolution`.
    exponent : float
        From 0 to 1: the power of its count that a cell is worth. 1 is the papers'; less of it gives
        more texels to what is thinly covered.
    even_share : float
        From 0 to 1: the part of each function that is the identity, so that nothing is squeezed
        farther than to this part of its size. 0 is the papers'.

    The others are those of `WarpMethod`.

    References
    ----------
    T. Milet, J. Navrátil, P. Zemčík, "An improved non-orthogonal texture warping for better shadow
    rendering", WSCG 2015; J. Navrátil's doctoral thesis, chapter 5.

    Examples
    --------
    >>> NonOrthogonalWarp(smoothing=8).smoothing
    8.0
    """

    name: ClassVar[str] = "notw"

    functions: ClassVar[tuple[str, ...]] = ("count", "normal", "shadow_edge", "boundary")

    importance: str | Sequence[str] = "count"
    smoothing: float | None = None
    exponent: float = 2 / 3
    even_share: float = 0.15

    def __post_init__(self) -> None:
        super().__post_init__()
        for parameter in ("smoothing", "exponent", "even_share"):
            if getattr(self, parameter) is not None:
                object.__setattr__(self, parameter, real(parameter, getattr(self, parameter)))
        _check_not_negative(self, "smoothing")
        _check_fraction(self, "exponent")
        _check_fraction(self, "even_share")


@dataclass(frozen=True, kw_only=True)
class RayTraced(ShadowMethod):
    """A ray from every receiver towards the light, through a bounding volume hierarchy.

    A receiver ``p`` with the unit vector ``d`` towards the light is in shadow where a triangle
    other than its own meets the ray

    .. math:: p + t d, \\quad 0 < t < t_{light}

    Positions are relative to the eye in float32; edges take in what their rounding may hide, and a
    triangle counts only where it is beyond the rounding of the receiver. No pixel is known to
    differ from `reference` but its ties.

    Limits: the hierarchy is built on the CPU when the scene is new or its vertices have moved,
    which then is most of the frame. A ray that meets 65,000 boxes and triangles or more is a
    `DeviceError`.

    References
    ----------
    B. Smits, "Efficiency issues for ray tracing", Journal of Graphics Tools 3(2), 1998; S. Woop,
    C. Benthin, I. Wald, "Watertight ray/triangle intersection", Journal of Computer Graphics
    Techniques 2(1), 2013.

    Examples
    --------
    >>> RayTraced().parameters()
    {}
    """

    name: ClassVar[str] = "ray_traced"


MapMethod: TypeAlias = (
    Uniform | DesiredView | MinimalShadowMap | RectilinearWarp | NonOrthogonalWarp
)
Method: TypeAlias = MapMethod | RayTraced

METHODS: Mapping[str, type[Method]] = MappingProxyType(
    {method.name: method for method in get_args(Method)}
)
"""Every method by name."""

MAP_METHODS: Mapping[str, type[MapMethod]] = MappingProxyType(
    {method.name: method for method in get_args(MapMethod)}
)
"""Those that look up a shadow map, by name."""

WARPS: Mapping[str, type[RectilinearWarp | NonOrthogonalWarp]] = MappingProxyType(
    {method.name: method for method in (RectilinearWarp, NonOrthogonalWarp)}
)
"""Those that warp a fitted map."""


def method_from(method: str | Method) -> Method:
    """The method of a name, with its default parameters; a method object as it is.

    Parameters
    ----------
    method : str or method object
        A name, or a composition of names joined by ``+``: ``"min_sm+notw"`` is
        ``NonOrthogonalWarp(fit="min_sm")``.

    Raises
    ------
    ValueError
        An unknown name or composition; the message lists the known ones.
    TypeError
        Neither a name nor a method object.
    """
    if isinstance(method, Method):
        return method
    known = ", ".join(repr(name) for name in METHODS)
    if isinstance(method, type) and issubclass(method, ShadowMethod):
        raise TypeError(f"method must be an object, {method.__name__}(), got the class itself")
    if not isinstance(method, str):
        raise TypeError(
            f"method must be a name ({known}) or a method object, got {type(method).__name__}"
        )
    if method in METHODS:
        return METHODS[method]()
    parts = [part.strip() for part in method.split("+")]
    if len(parts) == 2 and parts[0] in get_args(Fit) and parts[1] in WARPS:
        return WARPS[parts[1]](fit=cast(Fit, parts[0]))
    unknown = [part for part in parts if part not in (*METHODS, *get_args(Fit))]
    if len(parts) > 1 and not unknown:
        raise ValueError(f"method {method!r} joins what cannot be joined; known: {known}")
    raise ValueError(
        f"method must be one of {known}, got {method!r}"
        + (f", where {unknown[0]!r} is unknown" if len(parts) > 1 else "")
    )
