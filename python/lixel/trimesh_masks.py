"""Which triangles of a trimesh mesh have holes: textured materials with alpha."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from .masks import MAX_TEXELS, AlphaMask, PartMask, alpha_of_image, check_size

if TYPE_CHECKING:
    import trimesh


class TrimeshMasks:
    """Those of several meshes, which may share images."""

    def __init__(self) -> None:
        self._masks: dict[tuple[int, float], tuple[Any, AlphaMask | None]] = {}

    def of_mesh(self, mesh: trimesh.Trimesh) -> PartMask | None:
        """What masks the triangles of a mesh; None: nothing.

        A PBRMaterial says so by its `alphaMode`, "BLEND" is taken as "MASK" at 0.5, and so is a
        SimpleMaterial whose image has alpha.
        """
        uv = getattr(mesh.visual, "uv", None)
        material = getattr(mesh.visual, "material", None)
        if uv is None or material is None or len(uv) != len(mesh.vertices):
            return None
        cutoff, factor, image = 0.5, 1.0, getattr(material, "image", None)
        if hasattr(material, "alphaMode"):
            if material.alphaMode not in ("MASK", "BLEND"):
                return None
            image = material.baseColorTexture
            if material.alphaMode == "MASK" and material.alphaCutoff is not None:
                cutoff = float(material.alphaCutoff)
            if material.baseColorFactor is not None:
                # trimesh keeps colours in whole numbers up to 255.
                factor = float(np.ravel(material.baseColorFactor)[3]) / 255.0
        mask = self._mask(image, cutoff)
        if mask is None:
            return None
        places = np.asarray(uv, np.float64)[np.asarray(mesh.faces)]
        # trimesh counts v from below.
        u, v = places[..., 0], 1.0 - places[..., 1]
        return PartMask(mask, np.stack([u, v, np.full(u.shape, factor)], axis=2))

    def _mask(self, image: Any, cutoff: float) -> AlphaMask | None:
        key = (id(image), cutoff)
        if key not in self._masks:
            alpha = None
            if image is not None:
                check_size(image, MAX_TEXELS, "an image")
                alpha = alpha_of_image(image)
            self._masks[key] = (image, None if alpha is None else AlphaMask(alpha, cutoff))
        return self._masks[key][1]
