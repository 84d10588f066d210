"""The choice of `lixel.Auto`: the cheapest method for an error, by two maps and a table of times.

Two maps of one fit, the second twice as fine, differ in some pixels; the finer one is wrong in
fewer than that, which `lixel lab calibration` measures. The times come from there too, and
from no clock, so that the same call makes the same choice.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from ._core import DeviceError
from .camera import Camera
from .light import WITH_POSITION, Light
from .methods import (
    Auto,
    DesiredView,
    Exact,
    LightSpacePerspective,
    Method,
    RayTraced,
    resolution_text,
)
from .scene import Scene

if TYPE_CHECKING:
    from .frame import FrameParts

BOTH_BROKEN = "nothing keeps both max_error and max_ms"

# Texels along each side: the first two maps, and those that follow while they are cheaper than the
# methods without a wrong pixel.
RESOLUTIONS = (256, 512, 1024, 2048)


@cache
def model() -> dict[str, Any]:
    """What calibration measured; the file names its device, date and command."""
    path = Path(__file__).with_name("auto_model.json")
    found: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return found


def map_for(light: Light, resolution: int) -> Method:
    """The map that is tried: of those calibrated the one with the fewest wrong pixels."""
    if isinstance(light, WITH_POSITION):
        return DesiredView(resolution=resolution)
    return LightSpacePerspective(resolution=resolution)


def differing(coarse: npt.NDArray[np.float32], fine: npt.NDArray[np.float32]) -> int:
    """Pixels of a surface in which two visibility images differ."""
    return int(np.count_nonzero((coarse != fine) & ~np.isnan(fine)))


def error_bound(differing_count: int, covered: int) -> float:
    """Greatest share of covered pixels that are wrong in the finer of two maps, by calibration."""
    fitted = model()["error"]
    return float(fitted["share"] * (differing_count + fitted["slack"]) / max(covered, 1))


def features(triangles: int, pixels: int, texels: int, *, by_rays: bool = False) -> list[float]:
    """What a time is linear in: one, triangles, pixels and texels, in millions.

    A ray takes as long as its hierarchy is deep, so of rays it is pixels times that.
    """
    if by_rays:
        return [1.0, 0.0, 1e-6 * pixels * math.log2(triangles + 1), 0.0]
    return [1.0, 1e-6 * triangles, 1e-6 * pixels, 1e-6 * texels]


def time_key(method: Method, light: Light) -> str:
    """Which of the model's times is the method's."""
    kind = "positional" if isinstance(light, WITH_POSITION) else "directional"
    return method.name if isinstance(method, RayTraced) else f"{method.name}, {kind}"


def predicted_ms(
    method: Method, light: Light, triangles: int, pixels: int, *, is_moving: bool
) -> float:
    """Milliseconds of a method after the visibility buffer is there, on the calibrated device."""
    times = model()["ms"]
    by_rays = isinstance(method, RayTraced)
    texels = math.prod(method.map_size or (0,))
    known = features(triangles, pixels, texels, by_rays=by_rays)
    of_frame = float(np.dot(times[time_key(method, light)], known))
    # A scene that stays builds its hierarchy once, one that moves in every frame.
    if by_rays and is_moving:
        of_frame += float(times["build"][0]) * 1e-6 * triangles
    return of_frame


@dataclass
class Trial:
    """Maps rendered so far, finer and finer."""

    names: list[str] = field(default_factory=list)
    parts: FrameParts | None = None
    bound: float | None = None

    def add(self, parts: FrameParts) -> None:
        if self.parts is not None:
            covered = int(np.count_nonzero(~np.isnan(parts.visibility)))
            self.bound = error_bound(differing(self.parts.visibility, parts.visibility), covered)
        self.names.append(spelled(parts.method))
        self.parts = parts


def spelled(method: Method) -> str:
    """Name and resolution."""
    resolution = method.map_resolution
    if resolution is None:
        return method.spelling
    return f"{method.spelling} {resolution_text(resolution)}"


def choose(
    scene: Scene,
    camera: Camera,
    light: Light,
    wanted: Auto,
    render: Callable[[Method], FrameParts],
) -> FrameParts:
    """What `render` gives of the method that was chosen, with the choice in ``stats["auto"]``.

    ``timings`` are those of all that was rendered for the choice.
    """
    plan = _Plan(scene, camera, light, wanted)
    trial = Trial()
    timings: dict[str, float] = {}

    def rendered(method: Method) -> FrameParts:
        parts = render(method)
        for label, milliseconds in parts.timings.items():
            timings[label] = timings.get(label, 0.0) + milliseconds
        return replace(parts, timings=timings)

    why = ""
    failed: list[str] = []
    resolutions, is_open = plan.ladder()
    try:
        for resolution in resolutions:
            method = map_for(light, resolution)
            if is_open and trial.bound is not None and not plan.goes_on(trial.bound, method):
                break
            trial.add(rendered(method))
            if trial.bound is not None and trial.bound <= wanted.max_error:
                why = "two maps differ in so few pixels that the finer one keeps max_error"
                break
    except DeviceError as error:
        failed.append(f"{spelled(method)}: {error}")
        why = ""
    if not why and not is_open and trial.parts is not None:
        is_pair = trial.bound is not None
        taken = "the finest maps within max_ms" if is_pair else "the fastest map"
        why = f"{BOTH_BROKEN}: {taken}"
    if why:
        assert trial.parts is not None
        return plan.told(trial, trial.parts, why, failed)
    why = (
        "no map was found that keeps max_error and is cheaper" if trial.names else plan.why_no_map()
    )
    for method in plan.exact:
        try:
            parts = rendered(method)
        except DeviceError as error:
            failed.append(f"{spelled(method)}: {error}")
            continue
        trial.bound = 0.0
        return plan.told(trial, parts, why, failed)
    raise DeviceError("; ".join(failed))


def choose_on_cpu(
    scene: Scene,
    camera: Camera,
    light: Light,
    wanted: Auto,
    render: Callable[[Method], FrameParts],
) -> FrameParts:
    """The same on the CPU engine, where `Exact` is the fastest method and has no wrong pixel."""
    why = "nothing on the CPU engine is faster than a method without a wrong pixel"
    plan = _Plan(scene, camera, light, wanted)
    parts = plan.told(Trial(bound=0.0), render(Exact()), why, [])
    # The model's times are a GPU's.
    times = ("predicted_ms", "predicted_ms_without_error", "times_of")
    facts = {**parts.stats["auto"], **dict.fromkeys(times)}
    return replace(parts, stats={**parts.stats, "auto": facts})


class _Plan:
    """Predicted times of one view, and what follows from them."""

    def __init__(self, scene: Scene, camera: Camera, light: Light, wanted: Auto) -> None:
        self.wanted = wanted
        self.pixels = camera.width * camera.height

        def predicted(method: Method) -> float:
            return predicted_ms(
                method, light, scene.triangle_count, self.pixels, is_moving=scene._generation > 0
            )

        self.predicted = predicted
        visibility = np.dot(
            model()["ms"]["visibility"], features(scene.triangle_count, self.pixels, 0)
        )
        # The visibility buffer is every method's.
        self.within = np.inf if wanted.max_ms is None else wanted.max_ms - float(visibility)
        self.exact: Sequence[Method] = sorted((RayTraced(), Exact()), key=predicted)
        self.exact_ms = predicted(self.exact[0])
        self.map_ms = {n: predicted(map_for(light, n)) for n in RESOLUTIONS}

    def ladder(self) -> tuple[Sequence[int], bool]:
        """Resolutions of the maps to try, and whether there is time to give them up."""
        pair = self.map_ms[RESOLUTIONS[0]] + self.map_ms[RESOLUTIONS[1]]
        if self.exact_ms <= self.within:
            is_cheaper = pair < self.exact_ms and pair + self.exact_ms <= self.within
            is_told = error_bound(0, self.pixels) <= self.wanted.max_error
            return RESOLUTIONS if is_cheaper and is_told else (), True
        for fine in range(len(RESOLUTIONS) - 1, 0, -1):
            both = RESOLUTIONS[fine - 1 : fine + 1]
            if sum(self.map_ms[n] for n in both) <= self.within:
                return both, False
        # Too little time for anything: a map is the answer only where it is expected to be faster
        # than what misclassifies no pixel.
        fastest = RESOLUTIONS[:1]
        return fastest if self.map_ms[fastest[0]] < self.exact_ms else (), False

    def goes_on(self, bound: float, method: Method) -> bool:
        """Whether the next finer map promises more than a method without a wrong pixel."""
        next_bound = bound * model()["error"]["falloff"]
        cost = self.predicted(method)
        is_in_time = cost + self.exact_ms <= self.within
        return next_bound <= self.wanted.max_error and cost < self.exact_ms and is_in_time

    def why_no_map(self) -> str:
        if self.exact_ms > self.within:
            return f"{BOTH_BROKEN}: no map is faster than what misclassifies no pixel"
        if error_bound(0, self.pixels) > self.wanted.max_error:
            return "max_error is below what two maps can tell"
        return "no pair of maps is cheaper"

    def told(self, trial: Trial, parts: FrameParts, why: str, failed: Sequence[str]) -> FrameParts:
        facts = {
            "method": spelled(parts.method),
            "why": why,
            "max_error": self.wanted.max_error,
            # None: one map alone tells nothing.
            "predicted_error": trial.bound,
            "max_ms": self.wanted.max_ms,
            "predicted_ms": round(self.predicted(parts.method), 3),
            "predicted_ms_without_error": round(self.exact_ms, 3),
            "times_of": model()["device"],
            "tried": trial.names,
            "failed": list(failed),
        }
        return replace(parts, stats={**parts.stats, "auto": facts})
