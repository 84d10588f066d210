"""The command `lixel`."""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import re
import shlex
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from . import __version__
from ._core import DeviceError
from .arguments import needs
from .camera import Camera
from .frame import render as render_frame
from .info import info as device_info
from .lab import demo, flicker, papers, stress
from .lab import peers as bench
from .lab.options import image_size, method_with, parameter
from .lab.report import milliseconds, say, table
from .lab.result_tables import check_table_path, provenance
from .lab.result_tables import save as save_table
from .lab.result_tables import write as write_rows
from .lab.study import study
from .lab.study import summary as study_summary
from .lab.views import SIZE, scene_and_views
from .light import Light
from .load import FORMATS
from .methods import MAP_METHODS, METHODS, OMNIDIRECTIONAL_METHODS, method_from
from .pictures import plots
from .scene import Scene
from .scenes import GENERATORS

DESCRIPTION = "Hard shadows with research shadow-map methods on the GPU, and how wrong each one is."

CAMERA_HELP = """name or index of a camera of the scene or of --views, or "eye;target;yfov" or
"eye;target;yfov;up": points as x,y,z, the vertical angle of view in radians, or in degrees as in
60deg; default: the first camera, or one that sees the whole scene"""

LIGHT_HELP = """name or index of a light of the scene or of --views, or "x,y,z", the direction from
the light towards the scene; default: the first light, or a sun from above"""

