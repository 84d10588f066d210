"""Which triangles of a glTF file have holes: materials whose alpha is tested, and their images."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from ...masks import AlphaMask, PartMask, Sampling, Wrap
from ..alpha_images import AlphaImages
from ..contents import words_of
from ..references import referenced
from .document import Document, Object, extension_of, whole
from .primitives import Primitive

# What samplers call it (OpenGL).
_WRAPS: dict[int, Wrap] = {10497: "repeat", 33071: "clamp", 33648: "mirror"}
_REPEAT = 10497
_NEAREST = 9728

_OPAQUE = np.full((1, 1), 255, np.uint8)

Floats = npt.NDArray[np.float64]


class _Texture(NamedTuple):
    # None where it is opaque.
    alpha: npt.NDArray[np.uint8] | None
    wrap: tuple[Wrap, Wrap] = ("repeat", "repeat")
    sampling: Sampling = "linear"


class MaskedMaterials:
    """The materials of a file that are masked, each image read once.

    `leave_out` takes a word on what is not taken as the file says it.
    """

    def __init__(self, document: Document, leave_out: Callable[[str], None]) -> None:
        self._document = document
        self._leave_out = leave_out
        self._alpha: dict[int, npt.NDArray[np.uint8] | None] = {}
        self._masks: dict[tuple[object, ...], AlphaMask] = {}
        self._images = AlphaImages(leave_out)

    def of_primitive(self, primitive: Primitive) -> PartMask | None:
        """What masks the triangles of a primitive; None: nothing."""
        number = primitive.entry.get("material")
        if number is None or not len(primitive.faces):
            return None
        material = self._document.item("materials", number)
        mode = material.get("alphaMode", "OPAQUE")
        if mode not in ("MASK", "BLEND"):
            return None
        name = repr(material.get("name", number))
        factor, info = _base_color(material)
        texture = self._texture(info, name)
        image = _OPAQUE if texture.alpha is None else texture.alpha
        alpha = np.full(primitive.faces.shape, float(factor))
        colors = primitive.attribute("COLOR_0")
        if colors is not None and colors.shape[1] == 4:
            alpha *= colors[primitive.faces, 3]
        cutoff = float(material.get("alphaCutoff", 0.5)) if mode == "MASK" else 0.5
        if float(image.min()) * float(alpha.min()) >= 255.0 * cutoff:
            return None
        if mode == "BLEND":
            self._leave_out(
                f"half transparency of material {name}, taken for alphaMode MASK at 0.5"
            )
        uv = _places(primitive, info)[primitive.faces]
        key = (id(image), cutoff, texture.wrap, texture.sampling)
        if key not in self._masks:
            self._masks[key] = AlphaMask(image, cutoff, texture.wrap, texture.sampling)
        return PartMask(self._masks[key], np.concatenate([uv, alpha[..., None]], axis=2))

    def _texture(self, info: Object | None, material: str) -> _Texture:
        if info is None:
            return _Texture(None)
        entry = self._document.item("textures", info["index"])
        sampler: Object = {}
        if "sampler" in entry:
            sampler = self._document.item("samplers", entry["sampler"])
        along_u, along_v = (_WRAPS.get(sampler.get(k, _REPEAT)) for k in ("wrapS", "wrapT"))
        if along_u is None or along_v is None:
            raise ValueError(f"wrapS and wrapT must be among {sorted(_WRAPS)}, got {sampler}")
        sampling: Sampling = "nearest" if sampler.get("magFilter") == _NEAREST else "linear"
        webp = extension_of(entry, "EXT_texture_webp") or {}
        source = entry.get("source", webp.get("source"))
        if source is None:
            self._leave_out(f"holes of material {material}: its image is in no known format")
            return _Texture(None)
        if source not in self._alpha:
            self._alpha[source] = self._decoded(source, material)
        return _Texture(self._alpha[source], (along_u, along_v), sampling)

    def _decoded(self, source: int, material: str) -> npt.NDArray[np.uint8] | None:
        try:
            content = self._content(source)
        except Exception as error:
            self._leave_out(f"holes of material {material}: {words_of(error)}")
            return None
        return self._images.decoded(content, f"image {source}", material)

    def _content(self, source: int) -> bytes:
        image = self._document.item("images", source)
        if "bufferView" in image:
            return bytes(self._document.view(image["bufferView"])[0])
        return referenced(self._document.folder, image["uri"])


def _base_color(material: Object) -> tuple[float, Object | None]:
    """The factor of alpha, and the texture."""
    older = extension_of(material, "KHR_materials_pbrSpecularGlossiness")
    if older is not None:
        return older.get("diffuseFactor", (1, 1, 1, 1))[3], older.get("diffuseTexture")
    metal = material.get("pbrMetallicRoughness", {})
    return metal.get("baseColorFactor", (1, 1, 1, 1))[3], metal.get("baseColorTexture")


def _places(primitive: Primitive, info: Object | None) -> Floats:
    """Texture coordinates of the vertices, after KHR_texture_transform."""
    transform = extension_of(info or {}, "KHR_texture_transform") or {}
    own = (info or {}).get("texCoord", 0)
    places = primitive.attribute(f"TEXCOORD_{whole(transform.get('texCoord', own), 'texCoord')}")
    if info is None or places is None:
        # Every point shows the same texel.
        return np.zeros((len(primitive.positions), 2))
    turn = float(transform.get("rotation", 0.0))
    cosine, sine = math.cos(turn), math.sin(turn)
    rotation = np.array([[cosine, sine], [-sine, cosine]])
    scaled = places * np.asarray(transform.get("scale", (1, 1)), np.float64)
    moved: Floats = scaled @ rotation.T + np.asarray(transform.get("offset", (0, 0)), np.float64)
    return moved
