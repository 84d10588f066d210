"""glTF files that tests make, the folder of small files, and the area of what is read."""

from __future__ import annotations

import base64
import json
from pathlib import Path
from typing import Any

import numpy as np

import lixel as lx

CASES = Path(__file__).parent / "cases"

_CODES = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
_KINDS = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}


def area(scene: lx.Scene) -> float:
    corners = scene.vertices[scene.faces]
    sides = corners[:, 1:] - corners[:, :1]
    return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2


def data_uri(content: bytes) -> str:
    return "data:application/octet-stream;base64," + base64.b64encode(content).decode()


class GltfFile:
    """A glTF document that grows by arrays, meshes and nodes."""

    def __init__(self) -> None:
        self.data = b""
        self.tree: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
        }

    def view(self, content: bytes, **members: Any) -> int:
        self.data += b"\0" * (-len(self.data) % 4)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(content)}
        self.data += content
        return self._add("bufferViews", view | members)

    def accessor(self, values: Any, dtype: str, **members: Any) -> int:
        array = np.asarray(values, dtype="<" + dtype)
        array = array if array.ndim == 2 else array.reshape(len(array), -1)
        entry = {
            "bufferView": self.view(array.tobytes()),
            "componentType": _CODES[dtype],
            "count": len(array),
            "type": _KINDS[array.shape[1]],
        }
        return self._add("accessors", entry | members)

    def mesh(self, *primitives: dict[str, Any], **members: Any) -> int:
        return self._add("meshes", {"primitives": list(primitives)} | members)

    def node(self, *, root: bool = True, **members: Any) -> int:
        index = self._add("nodes", members)
        if root:
            self.tree["scenes"][0]["nodes"].append(index)
        return index

    def add(self, kind: str, entry: Any) -> int:
        self.tree.setdefault(kind, [])
        return self._add(kind, entry)

    def write(self, path: Path) -> Path:
        buffers = [{"byteLength": len(self.data), "uri": data_uri(self.data)}]
        path.write_text(json.dumps({"buffers": buffers} | self.tree))
        return path

    def _add(self, kind: str, entry: Any) -> int:
        self.tree[kind].append(entry)
        return len(self.tree[kind]) - 1
