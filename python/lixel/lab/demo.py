"""Render with methods, and tell of each what it costs and how wrong it is."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from .. import scenes
from ..camera import Camera
from ..compare import compare
from ..frame import render, render_outputs
from ..light import Light, PointLight
from ..methods import METHODS, Method, method_from
from ..pictures import display
from ..reference import reference
from ..scene import Scene
from .report import milliseconds, progress, say, table

AROUND_A_LAMP = ("cube", "cube+rtw", "dual_paraboloid", "improved_paraboloid", "ray_traced")


def run(folder: Path, width: int, height: int) -> list[dict[str, Any]]:
    """Render a built-in scene with every method, write pictures into a folder, print two tables.

    Parameters
    ----------
    folder : path
        Made where there is none.
    width, height : int
        Size of the images in pixels.

    Returns
    -------
    list of dict
        The rows of the tables, as from `judge`, and of each its light, ``"sun"`` or ``"lamp"``.
    """
    scene = scenes.colonnade()
    camera, sun = scene.cameras["default"].resized(width, height), scene.lights["default"]
    low, high = scene.bounds
    lamp = PointLight(low + (0.53, 0.6, 0.52) * (high - low))
    say(f"a colonnade of {scene.triangle_count:,} triangles, {width} x {height} pixels")
    in_the_sun = [method() for method in METHODS.values() if method().takes(sun)]
    around_a_lamp = [method_from(name) for name in AROUND_A_LAMP]
    of_sun = judge(scene, camera, sun, in_the_sun, folder / "sun", repeats=3)
    of_lamp = judge(scene, camera, lamp, around_a_lamp, folder / "lamp", repeats=3)
    frame = render(scene, camera, sun, "exact")
    frame.save(folder / "shadows.png")
    print("in the sun\n\n" + table(of_sun))
    print("\nunder a lamp\n\n" + table(of_lamp))
    adapter = frame.adapter
    print(f"\non {adapter.get('name', '?')}, driver {adapter.get('driver', '?')}")
    print(f"pictures in {folder}: shadows.png, and one for each row with its wrong pixels in red")
    return [{"light": "sun", **row} for row in of_sun] + [
        {"light": "lamp", **row} for row in of_lamp
    ]


def judge(
    scene: Scene,
    camera: Camera,
    light: Light,
    methods: Sequence[Method],
    folder: Path | None = None,
    repeats: int = 1,
) -> list[dict[str, Any]]:
    """Render with each method and compare with the reference.

    Parameters
    ----------
    scene, camera, light
        As for `render`.
    methods : sequence of Method
        At least one.
    folder : path, optional
        Where the pictures with wrong pixels in red go, named by method and resolution.
    repeats : int
        Frames of each method, in rounds; the one with the median time counts.

    Returns
    -------
    list of dict
        For each method its name and resolution, milliseconds on the GPU in all and per pass, and
        the pixels that it got wrong.
    """
    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)

    def shadows(seen_by: Camera, method: Method) -> dict[str, Any]:
        # As `render_shadows`: nothing is drawn that the picture does not need.
        return render_outputs(scene, seen_by, light, method, ("visibility",))[1]

    # In small first: pipelines are compiled on first use, and a machine without a GPU says so
    # before the reference takes its time.
    for method in methods:
        shadows(camera.resized(64, 64), method)
    first = shadows(camera, methods[0])["timings"]
    rendered = [shadows(camera, method) for method in progress([*methods] * repeats, "render")]
    frames = []
    for i in range(len(methods)):
        of_method = sorted(rendered[i :: len(methods)], key=lambda f: sum(f["timings"].values()))
        frames.append(of_method[len(of_method) // 2])
    # What depends on the camera alone ran only once, and counts for every frame.
    shared = {name: ms for name, ms in first.items() if name not in frames[0]["timings"]}
    say("reference: casting rays on the CPU")
    truth = reference(scene, camera, light)
    rows = []
    for method, frame in zip(methods, frames, strict=True):
        name, resolution = method.spelling, method.map_resolution
        timings = {**shared, **frame["timings"]}
        judged = compare(frame["visibility"], truth)
        if folder is not None:
            size = "" if resolution is None else f"-{resolution}"
            display.save(folder / f"{name}{size}.png", judged.picture(), frame["visibility"])
        rows.append(
            {
                "method": name,
                "resolution": "" if resolution is None else resolution,
                "GPU ms": sum(timings.values()),
                "misclassified": judged.misclassified_count,
                "% of covered": 100.0 * judged.rate_covered,
                "false lit": judged.false_lit_count,
                "false shadow": judged.false_shadow_count,
                "GPU ms per pass": milliseconds(timings),
            }
        )
    return rows
