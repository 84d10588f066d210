"""Methods that fit one matrix to the light."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, TypeAlias

from .base import BoxMethod, ShadowMapMethod

MatrixFit: TypeAlias = Literal["receivers", "frustum"]
Samples: TypeAlias = Literal["shadow", "boundary", "facing"]
Optimizer: TypeAlias = Literal["paper", "simplex"]
Matrix: TypeAlias = tuple[tuple[float, ...], ...]


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
        object.__setattr__(self, "previous", _previous_matrix(self.previous))
        super().__post_init__()


def _previous_matrix(previous: Any) -> Any:
    """The light matrix of a frame with one map; None of several, anything else as it is."""
    matrices = getattr(previous, "light_matrix", None)
    if matrices is None:
        return previous
    return matrices[0] if len(matrices) == 1 else None
