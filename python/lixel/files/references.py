"""Files that a file refers to. None outside its own folder is opened: files come from strangers."""

from __future__ import annotations

import base64
import binascii
import re
from pathlib import Path
from urllib.parse import unquote, unquote_to_bytes

from .contents import FileError

_BESIDE = "put that file beside it and refer to its name"


def referenced(folder: Path, uri: str) -> bytes:
    """The bytes behind a URI: a data URI, or a file in the folder or below it.

    Raises
    ------
    FileError
        It is a URL or an absolute path, leads out of the folder, or there is no such file.
    """
    if not isinstance(uri, str):
        raise FileError(f"a URI must be a text, got {type(uri).__name__}")
    if uri[:5].lower() == "data:":
        return _data(uri)
    shown = repr(uri if len(uri) <= 80 else uri[:77] + "...")
    if re.match(r"[A-Za-z][A-Za-z0-9+.-]*:", uri) or uri.startswith(("/", "\\")):
        raise FileError(
            f"it refers to {shown}, a URL or an absolute path, which is not opened", _BESIDE
        )
    # Names are percent-encoded by the standard, and bare in what some programs write.
    for name in (unquote(uri), uri):
        path = folder / name.replace("\\", "/")
        try:
            inside = path.resolve().is_relative_to(folder.resolve())
            there = path.is_file()
        except (OSError, ValueError, RuntimeError):
            inside, there = True, False
        if not inside:
            raise FileError(
                f"it refers to {shown}, outside its own folder, which is not opened", _BESIDE
            )
        if there:
            return path.read_bytes()
    raise FileError(f"it refers to {shown}, and there is no such file beside it", "put it there")


def _data(uri: str) -> bytes:
    head, comma, body = uri.partition(",")
    if not comma:
        raise FileError("a data URI has no comma before its data")
    if not head.lower().endswith(";base64"):
        return unquote_to_bytes(body)
    try:
        # Some programs leave out the padding.
        text = unquote(body).rstrip("=")
        return base64.b64decode(text + "=" * (-len(text) % 4), validate=True)
    except (binascii.Error, ValueError) as error:
        raise FileError(f"the base64 of a data URI cannot be decoded: {error}") from None
