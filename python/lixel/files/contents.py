"""What a reader returns, and how it refuses."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ..camera import Camera
from ..light import Light
from ..masks import PartMask

Positions = npt.NDArray[np.float64]
Faces = npt.NDArray[np.int64]

_FEWEST_TRIANGLES = 1 << 25
"""A file may hold as many triangles as it has bytes, and always this many."""

_COST_OF_COPY = 64
"""What a copy takes beside its vertices, in triangles."""


EXPORT_AGAIN = "export it again"
COPY_AGAIN = "copy or download it again"


class FileError(ValueError):
    """Why a file cannot be read at all, in plain words: the place in it, and what to do."""

    def __init__(self, why: str, remedy: str = EXPORT_AGAIN) -> None:
        super().__init__(f"{why}; {remedy}")


class Part(NamedTuple):
    """Triangles of a file that go by one name.

    `positions` are (n, 3) in world space, `faces` are (m, 3) and count from 0 in this part.
    `material` is what the file calls or counts it by.
    """

    positions: Positions
    faces: Faces
    name: str = ""
    material: str | int | None = None
    mask: PartMask | None = None


class Room:
    """How much a file may still hold. Copies of a mesh cost the file next to nothing, and would
    fill the memory."""

    def __init__(self, file_size: int) -> None:
        self._most = self._left = max(_FEWEST_TRIANGLES, file_size)

    def take(self, faces: Faces, positions: Positions, copies: int = 1) -> None:
        """FileError where there is no room for copies of a mesh."""
        self._left -= (max(len(faces), len(positions)) + _COST_OF_COPY) * copies
        if self._left < 0:
            raise FileError(
                f"its nodes hold more than {self._most:,} triangles, copies counted",
                "split it into several",
            )


@dataclass
class Contents:
    """All of a file that lixel takes, and a word on each thing that it does not. `up` is the axis
    that points up, by the file's own word."""

    parts: list[Part] = field(default_factory=list)
    cameras: dict[str, Camera] = field(default_factory=dict)
    lights: dict[str, Light] = field(default_factory=dict)
    unsupported: list[str] = field(default_factory=list)
    up: str = "y"

    def leave_out(self, what: str) -> None:
        """Name what is left out, once."""
        if what not in self.unsupported:
            self.unsupported.append(what)


def words_of(error: BaseException) -> str:
    """An error as part of a sentence; a broken file fails with any error there is."""
    if isinstance(error, KeyError):
        return f"it has no {error.args[0]!r}"
    if isinstance(error, ValueError | ImportError) and str(error):
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
