"""Maps in pages, of which only those are drawn that receivers look at."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

from .base import Resolution, ShadowMapMethod

PagesOver: TypeAlias = Literal["receivers", "scene"]


@dataclass(frozen=True, kw_only=True)
class VirtualShadowMap(ShadowMapMethod):
    """A map far larger than memory, in pages: each receiver looks into texels as wide as its pixel.

    The map is a pyramid of levels, each with half of the texels of the one before along its sides,
    and each level is cut into pages. With ``a`` the area of a pixel in texels of the finest level,
    level 0, both across their rays at the receiver, it looks into level

    .. math:: l = \\lfloor \\frac{1}{2} \\log_2 a + b \\rfloor

    between the finest and the coarsest one, where ``b`` is `level_bias`: the coarsest level whose
    texels are no larger than a pixel. So the perspective aliasing error is from 1/2 to 1; how the
    surface is turned is left out, since neighbours would then ask for levels, and so pages, of
    their own. A first pass marks the pages that the lookups touch, those across a page's edge too,
    and only these are drawn: the triangles are sorted into the pages of a level at once. Where more
    are marked than `pages`, ``b`` grows in steps of a quarter until they fit, so every receiver has
    its texels; ``stats["level_bias"]`` says where it ended. Around a point, or within a wide cone,
    each face of a cube is such a map.

    `Frame.pages` lists the pages, `Frame.page_levels` has the level of each pixel, and
    `Frame.shadow_map` the texels, page after page. `lixel.pictures.page_plots` draws them.

    Limits: each level that is looked into is a pass over the casters. Under light that grazes a
    surface a texel is stretched over many pixels, however small it is across its ray. On a GPU the
    pages of one level must fit into one buffer of the device, and none are kept.

    Parameters
    ----------
    resolution : int
        Texels of the finest level along each side. None of them takes memory until it is looked at.
        A map in pages is a square: a level is chosen by the area of a texel. Any other is refused.
    page_size : int
        Texels of a page along each side: a power of two from 64 to 4096.
    pages : int
        The most pages that are stored; there is at least one for each map of the light. A page of
        128 x 128 texels takes 128 KiB.
    level_bias : float
        Levels added to each receiver's, of either sign: 1 for texels of up to twice the width of
        a pixel, -1 for half of it.
    cut : {"receivers", "scene"}
        What the map is over: the square around the receivers, or around the scene, or with a
        position the whole cube or cone. With ``"scene"`` pages hold still while the camera moves,
        and those that the frame before had are not drawn again, as long as light and vertices are
        the same; ``stats["shadow map"]["kept_pages"]`` counts them. The answer is the same bytes.
        A GPU draws all pages anew.

    The others are those of `ShadowMapMethod`; `rasterization` must be ``"exact"``, and `lookup` one
    that looks at texels around the receiver alone: no filtered map, no ``"revectorized"``.

    References
    ----------
    A. E. Lefohn, S. Sengupta, J. D. Owens, "Resolution-matched shadow maps", ACM Transactions on
    Graphics 26(4), 2007; M. Giegl, M. Wimmer, "Queried virtual shadow maps", I3D 2007, and "Fitted
    virtual shadow maps", Graphics Interface 2007.

    Examples
    --------
    >>> VirtualShadowMap(pages=512).resolution
    16384
    """

    name: ClassVar[str] = "virtual"

    resolution: Resolution = 16384
    page_size: int = 128
    pages: int = 4096
    level_bias: float = 0.0
    cut: PagesOver = "receivers"
