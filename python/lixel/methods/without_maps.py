"""Methods that look up no shadow map, and misclassify no pixel, or a few."""

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

    On a GPU positions are float32, relative to the eye. Edges are widened by what rounding may
    hide, and a triangle counts only if it is farther from the receiver than rounding can tell. The
    traversal finds the triangles whose boxes, grown by all roundings, the ray meets; the same test
    decides about them in either traversal. The CPU engine computes in float64. No pixel is known to
    differ from `reference` but its ties.

    Limits: the hierarchy is built when the scene is new or its vertices have moved. For
    ``"compute"`` this is done on the CPU, and takes most of that frame; for ``"hardware"`` the
    device does it. A ray that meets 65,000 boxes and triangles or more is a `DeviceError`.

    Parameters
    ----------
    traversal : {"auto", "compute", "hardware"}
        How the triangles are found.

        - ``"compute"``: a shader walks a bounding volume hierarchy, on every device.
        - ``"hardware"``: by the ray queries of the device.
        - ``"auto"``: hardware on a GPU that has ray queries, else compute, which is faster on a
          CPU.

        The CPU engine walks the hierarchy itself, unless it is told ``"hardware"``.
        `Frame.stats` and `Frame.timings` say which it was: ``"shadow rays"`` is compute, ``"ray
        queries"`` is hardware.

    Raises
    ------
    ValueError
        Another word.
    DeviceError
        From `render`: ``"hardware"`` where the device has no ray queries, as the CPU engine has
        none, or cannot hold the scene.

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
    """An irregular z-buffer: no misclassified pixel, and no hierarchy to build.

    A shadow map finds most receivers that are in shadow: the triangle in their texel meets their
    own light ray. Each of the others is listed in the texel of the light's grid that it falls in.
    Each caster is tested against the receivers listed in the texels that it may touch. Receiver
    ``p`` with the vector ``d`` towards the light is in shadow where another triangle meets

    .. math:: p + t d, \\quad 0 < t < t_{light}

    This test does not depend on the grid, so neither its resolution nor its warp changes a pixel;
    they only distribute the work. No pixel is known to differ from `reference` but its ties.

    The CPU engine lists the triangles in the cells of the light's grid instead, and tests each
    receiver against those in its cell; crowded cells have a finer grid of their own. `resolution`
    and `warp` shape the grid of the GPU engine only.

    Limits: time grows with the casters near lit receivers, whether they shadow them or not. If
    millions of receivers fall in one tile of texels, more work may be needed than the device can
    list, which is a `DeviceError`; a warp spreads them.

    Parameters
    ----------
    resolution : int, optional
        Texels along each side of the grid, at most 4096. None: about two texels to a receiver.
    warp : {"none", "rtw", "notw"}
        How the grid is warped: not at all, as by `RectilinearWarp`, or as by `NonOrthogonalWarp`. A
        warp shortens the lists where many receivers share a texel, and widens the bounds of
        casters.

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
    """The volumes behind triangles that each receiver is in, counted along its line of sight.

    A triangle, oriented to face the light, shades the volume between itself, the planes through its
    edges and the light, and infinity. A receiver ``p`` is inside as many volumes as its line of
    sight leaves beyond it, less those that it enters there,

    .. math:: n(p) = \\sum_{faces \\, beyond \\, p} \\pm m, \\quad
              m = \\sum_{triangles \\, of \\, an \\, edge} \\pm 1,

    and in shadow where ``n`` is positive, wherever light and camera are. Only silhouettes have
    sides: the edges whose triangles, oriented to the light, do not cancel (``m`` is not 0). So
    meshes may be closed or open, and an edge may have any number of triangles. A triangle never
    shadows itself, and no bias is needed: nothing visible is nearer than the receiver, and the
    plane through edge and light says whether a side is beyond it.

    A GPU counts the faces beyond each receiver on its rasterization hardware (z-fail). The CPU
    engine counts the sides before it, and begins with the volumes that the eye is in (z-pass): the
    sum is the same, and no triangle is drawn. Parts of the image where a side is before all
    receivers or behind them are counted at once, and what float32 leaves open is decided in
    float64, so that no pixel is known to differ from `reference` but its ties.

    Limits: a GPU rounds corners to 1/256 of a pixel, so that a few pixels at outlines of triangles
    and volumes are misclassified; docs/results counts them. Time grows with the area of all volumes
    in the image, on the CPU engine with the length of their outlines. Edges are found on the CPU
    when the scene is new or its vertices have moved.

    Raises
    ------
    DeviceError
        From `render`: an image wider or higher than the textures of the GPU.

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

    def takes_holes(self) -> bool:
        """No: a volume is bounded by edges, and the rim of a hole is none."""
        return False
