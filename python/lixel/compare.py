"""Comparison of a visibility image with the reference: misclassified pixels, and edges."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal, overload

import numpy as np
import numpy.typing as npt

from .arguments import REAL, array_of
from .coverage import Coverage, CoverageComparison, compare_shares
from .likeness import Likeness
from .pictures import display
from .receivers import Receivers
from .reference import Reference

FALSE_LIT = (255, 64, 48)
FALSE_SHADOW = (158, 0, 16)

MAX_TIE_SHARE = 0.01
"""Of the pixels that face the light: where more are not judged, `compare` warns."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Comparison(Likeness):
    """A visibility image against the truth. All that costs time is computed on first use.

    A pixel is *misclassified* where the image says lit and the truth says shadow (*false lit*) or
    the other way round (*false shadow*). Partly lit pixels, as filters make them, are taken for lit
    from one half on and for shadow below: the edge that counts is the middle of the penumbra,
    and the penumbra itself is no error. Ties of the reference are never misclassified, and count as
    right in every number here; so `judged_share` says how much the other numbers are worth.

    Attributes
    ----------
    lit : (H, W) bool
        What the image says, with the truth in ties and where no surface is seen.
    expected : (H, W) bool
        What the truth says; True where no surface is seen.
    covered : (H, W) bool
        Where the truth sees a surface.
    counted : (H, W) bool
        Where it does and there is no tie, neither of float64 nor of float32.
    float32_tie : (H, W) bool
        Where it does and float32 may see another surface with another visibility.
    partly_lit : (H, W) bool
        Where the image says neither lit nor in shadow, of those that are counted.
    other_surface : (H, W) bool
        Where only one of the two sees a surface; nowhere, unless `compare` was told to count that.
    facing : (H, W) bool or None
        Where that surface faces the light; None for a reference that is a plain array, or whose
        scene has moved since.
    """

    lit: npt.NDArray[np.bool_]
    expected: npt.NDArray[np.bool_]
    counted: npt.NDArray[np.bool_]
    float32_tie: npt.NDArray[np.bool_]
    partly_lit: npt.NDArray[np.bool_]
    facing: npt.NDArray[np.bool_] | None

    _NUMBERS: ClassVar[tuple[str, ...]] = (
        "misclassified_count", "false_lit_count", "false_shadow_count",
        "covered_count", "facing_count", "tie_count", "float32_tie_count", "partly_lit_count",
        "judged_share", "rate_covered", "rate_facing",
        "ssim", "hausdorff", "edge_displacement_mean", "edge_displacement_p95",
    )  # fmt: skip

    # --- Masks ---

    @cached_property
    def false_lit(self) -> npt.NDArray[np.bool_]:
        """(H, W) bool: lit, but should be in shadow."""
        return self.lit & ~self.expected & ~self.other_surface

    @cached_property
    def false_shadow(self) -> npt.NDArray[np.bool_]:
        """(H, W) bool: in shadow, but should be lit."""
        return ~self.lit & self.expected & ~self.other_surface

    @property
    def misclassified(self) -> npt.NDArray[np.bool_]:
        """(H, W) bool: false lit, false shadow, or of another surface."""
        return (self.lit ^ self.expected) | self.other_surface

    # --- Counts and rates ---

    @cached_property
    def false_lit_count(self) -> int:
        """Pixels that are lit but should be in shadow."""
        return int(np.count_nonzero(self.false_lit))

    @cached_property
    def false_shadow_count(self) -> int:
        """Pixels that are in shadow but should be lit."""
        return int(np.count_nonzero(self.false_shadow))

    @cached_property
    def misclassified_count(self) -> int:
        """Pixels that are false lit, false shadow, or of another surface."""
        return int(np.count_nonzero(self.misclassified))

    @cached_property
    def tie_count(self) -> int:
        """Covered pixels that are not counted, because float64 leaves the truth itself open."""
        return int(np.count_nonzero(self.covered & ~self.counted & ~self.float32_tie))

    @cached_property
    def float32_tie_count(self) -> int:
        """Covered pixels that are not counted, because float32 may see another surface there."""
        return int(np.count_nonzero(self.float32_tie))

    @cached_property
    def partly_lit_count(self) -> int:
        """Counted pixels with a visibility between 0 and 1, each taken for lit or in shadow."""
        return int(np.count_nonzero(self.partly_lit))

    @cached_property
    def facing_count(self) -> int | None:
        """Pixels whose surface faces the light, ties included; None where that is unknown."""
        return None if self.facing is None else int(np.count_nonzero(self.facing))

    @property
    def rate_covered(self) -> float:
        """Misclassified pixels over covered pixels, in [0, 1]; 0 where nothing is covered."""
        return self.misclassified_count / max(self.covered_count, 1)

    @property
    def rate_facing(self) -> float | None:
        """Misclassified pixels over pixels that face the light; None where those are unknown. Only
        these need a map at all, so this rate does not improve with a wall turned away."""
        return (
            None
            if self.facing_count is None
            else self.misclassified_count / max(self.facing_count, 1)
        )

    @property
    def judged_share(self) -> float:
        """Counted pixels over covered pixels, in [0, 1]; 1 where nothing is covered."""
        return 1.0 - (self.tie_count + self.float32_tie_count) / max(self.covered_count, 1)

    @property
    def warning(self) -> str | None:
        """What `compare` warns of: more than a hundredth of the pixels that face the light are not
        judged. None where it need not."""
        left_out = self.tie_count + self.float32_tie_count
        facing = self.covered_count if self.facing_count is None else self.facing_count
        if left_out <= MAX_TIE_SHARE * facing:
            return None
        return (
            f"{left_out:,} pixels are ties and not judged, as against {facing:,} that "
            f"{'see a surface' if self.facing is None else 'face the light'}"
        )

    # --- Likeness of the pictures and of their edges ---

    def _both(self) -> tuple[npt.NDArray[Any], npt.NDArray[Any]]:
        return self.lit, self.expected

    @property
    def hausdorff(self) -> float:
        """Hausdorff distance of the shadow edges in pixels: the greatest distance from an edge in
        one picture to the nearest in the other. 0 where neither has an edge, inf where one has."""
        return float(self.edge_displacement.max(initial=0.0))

    @cached_property
    def edge_displacement(self) -> npt.NDArray[np.float64]:
        """(n,) float64: for each edge pixel of either picture, the distance in pixels to the
        nearest edge of the other; [inf] where only one has edges."""
        from scipy.ndimage import distance_transform_edt

        first, second = self._edges
        if not first.any() and not second.any():
            return np.zeros(0)
        if not first.any() or not second.any():
            return np.array([math.inf])
        return np.concatenate(
            [distance_transform_edt(~second)[first], distance_transform_edt(~first)[second]]
        )

    @property
    def edge_displacement_mean(self) -> float:
        """Mean of `edge_displacement` in pixels; 0 without edges."""
        return float(self.edge_displacement.mean()) if self.edge_displacement.size else 0.0

    @property
    def edge_displacement_p95(self) -> float:
        """95th percentile of `edge_displacement` in pixels; 0 without edges."""
        if not self.edge_displacement.size:
            return 0.0
        # By rank, not interpolated: between two infinities that would be NaN.
        return float(np.percentile(self.edge_displacement, 95, method="higher"))

    @cached_property
    def _edges(self) -> tuple[npt.NDArray[np.bool_], npt.NDArray[np.bool_]]:
        return _edge_mask(self.lit, self.covered), _edge_mask(self.expected, self.covered)

    # --- To look at ---

    def picture(self) -> npt.NDArray[np.uint8]:
        """(H, W, 3) uint8: the image with misclassified pixels in red, false lit bright, others
        dark."""
        visibility = np.where(self.covered, self.lit, np.nan).astype(np.float32)
        picture = display.shadow_picture(visibility)
        picture[self.misclassified] = FALSE_SHADOW
        picture[self.false_lit] = FALSE_LIT
        return picture

    def __str__(self) -> str:
        facing = self.rate_facing
        return (
            f"{self.misclassified_count:,} of {self.covered_count:,} covered pixels misclassified "
            f"({self.rate_covered:.3%}"
            + (f"; {facing:.3%} of lit-facing" if facing is not None else "")
            + f"): {self.false_lit_count:,} false lit, {self.false_shadow_count:,} false shadow; "
            f"{self.tie_count:,} ties not counted"
            + (f", {self.float32_tie_count:,} of float32" if self.float32_tie_count else "")
            + (f"; {self.partly_lit_count:,} partly lit" if self.partly_lit_count else "")
        )

    def __repr__(self) -> str:
        return f"<lixel.Comparison: {self}{f'; WARNING: {self.warning}' if self.warning else ''}>"


