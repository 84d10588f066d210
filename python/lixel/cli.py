"""The command `lixel`: a list of commands, and of experiments below `lixel lab`."""

from __future__ import annotations

import argparse
import json
import re
import shlex
import sys
import textwrap
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from . import __version__, completion, image_files
from ._core import DeviceError
from .arguments import did_you_mean, needs
from .frame import render
from .info import info
from .lab import (
    accuracy,
    aligned,
    angles,
    bench,
    calibration,
    culling,
    data_set,
    demo,
    departures,
    doctor,
    equal,
    filters,
    flicker,
    growth,
    masks,
    pages,
    papers,
    peers,
    points,
    rankings,
    side_by_side,
    stress,
    study,
    sun_hours,
    viewer,
)
from .lab.image_comparison import compare_image
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
    path_ending_in,
    view_of,
)
from .lab.report import status, waiting
from .lab.views import scene_and_views
from .methods import MAP_METHODS, OMNIDIRECTIONAL_METHODS, PAGED_METHODS, Method
from .pictures.display import milliseconds

DESCRIPTION = "Hard shadows with research shadow-map methods, and how wrong each one is."


class Command(NamedTuple):
    """A line about a command, examples, its options, and what it does with them.

    A command that renders may have a `device`, whose its table is to be on every machine.
    `--device` and ``LIXEL_DEVICE`` count for more.
    """

    help: str
    examples: Sequence[str]
    add_arguments: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], None]
    renders: bool = True
    device: str | None = None

    @classmethod
    def of(
        cls, module: ModuleType, *examples: str, device: str | None = None, renders: bool = True
    ) -> Command:
        """That of a module, whose docstring begins with the line."""
        line = (module.__doc__ or "").split("\n\n")[0]
        return cls(line, examples, module.add_arguments, module.run, renders, device)


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
        options, unknown = parser().parse_known_args(given)
        if unknown:
            options_of = re.findall(r"--[\w-]+", options.parser.format_help())
            nearest = did_you_mean(unknown[0], options_of)
            raise ValueError(f"unrecognized arguments: {' '.join(unknown)}{nearest}")
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
    def __init__(self, **given: Any) -> None:
        super().__init__(formatter_class=_Help, **given)

    def error(self, message: str) -> Any:
        wrong = re.match(r"argument .*: invalid choice: '(.*)' \(choose from (.*)\)$", message)
        if wrong:
            message += did_you_mean(wrong[1], re.findall(r"[\w-]+", wrong[2]))
        raise ValueError(message)


