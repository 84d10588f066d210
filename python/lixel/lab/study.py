"""Studies: scenes x cameras x lights x methods x parameters, measured into one table."""

from __future__ import annotations

import concurrent.futures
import hashlib
import inspect
import itertools
import json
import math
import time
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from datetime import datetime, timezone
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from .. import __path__ as package_path
from .._core import DeviceError, __version__
from ..arguments import count, instance, needs
from ..camera import Camera
from ..compare import compare
from ..frame import render, render_outputs
from ..light import LIGHTS, DirectionalLight, Light
from ..load import load
from ..methods import METHODS, Method, method_from
from ..reference import Reference, reference
from ..scene import Scene
from ..scenes import GENERATORS
from .peers import moved_by_a_hair
from .report import progress as show_progress
from .report import say

if TYPE_CHECKING:
    import pandas

Value = TypeVar("Value")
Record: TypeAlias = dict[str, Any]
SceneLike: TypeAlias = str | Path | tuple[str, Mapping[str, Any]] | Scene
Views: TypeAlias = Value | Sequence[Value] | Mapping[str, Value] | Mapping[str, Mapping[str, Value]]

SUN = (0.4, -0.8, -0.45)

# Samples that travel to a worker together: enough to make the way there cheap, few enough that
# little is lost with a worker.
_MOST_IN_A_TASK = 8
_TASKS = 64


