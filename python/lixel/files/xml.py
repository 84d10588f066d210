"""XML files from strangers."""

from __future__ import annotations

from .contents import FileError


def refuse_entities(content: bytes) -> None:
    """Entities can open other files, and a few of them can stand for gigabytes."""
    # In UTF-16 every other byte is zero.
    if b"<!ENTITY" in content.replace(b"\0", b""):
        raise FileError("its XML defines entities, which are not read", "export it without them")
