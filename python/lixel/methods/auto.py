"""The method that chooses a method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from .base import ShadowMethod


@dataclass(frozen=True, kw_only=True)
class Auto(ShadowMethod):
    """Chooses the method and its resolution: the cheapest for an error.

    Where two small shadow maps cost less than the methods without a wrong pixel, they are rendered
    first, the second twice as fine. The ``d`` pixels in which they differ bound those that are
    wrong in the finer one, as a share of the ``n`` pixels that see a surface,

    .. math:: e = c (d + 3) / n,

    with ``c`` measured on generated scenes. If that is below `max_error` the finer map is the
    answer; a still finer one is tried as long as it promises to be cheaper than `RayTraced` and
    `Exact`, one of which is the answer else. Costs are predicted by a model of triangles, pixels
    and texels, which ``python -m lixel.calibration`` measures on one device; no clock is read, so
    that the same call makes the same choice. ``frame.stats["auto"]`` says what was chosen and why,
    and ``frame.method`` is the chosen method.

    Limits: it is one choice for the whole image. Times of other devices than the calibrated one are
    predicted as if they were its own. What two maps miss alike, such as casters far thinner than a
    texel, they do not tell.

    Parameters
    ----------
    max_error : float
        Most wrong pixels, as a share of the pixels that see a surface, from 0 to 1. With 0 no map
        is tried.
    max_ms : float, optional
        Most milliseconds on the GPU. A preference: where no method keeps both, the finest maps
        whose predicted time is within it are taken, and the statistics say so.

    Examples
    --------
    >>> method_from("auto")
    Auto(max_error=0.001, max_ms=None)
    """

    name: ClassVar[str] = "auto"

    max_error: float = 0.001
    max_ms: float | None = None
