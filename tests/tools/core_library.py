"""The extension module as cargo leaves it, for commands that put it into a package themselves."""

from __future__ import annotations

import shutil
from pathlib import Path

# On Linux and on macOS.
NAMES = ("lib_core.so", "lib_core.dylib")


def install(built: Path, package: Path) -> Path:
    """Copies what cargo built in a folder into a copy of the package `lixel`; the module's path."""
    (library,) = (file for file in built.iterdir() if file.name in NAMES)
    module = package / "_core.abi3.so"
    # A new file: the old one may be in use.
    module.unlink(missing_ok=True)
    shutil.copy(library, module)
    return module