def study(
    scenes: SceneLike | Sequence[SceneLike] | Mapping[str, SceneLike],
    *,
    cameras: Views[Camera] | None = None,
    lights: Views[Light] | None = None,
    methods: str | Method | Iterable[str | Method] | None = None,
    parameters: Mapping[str, Iterable[Any]] | None = None,
    size: tuple[int, int] | None = None,
    repeats: int = 5,
    journal: str | Path | None = None,
    executor: concurrent.futures.Executor | None = None,
    progress: bool = True,
) -> pandas.DataFrame:
    """Measure every combination of scenes, cameras, lights, methods and parameters.

    Each case is rendered once from its own camera and judged against `reference`. Then come
    `repeats` timed frames, each from the camera moved by a hair so that nothing is kept from the
    frame before. The cases of a scene take turns, frame by frame, so that a drift of the machine
    hits all alike. A case that cannot be rendered, such as a method that does not have the kind of
    light, gets a row with the reason in ``error``.

    Parameters
    ----------
    scenes : path, name, (name, arguments), Scene, or a sequence or mapping of these
        Files that `load` reads, names of `scenes.GENERATORS`, or scenes themselves. A mapping names
        them; else files go by their stem.
    cameras : Camera, or a sequence or mapping of these, optional
        For every scene, or a mapping from the names of scenes to mappings. None: the scene's own,
        or one that sees all of it.
    lights : light, or a sequence or mapping of these, optional
        As `cameras`. None: the scene's own, or a sun from above.
    methods : name, method object, or several, optional
        None: all of `METHODS`.
    parameters : mapping of str to values, optional
        Every combination of the values is set in each method that has these parameters.
    size : (width, height), optional
        Of the images in pixels; None: the cameras' own.
    repeats : int
        Timed frames of each case.
    journal : path, optional
        A file to which every sample is appended as a line of JSON. A study that finds samples of
        its own there goes on where the last one stopped.
    executor : concurrent.futures.Executor, optional
        Where the cases run, for example a ProcessPoolExecutor with the start method ``"spawn"``, or
        ``dask.distributed.Client(...).get_executor()``; None: here, one after the other. Workers
        that share a device disturb each other's times, but not each other's errors. Scenes given as
        objects travel with each task; files must be there for each worker.
    progress : bool
        Show progress on stderr: a bar where tqdm is installed.

    Returns
    -------
    pandas.DataFrame
        A row for each case, and for each device where a study went on elsewhere:

        - ``scene``, ``camera``, ``light``, ``light_kind``, ``method`` and every parameter;
          ``width``, ``height``, ``triangles``; ``case``, a hash of all that the case depends on.
        - ``repeats``: timed frames. ``gpu_ms``: median over them of the sum of all passes, with
          quartiles ``gpu_ms_q1`` and ``gpu_ms_q3``; likewise ``wall_ms``, from the call to the
          array in memory; ``pass_ms.NAME``: median for each pass.
        - The numbers of `Comparison.as_dict`: ``misclassified_count``, ``false_lit_count``,
          ``false_shadow_count``, rates, ``ssim``, ``edge_displacement_mean`` and ``_p95`` in
          pixels, and others.
        - ``aliasing_largest``: `Frame.largest_aliasing_error`.
        - ``aliasing_median``, ``aliasing_p95``: of `Frame.aliasing_error` over the pixels that face
          the light; ``aliasing_above_1``: the share of them where a texel is wider than the pixel.
        - ``map_bytes``: shadow map (depth and triangle) and warp map. ``stats.NAME``: counters.
        - ``device``, ``driver``, ``date`` (of the last frame), ``lixel``, ``error``.

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
    pandas = needs("pandas", "study")
    repeats = count("repeats", repeats, "frames")
    cases = list(_cases(scenes, cameras, lights, methods, parameters, size))
    book = _Journal(None if journal is None else Path(journal), {case.key for case in cases})
    samples = [
        (case, turn)
        for _, group in itertools.groupby(cases, key=lambda case: case.source)
        for turn, case in itertools.product(range(repeats), list(group))
    ]
    missing = [(case, turn) for case, turn in samples if not book.has(case.key, turn)]
    complete = _run(missing, executor, book, progress, len(samples))
    rows = [row for case in cases for row in _rows(case, book.of(case.key))]
    # Part by part, so that a parameter that only the last method has stands with the others.
    columns = [name for part in zip(*rows, strict=True) for name in _merged(part)]
    table = pandas.DataFrame(
        [{name: value for part in row for name, value in part.items()} for row in rows],
        columns=columns,
    )
    table.attrs["complete"] = complete
    return table


def summary(table: pandas.DataFrame, parameters: Iterable[str] = ()) -> list[dict[str, Any]]:
    """The columns to look at first and those of some parameters, as rows for a text table."""
    whole = {
        **{name: name for name in parameters},
        "misclassified_count": "misclassified",
        "false_lit_count": "false lit",
        "false_shadow_count": "false shadow",
    }
    columns = {
        **{name: name for name in ("scene", "camera", "light", "method", *parameters)},
        "gpu_ms": "GPU ms",
        "gpu_ms_q1": "from",
        "gpu_ms_q3": "to",
        **whole,
        "edge_displacement_mean": "edge displacement, px",
        "error": "error",
    }

    def cell(name: str, value: Any) -> Any:
        # A column with gaps is one of floats.
        is_whole = name in whole and isinstance(value, float) and value.is_integer()
        return int(value) if is_whole else value

    return [
        {
            title: cell(name, row[name])
            for name, title in columns.items()
            # A NaN differs from itself.
            if row.get(name) is not None and row[name] == row[name]
        }
        for row in table.to_dict("records")
    ]


# --- Cases ---


@dataclass(frozen=True)
class _Source:
    """How a worker gets a scene; two are equal where the geometry is."""

    key: str
    name: str = field(compare=False)
    origin: SceneLike = field(compare=False)


@dataclass(frozen=True)
class _Case:
    """One row of the table; two are equal where all that they depend on is."""

    key: str
    source: _Source = field(compare=False)
    triangles: int = field(compare=False)
    camera_name: str = field(compare=False)
    camera: Camera = field(compare=False)
    light_name: str = field(compare=False)
    light: Light = field(compare=False)
    method: Method = field(compare=False)


def _cases(
    scenes: SceneLike | Sequence[SceneLike] | Mapping[str, SceneLike],
    cameras: Views[Camera] | None,
    lights: Views[Light] | None,
    methods: str | Method | Iterable[str | Method] | None,
    parameters: Mapping[str, Iterable[Any]] | None,
    size: tuple[int, int] | None,
) -> Iterator[_Case]:
    variants = _variants(methods, parameters)
    for name, origin in _named_scenes(scenes).items():
        scene = _made(origin)
        digest = hashlib.sha256(scene.vertices.tobytes() + scene.faces.tobytes()).hexdigest()
        source = _Source(digest, name, origin)
        seen_by = _views_of(name, "cameras", cameras, scene.cameras, (Camera,))
        lit_by = _views_of(name, "lights", lights, scene.lights, LIGHTS)
        for (camera_name, camera), (light_name, light), method in itertools.product(
            (seen_by or {"all": see_all(scene)}).items(),
            (lit_by or {"sun": DirectionalLight(SUN)}).items(),
            variants,
        ):
            if not method.takes(light):
                continue
            sized = camera if size is None else camera.resized(*size)
            identity = (
                digest, repr(sized), repr(light), method.name,
                _canonical(method.parameters()), __version__, _build(),
            )  # fmt: skip
            key = hashlib.sha256(repr(identity).encode()).hexdigest()[:24]
            yield _Case(
                key, source, scene.triangle_count, camera_name, sized, light_name, light, method
            )


def _variants(
    methods: str | Method | Iterable[str | Method] | None,
    parameters: Mapping[str, Iterable[Any]] | None,
) -> list[Method]:
    """Every method with every combination of the parameters that it has, each once."""
    if methods is None:
        chosen = [method_from(name) for name in METHODS]
    elif isinstance(methods, str) or not isinstance(methods, Iterable):
        chosen = [method_from(methods)]
    else:
        chosen = [method_from(method) for method in methods]
    values = {name: list(choices) for name, choices in (parameters or {}).items()}
    known = sorted({f.name for method in chosen for f in fields(method)})
    for name, choices in values.items():
        if name not in known:
            raise ValueError(f"parameters must be among {', '.join(known)}, got {name!r}")
        if not choices:
            raise ValueError(f"parameters[{name!r}] must have at least one value, got none")
    variants: dict[str, Method] = {}
    for method in chosen:
        own = [name for name in values if name in {f.name for f in fields(method)}]
        for combination in itertools.product(*(values[name] for name in own)):
            variant = replace(method, **dict(zip(own, combination, strict=True)))
            variants.setdefault(repr((variant.name, _canonical(variant.parameters()))), variant)
    return list(variants.values())


def _named_scenes(
    scenes: SceneLike | Sequence[SceneLike] | Mapping[str, SceneLike],
) -> dict[str, SceneLike]:
    if isinstance(scenes, Mapping):
        return {str(name): scene for name, scene in scenes.items()}
    listed: Sequence[SceneLike]
    if isinstance(scenes, (str, Path, Scene)):
        listed = [scenes]
    elif isinstance(scenes, tuple) and len(scenes) == 2 and isinstance(scenes[1], Mapping):
        # The name of a generator with its arguments.
        listed = [scenes]
    else:
        listed = scenes
    named: dict[str, SceneLike] = {}
    for number, scene in enumerate(listed):
        if isinstance(scene, Scene):
            name = f"scene {number}"
        elif isinstance(scene, tuple):
            name = ", ".join([scene[0], *(f"{k}={v}" for k, v in scene[1].items())])
        else:
            name = Path(scene).stem
        if name in named:
            raise ValueError(f"scenes must differ in name, got {name!r} twice: use a mapping")
        named[name] = scene
    return named


def _made(origin: SceneLike) -> Scene:
    if isinstance(origin, Scene):
        return origin
    name, arguments = origin if isinstance(origin, tuple) else (origin, {})
    if str(name) in GENERATORS:
        return GENERATORS[str(name)](**arguments)
    if isinstance(origin, tuple):
        raise ValueError(f"scenes must name one of {', '.join(GENERATORS)}, got {name!r}")
    return load(name)


def _views_of(
    scene: str,
    argument: str,
    given: Views[Value] | None,
    own: Mapping[str, Value],
    kinds: tuple[type[Value], ...],
) -> dict[str, Value]:
    """The cameras or lights of a scene, by name."""
    if given is None:
        return dict(own)
    if isinstance(given, kinds):
        named: Mapping[str, Any] = {"0": given}
    elif isinstance(given, Mapping):
        nested = any(isinstance(value, Mapping) for value in given.values())
        if nested and scene not in given:
            raise ValueError(f"{argument} must have an entry for the scene {scene!r}")
        named = given[scene] if nested else given  # type: ignore[assignment]
    else:
        named = {str(i): view for i, view in enumerate(given)}  # type: ignore[arg-type]
    for name, view in named.items():
        instance(f"{argument}[{name!r}]", view, *kinds)
    return {str(name): view for name, view in named.items()}


def see_all(scene: Scene, width: int = 1920, height: int = 1080) -> Camera:
    """A camera that looks down at the scene's box, all of it in view."""
    low, high = scene.bounds
    centre, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    yfov = 0.8
    away = np.array((0.5, 0.45, 0.75))
    eye = centre + away / np.linalg.norm(away) * (radius or 1.0) / math.sin(yfov / 2)
    return Camera.look_at(eye, centre, yfov=yfov, width=width, height=height)


