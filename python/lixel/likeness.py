"""How alike two pictures are."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import numpy.typing as npt

from .pictures import display


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Likeness(ABC):
    """What every comparison of an image with the truth counts, and how it shows itself."""

    covered: npt.NDArray[np.bool_]
    other_surface: npt.NDArray[np.bool_]

    _NUMBERS: ClassVar[tuple[str, ...]]
    """The names of all that is a number."""

    @cached_property
    def covered_count(self) -> int:
        """Pixels that are `covered`, ties included."""
        return int(np.count_nonzero(self.covered))

    @cached_property
    def other_surface_count(self) -> int:
        """Pixels in which only one of the two sees a surface."""
        return int(np.count_nonzero(self.other_surface))

    @cached_property
    def ssim(self) -> float:
        """Structural similarity of the two pictures, lit 1 and shadow 0, the background 1 in both;
        1 where they are equal. NaN for images smaller than 3 x 3."""
        return structural_similarity(*self._both())

    @abstractmethod
    def _both(self) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        """The image and the truth, 1 where no surface is seen."""

    @abstractmethod
    def picture(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3) uint8: the image, red where it is wrong."""

    def as_dict(self) -> dict[str, Any]:
        """Every number by name, for a table; computes all of them."""
        return {name: getattr(self, name) for name in self._NUMBERS}

    def __repr__(self) -> str:
        return f"<lixel.{type(self).__name__}: {self}>"

    def _repr_png_(self) -> bytes:
        return display.png_bytes(self.picture())

    def _repr_html_(self) -> str:
        return display.html_figure(self.picture(), self.as_dict().items(), str(self))


def structural_similarity(first: npt.NDArray[Any], second: npt.NDArray[Any]) -> float:
    """That of two (H, W) pictures with values in [0, 1]; NaN where they are smaller than 3 x 3."""
    from skimage import metrics

    # The usual window is 7; smaller images take the largest odd one that fits.
    window = min(7, *((side - 1) // 2 * 2 + 1 for side in first.shape))
    if window < 3:
        return math.nan
    similarity: Any = metrics.structural_similarity  # untyped
    pictures = (picture.astype(np.float32) for picture in (first, second))
    return float(similarity(*pictures, data_range=1.0, win_size=window))
