"""Measure scenes x cameras x lights x methods x parameters into one table."""

from __future__ import annotations

import argparse
import concurrent.futures
import contextlib
import itertools
import math
import multiprocessing
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from .._core import __version__
from ..arguments import count, needs
from ..camera import Camera
from ..light import Light
from ..methods import METHODS, Method, method_from
from .cases import Case, SceneLike, Source, Views, canonical, cases_of
from .options import (
    DEFAULT_SCENE,
    PICTURES,
    SCENE_HELP,
    add_methods,
    add_output,
    add_parameters,
    add_resolutions,
    add_view,
    path_ending_in,
)
from .report import progress as show_progress, status, table as as_text
from .result_tables import read, save
from .samples import Journal, Record, sample
from .views import scene_and_views

if TYPE_CHECKING:
    import pandas

Value = TypeVar("Value")

# Samples that travel to a worker together: enough to make the way there cheap, few enough that
# little is lost with a worker.
_MAX_IN_A_TASK = 8
_TASKS = 64


def study(
    scenes: SceneLike | Sequence[SceneLike] | Mapping[str, SceneLike],
    *,
    cameras: Views[Camera] | None = None,
    lights: Views[Light] | None = None,
    methods: str | Method | Iterable[str | Method] | None = None,
    parameters: Mapping[str, Iterable[Any]] | None = None,
    size: tuple[int, int] | None = None,
    device: str | None = None,
    repeats: int = 5,
    journal: str | Path | None = None,
    executor: concurrent.futures.Executor | None = None,
    progress: bool = True,
) -> pandas.DataFrame:
    """Measure every combination of scenes, cameras, lights, methods and parameters.

    Each case is rendered once and compared with `reference`. Then come `repeats` timed frames, each
    from the camera moved by a hair, so that nothing is kept from the frame before. The cases of a
    scene take turns, so that a drift of the machine hits all alike.

    Parameters
    ----------
    scenes : path, name, (name, arguments), Scene, or a sequence or mapping of these
        Files that `load` reads, names of `scenes.GENERATORS`, or scenes themselves. A mapping names
        them; else files go by their stem.
    cameras : Camera, or a sequence or mapping of these, optional
        For every scene, or a mapping from the names of scenes to mappings. None: the scene's own,
        or one that sees all of it.
    lights : light, or a sequence or mapping of these, optional
        As `cameras`. None: the scene's own, or a directional one from above.
    methods : name, method object, or several, optional
        None: all of `METHODS`.
    parameters : mapping of str to values, optional
        Every combination of the values is set in each method that has these parameters.
        Of ``{"resolution": [512, (1024, 256)]}`` the second is "1024x256" in the table.
    size : (width, height), optional
        Of the images in pixels; None: the cameras' own.
    device : str, optional
        As for `render_shadows`.
    repeats : int
        Timed frames of each case.
    journal : path, optional
        A file of samples, each a line of JSON. A study that finds its own there resumes.
    executor : concurrent.futures.Executor, optional
        Where the cases run, for example a ProcessPoolExecutor with the start method ``"spawn"``, or
        ``dask.distributed.Client(...).get_executor()``; None: here. Workers that share a device
        disturb each other's times, but not their errors. Files must be there for each worker.
    progress : bool
        Show a bar on stderr.

    Returns
    -------
    pandas.DataFrame
        A row for each case, and for each device where a study went on elsewhere:

        - ``scene``, ``camera``, ``light``, ``light_kind``, ``method``, ``published`` (in which
          paper), every parameter; ``width``, ``height``, ``triangles``; ``case``, a hash of these.
        - ``repeats``: timed frames. ``gpu_ms``: median over them of the sum of all passes, on any
          device, with quartiles ``gpu_ms_q1`` and ``gpu_ms_q3``; likewise ``wall_ms``, from the
          call to the array in memory; ``pass_ms.NAME``: median for each pass.
        - What `Comparison.as_dict` counts: ``misclassified_count``, ``false_lit_count``, ``ssim``,
          ``edge_displacement_mean`` and ``_p95`` in pixels, and others.
        - ``aliasing_largest``: `Frame.largest_aliasing_error`; over pixels that face the light
          ``aliasing_median``, ``aliasing_p95``, ``aliasing_above_1``; ``map_bytes``: shadow and
          warp map; ``max_effective_resolution_x`` and ``_y``; ``stats.NAME``: counters.
        - ``device``, ``driver``, ``date`` (of the last frame), ``lixel``; ``error``, if any.

        After Ctrl-C the rows hold what was measured until then, and ``attrs["complete"]`` is False.

    Raises
    ------
    ImportError
        pandas is missing; the extra ``study`` has it.
    TypeError, ValueError
        A wrong argument, or a journal that is none.

    Examples
    --------
    >>> table = study("plane_and_box", methods=["uniform", "rtw"], size=(64, 36), repeats=1,
    ...               parameters={"resolution": [64, 128]}, progress=False)
    >>> table[["method", "resolution"]].values.tolist()
    [['uniform', 64], ['uniform', 128], ['rtw', 64], ['rtw', 128]]
    """
    needs("pandas", "study")
    cases = list(cases_of(scenes, cameras, lights, methods, parameters, size, device))
    log = Journal(None if journal is None else Path(journal), {case.key for case in cases})
    complete = _run(cases, count("repeats", repeats), executor, log, progress)
    table = _table_of([row for case in cases for row in _rows(case, log.of(case.key))])
    table.attrs["complete"] = complete
    return table


