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
from typing import Any, ClassVar, Literal, NamedTuple, TypeAlias, cast, get_args

import numpy as np
import numpy.typing as npt

from ..arguments import count, flag, real, reals
from ..light import LIGHTS, WITH_POSITION, Light, SpotLight

Bias: TypeAlias = Literal["auto", "constant", "slope", "receiver_plane"]
Rasterization: TypeAlias = Literal["exact", "linear"]
Lookup: TypeAlias = Literal["auto", "auto_5x5", "depth", "triangle", "triangle_1x1", "triangle_5x5"]
Analysis: TypeAlias = Literal["backward", "forward", "hybrid"]
Fit: TypeAlias = Literal[
    "desired_view",
    "min_sm",
    "principal_axes",
    "lispsm",
    "scene_optimized",
    "cube",
    "dual_paraboloid",
    "improved_paraboloid",
    "spot",
]
MatrixFit: TypeAlias = Literal["receivers", "frustum"]
Samples: TypeAlias = Literal["shadow", "boundary", "facing"]
Splits: TypeAlias = Literal["receivers", "quantiles", "practical", "logarithmic", "uniform"]
Optimizer: TypeAlias = Literal["paper", "simplex"]
Matrix: TypeAlias = tuple[tuple[float, ...], ...]

Space: TypeAlias = Literal["warped", "unwarped"]

GridWarp: TypeAlias = Literal["none", "rtw", "notw"]
Traversal: TypeAlias = Literal["auto", "compute", "hardware"]

# Tiles of 16 texels are counted in 8 bits.
_LARGEST_GRID = 4096


def _check_choice(name: str, value: object, choices: tuple[str, ...]) -> None:
    if value not in choices:
        raise ValueError(f"{name} must be one of {', '.join(map(repr, choices))}, got {value!r}")


def _check_not_negative(method: ShadowMethod, *parameters: str) -> None:
    for parameter in parameters:
        value = getattr(method, parameter)
        if value is not None and not 0.0 <= value < math.inf:
            raise ValueError(f"{parameter} must be finite and not negative, got {value}")


@dataclass(frozen=True)
class Pcf:
    """Percentage closer filtering: ``lookup=Pcf(...)`` of any method that looks up a shadow map.

    The visibility of a receiver is the share of depth tests that find it lit, in [0, 1], over
    points that cover a disc around it evenly:

    .. math:: v = \\frac{1}{n} \\sum_{i=1}^{n} \\mathrm{lit}(p + r s_i)

    Each is a ``"depth"`` lookup in the texel that the point falls in, on that texel's own ray. With
    the automatic bias the receiver's plane is evaluated there, so that a plane never shadows
    itself. Points off the layer (the map's border, the edge of a cube's face, the end of a cascade)
    are left out of the mean; a receiver off the map is lit, as in every lookup.

    Limits: where surfaces meet, the disc of one takes in texels of the other, which may be before
    its plane: a dark line along concave edges, as wide as the disc. The map of
    `SceneOptimized` holds no more than what is in shadow, and the lit half of a penumbra only with
    ``samples="facing"``. All points have the same
    weight, so that a penumbra ends where the radius says; Rosen weighs and jitters them.

    Parameters
    ----------
    radius : float
        Of the disc, in texels of the map as it is stored (``"warped"``), or in world units across
        the receiver's light ray (``"unwarped"``). The penumbra of a straight edge is twice as wide.
        0: the ``"depth"`` lookup.
    samples : int
        Points in the disc, from 1 to 1024. There are as many steps between lit and shadow.
    space : {"warped", "unwarped"}
        ``"warped"``: shadow edges are antialiased, and sharper where a warp spends more texels.
        ``"unwarped"``: soft edges, equally wide whatever the map; each point is warped by itself.

    Raises
    ------
    TypeError
        A parameter of the wrong kind.
    ValueError
        A value out of range; the message names the parameter, the rule and the value.

    References
    ----------
    W. Reeves, D. Salesin, R. Cook, "Rendering antialiased shadows with depth maps", SIGGRAPH 1987;
    P. Rosen, "Rectilinear texture warping for fast adaptive shadow mapping", I3D 2012, section 6.2.

    Examples
    --------
    >>> soft = RectilinearWarp(lookup=Pcf(radius=0.1, samples=32, space="unwarped"))
    >>> soft.lookup.samples
    32
    """

    radius: float = 2.0
    samples: int = 16
    space: Space = "warped"

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", real("radius", self.radius))
        if not 0.0 <= self.radius < math.inf:
            raise ValueError(f"radius must be finite and not negative, got {self.radius}")
        object.__setattr__(self, "samples", count("samples", self.samples, "points"))
        if self.samples > _MOST_SAMPLES:
            raise ValueError(f"samples must be at most {_MOST_SAMPLES}, got {self.samples}")
        _check_choice("space", self.space, get_args(Space))

    def __str__(self) -> str:
        return f"pcf(radius={self.radius!r}, samples={self.samples}, space={self.space})"


# Loops of a driver may end at 65,535 iterations, and an invocation takes up to 32 pixels.
_MOST_SAMPLES = 1024