def _canonical(value: Any) -> Any:
    """The value in a form whose repr is the same in every process."""
    if isinstance(value, Mapping):
        return sorted((str(name), _canonical(item)) for name, item in value.items())
    if isinstance(value, (list, tuple)):
        return [_canonical(item) for item in value]
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()
    if inspect.isfunction(value):
        return value.__qualname__, inspect.getsource(value)
    return value


@cache
def _build() -> str:
    """A hash of the compiled core, which holds the methods and their shaders."""
    digest = hashlib.sha256()
    for folder in package_path:
        for file in sorted(Path(folder).glob("_core*")):
            if file.suffix != ".pyi":
                digest.update(file.read_bytes())
    return digest.hexdigest()


# --- The journal ---


class _Journal:
    """The samples measured so far, and a file that outlives the process."""

    def __init__(self, path: Path | None, wanted: set[str]) -> None:
        self.path = path
        self.records: dict[str, dict[int, Record]] = defaultdict(dict)
        if path is None or not path.exists():
            return
        content = path.read_bytes()
        # A process that was killed may have left half a line.
        whole = content[: content.rfind(b"\n") + 1]
        for number, line in enumerate(whole.splitlines(), 1):
            try:
                record = json.loads(line)
                case, turn = record["case"], record["turn"]
            except (ValueError, KeyError, TypeError):
                raise ValueError(
                    f"journal must hold samples of a study, got {str(path)!r}, line {number}"
                ) from None
            if case in wanted:
                self.records[case][turn] = record
        if len(whole) < len(content):
            with path.open("r+b") as file:
                file.truncate(len(whole))

    def has(self, case: str, turn: int) -> bool:
        found = self.records.get(case, {})
        # A case that cannot be rendered has no further samples.
        return turn in found or any("error" in record for record in found.values())

    def of(self, case: str) -> list[Record]:
        return [record for _, record in sorted(self.records.get(case, {}).items())]

    def add(self, records: Iterable[Record]) -> None:
        records = list(records)
        for record in records:
            self.records[record["case"]][record["turn"]] = record
        if self.path is not None:
            # What a device could not do today it may do tomorrow.
            lines = [json.dumps(r) + "\n" for r in records if not r.get("transient")]
            with self.path.open("a", encoding="utf-8") as file:
                file.write("".join(lines))


