"""Methods that look up no shadow map: no pixel is known to be wrong, or single ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

from .base import ShadowMethod

GridWarp: TypeAlias = Literal["none", "rtw", "notw"]
Traversal: TypeAlias = Literal["auto", "compute", "hardware"]


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