@dataclass(frozen=True, kw_only=True)
class ShadowMethod:
    """What all methods share."""

    name: ClassVar[str]
    lights: ClassVar[tuple[type[Light], ...]] = LIGHTS
    """The kinds of light that the method is made for."""

    def takes(self, light: Light) -> bool:
        """Whether the method, with its parameters, is made for the light."""
        return isinstance(light, self.lights)

    @property
    def spelling(self) -> str:
        """What `method_from` calls it: its name, or a composition such as ``"cube+notw"``."""
        return self.name

    def parameters(self) -> dict[str, Any]:
        """Every parameter by name; a filter as text."""
        values = ((entry.name, getattr(self, entry.name)) for entry in dataclasses.fields(self))
        return {name: str(v) if isinstance(v, Pcf) else v for name, v in values}

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
    rasterization : {"exact", "linear"}
        How casters become texels.

        - ``"exact"``: each texel takes its own light ray through projection and warp.
        - ``"linear"``: as published (Rosen, 6.1): corners are projected and warped, edges between
          them are straight in the map, depths are interpolated along them. It is right where a
          projection keeps lines and nothing is warped; a paraboloid ends at its rim, and around a
          light casters nearer than 2^-16 of the farthest are left out.
    tessellation : float, optional
        For ``"linear"``: triangles are split at the middles of their edges until no edge in the map
        is longer than this share of its side; 0.05, 0.025 and 0.01 are the paper's. Where two
        functions of `NonOrthogonalWarp` part, which no splitting mends, an edge of a function's
        width may stay longer. None: not at all. More pieces than the device has room for are a
        `DeviceError`.
    lookup : {"auto", "auto_5x5", "depth", "triangle", "triangle_1x1", "triangle_5x5"} or Pcf
        How a receiver is compared with the map.

        - ``"depth"``: with the depth in its texel.
        - ``"triangle"``: the receiver's own light ray is tested against the triangles stored in the
          3 x 3 texels around it (or in one, or in 5 x 5). There is no false shadow; a caster that
          none of these texels saw is missed, as many are where triangles are smaller than texels.
        - ``"auto"``: in shadow if a triangle of the 3 x 3 is hit, or if nine tenths of the depth
          tests around say so, weighed bilinearly, and four of the nine; six tenths where most
          texels hold a nearer triangle and each another. That finds casters smaller than a texel.
          ``"auto_5x5"`` asks the triangles of 5 x 5, too.
        - `Pcf`: the share of depth tests in a disc, for antialiased or soft edges.
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
    rasterization: Rasterization = "exact"
    tessellation: float | None = None
    lookup: Lookup | Pcf = "auto"
    bias: Bias = "auto"
    constant_bias: float | None = None
    slope_bias: float = 1.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "resolution", count("resolution", self.resolution, "texels"))
        _check_choice("rasterization", self.rasterization, get_args(Rasterization))
        if self.tessellation is not None:
            object.__setattr__(self, "tessellation", real("tessellation", self.tessellation))
            if not 0.0 < self.tessellation <= 1.0:
                raise ValueError(
                    f"tessellation must be above 0 and at most 1, got {self.tessellation}"
                )
        if not isinstance(self.lookup, Pcf) and self.lookup not in get_args(Lookup):
            known = ", ".join(map(repr, get_args(Lookup)))
            raise ValueError(f"lookup must be one of {known} or a lixel.Pcf, got {self.lookup!r}")
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

    where the box is the scene's, turned as that of `DesiredView`, and ``r`` the resolution. A
    receiver is in shadow where its depth exceeds the one stored in its texel by more than the bias.

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
class BoxMethod(ShadowMapMethod):
    """What the methods share whose maps are boxes around receivers, along axes of the light.

    Parameters
    ----------
    snap : bool
        Texel snapping, against the flicker of shadow edges while the camera moves: texels are a
        power of the fourth root of 2 wide, up to 1.19 times as wide as they must be, and lie on a
        grid that only the light moves.

    The others are those of `ShadowMapMethod`.

    References
    ----------
    M. Valient, "Stable rendering of cascaded shadow maps", ShaderX6, 2008.
    """

    snap: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "snap", flag("snap", self.snap))


