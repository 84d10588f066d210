"""Triangles with holes: alpha images, and where on them the corners of triangles lie."""

from __future__ import annotations

import io
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, NamedTuple, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from .arguments import INTEGER, array_of, real, reals

Wrap: TypeAlias = Literal["repeat", "mirror", "clamp"]
Sampling: TypeAlias = Literal["linear", "nearest"]

# Texels of all images of a scene together, as in src/masks.rs.
MAX_TEXELS = 1 << 27


@dataclass(frozen=True, eq=False)
class AlphaMask:
    """An image that says where triangles have holes: where its alpha is below the cutoff.

    It is sampled at its base level, as glTF's ``alphaMode: MASK`` asks, at the very point that a
    ray meets. There is no half transparency: a point is there or it is not.

    Parameters
    ----------
    image : (H, W) uint8 or bool
        Alpha of the texels, 255 or True where the surface is there. Texture coordinates are glTF's:
        (0, 0) is the outer corner of the first texel of row 0, (1, 1) that of the last one of the
        last row.
    cutoff : float
        From which alpha on the surface is there, as a share of 255; at least 0.
    wrap : str or (str, str)
        How the image goes on beyond its sides, along u and v: ``"repeat"``, ``"mirror"`` or
        ``"clamp"``.
    sampling : str
        Between the middles of texels: ``"linear"`` takes the mean of four, ``"nearest"`` one.

    Raises
    ------
    TypeError
        An image of other numbers, or a cutoff that is no number.
    ValueError
        A wrong shape, more than 2**27 texels, a cutoff below 0 or infinite, an unknown wrap or
        sampling.

    Examples
    --------
    >>> import numpy as np
    >>> AlphaMask(np.eye(4, dtype=bool)).cutoff
    0.5
    """

    image: npt.NDArray[np.uint8] = field(repr=False)
    cutoff: float = 0.5
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    sampling: Sampling = "linear"

    def __init__(
        self,
        image: npt.ArrayLike,
        cutoff: float = 0.5,
        wrap: Wrap | tuple[Wrap, Wrap] = "repeat",
        sampling: Sampling = "linear",
    ) -> None:
        texels = np.asarray(image)
        if texels.dtype not in (np.uint8, np.bool_):
            raise TypeError(f"image must be an array of uint8 or bool, got dtype {texels.dtype}")
        if texels.ndim != 2 or not 0 < texels.size <= MAX_TEXELS:
            raise ValueError(
                f"image must have shape (H, W) and 1 to {MAX_TEXELS} texels, got {texels.shape}"
            )
        cutoff = real("cutoff", cutoff)
        if not 0.0 <= cutoff < np.inf:
            raise ValueError(f"cutoff must be finite and at least 0, got {cutoff}")
        wraps = (wrap, wrap) if isinstance(wrap, str) else tuple(wrap)
        if len(wraps) != 2 or any(w not in get_args(Wrap) for w in wraps):
            raise ValueError(f"wrap must be one or two of {get_args(Wrap)}, got {wrap!r}")
        if sampling not in get_args(Sampling):
            raise ValueError(f"sampling must be one of {get_args(Sampling)}, got {sampling!r}")
        if texels.dtype == np.bool_:
            texels = texels * np.uint8(255)
        # A copy, which nobody can change behind the scene's back.
        texels = np.array(texels, dtype=np.uint8, order="C")
        texels.flags.writeable = False
        object.__setattr__(self, "image", texels)
        object.__setattr__(self, "cutoff", cutoff)
        object.__setattr__(self, "wrap", wraps)
        object.__setattr__(self, "sampling", sampling)


@dataclass(frozen=True)
class Masks:
    """What masks the triangles of a scene."""

    # Of each triangle the number of its image, -1 where it is opaque.
    face_alpha: npt.NDArray[np.int32]
    # (u, v, factor of alpha) of the corners of those that are masked, (k, 3, 3).
    corners: npt.NDArray[np.float64]
    alpha: tuple[AlphaMask, ...]

    def of_core(self) -> tuple[object, ...]:
        """As the core takes them."""
        images = [(mask.image, mask.wrap, mask.sampling, mask.cutoff) for mask in self.alpha]
        return self.face_alpha, self.corners, images

    def bytes(self) -> Iterator[bytes]:
        """All that says where holes are."""
        yield from (self.face_alpha.tobytes(), self.corners.tobytes())
        for mask in self.alpha:
            yield from (mask.image.tobytes(), repr(mask).encode())


class PartMask(NamedTuple):
    """What masks all triangles of a part of a scene."""

    image: AlphaMask
    # (u, v, factor of alpha) of the corners, (m, 3, 3).
    corners: npt.NDArray[np.float64]


