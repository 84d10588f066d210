"""The method that chooses a method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .base import ShadowMethod


@dataclass(frozen=True, kw_only=True)
class Auto(ShadowMethod):
    """Chooses the cheapest method and resolution whose error stays within a bound.

    1. If two small shadow maps, the second twice as fine, cost less than the methods without a
       misclassified pixel, both are rendered. Where they differ bounds the error of the finer one.
    2. If the bound is at most `max_error`, the finer map is the answer.
    3. Otherwise a map twice as fine is tried, as long as it is predicted to suffice and to cost
       less than `RayTraced` and `Exact`.
    4. Otherwise the cheaper of these two is the answer.

    With ``d`` pixels that differ of ``n`` that see a surface, and ``c`` measured on generated
    scenes, the bound is

    .. math:: e = c (d + 3) / n.

    Costs are predicted by a model of triangles, pixels and texels, which ``lixel lab calibration``
    measures on one device. No clock is read, so that the same call makes the same choice.
    ``frame.stats["auto"]`` says what was chosen and why; ``frame.method`` is the chosen method.
    On the CPU engine the choice is always `Exact`: nothing is faster there.

    Limits: it is one choice for the whole image. The predicted times are those of the calibrated
    device, whichever is used. The bound does not see what both maps miss, such as casters far
    thinner than a texel.

    Parameters
    ----------
    max_error : float
        The most misclassified pixels, as a share of the pixels that see a surface, from 0 to 1.
        With 0 no map is tried.
    max_ms : float, optional
        Most milliseconds on the GPU. A preference: where no method keeps both, the finest maps
        whose predicted time is within it are taken, and where there is none, the fastest of a small
        map and the methods without a misclassified pixel: never a map that is predicted to be
        slower than one of these. The statistics say so.

    Examples
    --------
    >>> method_from("auto")
    Auto(max_error=0.001, max_ms=None)
    """

    name: ClassVar[str] = "auto"

    max_error: float = 0.001
    max_ms: float | None = None
