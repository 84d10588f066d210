"""Filters, values of ``lookup``: percentage closer filtering, and maps that are filtered before."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar, Literal, TypeAlias

from .checked import Checked

Space: TypeAlias = Literal["warped", "unwarped"]
Weights: TypeAlias = Literal["even", "gaussian"]
Kernel: TypeAlias = Literal["gaussian", "box"]


@dataclass(frozen=True)
class Pcf(Checked):
    """Percentage closer filtering: ``lookup=Pcf(...)`` of any method that looks up a shadow map.

    The visibility of a receiver is the share of depth tests that find it lit, in [0, 1], over
    points that cover a disc around it evenly:

    .. math:: v = \\sum_{i=1}^{n} w_i \\, \\mathrm{lit}(p + r s_i) / \\sum_{i=1}^{n} w_i

    Each test is a ``"depth"`` lookup in the texel that the point falls in, on that texel's own ray.
    With the automatic bias the receiver's plane is evaluated there, so that a plane never shadows
    itself. Points outside of the layer (beyond the border of the map, the edge of a cube's face or
    the end of a cascade) are left out of the mean. A receiver off the map is lit, as in every
    lookup.

    Limits: where two surfaces meet in a concave edge, the disc around a receiver on one of them
    covers texels of the other, which may lie in front of its plane. This gives a dark line along
    the edge, as wide as the disc. The map of `SceneOptimized` holds only what is in shadow; the lit
    half of a penumbra is on it only with ``samples="facing"``.

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
    weights : {"even", "gaussian"}
        Of the points: all the same, or a Gaussian whose standard deviation is half the radius, as
        Rosen has them (6.2), who gives no deviation: :math:`w_i = \\exp(-2 |s_i|^2)`.
    jitter : bool
        Each pixel turns the disc by an angle of its own, which is the same in every frame, so that
        steps become noise, as Rosen has them.

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

    name: ClassVar[str] = "pcf"

    radius: float = 2.0
    samples: int = 16
    space: Space = "warped"
    weights: Weights = "even"
    jitter: bool = False


@dataclass(frozen=True)
class FilteredMap(Checked):
    """The base class of the maps that hold moments of depths, which can be blurred like an image.

    Each texel holds moments in place of its depth. They are blurred, halved into coarser levels if
    there are mips, and looked up bilinearly at the receiver's place; from them follows the greatest
    share of the filter that may be lit. One lookup costs the same at any radius of the blur, where
    `Pcf` tests each of its samples. Depths are linear along the layer, from its nearest caster or
    receiver to its farthest receiver, around a light as well, as engines have them: a perspective
    depth would spend nearly all of its range near the light. In a paraboloid or a cube they are
    those of its projection: the distance from the light, or along a face's axis.

    The receiver's depth is what its bias leaves of it, at its own place.

    Parameters
    ----------
    blur : float
        Radius of the blur in texels of the map as it is stored, from 0 to 256. 0: none but the
        bilinear one of every lookup. It ends at the border of the map, at the edge of a cube's
        face, and at a seam of a map that is torn; there the texels within weigh more.
    kernel : {"gaussian", "box"}
        Weights of the blur along each axis: a Gaussian whose standard deviation is half the radius,
        cut at the first whole texel from it on (``"gaussian"``), or all the same, the last as far
        as it is within the radius (``"box"``).
    mips : bool
        Whether maps of half the texels along each side, and so on, answer pixels that cover more
        than one texel: each pixel takes the two levels whose texels are nearest to the width of
        what it sees where that is widest, and what lies between (trilinear). A map that a warp
        tears has no such levels, and is refused.
    bleeding_reduction : float
        From 0 to 0.99. Shares up to it are dark, and the others are stretched from there to 1,
        :math:`v = \\max(0, (v' - b) / (1 - b))`. It darkens false light, and edges with it.

    Raises
    ------
    TypeError
        A parameter of the wrong kind.
    ValueError
        A value out of range; the message names the parameter, the rule and the value.
    """

    blur: float = 2.0
    kernel: Kernel = "gaussian"
    mips: bool = False
    bleeding_reduction: float = 0.0


