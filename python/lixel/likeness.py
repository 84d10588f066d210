"""How alike two pictures are."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt


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
