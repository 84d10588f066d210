"""The command `lixel`: a list of commands, and of experiments below `lixel lab`."""

from __future__ import annotations

import argparse
import re
import shlex
import sys
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from . import __version__
from ._core import DeviceError
from .frame import render
from .info import info
from .lab import (
    accuracy,
    aligned,
    calibration,
    culling,
    demo,
    departures,
    flicker,
    growth,
    papers,
    peers,
    rankings,
    stress,
    study,
    sun_hours,
)
from .lab.options import (
    SCENE_HELP,
    add_device,
    add_methods,
    add_one_method,
    add_output,
    add_parameters,
    add_resolutions,
    add_view,
    device_of,
    method_with,
    view_of,
)
from .lab.report import status
from .methods import MAP_METHODS, OMNIDIRECTIONAL_METHODS
from .pictures.display import milliseconds

DESCRIPTION = "Hard shadows with research shadow-map methods, and how wrong each one is."


class Command(NamedTuple):
    """A line about a command, its options, and what it does with them.

    A command that renders may have a `device`, whose its table is to be on every machine.
    `--device` and ``LIXEL_DEVICE`` count for more.
    """

    help: str
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], None]
    renders: bool = True
    device: str | None = None

    @classmethod
    def of(cls, module: ModuleType, device: str | None = None, *, renders: bool = True) -> Command:
        """That of a module, whose docstring begins with the line."""
        line = (module.__doc__ or "").split("\n\n")[0]
        return cls(line, module.add_arguments, module.run, renders, device)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the process if None.

    Returns
    -------
    int
        The exit code: 0, 2 where an argument or the machine was at fault, 130 after Ctrl-C.
    """
    try:
        given = _with_vectors_joined(sys.argv[1:] if arguments is None else arguments)
        options = _parser().parse_args(given)
        # What a table says of where it comes from: the names of files, not this machine's folders.
        names = (Path(word).name if Path(word).is_absolute() else word for word in given)
        options.line = shlex.join(["lixel", *names])
        with device_of(options), _warnings_in_lines():
            options.run(options)
    except (ValueError, TypeError, OSError, ImportError, DeviceError) as error:
        # One line, whatever the message holds.
        status("lixel: error: " + " ".join(str(error).split()))
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


def _with_vectors_joined(arguments: Sequence[str]) -> list[str]:
    """`--light -1,-2,0` as `--light=-1,-2,0`: argparse takes a vector that begins with a minus sign
    for an option."""
    joined: list[str] = []
    for argument in arguments:
        follows = bool(joined) and joined[-1] in ("--camera", "--light")
        if follows and re.match(r"-[0-9.]", argument):
            joined[-1] += "=" + argument
        else:
            joined.append(argument)
    return joined


@contextmanager
def _warnings_in_lines() -> Iterator[None]:
    """A warning is one line of words, each time."""

    def show(message: Warning | str, *_: object, **__: object) -> None:
        status("lixel: warning: " + " ".join(str(message).split()))

    # It puts back `showwarning` as well.
    with warnings.catch_warnings():
        warnings.showwarning = show
        warnings.simplefilter("always", UserWarning)
        yield


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> Any:
        raise ValueError(message)


def _parser() -> argparse.ArgumentParser:
    top = _Parser(prog="lixel", description=DESCRIPTION)
    top.add_argument("--version", action="version", version=f"lixel {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND")
    _add_all(commands, COMMANDS)
    words = "Experiments: each measures what the documentation says, and keeps it in a table."
    lab = commands.add_parser("lab", help=words, description=words)
    _add_all(lab.add_subparsers(required=True, metavar="EXPERIMENT"), LAB)
    return top


def _add_all(parsers: Any, commands: Mapping[str, Command]) -> None:
    for name, command in commands.items():
        added = parsers.add_parser(name, help=command.help, description=command.help)
        added.set_defaults(run=command.run)
        command.add_arguments(added)
        if command.renders:
            add_device(added, command.device)


# --- The commands that are no experiments ---


def _add_render(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="FILE", help=SCENE_HELP)
    add_view(parser)
    add_one_method(parser)
    words = ".png: a shaded picture; .npy: float32, 1 lit, 0 in shadow, NaN no surface"
    add_output(parser, words, (".png", ".npy"), required=True)


def _render(options: argparse.Namespace) -> None:
    method = method_with(options.method, options.resolution, options.parameters)
    frame = render(*view_of(options), method)
    frame.save(options.output)
    print(f"{options.output}: {milliseconds(frame.timings)} ms")


def _add_compare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="FILE", help=SCENE_HELP)
    add_view(parser)
    add_methods(parser, "all with a map that take the light")
    add_resolutions(parser, "that of the method")
    add_parameters(parser)
    words = "write pictures with the misclassified pixels in red into this folder"
    add_output(parser, words, type=Path, metavar="FOLDER")


def _compare(options: argparse.Namespace) -> None:
    scene, camera, light = view_of(options)
    maps = {**MAP_METHODS, **OMNIDIRECTIONAL_METHODS}
    methods = [
        method_with(name, resolution, options.parameters)
        for name in options.method or [n for n, method in maps.items() if method().takes(light)]
        for resolution in options.resolution or [None]
    ]
    demo.show(demo.evaluate(scene, camera, light, methods, options.output))


def _info(_: argparse.Namespace) -> None:
    found = info()
    print(found)
    if found.problem is not None:
        raise DeviceError(found.problem)


COMMANDS: Mapping[str, Command] = {
    "render": Command(
        "Render the shadows of a scene into a picture or an array.", _add_render, _render
    ),
    "compare": Command(
        "Render with methods, and count the pixels that each misclassifies.", _add_compare, _compare
    ),
    "info": Command(
        "Tell the CPU engine, adapters, drivers, limits, and which of them is in use.",
        lambda _: None,
        _info,
        renders=False,
    ),
    "demo": Command.of(demo),
}

LAB: Mapping[str, Command] = {
    "study": Command.of(study),
    "peers": Command.of(peers),
    "papers": Command.of(papers),
    "rankings": Command.of(rankings),
    "stress": Command.of(stress, device="gpu"),
    "culling": Command.of(culling, device="gpu"),
    "flicker": Command.of(flicker, device="gpu"),
    "accuracy": Command.of(accuracy, device="gpu"),
    "departures": Command.of(departures, device="gpu"),
    "aligned": Command.of(aligned, device="cpu"),
    "growth": Command.of(growth, device="gpu"),
    "calibration": Command.of(calibration, device="gpu"),
    "sun_hours": Command.of(sun_hours, renders=False),
}
"""Each is the module of its name in `lixel.lab`."""
