"""Text files, whatever program wrote them."""

from __future__ import annotations

import codecs

import numpy as np
import numpy.typing as npt

_WIDE = ((codecs.BOM_UTF16_LE, "utf-16-le"), (codecs.BOM_UTF16_BE, "utf-16-be"))


def plain(content: bytes) -> bytes:
    """A text in UTF-8, or in what bytes the file has, without a byte order mark; lines end with a
    line feed."""
    for mark, encoding in _WIDE:
        # Without a mark every other byte of plain letters is zero.
        zeros = content[encoding.endswith("le") : 64 : 2]
        if content.startswith(mark) or (len(zeros) > 1 and not any(zeros)):
            content = content.decode(encoding, "replace").encode()
            break
    content = content.removeprefix(codecs.BOM_UTF8)
    if b"\r" not in content:
        return content
    return content.replace(b"\r\n", b"\n").replace(b"\r", b"\n")


def numbers(words: list[bytes]) -> npt.NDArray[np.float64]:
    """Words of a text as numbers; ValueError where one is none."""
    return np.fromiter(map(float, words), dtype=np.float64, count=len(words))


def are_numbers(words: list[bytes], count: int | None = None) -> bool:
    """Whether words are numbers, and so many."""
    try:
        return len(numbers(words)) == (len(words) if count is None else count)
    except ValueError:
        return False


def name_of(words: bytes) -> str:
    """A name in UTF-8, or else in Latin-1, which has a letter for every byte."""
    try:
        return words.decode()
    except UnicodeDecodeError:
        return words.decode("latin-1")
