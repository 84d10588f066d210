"""The cases of a study: each scene, camera and light with each method and its parameters."""

from __future__ import annotations

import hashlib
import inspect
import itertools
import marshal
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np

from .. import _core
from ..arguments import did_you_mean, instance
from ..camera import Camera
from ..default_view import DEFAULT_LIGHT, see_all
from ..light import LIGHTS, Light
from ..load import load
from ..methods import METHODS, Checked, Method, OwnMethod, method_from
from ..scene import Scene
from ..scenes import GENERATORS

Value = TypeVar("Value")
SceneLike: TypeAlias = str | Path | tuple[str, Mapping[str, Any]] | Scene
Views: TypeAlias = Value | Sequence[Value] | Mapping[str, Value] | Mapping[str, Mapping[str, Value]]


@dataclass(frozen=True)
class Source:
    """How a worker gets a scene; two are equal where the geometry is."""

    key: str
    name: str = field(compare=False)
    origin: SceneLike = field(compare=False)


@dataclass(frozen=True)
class Case:
    """One row of the table; two are equal where all that they depend on is."""

    key: str
    source: Source = field(compare=False)
    triangles: int = field(compare=False)
    camera_name: str = field(compare=False)
    camera: Camera = field(compare=False)
    light_name: str = field(compare=False)
    light: Light = field(compare=False)
    method: Method = field(compare=False)
    device: str | None = field(compare=False)


def cases_of(
    scenes: SceneLike | Sequence[SceneLike] | Mapping[str, SceneLike],
    cameras: Views[Camera] | None,
    lights: Views[Light] | None,
    methods: str | Method | Iterable[str | Method] | None,
    parameters: Mapping[str, Iterable[Any]] | None,
    size: tuple[int, int] | None,
    device: str | None = None,
) -> Iterator[Case]:
    variants = _variants(methods, parameters)
    for name, origin in _named_scenes(scenes).items():
        scene = made_scene(origin)
        digest = hashlib.sha256(b"".join(scene._bytes())).hexdigest()
        source = Source(digest, name, origin)
        seen_by = _views_of(name, "cameras", cameras, scene.cameras, (Camera,))
        lit_by = _views_of(name, "lights", lights, scene.lights, LIGHTS)
        for (camera_name, camera), (light_name, light), method in itertools.product(
            (seen_by or {"all": see_all(scene)}).items(),
            (lit_by or {"default": DEFAULT_LIGHT}).items(),
            variants,
        ):
            if not method.takes(light) or (scene.masked_count and not method.takes_holes()):
                continue
            sized = camera if size is None else camera.resized(*size)
            identity = (
                digest, repr(sized), repr(light), canonical(method), device, _core.__version__,
                _build(),
            )  # fmt: skip
            key = hashlib.sha256(repr(identity).encode()).hexdigest()[:24]
            yield Case(
                key, source, scene.triangle_count, camera_name, sized, light_name, light, method,
                device,
            )  # fmt: skip


def _variants(
    methods: str | Method | Iterable[str | Method] | None,
    parameters: Mapping[str, Iterable[Any]] | None,
) -> list[Method]:
    """Every method with every combination of the parameters that it has, each once."""
    if methods is None:
        chosen: list[Method] = [made() for made in METHODS.values()]
    elif isinstance(methods, str) or not isinstance(methods, Iterable):
        chosen = [method_from(methods)]
    else:
        chosen = [method_from(method) for method in methods]
    values = {name: list(choices) for name, choices in (parameters or {}).items()}
    known = sorted({f.name for method in chosen for f in fields(method)})
    for name, choices in values.items():
        if name not in known:
            raise ValueError(
                f"parameters must be among {', '.join(known)}, got {name!r}"
                f"{did_you_mean(name, known)}"
            )
        if not choices:
            raise ValueError(f"parameters[{name!r}] must have at least one value, got none")
    variants: dict[str, Method] = {}
    for method in chosen:
        own = [name for name in values if name in {f.name for f in fields(method)}]
        for combination in itertools.product(*(values[name] for name in own)):
            variant = replace(method, **dict(zip(own, combination, strict=True)))
            variants.setdefault(repr(canonical(variant)), variant)
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


def made_scene(origin: SceneLike) -> Scene:
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


def canonical(value: Any) -> Any:
    """The value in a form whose repr is the same in every process."""
    if isinstance(value, Mapping):
        return sorted((str(name), canonical(item)) for name, item in value.items())
    if isinstance(value, (list, tuple)):
        return [canonical(item) for item in value]
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, hashlib.sha256(value.tobytes()).hexdigest()
    if isinstance(value, Checked):
        own = canonical(value.function) if isinstance(value, OwnMethod) else None
        return value.name, own, canonical(value.parameters())
    if inspect.isfunction(value):
        return value.__qualname__, _source(value)
    return value


def _source(function: Any) -> str | bytes:
    """What a function does; where its text is in no file, its code."""
    try:
        return inspect.getsource(function)
    except OSError:
        return marshal.dumps(function.__code__)


@cache
def _build() -> str:
    """A hash of the compiled core, which holds the methods and their shaders."""
    return hashlib.sha256(Path(_core.__file__).read_bytes()).hexdigest()
