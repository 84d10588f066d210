"""The command `lixel`."""

from __future__ import annotations

import argparse
import ast
import contextlib
import inspect
import json
import math
import multiprocessing
import re
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from . import __version__, bench, demo, flicker, papers, plots, scenes, stress
from ._core import DeviceError
from .camera import Camera
from .frame import render as render_frame
from .info import info as device_info
from .kept import provenance
from .light import DirectionalLight, Light, PointLight, SpotLight
from .load import FORMATS, load
from .methods import MAP_METHODS, METHODS, OMNIDIRECTIONAL_METHODS, Method, method_from
from .report import milliseconds, say, table
from .scene import Scene
from .study import SUN, check_table_path, see_all, study
from .study import save as save_table
from .study import summary as study_summary

DESCRIPTION = "Hard shadows with research shadow-map methods on the GPU, and how wrong each one is."

CAMERA_HELP = """name or index of a camera of the scene or of --views, or "eye;target;yfov" or
"eye;target;yfov;up": points as x,y,z, the vertical angle of view in radians, or in degrees as in
60deg; default: the first camera, or one that sees the whole scene"""

LIGHT_HELP = """name or index of a light of the scene or of --views, or "x,y,z", the direction from
the light towards the scene; default: the first light, or a sun from above"""

VIEWS_HELP = """file with cameras (eye, target, up, fov_y_deg) and lights (kind, direction) to use
instead of the scene's own; in a list of such objects, the one whose "file" is the scene's name"""

SIZE = (1920, 1080)

Value = TypeVar("Value")


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
    add.add_argument("--size", type=_size, default=SIZE, metavar="WxH", help="default: 1920x1080")

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
        "sample, so that a command that was stopped goes on there",
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
    text = f"a {', '.join(FORMATS)} file, or a built-in scene: {', '.join(_built_in_scenes())}"
    if default is None:
        add.add_argument("scene", metavar="FILE", help=text)
    else:
        add.add_argument("scenes", nargs="*", metavar="FILE", help=f"{text}; default: {default}")
    add.add_argument("--camera", metavar="CAMERA", help=CAMERA_HELP)
    add.add_argument("--light", metavar="LIGHT", help=LIGHT_HELP)
    add.add_argument("--views", type=Path, metavar="FILE.json", help=VIEWS_HELP)
    add.add_argument(
        "--size", type=_size, metavar="WxH",
        help="size of the image in pixels; default: the camera's own, or 1920x1080",
    )  # fmt: skip


def _add_parameters(add: argparse.ArgumentParser, more: str = "") -> None:
    add.add_argument(
        "--set", dest="parameters", action="append", default=[], type=_parameter,
        metavar="NAME=VALUE",
        help=f"another parameter of the method;{more} may be given more than once",
    )  # fmt: skip


# --- The commands ---


def _render(options: argparse.Namespace) -> None:
    if Path(options.output).suffix.lower() not in (".png", ".npy"):
        # Now, rather than after the work.
        raise ValueError(f"output must end in .png or .npy, got {options.output!r}")
    method = _make_method(options.method, options.resolution, options.parameters)
    frame = render_frame(*_view(options), method)
    frame.save(options.output)
    print(f"{options.output}: {milliseconds(frame.timings)} ms")