class _Help(argparse.HelpFormatter):
    """Lines of words are wrapped, but for those that are laid out already, as the lists of commands
    are, which stand in groups."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, max_help_position=26)

    def _format_action(self, action: argparse.Action) -> str:
        is_list = isinstance(action, argparse._SubParsersAction)
        return "" if is_list else super()._format_action(action)

    def _fill_text(self, text: str, width: int, indent: str) -> str:
        return text if "\n" in text else super()._fill_text(text, width, indent)


def parser() -> argparse.ArgumentParser:
    """That of all commands."""
    top = _Parser(
        prog="lixel",
        usage="lixel [-h] [--version] COMMAND ...",
        description=DESCRIPTION,
        epilog=_listed(GROUPS, COMMANDS)
        + "\n\n`lixel COMMAND --help` says more of each.\n\n"
        + _examples([example for c in COMMANDS.values() for example in c.examples[:1]]),
    )
    top.add_argument("--version", action="version", version=f"lixel {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND", prog="lixel")
    _add_all(commands, COMMANDS)
    lab = commands.choices["lab"]
    lab.usage = "lixel lab [-h] EXPERIMENT ..."
    lab.epilog = f"{_listed(LAB_GROUPS, LAB)}\n\n{lab.epilog}"
    experiments = lab.add_subparsers(required=True, metavar="EXPERIMENT", prog="lixel lab")
    _add_all(experiments, LAB)
    return top


def _add_all(parsers: Any, commands: Mapping[str, Command]) -> None:
    for name, command in commands.items():
        added = parsers.add_parser(
            name,
            help=command.help,
            description=command.help,
            epilog=_examples(command.examples) if command.examples else None,
        )
        added.set_defaults(run=command.run, parser=added)
        command.add_arguments(added)
        if command.renders:
            add_device(added, command.device)


def _listed(groups: Mapping[str, Sequence[str]], commands: Mapping[str, Command]) -> str:
    """Commands by groups, each with its line."""
    width = max(map(len, commands)) + 4
    parts = []
    for title, names in groups.items():
        lines = (
            textwrap.fill(
                f"{name:{width - 4}}  {commands[name].help}",
                width=80, initial_indent="  ", subsequent_indent=" " * width,
            )
            for name in names
        )  # fmt: skip
        parts.append("\n".join([f"{title}:", *lines]))
    return "\n\n".join(parts)


def _examples(examples: Sequence[str]) -> str:
    return "\n".join(["examples:", *(f"  {example}" for example in examples)])


# --- The commands that are no experiments ---


def _add_render(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("scene", metavar="FILE", help=SCENE_HELP)
    add_view(parser)
    add_one_method(parser)
    words = (
        ".png: a shaded picture; .mask.png: 16 bits of grey, 0 no surface, 1 shadow, 65535 lit; "
        ".npy: float32, 1 lit, 0 in shadow, NaN no surface; .npz and .exr: that, triangles, "
        "objects, depths and normals; all but .npy hold what made them, see `lixel info`"
    )
    parser.add_argument("--sequence", metavar="KIND", help=data_set.HELP)
    add_output(parser, words, required=True, type=Path)


def _render(options: argparse.Namespace) -> None:
    method = method_with(options.method, options.resolution, options.parameters)
    if options.sequence is not None:
        _render_sequence(options, method)
        return
    try:
        path_ending_in(*image_files.ENDINGS)(str(options.output))
    except argparse.ArgumentTypeError as error:
        raise ValueError(f"argument -o/--output: {error}") from None
    if options.output.suffix.lower() == ".exr":
        needs("OpenEXR", "exr")  # said before the work
    scene, camera, light = view_of(options)
    with waiting(f"rendering by {method.spelling}"):
        frame = render(scene, camera, light, method)
    with waiting(f"writing {options.output.name}"):
        frame.save(options.output)
    print(f"{options.output}: {milliseconds(frame.timings)} ms")


def _render_sequence(options: argparse.Namespace, method: Method) -> None:
    if options.output.suffix:
        raise ValueError(f"--output must be a folder for a sequence, got {options.output}")
    scene, views = scene_and_views(options.scene, options.views, options.up)
    camera = views.camera(options.camera, scene)
    if options.size is not None:
        camera = camera.resized(*options.size)
    start = (camera, views.light(options.light))
    count = data_set.write_sequence(options.sequence, scene, views, start, method, options.output)
    print(f"{options.output}: {count} pictures and masks, coco.json")


def _add_compare(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "scene", metavar="FILE",
        help=f"{SCENE_HELP}; or an image of visibility that is to be judged: "
        f"{', '.join(image_files.VISIBILITY_ENDINGS)}",
    )  # fmt: skip
    parser.add_argument(
        "truth", nargs="?", metavar="TRUTH",
        help="what an image is judged by: another image, or a scene, whose reference is found",
    )  # fmt: skip
    parser.add_argument(
        "--other-surfaces", choices=("refuse", "count"), default="refuse",
        help="of two images in which only one sees a surface in a pixel: refuse, the default, or "
        "count the pixel as misclassified",
    )  # fmt: skip
    add_view(parser)
    group = parser.add_argument_group("methods, where FILE is a scene")
    add_methods(group, "all with a map that take the light")
    add_resolutions(group, "that of the method")
    add_parameters(group)
    words = "write pictures with the misclassified pixels in red into this folder"
    add_output(parser, words, type=Path, metavar="FOLDER")


def _compare(options: argparse.Namespace) -> None:
    if options.truth is not None:
        compare_image(options)
        return
    if options.scene.lower().endswith(image_files.VISIBILITY_ENDINGS):
        raise ValueError(f"TRUTH must be an image or a scene to judge {options.scene} by, got none")
    scene, camera, light = view_of(options)
    maps = {**MAP_METHODS, **OMNIDIRECTIONAL_METHODS, **PAGED_METHODS}

    methods = [
        method_with(name, resolution, options.parameters)
        for name in options.method or [n for n, known in maps.items() if known().takes(light)]
        for resolution in options.resolution or [None]
    ]
    demo.show(demo.evaluate(scene, camera, light, methods, options.output))


def _add_info(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "files", nargs="*", type=Path, metavar="FILE",
        help="tell what made these images instead: .png, .npz or .exr",
    )  # fmt: skip


def _info(options: argparse.Namespace) -> None:
    for file in options.files:
        record = image_files.read_metadata(file)
        print(file)
        for name, value in record.items():
            print(f"  {name}: {value if isinstance(value, str) else json.dumps(value)}")
    if options.files:
        return
    found = info()
    print(found)
    if found.problem is not None:
        raise DeviceError(found.problem)


def _add_completion(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("shell", choices=completion.SHELLS, help="whose words are completed")


def _completion(options: argparse.Namespace) -> None:
    print(completion.script(parser(), options.shell))


COMMANDS: Mapping[str, Command] = {
    "render": Command(
        "Render the shadows of a scene into a picture or an array.",
        (
            "lixel render colonnade --method rtw --resolution 2048 -o shadows.png",
            'lixel render town.glb --camera "8,6,9;0,0,0;50deg" --light 0.5,-1,-0.3 -o a.mask.png',
            "lixel render town.glb --method cube+notw --set lookup=depth -o layers.exr",
            "lixel render town.glb --method exact --sequence orbit:24 --size 640x480 -o masks",
        ),
        _add_render,
        _render,
    ),
    "compare": Command(
        "Count the pixels that methods, or an image, misclassify.",
        (
            "lixel compare colonnade --method uniform --method notw -o out",
            "lixel compare mine.npy theirs.npy -o out",
            "lixel compare shadows.npz town.glb",
        ),
        _add_compare,
        _compare,
    ),
    "view": Command.of(viewer, "lixel view colonnade", "lixel view town.glb --no-browser"),
    "demo": Command.of(demo, "lixel demo --out out"),
    "info": Command(
        "Tell the engines, adapters and drivers, or what made an image.",
        ("lixel info", "lixel info shadows.png"),
        _add_info,
        _info,
        renders=False,
    ),
    "doctor": Command.of(doctor, "lixel doctor", "lixel doctor cpu", renders=False),
    "bench": Command.of(bench, "lixel bench --gpu -o bench.json", "lixel bench --device llvmpipe"),
    "completion": Command(
        "Print a script by which a shell completes lixel's words.",
        (
            "lixel completion bash > ~/.local/share/bash-completion/completions/lixel",
            "lixel completion zsh > ~/.zfunc/_lixel",
        ),
        _add_completion,
        _completion,
        renders=False,
    ),
    "lab": Command(
        "Experiments: each measures what the documentation says, and keeps it in a table.",
        ("lixel lab study colonnade -o times.csv --plot times.png",),
        lambda _: None,
        lambda _: None,
        renders=False,
    ),
}

GROUPS = {
    "shadows, and how wrong they are": ("render", "compare", "view", "demo"),
    "this machine": ("info", "doctor", "bench", "completion"),
    "measurements": ("lab",),
}
"""The commands in the order of the help."""

LAB: Mapping[str, Command] = {
    "study": Command.of(
        study, "lixel lab study town.glb --method rtw --method notw -o times.csv --plot times.png"
    ),
    "peers": Command.of(peers, "lixel lab peers town.glb -o peers.csv"),
    "equal": Command.of(equal, "lixel lab equal scenes -o equal.csv", device="cpu"),
    "papers": Command.of(papers, "lixel lab papers --quick", "lixel lab papers rosen-1 -o out"),
    "rankings": Command.of(rankings, "lixel lab rankings scenes -o rankings.parquet"),
    "angles": Command.of(angles, "lixel lab angles -o angles.csv"),
    "stress": Command.of(stress, "lixel lab stress --quick --method exact", device="cpu"),
    "culling": Command.of(culling, device="gpu"),
    "flicker": Command.of(flicker, "lixel lab flicker --quick --method rtw", device="cpu"),
    "accuracy": Command.of(
        accuracy, "lixel lab accuracy scenes --method rtw:lookup=depth -o wrong.csv", device="cpu"
    ),
    "departures": Command.of(departures, device="cpu"),
    "aligned": Command.of(aligned, device="cpu"),
    "growth": Command.of(growth, "lixel lab growth -o growth.csv", device="cpu"),
    "masks": Command.of(masks, "lixel lab masks sponza.glb --views scenes.json", device="cpu"),
    "pages": Command.of(pages, "lixel lab pages scenes -o pages.parquet", device="cpu"),
    "points": Command.of(points, "lixel lab points town.glb --lights 24", renders=False),
    "calibration": Command.of(calibration, device="gpu"),
    "side_by_side": Command.of(
        side_by_side, "lixel lab side_by_side colonnade --resolution 256 -o side_by_side.png"
    ),
    "filters": Command.of(
        filters, "lixel lab filters scenes -o filters.csv --plot filters.png", device="cpu"
    ),
    "sun_hours": Command.of(
        sun_hours, "lixel lab sun_hours --latitude 49 -o hours.png", renders=False
    ),
}
"""Each is the module of its name in `lixel.lab`."""

LAB_GROUPS = {
    "time and error": (
        "study",
        "peers",
        "equal",
        "growth",
        "accuracy",
        "filters",
        "pages",
        "masks",
        "points",
        "calibration",
    ),
    "what the papers say": ("papers", "rankings", "departures", "angles"),
    "hard views": ("stress", "aligned", "flicker", "culling"),
    "pictures": ("side_by_side", "sun_hours"),
}
