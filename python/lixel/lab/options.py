"""Options that several commands of `lixel` share, and what their texts mean."""

from __future__ import annotations

import argparse
import ast
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeAlias

from ..camera import Camera
from ..light import Light
from ..load import FORMATS
from ..methods import METHODS, PAPERS, Method, Resolution, method_from
from ..scene import Scene
from ..scenes import GENERATORS
from .report import table
from .result_tables import ENDINGS, write
from .views import scene_and_views

CAMERA_HELP = """name or index of a camera of the scene or of --views, or "eye;target;yfov" or
"eye;target;yfov;up": points as x,y,z, the vertical angle of view in radians, or in degrees as in
60deg; default: the first camera, or one that sees the whole scene"""

LIGHT_HELP = """name or index of a light of the scene or of --views, or "x,y,z", the direction from
the light towards the scene; default: the first light, or one from above"""

VIEWS_HELP = """file with cameras (eye, target, up, fov_y_deg) and lights (kind, direction) to use
instead of the scene's own; in a list of such objects, the one whose "file" is the scene's name"""

UP_HELP = """z for files whose Z axis points up, as CAD and maps have it: (x, y, z) becomes
(x, z, -y), and --camera and --light mean the turned scene; default: y"""

SCENE_HELP = f"a {', '.join(FORMATS)} file, or a built-in scene: {', '.join(GENERATORS)}"

METHOD_HELP = (
    f"one of {', '.join(METHODS)}, or a composition such as cube+notw; followed by @published, or "
    f"by @ and one of {', '.join(PAPERS)}, as a paper has it"
)

DEFAULT_SCENE = "colonnade"

DEVICE_VARIABLE = "LIXEL_DEVICE"
"""The core reads it where no device is given."""

THREADS_VARIABLE = "LIXEL_THREADS"
"""The core reads it where no number of threads is given."""

MORE = "may be given more than once"

RESOLUTION_HELP = "texels along each side of the map, or 1024x512 for so many columns and rows"

PICTURES = (".png", ".svg", ".pdf")
"""Endings of what matplotlib draws."""

Container: TypeAlias = argparse._ActionsContainer
"""What takes options: a parser, or a group of one."""


# --- Options ---


def add_scene_and_view(parser: argparse.ArgumentParser) -> None:
    """A scene that need not be named, and the options of `add_view`."""
    parser.add_argument(
        "scene", nargs="?", default=DEFAULT_SCENE, metavar="FILE",
        help=f"{SCENE_HELP}; default: {DEFAULT_SCENE}",
    )  # fmt: skip
    add_view(parser)


def add_view(parser: argparse.ArgumentParser) -> None:
    """`--camera`, `--light`, `--views`, `--up` and `--size`."""
    group = parser.add_argument_group("view")
    group.add_argument("--camera", metavar="CAMERA", help=CAMERA_HELP)
    group.add_argument("--light", metavar="LIGHT", help=LIGHT_HELP)
    group.add_argument("--views", type=Path, metavar="FILE.json", help=VIEWS_HELP)
    group.add_argument("--up", choices=("y", "z"), default="y", help=UP_HELP)
    add_size(group, "the camera's own, or 1920x1080")


def add_device(parser: argparse.ArgumentParser, default: str | None = None) -> None:
    """`--device`, and what it is where the environment names no device either."""
    group = parser.add_argument_group("who renders")
    words = default or "a hardware GPU where there is one, else the CPU engine"
    group.add_argument(
        "--device", metavar="NAME",
        help="cpu: the CPU engine; gpu: the best adapter; or a part of an adapter's name; default: "
        f"what {DEVICE_VARIABLE} names, or {words}",
    )  # fmt: skip
    group.add_argument(
        "--threads", metavar="N",
        help=f"threads of the CPU engine; default: what {THREADS_VARIABLE} or RAYON_NUM_THREADS "
        "says, or as many as there are cores",
    )  # fmt: skip
    parser.set_defaults(default_device=default)


@contextmanager
def device_of(options: argparse.Namespace) -> Iterator[None]:
    """Within it `--device` and `--threads` hold for all frames, in other processes, too."""
    default = os.environ.get(DEVICE_VARIABLE) or getattr(options, "default_device", None)
    asked = {
        DEVICE_VARIABLE: getattr(options, "device", None) or default,
        THREADS_VARIABLE: getattr(options, "threads", None),
    }
    set_now = {name: text for name, text in asked.items() if text is not None}
    before = {name: os.environ.get(name) for name in set_now}
    os.environ.update(set_now)
    try:
        yield
    finally:
        for name, text in before.items():
            if text is None:
                del os.environ[name]
            else:
                os.environ[name] = text