# --- The work ---


def _run(
    missing: Sequence[tuple[_Case, int]],
    executor: concurrent.futures.Executor | None,
    book: _Journal,
    progress: bool,
    total: int,
) -> bool:
    """Measure the missing samples; False where Ctrl-C came first."""
    done = total - len(missing)
    try:
        if executor is None:
            for case, turn in _shown(missing, progress, total, done):
                if not book.has(case.key, turn):
                    book.add([_sample(case, turn)])
        else:
            _spread(missing, executor, book, progress, total)
    except KeyboardInterrupt:
        say("study: stopped; the table holds what was measured until now")
        return False
    return True


def _spread(
    missing: Sequence[tuple[_Case, int]],
    executor: concurrent.futures.Executor,
    book: _Journal,
    progress: bool,
    total: int,
) -> None:
    tasks = list(_tasks(missing))
    futures = {executor.submit(_samples, task): len(task) for task in tasks}
    kept = set()

    def arrivals() -> Iterator[None]:
        for future in concurrent.futures.as_completed(futures):
            book.add(future.result())
            kept.add(future)
            yield from itertools.repeat(None, futures[future])

    try:
        for _ in _shown(arrivals(), progress, total, total - len(missing)):
            pass
    finally:
        for future in futures:
            future.cancel()
        for future in futures.keys() - kept:
            if future.done() and not future.cancelled() and future.exception() is None:
                book.add(future.result())


