"""The JSON of a glTF file, and its buffers."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ..contents import COPY_AGAIN, FileError
from ..references import referenced

_MAGIC = b"glTF"
_JSON_CHUNK = 0x4E4F534A
_BINARY_CHUNK = 0x004E4942

Object = dict[str, Any]


@dataclass(frozen=True)
class Document:
    """The JSON of a glTF file, the bytes that follow it in a .glb file, and the file's folder.

    `decompressed` keeps buffer views, by index, for whoever decompresses them.
    """

    tree: Object
    binary: bytes | None = None
    folder: Path = Path()
    size: int = 0
    decompressed: dict[int, bytes] = field(default_factory=dict)
    _buffers: dict[int, bytes] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path) -> Document:
        """From a .glb or a .gltf file, whatever its ending says; FileError where it is neither."""
        content = path.read_bytes()
        binary = None
        text = content
        if content.startswith(_MAGIC):
            text, binary = _chunks(content)
        elif path.suffix.lower() == ".glb":
            raise FileError("it does not start as a .glb file does, with the letters glTF")
        try:
            # Some programs pad it with zeros.
            text = text.rstrip(b"\0")
            try:
                tree = json.loads(text)
            except UnicodeDecodeError:
                tree = json.loads(text.decode("latin-1"))
        except (ValueError, RecursionError) as error:
            raise FileError(f"its JSON cannot be read: {error}") from None
        if not isinstance(tree, dict) or not isinstance(tree.get("asset"), dict):
            raise FileError("its JSON is no glTF asset: it has no 'asset'")
        version = str(tree["asset"].get("version", "2.0"))
        if not version.startswith("2"):
            raise FileError(
                f"it is glTF {version}, and only glTF 2 is read", "convert it to glTF 2.0"
            )
        return cls(tree, binary, path.parent, len(content))

    def items(self, kind: str) -> list[Any]:
        """The array of the file that holds such things, for example ``"meshes"``."""
        found = self.tree.get(kind, [])
        if not isinstance(found, list):
            raise FileError(f"its {kind!r} must be an array, got {type(found).__name__}")
        return found

    def item(self, kind: str, index: Any) -> Object:
        """One of them; ValueError where there is none of this index."""
        return entry_of(self.items(kind), index, kind)

    def extension(self, name: str) -> Object:
        """What an extension keeps for the whole file, empty where it is not used."""
        return extension_of(self.tree, name) or {}

    def buffer(self, index: Any) -> bytes:
        """The bytes of a buffer; FileError where they are missing or fewer than it says."""
        if index in self._buffers:
            return self._buffers[index]
        buffer = self.item("buffers", index)
        length = whole(buffer["byteLength"], "a buffer's byteLength")
        if "uri" in buffer:
            content = referenced(self.folder, buffer["uri"])
            name = repr(buffer["uri"][:40])
        elif index == 0 and self.binary is not None:
            content, name = self.binary, "its binary chunk"
        else:
            raise FileError(f"buffer {index} has no 'uri', so its bytes are nowhere")
        if len(content) < length:
            raise FileError(
                f"it is cut off: buffer {index}, {name}, has {len(content)} of {length} bytes",
                COPY_AGAIN,
            )
        self._buffers[index] = content[:length]
        return self._buffers[index]

    def view(self, index: Any) -> tuple[memoryview, Object]:
        """The bytes of a buffer view as they stand in the file, and the view."""
        view = self.item("bufferViews", index)
        return self.slice(view, f"buffer view {index}"), view

    def slice(self, view: Object, what: str) -> memoryview:
        """`byteLength` bytes of a buffer from `byteOffset`; no copy, for many may share a view."""
        content = self.buffer(view["buffer"])
        start = whole(view.get("byteOffset", 0), f"byteOffset of {what}")
        end = start + whole(view["byteLength"], f"byteLength of {what}")
        if end > len(content):
            raise ValueError(f"{what} ends at byte {end} of a buffer that has {len(content)} bytes")
        return memoryview(content)[start:end]


def entry_of(entries: list[Any], index: Any, kind: str) -> Object:
    """An object of an array of the file; ValueError where there is none of this index."""
    if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(entries):
        raise ValueError(f"it refers to {kind}[{index!r}], and the file has {len(entries)} of them")
    entry = entries[index]
    if not isinstance(entry, dict):
        raise ValueError(f"{kind}[{index}] must be an object, got {type(entry).__name__}")
    return entry


def extension_of(holder: Object, name: str) -> Object | None:
    """What an extension says of a part of the file, None where it says nothing."""
    found = holder.get("extensions")
    if not isinstance(found, dict) or name not in found:
        return None
    told: Object = found[name]
    if not isinstance(told, dict):
        raise ValueError(f"{name} must be an object, got {type(told).__name__}")
    return told


def whole(value: Any, what: str) -> int:
    """A whole number that is not negative; some programs write 3.0 for 3."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise ValueError(f"{what} must be a whole number and not negative, got {value!r}")
    return value


def _chunks(content: bytes) -> tuple[bytes, bytes | None]:
    if len(content) < 20:
        raise FileError(
            f"it is cut off: a .glb file starts with 20 bytes, got {len(content)}", COPY_AGAIN
        )
    _, version, length, json_length, kind = struct.unpack_from("<5I", content)
    if version != 2:
        raise FileError(f"it is glTF {version}, and only glTF 2 is read", "convert it to glTF 2.0")
    if length > len(content) or 20 + json_length > len(content):
        raise FileError(
            f"it is cut off: {len(content)} of {max(length, 20 + json_length)} bytes", COPY_AGAIN
        )
    if kind != _JSON_CHUNK:
        raise FileError("its first chunk is not JSON, as that of a .glb file is")
    text, binary = content[20 : 20 + json_length], None
    start = 20 + json_length
    while binary is None and start + 8 <= len(content):
        size, kind = struct.unpack_from("<2I", content, start)
        if kind == _BINARY_CHUNK:
            binary = content[start + 8 : start + 8 + size]
        start += 8 + size
    return text, binary
