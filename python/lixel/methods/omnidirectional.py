"""Maps around a light with a position."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal

from ..light import WITH_POSITION, Light, SpotLight
from .base import BoxMethod, ShadowMapMethod


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
