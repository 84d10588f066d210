"""Methods that fit one matrix to the light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias

import numpy as np

from .base import BoxMethod, ShadowMapMethod

MatrixFit: TypeAlias = Literal["receivers", "frustum"]
Samples: TypeAlias = Literal["shadow", "boundary", "facing"]
Boundaries: TypeAlias = Literal["focused", "previous"]
Optimizer: TypeAlias = Literal["paper", "simplex"]
Matrix: TypeAlias = tuple[tuple[float, ...], ...]


@dataclass(frozen=True, kw_only=True)
class LightMatrixMethod(ShadowMapMethod):
    """The base class of the methods that fit one matrix to the light.

    Rows 1, 2 and 4 of a light's matrix take a point to its place in the map. All points of a light
    ray must have the same place, so the matrix is a homography between rays and texels.
    Rasterization and lookup are exact for all of them.

    If what a light with a position reaches is not all in front of it, it gets one matrix for each
    face of a cube around it that holds a receiver.

    Parameters
    ----------
    fit : {"receivers", "frustum"}
        What the map must hold: the receivers that face the light, found from samples of the image,
        or the part of the scene's box that is in the camera's frustum. What is off the map is lit.
    sample_resolution : int
        Samples along the longer side of the image, for ``fit="receivers"``; an image that is
        narrower than 16 to 9 has no fewer samples than that one.
    margin : float
        The share of its size by which the map is widened, from 0 to 1, because a receiver between
        the samples may lie outside.

    The others are those of `ShadowMapMethod`.
    """

    fit: MatrixFit = "receivers"
    sample_resolution: int = 180
    margin: float = 0.02


@dataclass(frozen=True, kw_only=True)
class Focused(BoxMethod, LightMatrixMethod):
    """One map over the smallest rectangle, in any orientation, around what is seen.

    The points that the map must hold are projected along the light. A side of the smallest
    rectangle around their convex hull lies on an edge of the hull; a sheared rectangle may be
    smaller still:

    .. math:: u = A (x, y)^T + b

    with ``x, y`` across the light, A and b from the rectangle.

    Limits: texels have one size; near receivers get no more of them than far ones.

    Parameters
    ----------
    snap : bool
        Texel snapping, see `BoxMethod`. The rectangle is not rotated then, and a light with a
        position has one for each face of a cube.

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
    of what is seen. Unlike in the paper, :math:`z_n` is at least a twentieth of the farthest depth,
    so that an eye inside of what is seen has no apex beside it.

    Limits: the smaller the angle between light and view, the less there is to gain; along the view
    the map is that of `Focused`.

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
class LogPerspective(LightMatrixMethod):
    """A perspective across the light, as `LightSpacePerspective`, whose rows a logarithm spreads.

    With x beside the view and w the distance along it from the perspective's apex, in the light's
    plane, from :math:`w_0` to :math:`w_1`,

    .. math:: u = x / w, \\quad v = \\log (w / w_0) / \\log (w_1 / w_0)

    Columns are as wide as w is large and rows are as long, so that texels grow in both directions
    as the pixels of a view across the light do: the largest error is of the order of the logarithm
    of the farthest over the nearest depth, where a perspective's is of the order of a root of that.

    The paper fits a curve to the apex that is best for each angle between light and view. Here the
    apex that is best is searched for: the one with the least largest perspective aliasing error,
    that of ``frame.largest_aliasing_error``, over what the map must hold. Nothing is taken for
    nearer than a thousandth of the farthest depth. There is no ``"log_psm@published"``, because
    that curve is not at hand, and the papers whose values lixel holds do not run the method.

    Rasterization is exact without tessellation, which lines that a logarithm bends would need
    otherwise; ``rasterization="linear"`` shows what happens.

    Limits: the smaller the angle between light and view, the less there is to gain; along the view
    the map is that of `Focused`. It is that for an orthographic camera, too. Where most of what is
    seen is far away, as of terrain under a low sun, far texels are larger than those of `Focused`.
    A light with a position that is near has the map of `LightSpacePerspective`, without a
    logarithm. The map has no matrix, so `LightMatrix.of` and a warp's `previous` do not take it.

    Parameters are those of `LightMatrixMethod`.

    References
    ----------
    D. B. Lloyd, N. K. Govindaraju, C. Quammen, S. E. Molnar, D. Manocha, "Logarithmic perspective
    shadow maps", ACM Transactions on Graphics 27(4), 2008; the measure: D. B. Lloyd, D. Tuft,
    S. Yoon, D. Manocha, "Warping and partitioning for low error shadow maps", Eurographics
    Symposium on Rendering 2006.

    Examples
    --------
    >>> LogPerspective().name
    'log_psm'
    """

    name: ClassVar[str] = "log_psm"