def summary(table: pandas.DataFrame, parameters: Iterable[str] = ()) -> list[dict[str, Any]]:
    """The columns to look at first and those of some parameters, as rows for a text table."""
    columns = {
        **{name: name for name in ("scene", "camera", "light", "method", "published", *parameters)},
        "gpu_ms": "ms",
        "gpu_ms_q1": "from",
        "gpu_ms_q3": "to",
        "misclassified_count": "misclassified",
        "false_lit_count": "false lit",
        "false_shadow_count": "false shadow",
        "edge_displacement_mean": "edge displacement, px",
        "error": "error",
    }
    chosen = table[[name for name in columns if name in table]].rename(columns=columns)
    # Counts and parameters stay whole where a row has none.
    chosen = chosen.dropna(axis=1, how="all").convert_dtypes().astype(object)
    rows: list[dict[str, Any]] = chosen.where(chosen.notna(), None).to_dict("records")
    return rows


# --- The work ---


def _run(
    cases: Sequence[Case],
    repeats: int,
    executor: concurrent.futures.Executor | None,
    log: Journal,
    progress: bool,
) -> bool:
    """Measure the missing samples; False where Ctrl-C came first."""
    samples = [
        (case, turn)
        for _, group in itertools.groupby(cases, key=lambda case: case.source)
        for turn, case in itertools.product(range(repeats), list(group))
    ]
    missing = [(case, turn) for case, turn in samples if not log.has(case.key, turn)]
    total = len(samples)
    done = total - len(missing)
    try:
        if executor is None:
            for case, turn in show_progress(missing, "study", total, done, is_shown=progress):
                if not log.has(case.key, turn):
                    log.add([sample(case, turn)])
        else:
            _spread(missing, executor, log, progress, total)
    except KeyboardInterrupt:
        status("study: stopped; the table holds what was measured until now")
        return False
    return True


def _spread(
    missing: Sequence[tuple[Case, int]],
    executor: concurrent.futures.Executor,
    log: Journal,
    progress: bool,
    total: int,
) -> None:
    tasks = list(_tasks(missing))
    futures = {executor.submit(_samples, task): len(task) for task in tasks}
    kept = set()

    def arrivals() -> Iterator[None]:
        for future in concurrent.futures.as_completed(futures):
            log.add(future.result())
            kept.add(future)
            yield from itertools.repeat(None, futures[future])

    try:
        for _ in show_progress(arrivals(), "study", total, total - len(missing), is_shown=progress):
            pass
    finally:
        for future in futures:
            future.cancel()
        for future in futures.keys() - kept:
            if future.done() and not future.cancelled() and future.exception() is None:
                log.add(future.result())


