"""Scripts by which shells complete the words of the command `lixel`."""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from typing import Any, get_args

from .arguments import needs
from .methods import METHODS, WARPS, Fit
from .scenes import GENERATORS

SHELLS = ("bash", "zsh", "tcsh")

WORDS = {
    "method": (*METHODS, *(f"{fit}+{warp}" for warp in WARPS for fit in get_args(Fit))),
    "scene": tuple(GENERATORS),
    "scenes": tuple(GENERATORS),
    "device": ("cpu", "gpu"),
}
"""What is offered for arguments that take other words, too."""

FILES = frozenset({"scene", "scenes", "truth", "files", "views", "output", "plot", "folder", "out"})
"""Arguments that take the names of files."""


def script(parser: argparse.ArgumentParser, shell: str) -> str:
    """The script for one of `SHELLS`; it needs the package shtab, of the extra ``completion``."""
    shtab = needs("shtab", "completion")
    for action in _actions(parser):
        if action.choices is None and {action.dest} & {*WORDS, *FILES}:
            action.complete = {
                "bash": f"_lixel_{action.dest}",
                "zsh": _zsh(action.dest),
                "tcsh": _tcsh(action.dest),
            }
    preamble = {"bash": _bash(), "zsh": "", "tcsh": ""}
    return str(shtab.complete(parser, shell=shell, preamble=preamble))


def _actions(parser: argparse.ArgumentParser) -> Iterator[Any]:
    for action in parser._actions:
        yield action
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                yield from _actions(inner)


def _bash() -> str:
    lines = []
    for name in sorted({*WORDS, *FILES}):
        words = f'compgen -W "{" ".join(WORDS.get(name, ()))}" -- "$1"; ' if name in WORDS else ""
        files = 'compgen -f -- "$1"; ' if name in FILES else ""
        lines.append(f"_lixel_{name}() {{ {words}{files}}}")
    return "\n".join(lines)


def _zsh(name: str) -> str:
    words = f"({' '.join(WORDS.get(name, ()))})"
    if name not in FILES:
        return words
    return f'{{_alternative "w:word:{words}" "f:file:_files"}}' if name in WORDS else "_files"


def _tcsh(name: str) -> str:
    return "f" if name in FILES else f"({' '.join(WORDS[name])})"
