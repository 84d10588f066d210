"""Cameras and lights of a scene by their names, from the scene itself or from a file beside it."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

import numpy as np
import numpy.typing as npt

from ..arguments import did_you_mean
from ..camera import Camera
from ..default_view import DEFAULT_LIGHT, see_all
from ..light import DirectionalLight, Light, PointLight, SpotLight
from ..load import FORMATS, Up, load
from ..scene import Scene
from ..scenes import GENERATORS
from .report import waiting

SIZE = (1920, 1080)
"""Pixels of a camera that says nothing of its image."""

UP = (0.0, 1.0, 0.0)

View: TypeAlias = tuple[Scene, Camera, Light]

Value = TypeVar("Value")


@dataclass(frozen=True)
class Views:
    """Cameras and lights by name, in order."""

    cameras: dict[str, Camera] = field(default_factory=dict)
    lights: dict[str, Light] = field(default_factory=dict)
    # Lights that are listed but not of a kind that lixel has; they keep their place and name.
    unsupported: dict[str, str] = field(default_factory=dict)
    # What the scene's file holds and lixel does not take, in words.
    left_out: tuple[str, ...] = ()

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
                str(i): _camera(
                    c["eye"], c["target"], c.get("up", UP), math.radians(c["fov_y_deg"])
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
            return self._first("camera", self.cameras) or see_all(scene)
        if ";" not in text:
            return _pick("camera", text, self.cameras, self._broken("camera"))
        parts = text.split(";")
        if len(parts) not in (3, 4):
            raise ValueError(
                f'camera must be "eye;target;yfov" or "eye;target;yfov;up", got {text!r}'
            )
        eye, target = _point("camera eye", parts[0]), _point("camera target", parts[1])
        up = _point("camera up", parts[3]) if len(parts) == 4 else UP
        return _camera(eye, target, up, _angle(parts[2]))

    def light(self, text: str | None) -> Light:
        """The light of a name, an index or a direction; a suitable one for None."""
        if text is None:
            return self._first("light", self.lights) or DEFAULT_LIGHT
        if "," in text:
            return DirectionalLight(_point("light", text))
        if text in self.unsupported:
            kind = self.unsupported[text]
            raise ValueError(f"light must be directional, point or spot, got {text}, a {kind}")
        return _pick("light", text, self.lights, self._broken("light"))

    def _first(self, what: str, known: Mapping[str, Value]) -> Value | None:
        """The first of the scene's own; None where it has none at all. ValueError where it has, but
        none that can be used: another view would not be the one that was meant."""
        if not known and self._broken(what):
            example = '"0,2,5;0,0,0;60deg"' if what == "camera" else '"0.4,-0.8,-0.45"'
            raise ValueError(
                f"--{what} must say the {what}, for example {example}, since those of the file "
                f"cannot be used: {'; '.join(self._broken(what))}"
            )
        return next(iter(known.values()), None)

    def _broken(self, what: str) -> tuple[str, ...]:
        """What is said of cameras, or lights, that cannot be used."""
        return tuple(words for words in self.left_out if f"{what} " in words.split("'")[0])


def listed_in(folder: Path) -> Iterator[tuple[str, Views]]:
    """The names of the files that the scenes.json of a folder lists, with their views."""
    listing = folder / "scenes.json"
    for entry in json.loads(listing.read_text(encoding="utf-8")):
        yield entry["file"], Views.read(listing, entry["file"])


def first_cameras(
    folder: Path | None, names: Sequence[str] | None = None
) -> Iterator[tuple[str, Path, Camera]]:
    """Name, file and first camera of every scene that the scenes.json of a folder lists, or of
    those with some names; none without a folder."""
    if folder is None:
        return
    for file, views in listed_in(folder):
        name = Path(file).stem
        if not names or name in names:
            yield name, folder / file, next(iter(views.cameras.values()))


def scene_and_views(name: str, file: Path | None, up: Up = "y") -> tuple[Scene, Views]:
    """A file's scene or a built-in one, and its views: those of a file, or the scene's own."""
    views = None if file is None else Views.read(file, Path(name).name)
    if name in GENERATORS:
        if up != "y":
            raise ValueError(f"--up {up} is for files: {name} has its own axes")
        with waiting(f"making {name}"):
            scene = GENERATORS[name]()
    elif Path(name).suffix or Path(name).exists():
        with waiting(f"loading {Path(name).name}"):
            scene = load(name, up=up)
    else:
        raise ValueError(
            f"scene must be a file ({', '.join(FORMATS)}) or one of {', '.join(GENERATORS)}, "
            f"got {name!r}{did_you_mean(name, GENERATORS)}"
        )
    own = Views(dict(scene.cameras), dict(scene.lights), left_out=scene.unsupported)
    return scene, views or own


def _camera(eye: Any, target: Any, up: Any, yfov: float) -> Camera:
    return Camera.look_at(eye, target, up, yfov=yfov, width=SIZE[0], height=SIZE[1])


def _pick(what: str, text: str, known: Mapping[str, Value], broken: Sequence[str]) -> Value:
    if text in known:
        return known[text]
    names = list(known)
    # What cannot be used counts in the file, and would count here for another.
    if text.isdecimal() and int(text) < len(names) and not broken:
        return known[names[int(text)]]
    by = "name" if broken else "name or index"
    have = f"one of {', '.join(names)}, by {by}" if names else "described: it has none"
    why = f"; of the file's own these cannot be used: {'; '.join(broken)}" if broken else ""
    raise ValueError(f"{what} must be {have}, got {text!r}{why}{did_you_mean(text, names)}")


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