@dataclass(frozen=True, kw_only=True)
class Trapezoidal(LightMatrixMethod):
    """A trapezoid around what is seen, as the light sees it, becomes the map.

    Its centre line is the view through the eye; its top line, before what is seen, and its base
    line, behind it, lie across that; its sides meet in a point q and touch what is seen. With x
    beside the centre line and y along it, from the top line, and :math:`\\lambda` the length,

    .. math:: u = \\frac{q x}{y + q}, \\quad v = \\frac{(\\lambda + q) y}{\\lambda (y + q)}, \\quad
              q = \\frac{(1 - \\xi) f}{\\xi - f} \\lambda

    so that the nearer part of the trapezoid, the share f (`focus`) of its length, gets the share
    :math:`\\xi` (`line`) of the map: the paper's 80 % rule.

    The paper lays the trapezoid around the view frustum, ``fit="frustum"``, and focuses on what is
    nearer than a distance from the eye. Where the view covers less than half of the trapezoid's
    length, because the light shines nearly along it, f moves towards :math:`\\xi`, and the
    trapezoid towards a box, without a jump. So it is a box for an orthographic camera, too. There
    is no ``"trapezoidal@published"``: the paper's distance is set by hand for each scene, and the
    papers whose values lixel holds do not run the method.

    Limits: a light along the view has a map that is that of `Focused`. Where most of what is seen
    is far away, as of terrain under a low sun, far texels are larger than those of `Focused`.

    Parameters
    ----------
    focus : float
        The nearer part of the trapezoid, as a share of its length above 0. From `line` on the
        trapezoid is a box.
    line : float
        The share of the map that the nearer part gets, above 0 and below 1.

    The others are those of `LightMatrixMethod`.

    References
    ----------
    T. Martin, T.-S. Tan, "Anti-aliasing and continuity with trapezoidal shadow maps", Eurographics
    Symposium on Rendering 2004.

    Examples
    --------
    >>> Trapezoidal(focus=0.4).line
    0.8
    """

    name: ClassVar[str] = "trapezoidal"

    focus: float = 0.5
    line: float = 0.8


