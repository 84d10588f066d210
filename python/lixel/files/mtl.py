"""Materials of OBJ files: which have holes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ..masks import AlphaMask, PartMask, Wrap, alpha_of_image
from .alpha_images import AlphaImages, Texels
from .contents import FileError, words_of
from .references import referenced
from .text import name_of, plain

_OPAQUE = np.full((1, 1), 255, np.uint8)

_WORDS_AFTER = {"-o": 3, "-s": 3, "-t": 3, "-mm": 2}
"""How many numbers may follow an option of an image; any other is followed by one word."""

_UNTOLD = {"-t": "turbulence", "-mm": "a change of its values"}


@dataclass
class _Entry:
    """What a file says of the alpha of a material."""

    solid: float | None = None
    see_through: float = 0.0
    image: str = ""

    @property
    def factor(self) -> float:
        return 1.0 - self.see_through if self.solid is None else self.solid


@dataclass
class _Image:
    """An image with the options before its name."""

    name: str = ""
    options: dict[str, list[str]] = field(default_factory=dict)

    def pair(self, option: str, default: float) -> tuple[float, float]:
        numbers = [float(word) for word in self.options.get(option, [])]
        u, v = (numbers + [default] * 2)[:2]
        return u, v


@dataclass
class Material:
    """A material with holes. `scale` and `offset` take texture coordinates to the image."""

    alpha: AlphaMask
    factor: float
    scale: tuple[float, float] = (1.0, 1.0)
    offset: tuple[float, float] = (0.0, 0.0)

    def mask(self, places: npt.NDArray[np.float64]) -> PartMask:
        """What masks triangles, of the texture coordinates of their corners, (m, 3, 2)."""
        u, v = (places[..., i] * self.scale[i] + self.offset[i] for i in range(2))
        # OBJ counts v from below.
        return PartMask(self.alpha, np.stack([u, 1.0 - v, np.full(u.shape, self.factor)], axis=2))


class Materials:
    """Those of the files that an OBJ file refers to, each image read once.

    `leave_out` takes a word on what is not taken as the files say it.
    """

    def __init__(self, folder: Path, leave_out: Callable[[str], None]) -> None:
        self._folder, self._leave_out = folder, leave_out
        self._entries: dict[str, _Entry] = {}
        self._missing: dict[str, str | None] = {}
        self._alpha: dict[tuple[str, str], Texels | None] = {}
        self._images = AlphaImages(leave_out)

    def add(self, names: str) -> None:
        """Those of a file, whose name may have spaces, or of several."""
        if names in self._missing:
            return
        self._missing[names] = None
        try:
            content = referenced(self._folder, names)
        except FileError as error:
            if len(names.split()) > 1:
                for name in names.split():
                    self.add(name)
            else:
                self._missing[names] = f"holes by the materials of {names!r}: {error}"
        else:
            self._read(content)

    def name_missing(self) -> None:
        """Word on the files of materials that cannot be read."""
        for why in self._missing.values():
            if why is not None:
                self._leave_out(why)

    def of(self, name: str | None) -> Material | None:
        """A material, if it has holes."""
        entry = self._entries.get(name or "", _Entry())
        try:
            found = self._material(entry, name)
        except ValueError as error:
            if isinstance(error, FileError):
                raise
            self._leave_out(f"holes of material {name!r}: {words_of(error)}")
            return None
        if found is not None and 0.0 < entry.factor < 1.0:
            self._leave_out(f"half transparency of material {name!r}, taken for holes below 0.5")
        return found

    def _read(self, content: bytes) -> None:
        entry = _Entry()
        for line in plain(content).split(b"\n"):
            words = name_of(line).split(None, 1)
            if len(words) < 2:
                continue
            word, rest = words[0].lower(), words[1].strip()
            if word == "newmtl":
                entry = self._entries[rest] = _Entry()
            elif word == "map_d":
                entry.image = rest
            elif word in ("d", "tr"):
                number = rest.split()[-1]
                if not _is_number(number):
                    self._leave_out(f"a line of materials that is no number: {rest[:80]!r}")
                elif word == "d":
                    entry.solid = min(max(float(number), 0.0), 1.0)
                else:
                    entry.see_through = min(max(float(number), 0.0), 1.0)

    def _material(self, entry: _Entry, name: str | None) -> Material | None:
        image = _image(entry.image)
        for option, what in _UNTOLD.items():
            if option in image.options:
                self._leave_out(f"{what} ({option}) of the alpha image of material {name!r}")
        alpha = self._texels(image, name) if image.name else None
        alpha = _OPAQUE if alpha is None else alpha
        if float(alpha.min()) * entry.factor >= 127.5:
            return None
        wrap: Wrap = "clamp" if image.options.get("-clamp") == ["on"] else "repeat"
        scale, offset = image.pair("-s", 1.0), image.pair("-o", 0.0)
        return Material(AlphaMask(alpha, 0.5, wrap), entry.factor, scale, offset)

    def _texels(self, image: _Image, name: str | None) -> Texels | None:
        channel = "".join(image.options.get("-imfchan", []))
        if (image.name, channel) not in self._alpha:
            self._alpha[image.name, channel] = self._decoded(image.name, channel, name)
        return self._alpha[image.name, channel]

    def _decoded(self, image: str, channel: str, name: str | None) -> Texels | None:
        try:
            content = referenced(self._folder, image)
        except FileError as error:
            self._leave_out(f"holes of material {name!r}: {error}")
            return None
        return self._images.decoded(
            content, f"{image!r}", f"{name!r}", lambda opened: _opacity(opened, channel)
        )


def _image(words: str) -> _Image:
    """Options, and then a name that may have spaces."""
    image = _Image()
    while words.startswith("-"):
        option, _, words = words.partition(" ")
        given: list[str] = []
        for _ in range(_WORDS_AFTER.get(option, 1)):
            word, _, rest = words.lstrip().partition(" ")
            if option in _WORDS_AFTER and not _is_number(word):
                break
            given.append(word)
            words = rest
        image.options[option], words = given, words.lstrip()
    image.name = words.strip()
    return image


def _is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def _opacity(image: Any, channel: str) -> Texels | None:
    """How solid an image is: its alpha, or how bright it is where it has none, or the channel that
    the file names. None where all of it is solid."""
    alpha = alpha_of_image(image) if channel in ("", "m") else None
    if alpha is not None or channel == "m":
        return alpha
    if image.mode.startswith("I"):
        values = np.asarray(image).clip(0, 0xFFFF) // 0x101
    elif channel in ("r", "g", "b"):
        values = np.asarray(image.convert("RGB").getchannel(channel.upper()))
    else:
        values = np.asarray(image.convert("L"))
    return None if values.min() == 255 else values.astype(np.uint8)
