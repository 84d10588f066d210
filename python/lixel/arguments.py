"""Checks of arguments. Every message names the argument, the rule and the value."""

from __future__ import annotations

import difflib
import importlib
import operator
from collections.abc import Iterable
from typing import Any, SupportsIndex

import numpy as np
import numpy.typing as npt

REAL = ("fiu", "real numbers")
INTEGER = ("iu", "integers")


def array_of(
    kind: tuple[str, str], name: str, value: npt.ArrayLike, shape: tuple[int | str, ...]
) -> npt.NDArray[Any]:
    """The value as an array of REAL or INTEGER numbers; a letter in `shape` stands for any size."""
    codes, wanted = kind
    shape_text = f"({', '.join(map(str, shape))}{',' if len(shape) == 1 else ''})"
    try:
        array = np.asarray(value)
    except ValueError:  # numpy's word for a ragged list
        raise ValueError(f"{name} must have shape {shape_text}, got a ragged list") from None
    # An empty list has a float dtype; what is wrong with it is its shape.
    if array.dtype.kind not in codes and not (array.size == 0 and array.dtype.kind == "f"):
        raise TypeError(f"{name} must be an array of {wanted}, got dtype {array.dtype}")
    if array.ndim != len(shape) or any(
        isinstance(want, int) and have != want
        for have, want in zip(array.shape, shape, strict=True)
    ):
        raise ValueError(f"{name} must have shape {shape_text}, got {array.shape}")
    return array


def reals(name: str, value: npt.ArrayLike, *shape: int | str) -> npt.NDArray[np.float64]:
    """A float64 array in C order, native byte order; a copy only where one is needed."""
    array = array_of(REAL, name, value, shape)
    with np.errstate(over="ignore"):  # a longdouble beyond float64 becomes inf, judged later
        return np.ascontiguousarray(array, dtype=np.float64)


def finite(name: str, value: npt.ArrayLike, *shape: int | str) -> npt.NDArray[np.float64]:
    """As `reals`, without infinite numbers and NaN."""
    array = reals(name, value, *shape)
    if not np.isfinite(array).all():
        raise ValueError(f"{name} must be finite, got {array.tolist()}")
    return array


def real(name: str, value: Any) -> float:
    """A single real number."""
    array = np.asarray(value)
    if array.dtype.kind not in "fiu" or array.ndim != 0:
        raise TypeError(f"{name} must be a real number, got {value!r}")
    return float(array)


def count(name: str, value: SupportsIndex, least: int = 1) -> int:
    """An integer from `least` to 2**32 - 1, which fits the core's integers."""
    try:
        if isinstance(value, (bool, np.bool_)):
            raise TypeError
        number = operator.index(value)
    except TypeError:
        raise TypeError(f"{name} must be an integer, got {value!r}") from None
    if not least <= number < 2**32:
        raise ValueError(f"{name} must be at least {least} and below 2**32, got {number}")
    return number


def size(width: SupportsIndex, height: SupportsIndex) -> tuple[int, int]:
    """Of an image, in pixels."""
    return count("width", width), count("height", height)


def instance(name: str, value: object, *types: type) -> None:
    """Refuses what is of none of the types."""
    if not isinstance(value, types):
        wanted = " or ".join(f"lixel.{t.__name__}" for t in types)
        raise TypeError(f"{name} must be a {wanted}, got {type(value).__name__}")


def did_you_mean(value: object, known: Iterable[str]) -> str:
    """For the end of a message that refuses a name: the nearest of those that are known; nothing
    where none is near, or where it is itself one of them.

    >>> "got 'unifrom'" + did_you_mean("unifrom", ["uniform", "rtw"])
    "got 'unifrom'; did you mean 'uniform'?"
    """
    names = list(known)
    if value in names:
        return ""
    # Of names that differ in their case alone the first counts.
    by_case = {name.casefold(): name for name in reversed(names)}
    near = difflib.get_close_matches(str(value).casefold(), by_case, n=1)
    return f"; did you mean {by_case[near[0]]!r}?" if near else ""


def needs(module: str, extra: str) -> Any:
    """The module of an optional dependency; without it, an ImportError that says the remedy."""
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ImportError(
            f"this needs the package {error.name}: pip install 'lixel[{extra}]'", name=error.name
        ) from error


def unit_vector(name: str, value: npt.ArrayLike) -> npt.NDArray[np.float64]:
    """A direction, (3,) of any length but zero, at length 1."""
    vector = finite(name, value, 3)
    largest = np.abs(vector).max()
    if largest == 0.0:
        raise ValueError(f"{name} must not have zero length, got {vector.tolist()}")
    # A unit vector stays as it is to the last bit, so that pickles compare equal.
    if largest <= 1.0 and abs(np.linalg.norm(vector) - 1.0) < 1e-15:
        return np.array(vector)
    # Scaled first, so that neither tiny nor huge vectors under- or overflow.
    scaled = vector / largest
    return np.asarray(scaled / np.linalg.norm(scaled))