def _tasks(missing: Sequence[tuple[Case, int]]) -> Iterator[list[tuple[Case, int]]]:
    """Samples in their order. Those of a view stay together as far as a task allows it: each worker
    casts the rays of a view's reference for itself."""
    most = min(_MAX_IN_A_TASK, math.ceil(len(missing) / _TASKS))

    def scene_of(sample: tuple[Case, int]) -> tuple[Source, int]:
        return sample[0].source, sample[1]

    def view(sample: tuple[Case, int]) -> tuple[Source, int, Camera, Light]:
        return *scene_of(sample), sample[0].camera, sample[0].light

    task: list[tuple[Case, int]] = []
    for _, group in itertools.groupby(missing, key=view):
        samples = list(group)
        # A half more than the most is still one piece.
        size = math.ceil(len(samples) / max(1, round(len(samples) / most)))
        for i in range(0, len(samples), size):
            piece = samples[i : i + size]
            if task and (len(task) + len(piece) > most or scene_of(task[0]) != scene_of(piece[0])):
                yield task
                task = []
            task += piece
    if task:
        yield task


def _samples(task: Sequence[tuple[Case, int]]) -> list[Record]:
    """In a worker."""
    return [sample(case, turn) for case, turn in task]


# --- The table ---


def _table_of(rows: Sequence[Mapping[str, Any]]) -> pandas.DataFrame:
    table = needs("pandas", "study").DataFrame(rows, columns=_merged(rows))
    if any(isinstance(row.get("resolution"), str) for row in rows):
        # A column has one type: where a map is not square, all are texts.
        table["resolution"] = table["resolution"].map(str, na_action="ignore")
    return table


def _rows(case: Case, records: Sequence[Record]) -> Iterator[dict[str, Any]]:
    """A row for each device."""
    by_device: dict[tuple[str, str], list[Record]] = defaultdict(list)
    for record in records:
        by_device[record.get("device", ""), record.get("driver", "")].append(record)
    for (device, driver), group in by_device.items():
        timed = [record for record in group if "pass_ms" in record]
        merged = {name: value for record in group for name, value in record.items()}
        yield {
            "scene": case.source.name,
            "camera": case.camera_name,
            "light": case.light_name,
            "light_kind": type(case.light).__name__,
            "method": case.method.name,
            "published": case.method.published_in,
            **{name: cell(value) for name, value in case.method.parameters().items()},
            "width": case.camera.width,
            "height": case.camera.height,
            "triangles": case.triangles,
            "repeats": len(timed),
            **_spread_of("gpu_ms", [sum(record["pass_ms"].values()) for record in timed]),
            **_spread_of("wall_ms", [record["wall_ms"] for record in timed]),
            **_medians([record["pass_ms"] for record in timed]),
            **merged.get("comparison", {}),
            **dict(_counters("stats", merged.get("stats", {}))),
            "device": device,
            "driver": driver,
            "date": merged.get("date"),
            "lixel": __version__,
            "case": case.key,
            "error": merged.get("error"),
        }


def _merged(orders: Iterable[Iterable[str]]) -> list[str]:
    """All names, each after the one before it in its row: a parameter that only the last method
    has is beside the others, and passes are in the order in which they run."""
    merged: list[str] = []
    for order in orders:
        after = 0
        for name in order:
            if name not in merged:
                merged.insert(after, name)
            after = merged.index(name) + 1
    return merged


def _spread_of(name: str, values: Sequence[float]) -> dict[str, float]:
    low, middle, high = np.percentile(values, (25, 50, 75)) if values else 3 * [math.nan]
    return {name: float(middle), f"{name}_q1": float(low), f"{name}_q3": float(high)}


def _medians(times: Sequence[Mapping[str, float]]) -> dict[str, float]:
    passes = dict.fromkeys(name for each in times for name in each)
    # A pass that a frame did not need took no time in it.
    return {
        f"pass_ms.{name}": float(np.median([each.get(name, 0.0) for each in times]))
        for name in passes
    }