@dataclass(frozen=True, kw_only=True)
class DesiredView(BoxMethod):
    """One map over what the camera sees lit: the box of the receivers that face the light.

    As `Uniform`, but the box across the light holds only the visible receivers that face the light
    (all others are in shadow without a map), found from the visibility buffer. No texel lies
    outside what is seen, and casters that can reach no receiver are left out:

    .. math:: x_0 = \\min_i x_i, \\quad x_1 = \\max_i x_i \\quad \\text{over receivers } i,

    likewise ``y``; depth is the receivers', reached back to the light. Around the light's direction
    the map is turned so that its rows and columns lie across the edges of the scene, as far as the
    scene's box does not grow too much: a triangle that is thinner than a texel and lies along a row
    is seen by all of its texels or by none. This depends on light and scene, not on the camera.

    Limits: within the box texels are still uniform, so that near receivers get too few when far
    ones widen the box; the map moves with the camera, and its texels flicker unless they snap.

    Parameters are those of `BoxMethod`.

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
class WarpMethod(BoxMethod):
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
    fit : str
        The map, or the layers, that are warped. ``"desired_view"`` is that of `DesiredView`;
        ``"min_sm"`` turns it as `MinimalShadowMap` does, ``"principal_axes"`` along the principal
        axes of the receivers. ``"lispsm"`` and ``"scene_optimized"`` are the maps of
        `LightSpacePerspective` and `SceneOptimized`; ``"cube"``, ``"dual_paraboloid"``,
        ``"improved_paraboloid"`` and ``"spot"`` are those methods' layers, each cut to the box
        of its receivers.
    snap : bool
        Texel snapping of the map that is warped, see `BoxMethod`; with the fits
        ``"desired_view"``, ``"cube"``, ``"dual_paraboloid"`` and ``"spot"``.
    previous : Frame, optional
        The frame before, of the same method: its importance maps are blended in, so that the warp
        follows the view slowly (Rosen, 5.5). Each layer takes the old one that lay where it is;
        what was not on that had no importance. Not for paraboloids. `lixel.flicker` finds no less
        flicker with it.
    blend : float
        The part of the frame before, from 0 to 1.

    The others are those of `ShadowMapMethod`. Two methods are equal whatever their weights' arrays
    and the frame before.
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
    previous: Any = field(default=None, compare=False, repr=False)
    blend: float = 0.5

    def takes(self, light: Light) -> bool:
        """Whether the method, with its parameters, is made for the light."""
        return self.fit not in METHODS or METHODS[self.fit]().takes(light)

    @property
    def spelling(self) -> str:
        """What `method_from` calls it: its name, or a composition such as ``"cube+notw"``."""
        return self.name if self.fit == "desired_view" else f"{self.fit}+{self.name}"

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
        if self.snap and self.fit not in STILL_FITS:
            raise ValueError(
                f"snap must come with one of the fits {', '.join(map(repr, STILL_FITS))}, "
                f"got {self.fit!r}"
            )
        if self.previous is not None:
            object.__setattr__(self, "previous", _old_maps(type(self), self.previous))
        for parameter, unit in (
            ("importance_resolution", "cells"),
            ("analysis_resolution", "texels"),
        ):
            value = count(parameter, getattr(self, parameter), unit)
            object.__setattr__(self, parameter, value)
        for parameter in ("normal_bonus", "edge_floor", "boundary_weight", "blend"):
            object.__setattr__(self, parameter, real(parameter, getattr(self, parameter)))
        if self.edge_bias is not None:
            object.__setattr__(self, "edge_bias", real("edge_bias", self.edge_bias))
        _check_not_negative(self, "normal_bonus", "edge_bias", "boundary_weight")
        _check_fraction(self, "edge_floor")
        _check_fraction(self, "blend")
        for parameter in ("pixel_weights", "map_weights"):
            weights = getattr(self, parameter)
            if weights is not None:
                object.__setattr__(self, parameter, _weights(parameter, weights))


STILL_FITS: tuple[Fit, ...] = ("desired_view", "cube", "dual_paraboloid", "spot")
"""Fits whose layers do not turn with the receivers."""


class OldMaps(NamedTuple):
    """What a warp keeps of the frame before: `WarpMethod.previous`."""

    importance: npt.NDArray[np.float32]
    """(layers, h, w): importance maps."""
    matrices: npt.NDArray[np.float64]
    """(layers, 4, 4): x and y from 0 to 1 in the map, depth and w, from a point in the world."""


def _old_maps(method: type[WarpMethod], previous: Any) -> OldMaps | None:
    """Of a frame; None where the frame had no layer."""
    if isinstance(previous, OldMaps):
        return previous
    of_frame = getattr(previous, "method", None)
    if of_frame is None:
        raise TypeError(f"previous must be a lixel.Frame, got {type(previous).__name__}")
    if type(of_frame) is not method:
        raise ValueError(
            f"previous must be a frame of the method {method.name!r}, got {of_frame.spelling!r}"
        )
    if len(previous.importance_map) == 0:
        return None
    sides = np.array([1.0 / of_frame.resolution, 1.0 / of_frame.resolution, 1.0, 1.0])
    return OldMaps(previous.importance_map, previous.light_matrix * sides[:, None])


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

    The receivers are counted in cells of the desired view's map. Each row gets a function that
    equalizes its histogram, from the prefix sums of its counts:

    .. math:: x' = X_i(x) = g_i(x) / N_i

    (Eq. 1-5). The receivers are counted again where the rows' functions put them, and each column
    gets its function :math:`Y_j(y)` in the same way; :math:`i = \\lfloor y w \\rfloor`,
    :math:`j = \\lfloor x' w \\rfloor` (Eq. 6). Rasterization is exact: each texel takes its own
    light ray.

    Beyond the papers, rows share functions, `function_count` in all: where neighbouring functions
    differ, texels are torn. Counts are taken to the power `exponent` and a part of each function,
    `even_share`, is the identity. Of ``n`` pixels that share ``s`` texels, from ``n s**(-1/2)``
    (depth tests) to ``n / s`` (triangles) are wrong along edges, which is least in total for ``s``
    in proportion to ``n**(2/3)`` or ``n**(1/2)``; equal counts take too much from what is thinly
    covered.

    Limits: where neighbouring functions differ much the map is torn. The lookup goes on across a
    tear, at the nearest texel there; what a texel on the tear itself sees is of one side alone. The
    analysis and the rasterization take longer than those of `RectilinearWarp`.

    Parameters
    ----------
    importance : str or sequence of str
        A product of ``"count"``, ``"normal"``, ``"shadow_edge"`` and ``"boundary"``, see
        `WarpMethod`: what each receiver counts.
    importance_resolution : int
        Cells along each side of the map where receivers are counted, and of each function.
    function_count : int, optional
        Functions along each axis. The papers' is `importance_resolution`, which is also the most.
        None: 16, or as many as there are cells; all with ``rasterization="linear"``, whose straight
        edges come near the warp's only where neighbouring functions are alike. More
        leave fewer wrong pixels and take longer; a larger map wins more for the time.
    smoothing : float, optional
        Standard deviation, in cells, of the weighted average of counts among neighbouring rows
        (columns). None: a thirty-second of `importance_resolution`, less the rows that share a
        function.
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
    function_count: int | None = None
    smoothing: float | None = None
    exponent: float = 0.5
    even_share: float = 0.1

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.function_count is not None:
            function_count = count("function_count", self.function_count, "functions")
            object.__setattr__(self, "function_count", function_count)
        for parameter in ("smoothing", "exponent", "even_share"):
            if getattr(self, parameter) is not None:
                object.__setattr__(self, parameter, real(parameter, getattr(self, parameter)))
        _check_not_negative(self, "smoothing")
        _check_fraction(self, "exponent")
        _check_fraction(self, "even_share")


@dataclass(frozen=True, kw_only=True)
class LightMatrixMethod(ShadowMapMethod):
    """What the methods share that fit one matrix to the light.

    Rows 1, 2 and 4 of a light's matrix take a point to its place in the map, and must take each of
    the light's rays to one place: what is free is a homography between rays and texels.
    Rasterization and lookup are exact for all of them.

    A light with a position that has not all of what it reaches in front of it gets one matrix for
    each face of a cube around it that holds any receiver.

    Parameters
    ----------
    fit : {"receivers", "frustum"}
        What the map must hold: the receivers that face the light, found from samples of the image,
        or the part of the scene's box that is in the camera's frustum. What is off the map is lit.
    sample_resolution : int
        Pixels looked at along the longer side of the image, for ``fit="receivers"``.
    margin : float
        By how much of its size the map is widened, because between the samples something may stick
        out; from 0 to 1.

    The others are those of `ShadowMapMethod`.
    """

    fit: MatrixFit = "receivers"
    sample_resolution: int = 180
    margin: float = 0.02

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_choice("fit", self.fit, get_args(MatrixFit))
        _check_samples(self)


def _check_samples(method: LightMatrixMethod | SceneOptimized) -> None:
    samples = count("sample_resolution", method.sample_resolution, "samples")
    object.__setattr__(method, "sample_resolution", samples)
    object.__setattr__(method, "margin", real("margin", method.margin))
    if not 0.0 <= method.margin <= 1.0:
        raise ValueError(f"margin must be from 0 to 1, got {method.margin}")


@dataclass(frozen=True, kw_only=True)
class Focused(BoxMethod, LightMatrixMethod):
    """One map over the smallest rectangle, in any orientation, around what is seen.

    The points that the map must hold are projected along the light; a side of the smallest
    rectangle around their convex hull lies on an edge of the hull, and sides may lean:

    .. math:: u = A (x, y)^T + b

    with ``x, y`` across the light, A and b from the rectangle.

    Limits: texels are spread evenly; near receivers get no more than far ones.

    Parameters
    ----------
    snap : bool
        Texel snapping, see `BoxMethod`; the rectangle is not turned then, and around a light
        with a position it is one for each face of a cube.

    The others are those of `LightMatrixMethod`.

    References
    ----------
    S. Brabec, T. Annen, H.-P. Seidel, "Practical shadow mapping", Journal of Graphics Tools 7(4),
    2002; "focused" in H. Y. Chong, S. J. Gortler, "Scene optimized shadow mapping", Harvard
    TR-07-07, 2007, section 3.

    Examples
    --------
    >>> Focused(fit="frustum").fit
    'frustum'
    """

    name: ClassVar[str] = "focused"


@dataclass(frozen=True, kw_only=True)
class LightSpacePerspective(LightMatrixMethod):
    """A perspective across the light, so that texels narrow along the view as the pixels do.

    With y along the view in the light's plane, from where what is seen begins,

    .. math:: u = (x - x_{eye}) / (y + n), \\quad v = y / (y + n), \\quad
              n = (z_n + \\sqrt{z_n z_f}) / \\sin \\gamma

    where :math:`\\gamma` is the angle between view and light, and :math:`z_n, z_f` are the depths
    of what is seen.

    Limits: the more the light shines along the view the less there is to gain; along it the map is
    the one of `Focused`.

    Parameters are those of `LightMatrixMethod`.

    References
    ----------
    M. Wimmer, D. Scherzer, W. Purgathofer, "Light space perspective shadow maps", Eurographics
    Symposium on Rendering 2004.

    Examples
    --------
    >>> LightSpacePerspective().name
    'lispsm'
    """

    name: ClassVar[str] = "lispsm"


@dataclass(frozen=True, kw_only=True)
class PerspectiveShadowMap(LightMatrixMethod):
    """The light looks at the scene after the camera's perspective, where near things are large.

    With C the camera's projective map and L the light, a point or a direction,

    .. math:: (u, v) = R_{1,2} (C p - C L) / R_3 (C p - C L)

    where R turns the third axis from the light towards the middle of what is seen. A virtual camera
    steps back from what is seen until the light has all of it in front.

    Limits: a light along the view sees the transformed scene at a grazing angle, and after the step
    back little of the perspective may be left.

    Parameters are those of `LightMatrixMethod`.

    References
    ----------
    M. Stamminger, G. Drettakis, "Perspective shadow maps", SIGGRAPH 2002.

    Examples
    --------
    >>> PerspectiveShadowMap().name
    'psm'
    """

    name: ClassVar[str] = "psm"


@dataclass(frozen=True, kw_only=True)
class PlaneOptimal(LightMatrixMethod):
    """On the plane that most receivers lie in each texel is a pixel.

    A point p has the place in the map that its shadow on the plane :math:`\\pi` has in the image:

    .. math:: (u, v) = C (p \\, (\\pi L) - L \\, (\\pi p))

    with C the camera's projective map and L the light, homogeneous.

    Limits: off the plane texels may be of any size; what the light moves behind the camera on its
    way to the plane has no place, and counts as lit.

    Parameters
    ----------
    fit : {"receivers", "frustum"}
        Whether the map ends at the receivers, or at the image: then a receiver whose shadow on the
        plane is out of the image counts as lit.

    The others are those of `LightMatrixMethod`.

    References
    ----------
    H. Y. Chong, S. J. Gortler, "A lixel for every pixel", Eurographics Symposium on Rendering 2004.

    Examples
    --------
    >>> PlaneOptimal().name
    'plane_optimal'
    """

    name: ClassVar[str] = "plane_optimal"


@dataclass(frozen=True, kw_only=True)
class SceneOptimized(ShadowMapMethod):
    """The light matrix that serves the image's shadow boundaries best.

    Samples x of the image are read back, with the surfaces that they see; the matrix, which takes
    them to places u in the map, minimizes

    .. math:: h(P) = \\sum_{samples} \\sum_{i, j \\in \\{1, 2\\}}
              \\left(\\frac{dx^i}{du^j}\\right)^2

    (Eq. 6): how many pixels share a texel. The optical axis, row 4 of the matrix, is searched for;
    for each one tried, rows 1 and 2 follow from the smallest rectangle around the samples' hull.
    It is never worse than `Focused` by this measure.

    Limits: a map is drawn to find the boundaries before the one that counts, and the CPU waits for
    the GPU in between; a shadow that no sample meets may be off the map, and then is lit.

    Parameters
    ----------
    samples : {"shadow", "boundary", "facing"}
        What the map must hold and is optimized for: samples next to a shadow boundary as in the
        paper, those and all in shadow, or all that face the light.
    optimizer : {"paper", "simplex"}
        The paper's search: three times along the negative gradient, nine angles each; or what a
        downhill simplex makes of its result, which has a lower h, takes twice as long, and leaves
        as many wrong pixels.
    sample_resolution : int
        Pixels looked at along the longer side of the image.
    margin : float
        By how much of its size the map is widened, because between the samples something may stick
        out; from 0 to 1.
    previous : Frame or (4, 4) array_like, optional
        The frame before, or its light matrix: kept, scaled and shifted to hold all samples, unless
        the median quality of the new one is below 80 % of its own. So a map does not swim. For one
        map alone, not for those of a cube's faces.

    The others are those of `ShadowMapMethod`. ``frame.stats["h"]`` is the measure reached, in
    squared pixels per squared texel.

    References
    ----------
    H. Y. Chong, S. J. Gortler, "Scene optimized shadow mapping", Harvard TR-07-07, 2007.

    Examples
    --------
    >>> SceneOptimized(optimizer="simplex", samples="boundary").samples
    'boundary'
    """

    name: ClassVar[str] = "scene_optimized"

    samples: Samples = "shadow"
    optimizer: Optimizer = "paper"
    sample_resolution: int = 180
    margin: float = 0.02
    previous: Matrix | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_choice("samples", self.samples, get_args(Samples))
        _check_choice("optimizer", self.optimizer, get_args(Optimizer))
        _check_samples(self)
        if self.previous is not None:
            object.__setattr__(self, "previous", _previous_matrix(self.previous))


def _previous_matrix(previous: Any) -> Matrix | None:
    """The light matrix of a frame with one map, or the matrix itself."""
    matrix = np.asarray(getattr(previous, "light_matrix", previous))
    if matrix.ndim == 3:
        if len(matrix) != 1:
            return None
        matrix = matrix[0]
    if matrix.dtype.kind not in "fiu":
        raise TypeError(f"previous must be a frame or a matrix, got {type(previous).__name__}")
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all():
        raise ValueError(f"previous must be finite, of shape (4, 4), got {matrix.shape}")
    return tuple(tuple(row) for row in matrix.astype(float).tolist())


@dataclass(frozen=True, kw_only=True)
class Cascades(BoxMethod):
    """The view is cut into slabs of depth, each with a map over the box of its receivers.

    With z from the near to the far end of what is split, slab i of m ends at

    .. math:: z_i = \\lambda \\, z_n (z_f / z_n)^{i / m}
              + (1 - \\lambda) (z_n + (z_f - z_n) \\, i / m)

    Limits: each layer is drawn on its own, and has `resolution` texels along each side: four layers
    of half the resolution have the texels of one map. The faces of a cube around a point light are
    not split.

    Parameters
    ----------
    layers : int
        Slabs, from 1 to 8; one that holds no receiver is left out.
    splits : {"receivers", "quantiles", "practical", "logarithmic", "uniform"}
        Where the slabs end. Between the camera's near plane and the end of the scene: lambda 0
        (``"uniform"``), 1 (``"logarithmic"``) or `weight` (``"practical"``). Between the nearest
        and the farthest receiver that faces the light, lambda 1 (``"receivers"``). With as many
        receivers in each (``"quantiles"``).
    weight : float
        Lambda of ``"practical"``, from 0 to 1.
    sample_resolution : int
        Pixels looked at along the longer side of the image, where the receivers are asked.
    snap : bool
        Texel snapping, see `BoxMethod`, of every layer; slabs that the receivers bound end at
        powers of the fourth root of 2, in units of the world.

    The others are those of `ShadowMapMethod`.

    References
    ----------
    F. Zhang, H. Sun, L. Xu, L. K. Lun, "Parallel-split shadow maps for large-scale virtual
    environments", VRCIA 2006; A. Lauritzen, M. Salvi, A. Lefohn, "Sample distribution shadow maps",
    I3D 2011.

    Examples
    --------
    >>> Cascades(layers=3, splits="practical").weight
    0.5
    """

    name: ClassVar[str] = "cascades"

    layers: int = 4
    splits: Splits = "receivers"
    weight: float = 0.5
    sample_resolution: int = 180

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "layers", count("layers", self.layers, "layers"))
        if self.layers > 8:
            raise ValueError(f"layers must be at most 8, got {self.layers}")
        _check_choice("splits", self.splits, get_args(Splits))
        object.__setattr__(self, "weight", real("weight", self.weight))
        if not 0.0 <= self.weight <= 1.0:
            raise ValueError(f"weight must be from 0 to 1, got {self.weight}")
        samples = count("sample_resolution", self.sample_resolution, "samples")
        object.__setattr__(self, "sample_resolution", samples)


@dataclass(frozen=True, kw_only=True)
class Cube(BoxMethod):
    """Six perspective maps around a light with a position: the faces of a cube.

    A face takes the receivers of its pyramid; with ``x, y, z`` in its axes,

    .. math:: u = r \\frac{x / z - u_0}{u_1 - u_0}, \\quad v = r \\frac{y / z - v_0}{v_1 - v_0}.

    A face that no receiver falls in is not made, and is counted in ``stats["skipped_layers"]``.

    Limits: up to six passes over the casters; a texel in a corner of a whole face covers a fifth of
    the solid angle of one in its middle.

    Parameters
    ----------
    cut : {"receivers", "face"}
        Each face over the box of its receivers, or over the whole face.
    snap : bool
        Texel snapping of the boxes of receivers, see `BoxMethod`.
    turned : bool
        Turns the cube's axes away from the world's, so that rows and columns of its faces lie
        across the scene's edges, see `DesiredView`.

    The others are those of `ShadowMapMethod`; `resolution` is that of each face.

    Raises
    ------
    ValueError
        From `render`: a directional light.

    References
    ----------
    J. Navrátil's doctoral thesis, section 3.3.1.

    Examples
    --------
    >>> method_from("cube+notw") == NonOrthogonalWarp(fit="cube")
    True
    """

    name: ClassVar[str] = "cube"
    lights: ClassVar[tuple[type[Light], ...]] = WITH_POSITION

    cut: Literal["receivers", "face"] = "receivers"
    turned: bool = False

    def __post_init__(self) -> None:
        super().__post_init__()
        object.__setattr__(self, "turned", flag("turned", self.turned))
        _check_choice("cut", self.cut, ("receivers", "face"))


@dataclass(frozen=True, kw_only=True)
class DualParaboloid(BoxMethod):
    """Two maps around a light with a position, as two paraboloids back to back reflect its rays.

    With :math:`d = (x, y, z)` the unit vector to a point in the axes of one half,

    .. math:: u = \\frac{x}{1 + z}, \\quad v = \\frac{y}{1 + z}

    on the unit disc; depth is the distance. The first half looks along the light's axis, or down.
    Rasterization is exact, so that a floor of two triangles needs no tessellation.

    Limits: texels in the middle cover four times the solid angle of those at the rim; the corners
    of a whole map lie outside the disc.

    Parameters
    ----------
    cut : {"hemisphere", "receivers"}
        Each map over its whole half of space, as published, or over the box of its receivers.
    snap : bool
        Texel snapping of the boxes of receivers, see `BoxMethod`.

    The others are those of `ShadowMapMethod`; `resolution` is that of each half.

    Raises
    ------
    ValueError
        From `render`: a directional light.

    References
    ----------
    S. Brabec, T. Annen, H.-P. Seidel, "Shadow mapping for hemispherical and omnidirectional light
    sources", CGI 2002; J. Navrátil's doctoral thesis, section 3.3.2.

    Examples
    --------
    >>> DualParaboloid(cut="receivers").cut
    'receivers'
    """

    name: ClassVar[str] = "dual_paraboloid"
    lights: ClassVar[tuple[type[Light], ...]] = WITH_POSITION

    cut: Literal["hemisphere", "receivers"] = "hemisphere"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_choice("cut", self.cut, ("hemisphere", "receivers"))


@dataclass(frozen=True, kw_only=True)
class ImprovedParaboloid(ShadowMapMethod):
    """One paraboloid that looks at what the camera sees, and is cut to it.

    As published, with the cut ``"frustum"``: the view frustum is truncated to the depths of the
    receivers; :math:`D_j` lead from the light to its eight corners. The paraboloid looks along
    their mean direction and reaches to the largest angle between it and them,

    .. math:: C = \\operatorname{norm} \\sum_j D_j, \\quad F = \\max_j \\angle (D_j, C)

    (Eq. 1 and 2), by the zoom factor :math:`Z = \\sin F / (1 + \\cos F)` (section 3.3). A light at
    infinity is the limit: a square around the corners across the light.

    Limits: with the light inside the truncated frustum, or where the cone is wider than a
    hemisphere, ``"frustum"`` is `DualParaboloid`. The other cuts make one map as long as a
    hemisphere holds the receivers, ``"receivers"`` with the light outside the view a wider one
    too; else two, each cut to the box of its receivers.

    Parameters
    ----------
    cut : {"frustum", "cone", "receivers"}
        To the frustum's corners, as published; to the smallest square of the receivers themselves
        around the axis of their smallest cone; to the box of the receivers, in the paraboloid whose
        axis gives them the finest texels, turned so that rows and columns lie across the edges of
        the scene: a paraboloid's texels are finer away from its axis, so it often looks past the
        receivers, up to 136 degrees. Axis and turn jump as the camera moves.

    The others are those of `ShadowMapMethod`.

    References
    ----------
    J. Vanek, J. Navrátil, A. Herout, P. Zemčík, "High-quality shadows with improved paraboloid
    mapping", ISVC 2011.

    Examples
    --------
    >>> ImprovedParaboloid().cut
    'receivers'
    """

    name: ClassVar[str] = "improved_paraboloid"

    cut: Literal["frustum", "cone", "receivers"] = "receivers"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_choice("cut", self.cut, ("frustum", "cone", "receivers"))


@dataclass(frozen=True, kw_only=True)
class Spot(BoxMethod):
    """One perspective map along the axis of a spot light.

    With ``x, y, z`` in the light's axes, over the box of its receivers,

    .. math:: u = r \\frac{x / z - u_0}{u_1 - u_0}, \\quad v = r \\frac{y / z - v_0}{v_1 - v_0}.

    A cone wider than 69 degrees to each side, which a plane would stretch too much, is mapped as
    one half of `DualParaboloid`.

    Limits: texels are spread evenly over the plane, not over what the camera sees.

    Parameters
    ----------
    cut : {"receivers", "cone"}
        Over the box of the receivers, or over the whole cone.
    snap : bool
        Texel snapping of the boxes of receivers, see `BoxMethod`.

    The others are those of `ShadowMapMethod`.

    Raises
    ------
    ValueError
        From `render`: a light that is not a `SpotLight`.

    References
    ----------
    L. Williams, "Casting curved shadows on curved surfaces", SIGGRAPH 1978.

    Examples
    --------
    >>> method_from("spot+rtw") == RectilinearWarp(fit="spot")
    True
    """

    name: ClassVar[str] = "spot"
    lights: ClassVar[tuple[type[Light], ...]] = (SpotLight,)

    cut: Literal["receivers", "cone"] = "receivers"

    def __post_init__(self) -> None:
        super().__post_init__()
        _check_choice("cut", self.cut, ("receivers", "cone"))


@dataclass(frozen=True, kw_only=True)
class RayTraced(ShadowMethod):
    """A ray from every receiver towards the light, against the triangles near it.

    A receiver ``p`` with the unit vector ``d`` towards the light is in shadow where a triangle
    other than its own meets the ray

    .. math:: p + t d, \\quad 0 < t < t_{light}

    Positions are relative to the eye in float32; edges take in what their rounding may hide, and a
    triangle counts only where it is beyond the rounding of the receiver. The traversal finds the
    triangles whose boxes, grown by all roundings, the ray meets; the same test decides about them
    whichever it is. No pixel is known to differ from `reference` but its ties.

    Limits: what is searched is built when the scene is new or its vertices have moved: the
    hierarchy of ``"compute"`` on the CPU, which then is most of the frame, that of ``"hardware"``
    by the device. A ray that meets 65,000 boxes and triangles or more is a `DeviceError`.

    Parameters
    ----------
    traversal : {"auto", "compute", "hardware"}
        Who finds the triangles.

        - ``"compute"``: a shader walks a bounding volume hierarchy; on every device.
        - ``"hardware"``: the ray queries of the device, through boxes of its acceleration
          structure.
        - ``"auto"``: hardware on a GPU that has ray queries, else compute. A driver on the CPU is
          faster with compute.

        `Frame.stats` and `Frame.timings` tell which it was: ``"shadow rays"`` is compute, ``"ray
        queries"`` is hardware.

    Raises
    ------
    ValueError
        Another word.
    DeviceError
        From `render`: ``"hardware"`` where the device has no ray queries, or cannot hold the scene.

    References
    ----------
    B. Smits, "Efficiency issues for ray tracing", Journal of Graphics Tools 3(2), 1998; S. Woop,
    C. Benthin, I. Wald, "Watertight ray/triangle intersection", Journal of Computer Graphics
    Techniques 2(1), 2013.

    Examples
    --------
    >>> RayTraced(traversal="compute").parameters()
    {'traversal': 'compute'}
    """

    name: ClassVar[str] = "ray_traced"

    traversal: Traversal = "auto"

    def __post_init__(self) -> None:
        _check_choice("traversal", self.traversal, get_args(Traversal))


@dataclass(frozen=True, kw_only=True)
class Exact(ShadowMethod):
    """An irregular z-buffer: every pixel right, and nothing kept between frames.

    A shadow map settles most receivers in shadow: the triangle in their texel meets their own light
    ray. The others are listed in the texels of the light's grid that they fall in. Each caster is
    tested against the receivers listed in the texels that it may touch, in each receiver's own
    light ray, relative to the receiver: receiver ``p`` with the vector ``d`` towards the light is
    in shadow where another triangle meets

    .. math:: p + t d, \\quad 0 < t < t_{light}

    so that neither the resolution nor the warp changes a pixel: they share out the work. No pixel
    is known to differ from `reference` but its ties.

    Limits: time grows with the casters near lit receivers, whether they shadow them or not. Lists
    of more than 8 million receivers are made in several pieces. A view in which millions of
    receivers fall in one tile of texels may need more items of work than a device allows, which is
    a `DeviceError`; a warp spreads them.

    Parameters
    ----------
    resolution : int, optional
        Texels along each side of the grid, at most 4096. None: about two texels to a receiver.
    warp : {"none", "rtw", "notw"}
        How the texels are spread: evenly over the receivers' box, as by `RectilinearWarp` or as by
        `NonOrthogonalWarp`. A warp shortens the lists where many receivers share a texel, and
        widens the bounds of casters.

    References
    ----------
    G. Johnson, J. Lee, C. Burns, W. Mark, "The irregular Z-buffer", ACM Transactions on Graphics
    24(4), 2005; T. Aila, S. Laine, "Alias-free shadow maps", EGSR 2004; for the warps T. Milet,
    J. Navrátil, P. Zemčík, WSCG 2015, and P. Rosen, I3D 2012.

    Examples
    --------
    >>> Exact(warp="notw").parameters()
    {'resolution': None, 'warp': 'notw'}
    """

    name: ClassVar[str] = "exact"

    resolution: int | None = None
    warp: GridWarp = "none"

    def __post_init__(self) -> None:
        if self.resolution is not None:
            resolution = count("resolution", self.resolution, "texels")
            if resolution > _LARGEST_GRID:
                raise ValueError(f"resolution must be at most {_LARGEST_GRID}, got {resolution}")
            object.__setattr__(self, "resolution", resolution)
        _check_choice("warp", self.warp, get_args(GridWarp))


@dataclass(frozen=True, kw_only=True)
class ShadowVolumes(ShadowMethod):
    """Volumes behind triangles, counted beyond each point on the rasterization hardware (z-fail).

    A triangle, turned to face the light, shades the volume between itself, the planes through its
    edges and the light, and infinity. A receiver ``p`` is inside as many volumes as its line of
    sight leaves beyond it, less those that it enters there,

    .. math:: n(p) = \\sum_{faces \\, beyond \\, p} \\pm m, \\quad
              m = \\sum_{triangles \\, of \\, an \\, edge} \\pm 1,

    and in shadow where ``n`` is positive, wherever light and camera are. Sides are drawn of the
    silhouettes alone, the edges where the triangles turned to the light do not cancel (``m`` is not
    0), so that meshes may be closed or open and an edge may have any number of triangles. A
    triangle never shadows itself, and no bias is needed: nothing visible is nearer than the
    receiver, and whether a side is beyond it is asked of the plane through edge and light.

    Limits: the hardware rounds corners to 1/256 of a pixel, so that single pixels at outlines of
    triangles and volumes may be wrong: 279 of 13.5 million in 143 views of eight scenes at
    480 x 270, at most 16 in one view. Time grows with the area of all volumes in the
    image. Edges are found on the CPU when the scene is new or its vertices have moved.

    Raises
    ------
    DeviceError
        From `render`: an image wider or higher than the device's textures.

    References
    ----------
    F. Crow, "Shadow algorithms for computer graphics", SIGGRAPH 1977; M. McGuire, J. Hughes, K.
    Egan, M. Kilgard, C. Everitt, "Fast, practical and robust shadows", NVIDIA 2003; B. Kim, K. Kim,
    G. Turk, "A shadow-volume algorithm for opaque and transparent nonmanifold casters", Journal of
    Graphics Tools 13(3), 2008.

    Examples
    --------
    >>> ShadowVolumes().parameters()
    {}
    """

    name: ClassVar[str] = "shadow_volumes"


@dataclass(frozen=True, kw_only=True)
class Auto(ShadowMethod):
    """Chooses the method and its resolution: the cheapest for an error.

    Where two small shadow maps cost less than the methods without a wrong pixel, they are rendered
    first, the second twice as fine. The ``d`` pixels in which they differ bound those that are
    wrong in the finer one, as a share of the ``n`` pixels that see a surface,

    .. math:: e = c (d + 3) / n,

    with ``c`` measured on generated scenes. If that is below `max_error` the finer map is the
    answer; a still finer one is tried as long as it promises to be cheaper than `RayTraced` and
    `Exact`, one of which is the answer else. Costs are predicted by a model of triangles, pixels
    and texels, which ``python -m lixel.calibration`` measures on one device; no clock is read, so
    that the same call makes the same choice. ``frame.stats["auto"]`` says what was chosen and why,
    and ``frame.method`` is the chosen method.

    Limits: it is one choice for the whole image. Times of other devices than the calibrated one are
    predicted as if they were its own. What two maps miss alike, such as casters far thinner than a
    texel, they do not tell.

    Parameters
    ----------
    max_error : float
        Most wrong pixels, as a share of the pixels that see a surface, from 0 to 1. With 0 no map
        is tried.
    max_ms : float, optional
        Most milliseconds on the GPU. A preference: where no method keeps both, the finest maps
        whose predicted time is within it are taken, and the statistics say so.

    Examples
    --------
    >>> method_from("auto")
    Auto(max_error=0.001, max_ms=None)
    """

    name: ClassVar[str] = "auto"

    max_error: float = 0.001
    max_ms: float | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "max_error", real("max_error", self.max_error))
        if not 0.0 <= self.max_error <= 1.0:
            raise ValueError(f"max_error must be from 0 to 1, got {self.max_error}")
        if self.max_ms is not None:
            object.__setattr__(self, "max_ms", real("max_ms", self.max_ms))
            if not 0.0 < self.max_ms < math.inf:
                raise ValueError(f"max_ms must be finite and above 0, got {self.max_ms}")


MapMethod: TypeAlias = (
    Uniform
    | DesiredView
    | MinimalShadowMap
    | Focused
    | LightSpacePerspective
    | PerspectiveShadowMap
    | PlaneOptimal
    | SceneOptimized
    | Cascades
    | RectilinearWarp
    | NonOrthogonalWarp
    | ImprovedParaboloid
)
OmnidirectionalMethod: TypeAlias = Cube | DualParaboloid | Spot
Method: TypeAlias = MapMethod | OmnidirectionalMethod | RayTraced | Exact | ShadowVolumes | Auto

METHODS: Mapping[str, type[Method]] = MappingProxyType(
    {method.name: method for method in get_args(Method) if method is not Auto}
)
"""Every method by name, but `Auto`, which chooses one of them."""

MAP_METHODS: Mapping[str, type[MapMethod]] = MappingProxyType(
    {method.name: method for method in get_args(MapMethod)}
)
"""Those that look up a shadow map of any light, by name."""

OMNIDIRECTIONAL_METHODS: Mapping[str, type[OmnidirectionalMethod]] = MappingProxyType(
    {method.name: method for method in get_args(OmnidirectionalMethod)}
)
"""Those that look up a shadow map of a light with a position, by name."""

WARPS: Mapping[str, type[RectilinearWarp | NonOrthogonalWarp]] = MappingProxyType(
    {method.name: method for method in (RectilinearWarp, NonOrthogonalWarp)}
)
"""Those that warp a fitted map."""


def method_from(method: str | Method) -> Method:
    """The method of a name, with its default parameters; a method object as it is.

    Parameters
    ----------
    method : str or method object
        A name, ``"auto"``, or a composition of names joined by ``+``: ``"min_sm+notw"`` is
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
    known = ", ".join(repr(name) for name in (*METHODS, Auto.name))
    if isinstance(method, type) and issubclass(method, ShadowMethod):
        raise TypeError(f"method must be an object, {method.__name__}(), got the class itself")
    if not isinstance(method, str):
        raise TypeError(
            f"method must be a name ({known}) or a method object, got {type(method).__name__}"
        )
    if method == Auto.name:
        return Auto()
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