@dataclass(frozen=True, kw_only=True)
class PerspectiveShadowMap(LightMatrixMethod):
    """A map of the scene after the camera's perspective, in which near things are large.

    With C the camera's projective map and L the light, a point or a direction,

    .. math:: (u, v) = R_{1,2} (C p - C L) / R_3 (C p - C L)

    where R turns the third axis from the light towards the middle of what is seen. A virtual camera
    steps back from what is seen until the light has all of it in front.

    Limits: a light along the view sees the transformed scene at a grazing angle. After the step
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
    """A map in which the texels on one plane, that of most light, are the pixels.

    A point p has the place in the map that its shadow on the plane :math:`\\pi` has in the image:

    .. math:: (u, v) = C (p \\, (\\pi L) - L \\, (\\pi p))

    with C the camera's projective map and L the light, homogeneous.

    Of the planes that are seen, it is the one that most light falls on; with ``fit="frustum"`` the
    one that has most pixels.

    Limits: off the plane texels may have any size. A point has no place in the map where its shadow
    on the plane lies behind the camera, or before what is seen of the plane. Such points have a
    second map, focused on them, with ``fit="receivers"``; with ``fit="frustum"``, as published,
    they count as lit.

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
    """The light matrix with the finest texels, in the mean, at the shadow boundaries of the image.

    Samples x of the image are read back, with the surfaces that they see. With u their places in
    the map, the matrix minimizes

    .. math:: h(P) = \\sum_{samples} \\sum_{i, j \\in \\{1, 2\\}}
              \\left(\\frac{dx^i}{du^j}\\right)^2

    (Eq. 6): how many pixels share a texel. The optical axis, row 4 of the matrix, is searched for;
    for each one tried, rows 1 and 2 follow from the smallest rectangle around the samples' hull,
    whose longer side has the more texels where the map is not square, as in the paper (2.4), which
    leaves open what counts as longer where the rectangle leans: here the sides before it does. It
    is never worse than `Focused` by this measure.

    This differs from the paper in three ways. The sum is over at most 400 samples, evenly chosen.
    Samples whose surface is within three degrees of edge-on to the light are left out of it: one
    weighs as much as all the others. And unless `boundaries` and `every` say otherwise, every frame
    has a focused first map that finds the boundaries, and a search.

    Limits: a first map finds the boundaries, and the CPU waits for the GPU in between. A shadow
    that no sample meets may be off the map, and then is lit.

    Parameters
    ----------
    samples : {"shadow", "boundary", "facing"}
        What the map must hold and is optimized for. ``"boundary"``: samples next to a shadow
        boundary, as in the paper; ``"shadow"``: those and all in shadow; ``"facing"``: all that
        face the light.
    optimizer : {"paper", "simplex"}
        ``"paper"``: three steps along the negative gradient, each the best of nine angles.
        ``"simplex"``: a downhill simplex from there, which finds a lower h and takes longer.
    sample_resolution : int
        Samples along the longer side of the image; an image that is narrower than 16 to 9 has no
        fewer samples than that one.
    margin : float
        The share of its size by which the map is widened, from 0 to 1, because a receiver between
        the samples may lie outside.
    previous : Frame or (4, 4) array_like, optional
        The previous frame, or its light matrix. It is reused, scaled and shifted to hold all
        samples, unless the median h of a new matrix is below 80 % of its own; so shadow edges
        flicker less. For one map, not for the faces of a cube.
    previous_age : int, optional
        For how many frames the previous matrix has been in use; None with a matrix alone, taken
        from a frame's ``stats["matrix_age"]``.
    every : int
        The matrix is searched for in every so many frames, 3 in the paper (2.4): while
        `previous_age` is less, the previous one is kept as it is, and nothing is read back.
    boundaries : {"focused", "previous"}
        Whose map finds the boundaries: a focused one, or the previous matrix's, as in the paper
        (2.3), which takes a plain one every couple of frames (2.4): give these frames no
        `previous`.

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
    previous_age: int | None = None
    every: int = 1
    boundaries: Boundaries = "focused"

    def __post_init__(self) -> None:
        frame = self.previous
        age = getattr(frame, "stats", {}).get("matrix_age")
        if self.previous_age is None and age is not None:
            object.__setattr__(self, "previous_age", int(age))
        object.__setattr__(self, "previous", _previous_matrix(frame))
        super().__post_init__()
        of_frame = getattr(getattr(frame, "method", None), "map_size", None)
        if self.previous is not None and of_frame is not None and of_frame != self.map_size:
            # The matrix is in texels of a map of another size.
            scales = (*np.divide(self.map_size, of_frame).tolist(), 1.0, 1.0)
            rows = zip(self.previous, scales, strict=True)
            matrix = tuple(tuple(scale * value for value in row) for row, scale in rows)
            object.__setattr__(self, "previous", matrix)


def _previous_matrix(previous: Any) -> Any:
    """The light matrix of a frame with one map; None of several, anything else as it is."""
    matrices = getattr(previous, "light_matrix", None)
    if matrices is None:
        return previous
    return matrices[0] if len(matrices) == 1 else None