def _compare(options: argparse.Namespace) -> None:
    scene, camera, light = _view(options)
    maps = {**MAP_METHODS, **OMNIDIRECTIONAL_METHODS}
    methods = [
        _make_method(name, resolution, options.parameters)
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
    demo.run(options.out, *options.size)


def _bench(options: argparse.Namespace) -> None:
    names = options.scenes or [bench.SCENE]
    if options.peers:
        _bench_peers(options, names)
        return
    if options.output is not None:
        # Now, rather than after the work.
        check_table_path("output", options.output)
    if options.plot is not None and options.plot.suffix not in (".png", ".svg", ".pdf"):
        raise ValueError(f"plot must end in .png, .svg or .pdf, got {str(options.plot)!r}")
    cameras: dict[str, dict[str, Camera]] = {}
    lights: dict[str, dict[str, Light]] = {}
    for name in names:
        scene, views = _scene_and_views(name, options.views)
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
    method = _make_method(
        (options.method or ["desired_view"])[0],
        (options.resolution or [2048])[0],
        options.parameters,
    )
    bench.run(*_view(options), method, repeats=15 if options.repeats is None else options.repeats)


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


def _size(text: str) -> tuple[int, int]:
    width, separator, height = text.lower().partition("x")
    if not (separator and width.isdecimal() and height.isdecimal()):
        raise argparse.ArgumentTypeError(f"must be WIDTHxHEIGHT in pixels, got {text!r}")
    return int(width), int(height)


def _parameter(text: str) -> tuple[str, Any]:
    name, separator, value = text.partition("=")
    if not (separator and name):
        raise argparse.ArgumentTypeError(f"must be NAME=VALUE, got {text!r}")
    try:
        return name, ast.literal_eval(value)
    except (ValueError, SyntaxError):
        return name, value  # no Python literal: a string


def _make_method(
    name: str, resolution: int | None, parameters: Sequence[tuple[str, Any]]
) -> Method:
    method = method_from(name)
    values = dict(parameters)
    if resolution is not None:
        values["resolution"] = resolution
    known = [f.name for f in fields(method)]
    for key in values:
        if key not in known:
            raise ValueError(f"parameter of {name} must be one of {', '.join(known)}, got {key!r}")
    return replace(method, **values)


def _built_in_scenes() -> dict[str, Callable[[], Scene]]:
    return {
        name: made
        for name, made in inspect.getmembers(scenes, inspect.isfunction)
        if made.__module__ == scenes.__name__ and not name.startswith("_")
    }


def _view(options: argparse.Namespace) -> tuple[Scene, Camera, Light]:
    """The scene, camera and light that the arguments name."""
    scene, views = _scene_and_views(options.scene, options.views)
    camera = views.camera(options.camera, scene)
    if options.size is not None:
        camera = camera.resized(*options.size)
    return scene, camera, views.light(options.light)


def _scene_and_views(name: str, file: Path | None) -> tuple[Scene, Views]:
    known = _built_in_scenes()
    views = None if file is None else Views.read(file, Path(name).name)
    if name in known:
        scene = known[name]()
    elif Path(name).suffix or Path(name).exists():
        scene = load(name)
    else:
        raise ValueError(
            f"scene must be a file ({', '.join(FORMATS)}) or one of {', '.join(known)}, "
            f"got {name!r}"
        )
    return scene, views or Views(dict(scene.cameras), dict(scene.lights))


@dataclass(frozen=True)
class Views:
    """Cameras and lights by name, in order."""

    cameras: dict[str, Camera] = field(default_factory=dict)
    lights: dict[str, Light] = field(default_factory=dict)
    # Lights that are listed but not of a kind that lixel has; they keep their place and name.
    unsupported: dict[str, str] = field(default_factory=dict)

    @classmethod
    def read(cls, path: Path, scene_name: str) -> Views:
        """From a JSON file."""
        try:
            entry = json.loads(path.read_text(encoding="utf-8"))
        except ValueError as error:
            raise ValueError(f"views must be a JSON file, got {str(path)!r}: {error}") from None
        if isinstance(entry, list):
            named = [e for e in entry if isinstance(e, dict) and e.get("file") == scene_name]
            if not named:
                raise ValueError(f"views {str(path)!r} has no entry whose file is {scene_name!r}")
            entry = named[0]
        try:
            cameras = {
                str(i): Camera.look_at(
                    c["eye"],
                    c["target"],
                    c.get("up", (0.0, 1.0, 0.0)),
                    yfov=math.radians(c["fov_y_deg"]),
                    width=SIZE[0],
                    height=SIZE[1],
                )
                for i, c in enumerate(entry.get("cameras", []))
            }
            lights: dict[str, Light] = {}
            unsupported = {}
            for i, light in enumerate(entry.get("lights", [])):
                match light["kind"]:
                    case "directional":
                        lights[str(i)] = DirectionalLight(light["direction"])
                    case "point":
                        lights[str(i)] = PointLight(light["position"])
                    case "spot":
                        outer = math.radians(light["fov_deg"]) / 2
                        spot = SpotLight(light["position"], light["direction"], outer)
                        lights[str(i)] = spot
                    case other:
                        unsupported[str(i)] = other
        except (AttributeError, KeyError, TypeError) as error:
            raise ValueError(
                f"views {str(path)!r} must hold cameras with eye, target and fov_y_deg, and lights "
                f"with kind and direction: {type(error).__name__} {error}"
            ) from None
        return cls(cameras, lights, unsupported)

    def camera(self, text: str | None, scene: Scene) -> Camera:
        """The camera of a name, an index or a description; a suitable one for None."""
        if text is None:
            return next(iter(self.cameras.values()), None) or see_all(scene)
        if ";" not in text:
            return _pick("camera", text, self.cameras)
        parts = text.split(";")
        if len(parts) not in (3, 4):
            raise ValueError(
                f'camera must be "eye;target;yfov" or "eye;target;yfov;up", got {text!r}'
            )
        up = _point("camera up", parts[3]) if len(parts) == 4 else (0.0, 1.0, 0.0)
        return Camera.look_at(
            _point("camera eye", parts[0]),
            _point("camera target", parts[1]),
            up,
            yfov=_angle(parts[2]),
            width=SIZE[0],
            height=SIZE[1],
        )

    def light(self, text: str | None) -> Light:
        """The light of a name, an index or a direction; a suitable one for None."""
        if text is None:
            return next(iter(self.lights.values()), None) or DirectionalLight(SUN)
        if "," in text:
            return DirectionalLight(_point("light", text))
        if text in self.unsupported:
            kind = self.unsupported[text]
            raise ValueError(f"light must be directional, point or spot, got {text}, a {kind}")
        return _pick("light", text, self.lights)


def _pick(what: str, text: str, known: Mapping[str, Value]) -> Value:
    if text in known:
        return known[text]
    names = list(known)
    if text.isdecimal() and int(text) < len(names):
        return known[names[int(text)]]
    have = f"one of {', '.join(names)}, by name or index" if names else "described: it has none"
    raise ValueError(f"{what} must be {have}, got {text!r}")


def _point(what: str, text: str) -> npt.NDArray[np.float64]:
    try:
        point = np.array([float(part) for part in text.split(",")])
    except ValueError:
        point = np.zeros(0)
    if len(point) != 3:
        raise ValueError(f"{what} must be three numbers x,y,z, got {text!r}")
    return point


def _angle(text: str) -> float:
    degrees = text.strip().removesuffix("deg")
    try:
        angle = float(degrees)
    except ValueError:
        raise ValueError(
            f"camera yfov must be radians, or degrees as in 60deg, got {text!r}"
        ) from None
    return angle if degrees == text.strip() else math.radians(angle)