@dataclass(frozen=True)
class Variance(FilteredMap):
    """A variance shadow map: ``lookup=Variance(...)``, or ``lookup="variance"``.

    A texel holds the mean and the mean square of depths. A receiver at depth ``t`` behind the mean
    is lit by at most the share of Chebyshev's one-sided inequality:

    .. math:: v = \\frac{\\sigma^2}{\\sigma^2 + (t - \\mu)^2}, \\quad
              \\sigma^2 = \\max(\\overline{d^2} - \\mu^2, \\sigma^2_{\\min}),
              \\quad \\mu = \\overline{d}

    and wholly lit before it. For one caster before one receiver that is the share that `Pcf` finds.

    Limits: with two casters at different depths in the filter the bound is far above the truth, and
    light leaks into the shadow of the nearer one along the edge of the other.

    Parameters
    ----------
    min_variance : float
        The least variance, in squares of the layer's range of depths, from 0 to 1: float32 rounds
        mean squares by about 1e-7. It is what light leaks where a caster touches its shadow.

    The others are those of `FilteredMap`.

    References
    ----------
    W. Donnelly, A. Lauritzen, "Variance shadow maps", I3D 2006.

    Examples
    --------
    >>> DesiredView(lookup=Variance(blur=4.0, bleeding_reduction=0.2)).lookup.blur
    4.0
    """

    name: ClassVar[str] = "variance"

    min_variance: float = 1e-6


@dataclass(frozen=True)
class ExponentialVariance(FilteredMap):
    """An exponential variance shadow map: ``lookup=ExponentialVariance(...)``, or
    ``lookup="exponential_variance"``.

    The bound of `Variance` of an exponential of the depth, which pulls casters apart less the
    nearer they are to the light, and of the negative one, which does the opposite; the smaller of
    the two bounds holds:

    .. math:: w_+(d) = e^{c (2 d - 1)}, \\quad w_-(d) = -e^{-c_- (2 d - 1)}, \\quad
              v = \\min(v_+, v_-)

    with depths ``d`` from 0 to 1 along the layer. With both exponentials a texel holds four moments
    (EVSM4), without the negative one two (EVSM2).

    Limits: light leaks where two casters are far before the receiver and near to each other, far
    less than with `Variance`. With the positive exponential alone the farthest texels of a blur
    outweigh the others: where a receiver slopes away from the light its shadows shrink by up to the
    radius.

    Parameters
    ----------
    exponent : float
        ``c``, above 0 and at most 42: with it the square of an exponential is still a float32.
    negative_exponent : float, optional
        Of the negative exponential, likewise. None: two moments.
    min_variance : float
        As for `Variance`, times the square of the exponential's slope at the receiver. It lights
        every shadow by ``4 min_variance exponent**2`` where there is no negative exponential.

    The others are those of `FilteredMap`.

    References
    ----------
    A. Lauritzen, M. McCool, "Layered variance shadow maps", Graphics Interface 2008, section 4; A.
    Lauritzen, "Rendering antialiased shadows using warped variance shadow maps", thesis, University
    of Waterloo 2008.

    Examples
    --------
    >>> ExponentialVariance(negative_exponent=None).exponent
    40.0
    """

    name: ClassVar[str] = "exponential_variance"

    exponent: float = 40.0
    negative_exponent: float | None = 5.0
    min_variance: float = 1e-8


@dataclass(frozen=True)
class Moments(FilteredMap):
    """A moment shadow map: ``lookup=Moments(...)``, or ``lookup="moments"``.

    A texel holds the means of four powers of the depth. Of all distributions of depths that have
    them, one with three depths, of which the receiver's ``t`` is one, has the least share before
    it (Hamburger's problem). With the orthogonal polynomials of the mixed moments

    .. math:: K(x, y) = 1 + \\frac{x y}{v} + \\frac{p(x) p(y)}{r}, \\quad
              v = \\overline{d^2}, \\quad p(x) = x^2 - \\frac{\\overline{d^3}}{v} x - v,
              \\quad r = \\overline{p^2},

    all around the mean, the other two are the roots of ``K(t, .)``, and each has the share
    ``1 / K(x, x)``. The receiver is lit by one less the shares before it.

    Limits: exact for two depths in the filter; light leaks where there are three, less than with
    `Variance`.

    Parameters
    ----------
    moment_bias : float
        From 0 to 1: the share of the moments that is taken from a distribution with half of it at
        each end of the layer, so that rounding leaves moments that depths can have. What the
        default is enough for is float32.

    The others are those of `FilteredMap`.

    References
    ----------
    C. Peters, R. Klein, "Moment shadow mapping", I3D 2015.

    Examples
    --------
    >>> DesiredView(lookup=Moments(blur=4.0)).lookup.kernel
    'gaussian'
    """

    name: ClassVar[str] = "moments"

    moment_bias: float = 3e-6


Filter: TypeAlias = Pcf | Variance | ExponentialVariance | Moments
"""What ``lookup`` may be beside a word."""