def _tasks(missing: Sequence[tuple[_Case, int]]) -> Iterator[list[tuple[_Case, int]]]:
    """Samples in their order. Those of a view stay together as far as a task allows it: each worker
    casts the rays of a view's reference for itself."""
    most = min(_MOST_IN_A_TASK, math.ceil(len(missing) / _TASKS))

    def stage(sample: tuple[_Case, int]) -> tuple[_Source, int]:
        return sample[0].source, sample[1]

    def view(sample: tuple[_Case, int]) -> tuple[_Source, int, Camera, Light]:
        return *stage(sample), sample[0].camera, sample[0].light

    task: list[tuple[_Case, int]] = []
    for _, group in itertools.groupby(missing, key=view):
        samples = list(group)
        # A half more than the most is still one piece.
        size = math.ceil(len(samples) / max(1, round(len(samples) / most)))
        for i in range(0, len(samples), size):
            piece = samples[i : i + size]
            if task and (len(task) + len(piece) > most or stage(task[0]) != stage(piece[0])):
                yield task
                task = []
            task += piece
    if task:
        yield task


def _shown(items: Iterable[Value], progress: bool, total: int, done: int) -> Iterator[Value]:
    return show_progress(items, "study", total, done) if progress else iter(items)


def _samples(task: Sequence[tuple[_Case, int]]) -> list[Record]:
    """In a worker."""
    return [_sample(case, turn) for case, turn in task]


def _sample(case: _Case, turn: int) -> Record:
    """One timed frame of a case; the first sample also judges it."""
    record: Record = {"case": case.key, "turn": turn}
    try:
        stage = _stage(case.source)
        if turn == 0:
            record["judged"] = _judge(case, stage.scene)
        elif case.key not in stage.warm:
            render_outputs(stage.scene, case.camera, case.light, case.method, ("visibility",))
        stage.warm.add(case.key)
        # Elsewhere for each case, too: a camera that was just seen would cost nothing.
        random = np.random.default_rng((turn, int(case.key, 16)))
        camera = moved_by_a_hair(case.camera, stage.scene, random)
        start = time.perf_counter()
        _, results = render_outputs(stage.scene, camera, case.light, case.method, ("visibility",))
        record["wall_ms"] = 1e3 * (time.perf_counter() - start)
        record["pass_ms"] = results["timings"]
        if turn == 0:
            record["stats"] = results["stats"]
        adapter = results["adapter"]
        record["date"] = datetime.now(timezone.utc).date().isoformat()
        record["device"], record["driver"] = adapter.get("name", ""), adapter.get("driver", "")
    except (ValueError, DeviceError) as error:
        record["error"] = f"{type(error).__name__}: {error}"
        record["transient"] = isinstance(error, DeviceError)
    return record


