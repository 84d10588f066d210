"""An assertion for quality checks in other people's tests.

With pytest, the fixture of the same name also saves a picture of what went wrong; see
`lixel.pytest_plugin`.
"""

from __future__ import annotations

from pathlib import Path

import numpy.typing as npt

from . import image_files
from .arguments import real
from .compare import compare
from .receivers import Receivers
from .reference import Reference


def assert_shadows_match(
    visibility: npt.ArrayLike | Receivers,
    reference: Reference | npt.ArrayLike,
    *,
    max_misclassified: int | float = 0,
    picture: str | Path | None = None,
) -> None:
    """Assert that few pixels are misclassified.

    Parameters
    ----------
    visibility : (H, W) float, or Frame
        Values in [0, 1], 1 lit, NaN where no surface is seen; of any renderer.
    reference : Reference, or (H, W) float
        The truth, from `lixel.reference` or an image that was right once. Ties of a `Reference` are
        never misclassified.
    max_misclassified : int or float
        The most pixels that may be misclassified; a float is a share of the covered pixels, below
        1.
    picture : path, optional
        Where a .png with the misclassified pixels in red is written on failure: false lit bright,
        false shadow dark.

    Raises
    ------
    AssertionError
        More are; the message counts them and names the picture.
    TypeError, ValueError
        As for `compare`, and a `max_misclassified` that is negative, or a share of 1 or more.

    Examples
    --------
    >>> assert_shadows_match([[1.0, 0.0]], [[1.0, 1.0]], max_misclassified=1)
    >>> assert_shadows_match([[1.0, 0.0]], [[1.0, 1.0]])  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    AssertionError: 1 pixel misclassified, at most 0 allowed: 0 false lit, 1 false shadow, of ...
    """
    __tracebackhide__ = True
    limit = real("max_misclassified", max_misclassified)
    is_share = isinstance(max_misclassified, float)
    if not limit >= 0.0 or (is_share and limit >= 1.0):
        raise ValueError(
            "max_misclassified must be a number of pixels, or a share in [0, 1), "
            f"got {max_misclassified!r}"
        )
    found = compare(visibility, reference)
    count = found.misclassified_count
    allowed = int(limit * found.covered_count) if is_share else int(limit)
    if count <= allowed:
        return
    message = (
        f"{count:,} pixel{'s' * (count != 1)} misclassified, at most {allowed:,} allowed: "
        f"{found.false_lit_count:,} false lit, {found.false_shadow_count:,} false shadow, "
        f"of {found.covered_count:,} covered"
    )
    if picture is not None:
        of_view = reference._made_by() if isinstance(reference, Reference) else {}
        numbers = {"misclassified": count, "covered": found.covered_count}
        image_files.save_picture(picture, found.picture(), {**of_view, **numbers})
        message += f"; misclassified pixels in red: {picture}"
    raise AssertionError(message)