@overload
def compare(
    visibility: npt.ArrayLike | Receivers | Coverage, reference: Coverage
) -> CoverageComparison: ...


@overload
def compare(
    visibility: npt.ArrayLike | Receivers,
    reference: Reference | npt.ArrayLike,
    *,
    other_surfaces: Literal["refuse", "count"] = "refuse",
) -> Comparison: ...


def compare(
    visibility: npt.ArrayLike | Receivers | Coverage,
    reference: Reference | Coverage | npt.ArrayLike,
    *,
    other_surfaces: Literal["refuse", "count"] = "refuse",
) -> Comparison | CoverageComparison:
    """Count the misclassified pixels of a visibility image.

    Parameters
    ----------
    visibility : (H, W) float, Frame, or Coverage
        Values in [0, 1], NaN where no surface is seen; from one half on taken for lit.
    reference : Reference, (H, W) float, or Coverage
        The truth. A plain array has no ties and does not know which surfaces face the light. With a
        `Coverage`, of several samples in each pixel, values count as they are: filtered and
        antialiased shadows are judged by the lit share.
    other_surfaces : {"refuse", "count"}
        What is done with a pixel in which only one of the two sees a surface, and which is no tie:
        such images are refused, or the pixel counts as misclassified.

    Returns
    -------
    Comparison, or CoverageComparison where the reference is a `Coverage`

    Warns
    -----
    UserWarning
        More than a hundredth of the pixels that face the light are ties: the other numbers say
        little about them.

    Raises
    ------
    TypeError
        Arrays that do not hold real numbers.
    ValueError
        Shapes that differ, values out of range, another word for `other_surfaces`, or pixels that
        it refuses; the message counts them.

    Examples
    --------
    >>> import numpy as np
    >>> truth = np.array([[1, 0], [0, np.nan]], np.float32)
    >>> seen = np.array([[1, 1], [0, np.nan]], np.float32)
    >>> compare(seen, truth).false_lit_count
    1
    """
    if other_surfaces not in ("refuse", "count"):
        raise ValueError(f"other_surfaces must be 'refuse' or 'count', got {other_surfaces!r}")
    image = _visibility("visibility", visibility)
    truth = _visibility("reference", reference)
    if image.shape != truth.shape:
        raise ValueError(
            f"visibility must have the shape of reference, {truth.shape}, got {image.shape}"
        )
    if isinstance(reference, Coverage):
        return compare_shares(image, reference)
    covered = ~np.isnan(truth)
    counted = covered.copy()
    float32_tie = np.zeros_like(covered)
    facing = None
    coverage_differs = covered != ~np.isnan(image)
    if isinstance(reference, Reference):
        # On the rim of an object the first hit itself may be a tie.
        float32_tie |= coverage_differs & reference.triangle_tie
        float32_tie |= reference.float32_tie
        float32_tie &= covered & ~reference.tie
        counted &= ~(reference.tie | float32_tie)
        coverage_differs &= ~reference.triangle_tie
        facing = reference.facing if reference.is_current else None
    if other_surfaces == "refuse":
        _refuse_other_surfaces(coverage_differs, covered)
    expected = np.where(covered, truth >= 0.5, True)
    comparison = Comparison(
        lit=np.where(counted, image >= 0.5, expected),
        expected=expected,
        covered=covered,
        counted=counted,
        float32_tie=float32_tie,
        partly_lit=counted & (image > 0.0) & (image < 1.0),
        other_surface=coverage_differs,
        facing=facing,
    )
    if comparison.warning is not None:
        warnings.warn(comparison.warning, stacklevel=2)
    return comparison


