"""Maps around a light with a position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

from ..light import WITH_POSITION, Light, SpotLight
from .base import BoxMethod, ShadowMapMethod

Splitting: TypeAlias = Literal["light", "view"]


@dataclass(frozen=True, kw_only=True)
class Cube(BoxMethod):
    """Six perspective maps around a light with a position: the faces of a cube.

    A face takes the receivers of its pyramid; with ``x, y, z`` in its axes,

    .. math:: u = r \\frac{x / z - u_0}{u_1 - u_0}, \\quad v = r \\frac{y / z - v_0}{v_1 - v_0}.

    A face that no receiver falls in is not made, and is counted in ``stats["skipped_layers"]``. A
    light far away (see `PointLight`) has one map of what it sees of the scene.

    Limits: up to six passes over the casters. A texel in a corner of a whole face covers a fifth of
    the solid angle of one in its middle.

    Parameters
    ----------
    cut : {"receivers", "face"}
        What a map covers: the box of its receivers, or the whole face.
    snap : bool
        Texel snapping of the boxes of receivers, see `BoxMethod`.
    turned : bool
        Rotates the cube, so that the rows and columns of its faces run diagonally to the dominant
        edges of the scene, see `DesiredView`.

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


@dataclass(frozen=True, kw_only=True)
class DualParaboloid(BoxMethod):
    """Two maps around a light with a position, as two paraboloids back to back reflect its rays.

    With :math:`d = (x, y, z)` the unit vector to a point in the axes of one half,

    .. math:: u = \\frac{x}{1 + z}, \\quad v = \\frac{y}{1 + z}

    on the unit disc; depth is the distance. The first half looks along the light's axis, or down. A
    light far away (see `PointLight`) has one map of what it sees of the scene.
    Rasterization is exact, so that a floor of two triangles needs no tessellation.

    Limits: texels in the middle cover four times the solid angle of those at the rim. The corners
    of a whole map, outside the disc, are wasted.

    Parameters
    ----------
    cut : {"hemisphere", "receivers"}
        What a map covers: its whole half of space, as published, or the box of its receivers.
    splitting : {"light", "view"}
        Which way the first half looks, so that the plane between the two is across it: along the
        light's axis, or down; or along the mean direction to the corners of the truncated view
        frustum, as in Eq. 1 of `ImprovedParaboloid`.
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
    splitting: Splitting = "light"


@dataclass(frozen=True, kw_only=True)
class ImprovedParaboloid(ShadowMapMethod):
    """One paraboloid map that is fitted to what the camera sees.

    As published, with ``cut="frustum"``, the view frustum is truncated to the depths of the
    receivers. The directions :math:`D_j` point from the light to its eight corners. The axis of the
    paraboloid is their mean, and the map reaches to the largest angle between it and them,

    .. math:: C = \\operatorname{norm} \\sum_j D_j, \\quad F = \\max_j \\angle (D_j, C)

    (Eq. 1 and 2), by the zoom factor :math:`Z = \\sin F / (1 + \\cos F)` (section 3.3). A light at
    infinity is the limit: a square around the corners across the light, and `MinimalShadowMap` for
    ``cut="receivers"``. Eq. 2 is printed as a maximum of dot products; the largest angle is meant.

    Limits: where the light is inside the truncated frustum, or the cone is wider than a hemisphere,
    ``"frustum"`` is the same as `DualParaboloid`. The other cuts use one map if a hemisphere holds
    the receivers (``"receivers"`` a wider one, if the light is outside of the view); otherwise two,
    each over the box of its receivers.

    Parameters
    ----------
    cut : {"frustum", "cone", "receivers"}
        What the map covers. ``"frustum"``: the frustum's corners, as published. ``"cone"``: the
        smallest square around the receivers themselves, with the axis of their smallest cone.
        ``"receivers"``: the box of the receivers, with the axis that gives them the finest texels.
        A paraboloid's texels are finer away from its axis, so this axis often points past the
        receivers. The map is rotated as that of `DesiredView`. Axis and rotation jump as the camera
        moves.
    splitting : {"light", "view"}
        Where two paraboloids are needed, which way the first looks, see `DualParaboloid`. With
        ``"view"`` they are rotated to the view, which is all that the paper allows there (section
        5); ``"light"`` is the regular pair that it falls back to (3.1).

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
    splitting: Splitting = "light"


@dataclass(frozen=True, kw_only=True)
class Spot(BoxMethod):
    """One perspective map along the axis of a spot light.

    With ``x, y, z`` in the light's axes, over the box of its receivers,

    .. math:: u = r \\frac{x / z - u_0}{u_1 - u_0}, \\quad v = r \\frac{y / z - v_0}{v_1 - v_0}.

    A wide cone, which a plane would stretch too much, is mapped as one half of `DualParaboloid`.

    Limits: texels have one size in the plane, whatever the camera sees.

    Parameters
    ----------
    cut : {"receivers", "cone"}
        What the map covers: the box of the receivers, or the whole cone.
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
