"""The words of a text, found all at once: in Python, line by line is slow."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

_IS_SPACE = bytes(byte in b" \t\n\v\f\r" for byte in range(256))
_SPACE, _SLASH, _ZERO = b" /0"

_WIDEST = 48
"""No number is longer; a text that has longer ones is read word by word."""

_AT_ONCE = 1 << 20

Places = npt.NDArray[np.int64]


class Words:
    """Where the words and lines of a text begin and end.

    Attributes
    ----------
    starts, ends : (n,) int64
        Bytes of `text`, which begins with a line feed of its own.
    first : (lines + 1,) int64
        The first word of each line; a line without words has that of the next one.
    """

    def __init__(self, text: bytes) -> None:
        self.text = b"\n" + text
        padded = self.text + b" " * (_WIDEST + 1)
        self._bytes = np.frombuffer(padded, np.uint8)
        is_space = np.frombuffer(padded.translate(_IS_SPACE), np.bool_)
        turns = np.flatnonzero(is_space[1:] != is_space[:-1]) + 1
        self.starts, self.ends = turns[0::2], turns[1::2]
        self._line_starts = np.flatnonzero(self._bytes == ord("\n"))
        self.first = np.append(np.searchsorted(self.starts, self._line_starts), len(self.starts))

    def are(
        self, which: Places, *words: bytes, any_case: bool = False
    ) -> list[npt.NDArray[np.bool_]]:
        """For each of these words, which words of the text are it; in lower case for any case."""
        starts = self.starts[which]
        lengths = self.ends[which] - starts
        case = 32 if any_case else 0
        found = []
        for word in words:
            like = np.flatnonzero(lengths == len(word))
            for i, letter in enumerate(word):
                like = like[self._bytes[starts[like] + i] | case == letter]
            same = np.zeros(len(which), np.bool_)
            same[like] = True
            found.append(same)
        return found

    def line(self, number: int) -> bytes:
        """A line, counted from 0."""
        bounds = self._line_starts[number : number + 2].tolist()
        return self.text[bounds[0] + 1 : bounds[1] if len(bounds) == 2 else None]

    def spelled(self, which: Places) -> list[bytes]:
        bounds = zip(self.starts[which].tolist(), self.ends[which].tolist(), strict=True)
        return [self.text[begin:end] for begin, end in bounds]

    def lines_with(self, letters: bytes) -> Places:
        """The lines that hold one of these bytes; one that holds more of them comes more often."""
        found = [np.flatnonzero(self._bytes == c) for c in letters if bytes([c]) in self.text]
        places = np.concatenate([np.zeros(0, np.int64), *found])
        return np.searchsorted(self._line_starts, places, side="right") - 1

    def reals(self, which: Places) -> npt.NDArray[np.float64]:
        """Words as numbers; ValueError where one is none."""
        return self._numbers(which, np.float64, float, None)

    def whole(self, which: Places, field: int = 0) -> npt.NDArray[np.int64]:
        """What stands between slashes in some words, as whole numbers; 0 where there is nothing.

        ValueError where one is none.
        """
        return self._numbers(which, np.int64, lambda word: _whole(word, field), field)

    def _numbers(
        self, which: Places, dtype: Any, one: Callable[[bytes], float], field: int | None
    ) -> npt.NDArray[Any]:
        parts = [
            self._some(which[i : i + _AT_ONCE], dtype, one, field)
            for i in range(0, len(which), _AT_ONCE)
        ]
        return np.concatenate(parts) if parts else np.zeros(0, dtype)

    def _some(
        self, which: Places, dtype: Any, one: Callable[[bytes], float], field: int | None
    ) -> npt.NDArray[Any]:
        starts, lengths = self.starts[which], self.ends[which] - self.starts[which]
        width = int(lengths.max())
        if width <= _WIDEST:
            rows = np.lib.stride_tricks.sliding_window_view(self._bytes, width + 1)[starts]
            rows[np.arange(width + 1) >= lengths[:, None]] = _SPACE
            if field is not None:
                _keep_field(rows, field)
            with warnings.catch_warnings():
                # What is no number is an error of some versions of numpy and a warning of others.
                warnings.simplefilter("error", DeprecationWarning)
                try:
                    found = np.fromstring(rows.tobytes(), dtype, sep=" ")
                except (ValueError, DeprecationWarning):
                    found = np.zeros(0, dtype)
            # Two numbers may stand in one word, as in 1-2.
            if len(found) == len(which):
                return found
        return np.fromiter(map(one, self.spelled(which)), dtype, len(which))


def _keep_field(rows: npt.NDArray[np.uint8], field: int) -> None:
    """Blanks all of each row but what stands between two slashes."""
    slashes = rows == _SLASH
    if field or slashes.any():
        rows[slashes | (np.cumsum(slashes, axis=1, dtype=np.uint8) != field)] = _SPACE
    empty = (rows == _SPACE).all(axis=1)
    if field:
        rows[empty, 0] = _ZERO


def _whole(word: bytes, field: int) -> int:
    fields = word.split(b"/")
    if field and (len(fields) <= field or not fields[field]):
        return 0
    return int(fields[field])