def masks_of_parts(parts: Sequence[tuple[int, PartMask | None]]) -> Masks | None:
    """The masks of parts after one another, each a number of triangles; None where none has any."""
    alpha: dict[int, AlphaMask] = {}
    numbers, corners = [], []
    for count, mask in parts:
        number = -1
        if mask is not None:
            alpha.setdefault(id(mask.image), mask.image)
            number = list(alpha).index(id(mask.image))
            corners.append(mask.corners)
        numbers.append(np.full(count, number, np.int32))
    if not corners:
        return None
    return Masks(np.concatenate(numbers), np.concatenate(corners), tuple(alpha.values()))


class TooManyTexelsError(ValueError):
    """Alpha images that would fill the memory."""


def decoded_alpha(
    content: bytes,
    most: int,
    what: str,
    taken: Callable[[Any], npt.NDArray[np.uint8] | None] | None = None,
) -> npt.NDArray[np.uint8] | None:
    """The alpha of an encoded image, rows from the top, None where all of it is opaque; or what
    another function takes of the PIL image.

    TooManyTexelsError, before anything is decoded, where it has more than `most`; what cannot be
    read raises any error of Pillow.
    """
    from PIL import Image

    with warnings.catch_warnings():
        # Pillow warns from 2**26 texels on; the bound here is the same for all.
        warnings.simplefilter("ignore", Image.DecompressionBombWarning)
        try:
            opened = Image.open(io.BytesIO(content))
        except Image.DecompressionBombError as error:
            # Pillow has a bound of its own, above this one.
            raise TooManyTexelsError(
                f"alpha images must have at most {MAX_TEXELS} texels together, and {what} has more "
                f"({error})"
            ) from None
        with opened as image:
            check_size(image, most, what)
            return (taken or alpha_of_image)(image)


def check_size(image: Any, most: int, what: str) -> None:
    """Refuses a PIL image, which is not decoded yet, of more than so many texels."""
    if image.width * image.height > most:
        raise TooManyTexelsError(
            f"alpha images must have at most {MAX_TEXELS} texels together, and {what} has "
            f"{image.width} x {image.height} where {most} are left"
        )


def alpha_of_image(image: Any) -> npt.NDArray[np.uint8] | None:
    """The alpha of a PIL image, rows from the top; None where all of it is opaque."""
    if "A" not in image.getbands():
        if "transparency" not in image.info:
            return None
        image = image.convert("RGBA")
    alpha = np.asarray(image.getchannel("A"), np.uint8)
    return None if alpha.min() == 255 else alpha


def masks_of_arrays(
    faces: npt.NDArray[np.int64],
    vertex_count: int,
    uv: npt.ArrayLike | None,
    alpha: AlphaMask | Sequence[AlphaMask] | None,
    face_alpha: npt.ArrayLike | None,
) -> Masks | None:
    """The masks of a new scene; None where nothing is masked."""
    given = {"uv": uv, "alpha": alpha, "face_alpha": face_alpha}
    if uv is None or alpha is None:
        lone = [name for name, value in given.items() if value is not None]
        if lone:
            raise ValueError(f"uv and alpha must come together, got {' and '.join(lone)} alone")
        return None
    images = (alpha,) if isinstance(alpha, AlphaMask) else tuple(alpha)
    for image in images:
        if not isinstance(image, AlphaMask):
            raise TypeError(f"alpha must hold lixel.AlphaMask, got {type(image).__name__}")
    count = len(faces)
    if face_alpha is not None:
        numbers = array_of(INTEGER, "face_alpha", face_alpha, (count,))
    elif len(images) == 1:
        numbers = np.zeros(count, np.int64)
    else:
        raise ValueError(f"face_alpha must say which of {len(images)} alpha images a face has")
    unknown = (numbers < -1) | (numbers >= len(images))
    if unknown.any():
        face = int(np.flatnonzero(unknown)[0])
        raise ValueError(
            f"face_alpha must be -1 or index one of {len(images)} alpha images: "
            f"face {face} has {numbers[face]}"
        )
    is_of_vertices = np.ndim(uv) == 2
    places = reals("uv", uv, vertex_count, 2) if is_of_vertices else reals("uv", uv, count, 3, 2)
    masked = numbers >= 0
    of_corners = places[faces[masked]] if is_of_vertices else places[masked]
    corners = np.concatenate([of_corners, np.ones((len(of_corners), 3, 1))], axis=2)
    return Masks(numbers.astype(np.int32), corners, images)