def _counters(prefix: str, stats: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for name, value in stats.items():
        if isinstance(value, Mapping):
            yield from _counters(f"{prefix}.{name}", value)
        else:
            yield f"{prefix}.{name}", cell(value)


def cell(value: Any) -> Any:
    """A value that a column can hold."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (list, tuple)) and all(isinstance(item, str) for item in value):
        return ", ".join(value)
    if isinstance(value, tuple) and len(value) == 2 and all(type(item) is int for item in value):
        return "x".join(map(str, value))
    return repr(canonical(value))


# --- The command ---


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab study`."""
    words = f"{SCENE_HELP}; default: {DEFAULT_SCENE}"
    parser.add_argument("scenes", nargs="*", metavar="FILE", help=words)
    add_view(parser)
    parser.add_argument(
        "--all-views", action="store_true", help="every camera with every light, not the first only"
    )
    add_methods(parser)
    add_resolutions(parser, "512, 1024 and 2048")
    add_parameters(parser, " with several values, joined by commas, each is taken in turn;")
    parser.add_argument("--repeats", type=int, default=5, metavar="N", help="timed frames")
    parser.add_argument(
        "--workers", type=int, metavar="N",
        help="processes; they disturb each other's times, but not the counts of pixels",
    )  # fmt: skip
    add_output(
        parser,
        "table with all that was measured, .csv or .parquet; FILE.jsonl beside it keeps every "
        "sample, so that a command that was stopped goes on there",
    )
    parser.add_argument(
        "--plot", type=path_ending_in(*PICTURES), metavar="FILE",
        help="picture of time against error with the Pareto front, .png, .svg or .pdf",
    )  # fmt: skip
    parser.add_argument(
        "--peers", type=Path, metavar="TABLE",
        help="of `lixel lab peers` in the same view: its renderers are marks in the picture, and "
        "times are those of whole frames",
    )  # fmt: skip


def run(options: argparse.Namespace) -> None:
    """Measure, save and print a study."""
    names = options.scenes or [DEFAULT_SCENE]
    cameras, lights = _views_of_options(options, names)
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
            executor = stack.enter_context(
                concurrent.futures.ProcessPoolExecutor(options.workers, mp_context=context)
            )
        table = study(
            names,
            cameras=cameras,
            lights=lights,
            methods=chosen,
            parameters=parameters,
            size=options.size,
            device=options.device,
            repeats=options.repeats,
            journal=options.output and options.output.with_name(options.output.name + ".jsonl"),
            executor=executor,
        )
    if options.output is not None:
        save(table.assign(command=options.line), options.output)
    if options.plot is not None:
        _plot(table, options)
    print(as_text(summary(table, parameters)))
    if not table.attrs["complete"]:
        raise KeyboardInterrupt


def _views_of_options(
    options: argparse.Namespace, names: Sequence[str]
) -> tuple[dict[str, dict[str, Camera]], dict[str, dict[str, Light]]]:
    """Cameras and lights of each scene, by the scene's name."""
    cameras: dict[str, dict[str, Camera]] = {}
    lights: dict[str, dict[str, Light]] = {}
    for name in names:
        scene, views = scene_and_views(name, options.views, options.up)
        label = Path(name).stem
        if options.all_views:
            cameras[label], lights[label] = views.cameras, views.lights
        cameras[label] = cameras.get(label) or {
            options.camera or "first": views.camera(options.camera, scene)
        }
        lights[label] = lights.get(label) or {options.light or "first": views.light(options.light)}
    return cameras, lights


def _plot(table: pandas.DataFrame, options: argparse.Namespace) -> None:
    import matplotlib as mpl

    from ..pictures import plots

    mpl.use("agg")  # no window
    beside = {}
    if options.peers is not None:
        beside = {"peers": read(options.peers), "time": "wall_ms"}
    (ax, *_) = plots.time_against_error_by_view(table, **beside)
    figure: Any = ax.figure
    plots.save(figure, options.plot, options.line, dpi=150)
