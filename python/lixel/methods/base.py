"""The base classes of methods, and the parameters of every map."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias, TypeVar

from ..light import LIGHTS, Light
from .checked import Checked
from .filters import Filter
from .published import PUBLISHED, PUBLISHED_NAME, published_values

Bias: TypeAlias = Literal["auto", "constant", "slope", "receiver_plane"]
Rasterization: TypeAlias = Literal["exact", "linear"]
Lookup: TypeAlias = Literal[
    "auto", "auto_5x5", "depth", "triangle", "triangle_1x1", "triangle_5x5", "revectorized",
    "variance", "exponential_variance", "moments",
]  # fmt: skip

Resolution: TypeAlias = int | tuple[int, int]
"""Texels of a map: along each side of a square, or (width, height)."""

Own = TypeVar("Own", bound="ShadowMethod")


def resolution_text(resolution: Resolution) -> str:
    """As a command line has it: ``"1024"``, ``"1024x512"``."""
    return "x".join(map(str, resolution if isinstance(resolution, tuple) else (resolution,)))


@dataclass(frozen=True, kw_only=True)
class ShadowMethod(Checked):
    """The base class of all methods."""

    lights: ClassVar[tuple[type[Light], ...]] = LIGHTS
    """The kinds of light that the method is made for."""

    @classmethod
    def published(cls: type[Own], *, paper: str | None = None, **changes: Any) -> Own:
        """The method as a paper has it; the class itself has the defaults, which may be better.

        ``"rtw@published"`` and ``"rtw@milet-2015"`` are its names wherever a method has a name.
        `lixel.methods.PUBLISHED` holds each value with the section or the equation that it is
        from, and says which ones the paper leaves open; a method's page lists them.

        Parameters
        ----------
        paper : str, optional
            A key of `lixel.methods.PAPERS`. None: the method's own paper.
        **changes
            Parameters that are to differ from the paper's. With a `fit` that a paper joins with the
            warp, the values are those of the composition.

        Raises
        ------
        ValueError
            No paper runs the method, or not this one; or a wrong value.
        """
        composition = f"{changes.get('fit')}+{cls.name}"
        name = composition if composition in PUBLISHED else cls.name
        values = {key: given.value for key, given in published_values(name, paper).items()}
        return cls(**{**values, **changes})

    def takes(self, light: Light) -> bool:
        """Whether the method, with its parameters, is made for the light."""
        return isinstance(light, self.lights)

    def takes_holes(self) -> bool:
        """Whether the method, with its parameters, heeds the holes of masked triangles.

        A scene that has some is refused by one that does not.
        """
        return self.parameters().get("rasterization") != "linear"

    @property
    def composition(self) -> str:
        """Its name, or a composition such as ``"cube+notw"``, whatever its other parameters."""
        return self.name

    @property
    def published_in(self) -> str | None:
        """The paper whose values the method has, whatever its resolution; None where there is none,
        or where a paper says nothing of the parameters."""
        for paper, given in PUBLISHED.get(self._published_name, {}).items():
            values = {name: value for name, (value, *_) in given.items()}
            if values and self == type(self)(**{**values, "resolution": self.map_resolution}):
                return paper
        return None

    @property
    def spelling(self) -> str:
        """What `method_from` calls it: ``"rtw"``, ``"cube+notw"``, ``"rtw@published"``."""
        paper = self.published_in
        if paper is None:
            return self.composition
        is_own = paper == next(iter(PUBLISHED[self._published_name]))
        return f"{self._published_name}@{PUBLISHED_NAME if is_own else paper}"

    @property
    def _published_name(self) -> str:
        return self.composition if self.composition in PUBLISHED else self.name

    @property
    def map_resolution(self) -> Resolution | None:
        """The parameter `resolution`, None where a method has no map."""
        return self.parameters().get("resolution")

    @property
    def map_size(self) -> tuple[int, int] | None:
        """Columns and rows of the map, None where a method has no map."""
        resolution = self.map_resolution
        return (resolution, resolution) if isinstance(resolution, int) else resolution


@dataclass(frozen=True, kw_only=True)
class ShadowMapMethod(ShadowMethod):
    """The base class of the methods that look up a shadow map.

    Parameters
    ----------
    resolution : int or (int, int)
        Texels of the map along each side, or (width, height). A map that is not square lies with
        its longer side along that of the box or rectangle that it is cut to; one along the view
        (`LightSpacePerspective`, `Trapezoidal`, `LogPerspective`) always has its rows across it,
        and those of `PerspectiveShadowMap` and `PlaneOptimal` are the image's. Arrays of texels
        have the shape (layers, height, width).
    rasterization : {"exact", "linear"}
        How casters become texels.

        - ``"exact"``: each texel takes its own light ray through projection and warp.
        - ``"linear"``: as published (Rosen, 6.1): corners are projected and warped, edges between
          them are straight in the map, and depths are interpolated along them. This is right where
          a projection keeps lines straight and nothing is warped. A paraboloid ends at its rim, and
          around a light casters nearer than 2^-16 of the farthest are left out.
    tessellation : float, optional
        For ``"linear"``: triangles are split at the middles of their edges until no edge in the map
        is longer than this share of its side; 0.05, 0.025 and 0.01 are the paper's. Where two
        functions of `NonOrthogonalWarp` differ, an edge that crosses from one to the other may stay
        longer. None: no triangle is split. If the pieces do not fit in memory, a `DeviceError` is
        raised.
    lookup : str, Pcf, Variance, ExponentialVariance or Moments
        How a receiver is compared with the map.

        - ``"depth"``: with the depth in its texel.
        - ``"triangle"``: the receiver's own light ray is tested against the triangles stored in the
          3 x 3 texels around it (``"triangle_1x1"``: in its own, ``"triangle_5x5"``: in 5 x 5).
          There is no false shadow. A caster that none of these texels saw is missed, which happens
          often where triangles are smaller than texels.
        - ``"auto"``, the default, decides in this order:

          1. In shadow, if a triangle stored in the 3 x 3 texels is hit (``"auto_5x5"``: 5 x 5).
          2. In shadow, if at least 4 of the 9 depth tests there say so, and these have at least 0.9
             of the bilinear weight of all. This finds casters smaller than a texel.
          3. Where at least 6 of the 9 texels hold something nearer, and each another triangle, 0.6
             of the weight is enough.
          4. Otherwise lit.

        - ``"revectorized"``: as ``"depth"``, but along the stairs of texels the edge between lit
          and shadow runs straight from the middle of one step to the middle of the next, for up to
          16 texels on each side of the receiver.
        - `Pcf`: the share of depth tests in a disc, for antialiased or soft edges.
        - `Variance`, `ExponentialVariance` and `Moments`, or ``"variance"``,
          ``"exponential_variance"`` and ``"moments"`` with their defaults: moments of the depths in
          a blur.

        The triangle in a texel, and those of its neighbours, are what Dai, Yang and Feng test, too.
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

    References
    ----------
    For the triangle lookups Q. Dai, B. Yang, J. Feng, "Reconstructable geometry shadow maps", I3D
    2008; P. Lecocq, J.-E. Marvie, G. Sourimant, P. Gautron, "Sub-pixel shadow
    mapping", I3D 2014. For the revectorized one V. Bondarev, "Shadow map silhouette
    revectorization", I3D 2014; M. Macedo, A. Apolinário, "Revectorization-based shadow mapping",
    Graphics Interface 2016; A. Reshetov, "Morphological antialiasing", HPG 2009.
    """

    resolution: Resolution = 1024
    rasterization: Rasterization = "exact"
    tessellation: float | None = None
    lookup: Lookup | Filter = "auto"
    bias: Bias = "auto"
    constant_bias: float | None = None
    slope_bias: float = 1.0

    @property
    def map_size(self) -> tuple[int, int]:
        """Columns and rows of the map."""
        sides = self.resolution
        return sides if isinstance(sides, tuple) else (sides, sides)


@dataclass(frozen=True, kw_only=True)
class RotatedMethod(ShadowMapMethod):
    """The base class of the methods whose maps a rule rotates around the light's direction.

    Parameters
    ----------
    rotation : float, optional
        Of the map's rows and columns around the light's direction, in radians, from where the
        world's Y is up in the map (Z, under a light along Y); quarters of a turn make no
        difference, and one that is not square lies along its box. None: off the dominant edges of
        the scene, see `DesiredView`. The faces of a cube around a light are not rotated.

    The others are those of `ShadowMapMethod`.
    """

    rotation: float | None = None


@dataclass(frozen=True, kw_only=True)
class BoxMethod(ShadowMapMethod):
    """The base class of the methods whose maps are boxes around receivers, along axes of the light.

    Parameters
    ----------
    snap : bool
        Texel snapping, which prevents the flicker of shadow edges while the camera moves. The width
        of a texel is rounded up to a power of the fourth root of 2 (at most 1.19 times as wide),
        and texels lie on a grid that moves only with the light.

    The others are those of `ShadowMapMethod`.

    References
    ----------
    M. Valient, "Stable rendering of cascaded shadow maps", ShaderX6, 2008.
    """

    snap: bool = False
