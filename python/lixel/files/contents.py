"""What a reader returns, and how it refuses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..light import Light

Positions = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int64]

FEWEST_TRIANGLES = 1 << 26
"""A file may hold as many triangles as it has bytes, and always this many: copies of a mesh cost
the file next to nothing, and would fill the memory."""


class FileError(ValueError):
    """Why a file cannot be read at all, in plain words: the place in it, and what to do."""


class Part(NamedTuple):
    """Triangles of a file that go by one name.

    `positions` are (n, 3) in world space, `faces` are (m, 3) and count from 0 in this part.
    `material` is what the file calls or counts it by.
    """

    positions: Positions
    faces: Faces
    name: str = ""
    material: str | int | None = None
    uv: npt.NDArray[np.float64] | None = None


@dataclass
class Contents:
    """All of a file that lixel takes, and a word on each thing that it does not."""

    parts: list[Part] = field(default_factory=list)
    cameras: dict[str, Camera] = field(default_factory=dict)
    lights: dict[str, Light] = field(default_factory=dict)
    unsupported: list[str] = field(default_factory=list)

    def leave_out(self, what: str) -> None:
        """Name what is left out, once."""
        if what not in self.unsupported:
            self.unsupported.append(what)


def words_of(error: BaseException) -> str:
    """An error as part of a sentence; a broken file fails with any error there is."""
    if isinstance(error, KeyError):
        return f"it has no {error.args[0]!r}"
    if isinstance(error, ValueError) and str(error):
        return str(error)
    return f"it cannot be understood ({type(error).__name__}: {error})"


def unused(name: str, taken: dict[str, object]) -> str:
    """The name, with a number where it is taken."""
    if name not in taken:
        return name
    number = 1
    while f"{name}_{number}" in taken:
        number += 1
    return f"{name}_{number}"
