"""Compressed geometry: Draco meshes and the buffer views of meshoptimizer, by their libraries."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..contents import FileError
from .document import Object, whole

DRACO = "KHR_draco_mesh_compression"
MESHOPT = ("EXT_meshopt_compression", "KHR_meshopt_compression")

_MAX_RATIO = 4096
"""Bytes that one compressed byte may stand for: no stream of the codecs has more."""


def decompressed(content: bytes, view: Object, name: str) -> bytes:
    """The bytes of a buffer view that meshoptimizer compressed."""
    try:
        import meshopt
    except ImportError:
        raise FileError(
            f"it uses {name}, which takes the package meshopt",
            "pip install meshopt (Python 3.11 or newer), or export it without compression",
        ) from None
    count, stride = whole(view["count"], "count"), whole(view["byteStride"], "byteStride")
    if count * stride > _MAX_RATIO * len(content) + _MAX_RATIO:
        raise ValueError(f"{name} promises {count * stride} bytes out of {len(content)}")
    mode, kind = str(view["mode"]), str(view.get("filter", "NONE"))
    values = meshopt.decode_gltf_buffer(content, count, stride, mode, kind)
    decoded = np.ascontiguousarray(values).tobytes()
    if len(decoded) != count * stride:
        raise ValueError(f"{name} promises {count * stride} bytes and has {len(decoded)}")
    return decoded


class DracoMesh:
    """A mesh that Draco compressed."""

    def __init__(self, content: bytes, identifiers: Object) -> None:
        try:
            import DracoPy
        except ImportError:
            raise FileError(
                f"it uses {DRACO}, which takes the package DracoPy",
                "pip install DracoPy, or export it without compression",
            ) from None
        self._identifiers = identifiers
        self._decoded = DracoPy.decode(content)
        if not hasattr(self._decoded, "faces"):
            raise ValueError("its Draco data are a point cloud")

    @property
    def faces(self) -> npt.NDArray[np.int64]:
        """The triangles, (m, 3)."""
        return np.asarray(self._decoded.faces, dtype=np.int64).reshape(-1, 3)

    def attribute(self, name: str) -> npt.NDArray[Any] | None:
        """An attribute of the vertices, (n, components), None where there is none."""
        if name not in self._identifiers:
            return None
        found = self._decoded.get_attribute_by_unique_id(self._identifiers[name])
        if found is None:
            raise ValueError(f"its Draco data have no {name}")
        values = np.asarray(found["data"])
        return values if values.ndim == 2 else values[:, None]