def _refuse_other_surfaces(differs: npt.NDArray[np.bool_], covered: npt.NDArray[np.bool_]) -> None:
    if not differs.any():
        return
    missing = int(np.count_nonzero(differs & covered))
    extra = int(np.count_nonzero(differs)) - missing
    row, column = np.argwhere(differs)[0].tolist()
    raise ValueError(
        "visibility and reference must see surfaces in the same pixels: "
        f"{missing} only in reference, {extra} only in visibility, "
        f"first at row {row}, column {column}"
    )


def _visibility(name: str, value: npt.ArrayLike | Receivers | Coverage) -> npt.NDArray[Any]:
    if isinstance(value, Receivers):
        value = value._shares
    values = value.visibility if isinstance(value, Coverage) else value
    array = array_of(REAL, name, values, ("H", "W"))
    outside = (array < 0) | (array > 1)  # False for NaN
    if outside.any():
        row, column = np.argwhere(outside)[0].tolist()
        raise ValueError(
            f"{name} must be in [0, 1] or NaN, got {array[row, column]} "
            f"at row {row}, column {column}"
        )
    return array


def _edge_mask(lit: npt.NDArray[np.bool_], covered: npt.NDArray[np.bool_]) -> npt.NDArray[np.bool_]:
    """Covered pixels whose covered neighbour to the right or below differs."""
    edges = np.zeros_like(lit)
    edges[:, :-1] |= (lit[:, :-1] != lit[:, 1:]) & covered[:, :-1] & covered[:, 1:]
    edges[:-1] |= (lit[:-1] != lit[1:]) & covered[:-1] & covered[1:]
    return edges
