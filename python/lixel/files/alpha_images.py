"""The images of a file that masks are made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ..masks import MAX_TEXELS, TooManyTexelsError, decoded_alpha
from .contents import FileError

Texels = npt.NDArray[np.uint8]


class AlphaImages:
    """Decodes them; all together have a bounded number of texels.

    `leave_out` takes a word on what cannot be read.
    """

    def __init__(self, leave_out: Callable[[str], None]) -> None:
        self._leave_out = leave_out
        self._texels_left = MAX_TEXELS

    def decoded(
        self,
        content: bytes,
        image: str,
        material: str,
        taken: Callable[[Any], Texels | None] | None = None,
    ) -> Texels | None:
        """As `decoded_alpha`; None where it cannot be read, too."""
        try:
            alpha = decoded_alpha(content, self._texels_left, image, taken)
        except MemoryError:
            raise
        except TooManyTexelsError as error:
            raise FileError(str(error), "make its images smaller") from None
        except Exception as error:
            # Pictures are decoded by libraries that fail with any error there is.
            self._leave_out(f"holes of material {material}: {image} cannot be read ({error})")
            return None
        self._texels_left -= 0 if alpha is None else alpha.size
        return alpha