@dataclass(frozen=True)
class _Stage:
    """A scene, and the cases that were rendered since it was made: their pipelines are compiled,
    their memory is allocated."""

    scene: Scene
    warm: set[str] = field(default_factory=set)


# A study goes through the scenes one by one, and through the views of each in the same order.
@lru_cache(maxsize=2)
def _stage(source: _Source) -> _Stage:
    return _Stage(_made(source.origin))


@lru_cache(maxsize=2)
def _truth(source: _Source, camera: Camera, light: Light) -> Reference:
    return reference(_stage(source).scene, camera, light)


def _judge(case: _Case, scene: Scene) -> Record:
    frame = render(scene, case.camera, case.light, case.method)
    truth = _truth(case.source, case.camera, case.light)
    aliasing = frame.aliasing_error[truth.facing]
    return {
        **compare(frame, truth).as_dict(),
        "aliasing_largest": frame.largest_aliasing_error,
        **_aliasing(aliasing[~np.isnan(aliasing)]),
        # The core stores depth and triangle of a texel in 64 bits.
        "map_bytes": 8 * frame.shadow_map.size + frame.warp_map.nbytes,
    }


def _aliasing(errors: npt.NDArray[np.float32]) -> dict[str, float | None]:
    if not errors.size:
        return dict.fromkeys(("aliasing_median", "aliasing_p95", "aliasing_above_1"))
    # By rank, not interpolated: errors may be infinite.
    median, p95 = np.percentile(errors, (50, 95), method="higher")
    return {
        "aliasing_median": float(median),
        "aliasing_p95": float(p95),
        "aliasing_above_1": float(np.mean(errors > 1.0)),
    }


# --- The table ---


def _rows(case: _Case, records: Sequence[Record]) -> Iterator[tuple[dict[str, Any], ...]]:
    """A row for each device, in parts."""
    by_device: dict[tuple[str, str], list[Record]] = defaultdict(list)
    for record in records:
        by_device[record.get("device", ""), record.get("driver", "")].append(record)
    for (device, driver), group in by_device.items():
        timed = [record for record in group if "pass_ms" in record]
        merged = {name: value for record in group for name, value in record.items()}
        yield (
            {
                "scene": case.source.name,
                "camera": case.camera_name,
                "light": case.light_name,
                "light_kind": type(case.light).__name__,
                "method": case.method.name,
            },
            {name: _cell(value) for name, value in case.method.parameters().items()},
            {
                "width": case.camera.width,
                "height": case.camera.height,
                "triangles": case.triangles,
                "repeats": len(timed),
                **_spread_of("gpu_ms", [sum(record["pass_ms"].values()) for record in timed]),
                **_spread_of("wall_ms", [record["wall_ms"] for record in timed]),
            },
            _medians([record["pass_ms"] for record in timed]),
            merged.get("judged", {}),
            dict(_counters("stats", merged.get("stats", {}))),
            {
                "device": device,
                "driver": driver,
                "date": merged.get("date"),
                "lixel": __version__,
                "case": case.key,
                "error": merged.get("error"),
            },
        )


def _merged(orders: Iterable[Iterable[str]]) -> list[str]:
    """All names, each where those around it stand: passes in the order in which they run."""
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
            yield f"{prefix}.{name}", _cell(value)


def _cell(value: Any) -> Any:
    """A value that a column can hold."""
    if value is None or isinstance(value, (bool, int, float, str)):
        return value
    if isinstance(value, (list, tuple)) and all(isinstance(item, str) for item in value):
        return ", ".join(value)
    return repr(_canonical(value))