def add_size(parser: Container, words: str, default: tuple[int, int] | None = None) -> None:
    """`--size`, and its default in words."""
    parser.add_argument(
        "--size", type=image_size, default=default, metavar="WxH",
        help=f"size of the image in pixels; default: {words}",
    )  # fmt: skip


def add_methods(parser: Container, default: str = "all") -> None:
    """`--method`, a list."""
    parser.add_argument(
        "--method", action="append", metavar="NAME",
        help=f"{METHOD_HELP}; {MORE}; default: {default}",
    )  # fmt: skip


def add_one_method(parser: argparse.ArgumentParser, resolution: Resolution | None = None) -> None:
    """`--method` and `--resolution`, one of each, and `--set`."""
    group = parser.add_argument_group("method")
    group.add_argument("--method", default="desired_view", metavar="NAME", help=METHOD_HELP)
    group.add_argument(
        "--resolution", type=map_resolution, default=resolution, metavar="N|WxH",
        help=f"{RESOLUTION_HELP}; default: {resolution or 'that of the method'}",
    )  # fmt: skip
    add_parameters(group)


def add_resolutions(parser: Container, default: str) -> None:
    """`--resolution`, a list, and its default in words."""
    parser.add_argument(
        "--resolution", action="append", type=map_resolution, metavar="N|WxH",
        help=f"{RESOLUTION_HELP}; {MORE}; default: {default}",
    )  # fmt: skip


def add_parameters(parser: Container, several: str = "") -> None:
    """`--set`, a list of names with values."""
    parser.add_argument(
        "--set", dest="parameters", action="append", default=[], type=parameter,
        metavar="NAME=VALUE", help=f"another parameter of the method;{several} {MORE}",
    )  # fmt: skip


def add_output(
    parser: argparse.ArgumentParser, words: str, endings: Sequence[str] = ENDINGS, **more: Any
) -> None:
    """`-o`, a path with one of some endings, and in words what is written there."""
    more = {"type": path_ending_in(*endings), "metavar": "FILE", **more}
    parser.add_argument("-o", "--output", help=words, **more)


# --- What their texts mean ---


def view_of(options: argparse.Namespace) -> tuple[Scene, Camera, Light]:
    """The scene, camera and light that a command's options name."""
    scene, views = scene_and_views(options.scene, options.views, options.up)
    camera = views.camera(options.camera, scene)
    if options.size is not None:
        camera = camera.resized(*options.size)
    return scene, camera, views.light(options.light)


def image_size(text: str) -> tuple[int, int]:
    """Pixels, (width, height)."""
    width, separator, height = text.lower().partition("x")
    if not (separator and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT in pixels, got {text!r}")
    return int(width), int(height)


def map_resolution(text: str) -> Resolution:
    """Texels of a map, along each side or (width, height)."""
    sides = text.lower().split("x")
    if not (len(sides) in (1, 2) and all(side.isdecimal() for side in sides)):
        raise argparse.ArgumentTypeError(f"must be N or WIDTHxHEIGHT in texels, got {text!r}")
    first, last = int(sides[0]), int(sides[-1])
    return first if len(sides) == 1 else (first, last)


def natural(text: str) -> int:
    """A count, zero or more."""
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"must be a whole number and not negative, got {text!r}")
    return int(text)


def parameter(text: str) -> tuple[str, Any]:
    """A parameter's name and value."""
    name, separator, value = text.partition("=")
    if not (separator and name):
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE, got {text!r}")
    try:
        return name, ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return name, value  # no Python literal: a string


def method_with(
    name: str, resolution: Resolution | None, parameters: Sequence[tuple[str, Any]]
) -> Method:
    """The method of a name, with parameters; the resolution, where one is given, is one more."""
    values = dict(parameters)
    if resolution is not None:
        values["resolution"] = resolution
    return method_from(name, **values)


def texels_text(method: Method) -> str:
    """The size of a method's map as a title has it."""
    width, height = method.map_size or (0, 0)
    return f"{width}²" if width == height else f"{width} x {height}"


def path_ending_in(*endings: str) -> Callable[[str], Path]:
    """What makes a path of a text: it refuses other endings before the work, not after it."""

    def path_of(text: str) -> Path:
        if Path(text).suffix.lower() not in endings:
            words = f"{', '.join(endings[:-1])} or {endings[-1]}"
            raise argparse.ArgumentTypeError(f"must end in {words}, got {text!r}")
        return Path(text)

    return path_of


def show(options: argparse.Namespace, rows: Sequence[Mapping[str, Any]]) -> None:
    """Print rows, and write them into the table that `-o` names, where it does."""
    print(table(rows))
    keep(options, rows)


def keep(options: argparse.Namespace, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows into the table that `-o` names, where it does."""
    if options.output is not None:
        write(options.output, options.line, rows)
