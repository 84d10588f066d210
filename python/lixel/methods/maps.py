"""Maps whose texels are all alike, and cascades of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

from .base import BoxMethod, RotatedMethod, ShadowMapMethod

Boxes: TypeAlias = Literal["receivers", "slabs"]
Splits: TypeAlias = Literal["receivers", "quantiles", "practical", "logarithmic", "uniform"]


@dataclass(frozen=True, kw_only=True)
class Uniform(RotatedMethod):
    """One map over all casters, with texels of one size.

    The light's orthographic box holds every triangle of the scene, so the map does not depend on
    the camera. With ``x, y`` across and ``z`` along the light, texel and depth of a point are

    .. math:: u = r (x - x_0) / (x_1 - x_0), \\quad v = r (y - y_0) / (y_1 - y_0), \\quad
              d = (z - z_0) / (z_1 - z_0)

    where the box is the scene's, rotated as that of `DesiredView`, and ``r`` the resolution. A
    receiver is in shadow where its depth exceeds the one stored in its texel by more than the bias.

    Limits: most texels cover what the camera does not see. In a large scene a texel spans many
    pixels, and shadow edges look like stairs.

    Parameters are those of `RotatedMethod`.

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
class DesiredView(BoxMethod, RotatedMethod):
    """One map over the box of the visible receivers that face the light.

    As `Uniform`, but the box across the light holds only the visible receivers that face the light
    (all others are in shadow without a map), found from the visibility buffer. No texel lies
    outside what is seen, and casters that can reach no receiver are left out:

    .. math:: x_0 = \\min_i x_i, \\quad x_1 = \\max_i x_i \\quad \\text{over receivers } i,

    likewise ``y``; depth reaches from the farthest receiver back to the nearest caster. The map is
    rotated around the light's direction so that its rows and columns run diagonally to the dominant
    edges of the scene, unless the scene's box would grow too much: a triangle that is thinner than
    a texel and lies along a row is seen by all of that row's texels or by none. The rotation
    depends on light and scene, not on the camera.

    Limits: texels have one size, so near receivers get too few when far ones widen the box. The map
    moves with the camera, and shadow edges flicker without `snap`.

    Parameters are those of `BoxMethod` and `RotatedMethod`.

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

    As `DesiredView`, but rotated around the light's direction: the convex hull of the receivers
    across the light gives the smallest rectangle that holds them, one of whose sides lies along an
    edge of the hull (rotating calipers):

    .. math:: \\min_{\\varphi} \\; w(\\varphi) \\, w(\\varphi + \\pi/2), \\quad
              w(\\varphi) = \\max_i \\langle p_i, e_\\varphi \\rangle
              - \\min_i \\langle p_i, e_\\varphi \\rangle.

    The near plane lies before every caster that may shadow them, the far plane at the last
    receiver.

    Limits: those of `DesiredView`; the map also rotates as the camera moves.

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
class Cascades(BoxMethod, RotatedMethod):
    """The view is split into slabs of depth, each with a map over the box of its receivers, or of
    the slab itself.

    With z from the near to the far end of what is split, slab i of m ends at

    .. math:: z_i = \\lambda \\, z_n (z_f / z_n)^{i / m}
              + (1 - \\lambda) (z_n + (z_f - z_n) \\, i / m)

    Limits: each layer is a pass over the casters and has a map of `resolution`; four
    layers of half the resolution have as many texels as one map. The faces of a cube around a point
    light are not split.

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
    boxes : {"receivers", "slabs"}
        What each map is over: the receivers in its slab (Lauritzen et al.), or the eight corners of
        the slab of the view frustum (Zhang et al.), from the camera's near plane to the end of the
        scene. A slab without receivers has no map in either case. Where a corner is behind a light
        with a position, the map is the whole cone's.
    sample_resolution : int
        Samples of the receivers along the longer side of the image; an image that is narrower than
        16 to 9 has no fewer samples than that one.
    snap : bool
        Texel snapping, see `BoxMethod`, of every layer; slabs that the receivers bound end at
        powers of the fourth root of 2, in units of the world.

    The others are those of `RotatedMethod`.

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
    boxes: Boxes = "receivers"
    sample_resolution: int = 180