VIEWS_HELP = """file with cameras (eye, target, up, fov_y_deg) and lights (kind, direction) to use
instead of the scene's own; in a list of such objects, the one whose "file" is the scene's name"""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command.

    Parameters
    ----------
    arguments : sequence of str, optional
        Those of the process if None.

    Returns
    -------
    int
        The exit code: 0, or 2 where an argument or the machine was at fault.
    """
    try:
        given = sys.argv[1:] if arguments is None else arguments
        options = _parser().parse_args(_with_vectors_joined(given))
        options.line = shlex.join(["lixel", *given])
        options.run(options)
    except (ValueError, TypeError, OSError, ImportError, DeviceError) as error:
        # One line, whatever the message holds.
        say("lixel: error: " + " ".join(str(error).split()))
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


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> Any:
        raise ValueError(message)


def _parser() -> argparse.ArgumentParser:
    top = _Parser(prog="lixel", description=DESCRIPTION)
    top.add_argument("--version", action="version", version=f"lixel {__version__}")
    commands = top.add_subparsers(required=True, metavar="COMMAND", dest="command")

    def command(
        name: str, run: Callable[[argparse.Namespace], None], text: str
    ) -> argparse.ArgumentParser:
        added = commands.add_parser(name, help=text, description=text)
        added.set_defaults(run=run)
        return added

    methods = "one of " + ", ".join(METHODS)
    add = command("render", _render, "Render the shadows of a scene into a picture or an array.")
    _add_scene(add)
    add.add_argument("--method", default="desired_view", metavar="NAME", help=methods)
    add.add_argument("--resolution", type=int, metavar="N", help="texels along a side of the map")
    _add_parameters(add)
    add.add_argument(
        "-o", "--output", required=True, metavar="FILE",
        help=".png: a shaded picture; .npy: float32, 1 lit, 0 in shadow, NaN no surface",
    )  # fmt: skip

    add = command("compare", _compare, "Render with methods, and count the pixels that are wrong.")
    _add_scene(add)
    add.add_argument(
        "--method", action="append", metavar="NAME",
        help=f"{methods}; may be given more than once; default: all",
    )  # fmt: skip
    add.add_argument(
        "--resolution", action="append", type=int, metavar="N",
        help="texels along a side of the map; may be given more than once",
    )  # fmt: skip
    _add_parameters(add)
    add.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER",
        help="write pictures with the wrong pixels in red into this folder",
    )  # fmt: skip

    command("info", _info, "Tell adapters, drivers, limits, and which features are used.")

    add = command("demo", _demo, "Render a built-in scene with every method, and judge each.")
    add.add_argument("--out", type=Path, default=Path("out"), metavar="FOLDER", help="default: out")
    add.add_argument(
        "-o", "--output", type=Path, metavar="FILE",
        help="keep the tables in this .csv, with device, date and command",
    )  # fmt: skip
    add.add_argument(
        "--size", type=image_size, default=SIZE, metavar="WxH", help="default: 1920x1080"
    )

    add = command(
        "bench", _bench,
        "Time methods and count their wrong pixels in one table, or time one beside its peers.",
    )  # fmt: skip
    _add_scene(add, default=bench.SCENE)
    add.add_argument(
        "--all-views", action="store_true", help="every camera with every light, not the first only"
    )
    add.add_argument(
        "--method", action="append", metavar="NAME",
        help=f"{methods}; may be given more than once; default: all, for --peers desired_view",
    )  # fmt: skip
    add.add_argument(
        "--resolution", action="append", type=int, metavar="N",
        help="texels along a side of the map; may be given more than once; default: 512, 1024 and "
        "2048, for --peers 2048",
    )  # fmt: skip
    _add_parameters(add, " with several values, joined by commas, each is taken in turn;")
    add.add_argument(
        "--repeats", type=int, metavar="N", help="timed frames; default: 5, for --peers 15"
    )
    add.add_argument(
        "--peers", action="store_true",
        help=f"one method beside {', '.join(bench.PEERS)}, where they are installed",
    )  # fmt: skip
    add.add_argument(
        "--workers", type=int, metavar="N",
        help="processes; they disturb each other's times, but not the counts of wrong pixels",
    )  # fmt: skip
    add.add_argument(
        "-o", "--output", type=Path, metavar="FILE",
        help="table with all that was measured, .csv or .parquet; FILE.jsonl beside it keeps every "
        "sample, so that a command that was stopped goes on there, but not for --peers",
    )  # fmt: skip
    add.add_argument(
        "--plot", type=Path, metavar="FILE",
        help="picture of time against error with the Pareto front, .png, .svg or .pdf",
    )  # fmt: skip

    add = command(
        "papers", _papers, "Measure the tables of the papers, beside the papers' figures."
    )
    add.add_argument(
        "tables", nargs="*", metavar="TABLE", help=f"default: all of {', '.join(papers.NAMES)}"
    )
    add.add_argument(
        "--quick", action="store_true", help="images and maps of half the size, fewer frames"
    )
    add.add_argument(
        "-o", "--output", type=Path, metavar="FOLDER",
        help="write all that was measured into this folder, and go on there after a stop",
    )  # fmt: skip

    add = command(
        "stress", _stress,
        "Render views that are hard for float32 and for maps, and hold each method to its bound.",
    )  # fmt: skip
    add.add_argument(
        "--method", action="append", metavar="NAME",
        help=f"{methods}; may be given more than once; default: all",
    )  # fmt: skip
    add.add_argument(
        "--family", action="append", metavar="NAME",
        help=f"what is hard: one of {', '.join(stress.FAMILIES)}; may be given more than once; "
        "default: all",
    )  # fmt: skip
    add.add_argument(
        "--quick",
        action="store_true",
        help="only the hardest views of each family; a tenth of the frames",
    )
    add.add_argument(
        "--skips", action="store_true",
        help="instead, what each method leaves out, and the proof that it changes no pixel",
    )  # fmt: skip
    add.add_argument(
        "--flicker", action="store_true",
        help="instead, pixels that turn from right to wrong while the camera or the light moves",
    )  # fmt: skip
    add.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="table of every view, .csv or .parquet"
    )
    return top


def _add_scene(add: argparse.ArgumentParser, default: str | None = None) -> None:
    text = f"a {', '.join(FORMATS)} file, or a built-in scene: {', '.join(GENERATORS)}"
    if default is None:
        add.add_argument("scene", metavar="FILE", help=text)
    else:
        add.add_argument("scenes", nargs="*", metavar="FILE", help=f"{text}; default: {default}")
    add.add_argument("--camera", metavar="CAMERA", help=CAMERA_HELP)
    add.add_argument("--light", metavar="LIGHT", help=LIGHT_HELP)
    add.add_argument("--views", type=Path, metavar="FILE.json", help=VIEWS_HELP)
    add.add_argument(
        "--size", type=image_size, metavar="WxH",
        help="size of the image in pixels; default: the camera's own, or 1920x1080",
    )  # fmt: skip


def _add_parameters(add: argparse.ArgumentParser, more: str = "") -> None:
    add.add_argument(
        "--set", dest="parameters", action="append", default=[], type=parameter,
        metavar="NAME=VALUE",
        help=f"another parameter of the method;{more} may be given more than once",
    )  # fmt: skip


# --- The commands ---


def _render(options: argparse.Namespace) -> None:
    if Path(options.output).suffix.lower() not in (".png", ".npy"):
        # Now, rather than after the work.
        raise ValueError(f"output must end in .png or .npy, got {options.output!r}")
    method = method_with(options.method, options.resolution, options.parameters)
    frame = render_frame(*_view(options), method)
    frame.save(options.output)
    print(f"{options.output}: {milliseconds(frame.timings)} ms")


def _compare(options: argparse.Namespace) -> None:
    scene, camera, light = _view(options)
    maps = {**MAP_METHODS, **OMNIDIRECTIONAL_METHODS}
    methods = [
        method_with(name, resolution, options.parameters)
        for name in options.method or [n for n, method in maps.items() if method().takes(light)]
        for resolution in options.resolution or [None]
    ]
    rows = demo.judge(scene, camera, light, methods, options.output)
    print(table(rows))


def _info(_: argparse.Namespace) -> None:
    found = device_info()
    print(found)
    if found.problem is not None:
        raise DeviceError(found.problem)


def _demo(options: argparse.Namespace) -> None:
    if options.output is not None:
        # Now, rather than after the work.
        check_table_path("output", options.output)
    rows = demo.run(options.out, *options.size)
    if options.output is not None:
        write_rows(options.output, options.line, rows)


def _bench(options: argparse.Namespace) -> None:
    names = options.scenes or [bench.SCENE]
    if options.output is not None:
        # Now, rather than after the work.
        check_table_path("output", options.output)
    if options.peers:
        _bench_peers(options, names)
        return
    if options.plot is not None and options.plot.suffix not in (".png", ".svg", ".pdf"):
        raise ValueError(f"plot must end in .png, .svg or .pdf, got {str(options.plot)!r}")
    cameras: dict[str, dict[str, Camera]] = {}
    lights: dict[str, dict[str, Light]] = {}
    for name in names:
        scene, views = scene_and_views(name, options.views)
        label = Path(name).stem
        if options.all_views:
            cameras[label], lights[label] = views.cameras, views.lights
        cameras[label] = cameras.get(label) or {
            options.camera or "first": views.camera(options.camera, scene)
        }
        lights[label] = lights.get(label) or {options.light or "first": views.light(options.light)}
    parameters = {
        # The lookup=auto,depth of a command line is a text with a comma in it.
        name: value.split(",") if isinstance(value, str) else np.atleast_1d(value).tolist()
        for name, value in options.parameters
    }
    chosen = [method_from(name) for name in options.method or METHODS]
    if options.resolution or any(hasattr(method, "resolution") for method in chosen):
        parameters = {"resolution": options.resolution or [512, 1024, 2048], **parameters}
    with contextlib.ExitStack() as stack:
        executor = None
        if options.workers is not None:
            # A device does not survive a fork.
            context = multiprocessing.get_context("spawn")
            executor = stack.enter_context(ProcessPoolExecutor(options.workers, mp_context=context))
        table_of_cases = study(
            names,
            cameras=cameras,
            lights=lights,
            methods=chosen,
            parameters=parameters,
            size=options.size,
            repeats=5 if options.repeats is None else options.repeats,
            journal=options.output and options.output.with_name(options.output.name + ".jsonl"),
            executor=executor,
        )
    if options.output is not None:
        save_table(table_of_cases.assign(command=options.line), options.output)
    if options.plot is not None:
        import matplotlib as mpl

        mpl.use("agg")  # no window
        (ax, *_) = plots.time_against_error_by_view(table_of_cases)
        figure: Any = ax.figure
        figure.savefig(options.plot, dpi=150)
    print(table(study_summary(table_of_cases, parameters)))
    if not table_of_cases.attrs["complete"]:
        raise KeyboardInterrupt


def _bench_peers(options: argparse.Namespace, names: Sequence[str]) -> None:
    if len(names) > 1 or len(options.method or []) > 1 or len(options.resolution or []) > 1:
        raise ValueError("--peers must have one scene, one method and one resolution")
    options.scene = names[0]
    method = method_with(
        (options.method or ["desired_view"])[0],
        (options.resolution or [2048])[0],
        options.parameters,
    )
    # Now, rather than after the work.
    pandas = needs("pandas", "study") if options.output is not None else None
    scene, camera, light = _view(options)
    repeats = 15 if options.repeats is None else options.repeats
    rows = bench.run(scene, camera, light, method, repeats=repeats)
    if pandas is not None:
        measured = pandas.DataFrame(rows).assign(
            scene=Path(names[0]).stem,
            triangles=scene.triangle_count,
            width=camera.width,
            height=camera.height,
            **provenance(options.line),
        )
        save_table(measured, options.output)


def _papers(options: argparse.Namespace) -> None:
    papers.run(options.tables, quick=options.quick, folder=options.output)


def _stress(options: argparse.Namespace) -> None:
    if options.output is not None:
        # Now, rather than after the work.
        check_table_path("output", options.output)
    if options.skips:
        measured = shown = stress.skips(options.method)
    elif options.flicker:
        known = {method_from(name).name for name in options.method or METHODS}
        chosen = [tried for tried in flicker.METHODS if tried[0].name in known]
        frames = 12 if options.quick else 120
        measured = shown = flicker.flicker(methods=chosen, frames=frames)
    else:
        measured = stress.run(options.method, options.family, options.quick)
        print(table(stress.summary(measured)))
        shown = measured[measured["beyond"] > 0].drop(columns="family")
    if options.output is not None:
        save_table(measured.assign(**provenance(options.line)), options.output)
    print(table(shown.astype(object).where(shown.notna(), None).to_dict("records")))


# --- What the arguments mean ---


def _view(options: argparse.Namespace) -> tuple[Scene, Camera, Light]:
    """The scene, camera and light that the arguments name."""
    scene, views = scene_and_views(options.scene, options.views)
    camera = views.camera(options.camera, scene)
    if options.size is not None:
        camera = camera.resized(*options.size)
    return scene, camera, views.light(options.light)
