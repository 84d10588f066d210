"""Measure how many answers a second `lixel.shadows_at` gives, beside Embree's rays."""

from __future__ import annotations

import argparse
import importlib.util
import statistics
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from ..light import DirectionalLight
from ..points import shadows_at
from ..scene import Scene
from .options import DEFAULT_SCENE, SCENE_HELP, UP_HELP, add_output, natural, show
from .rays import embree_scene, ray_offset
from .report import waiting
from .timing import wall_ms
from .views import scene_and_views

Points = npt.NDArray[np.float64]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab points`."""
    parser.add_argument(
        "scene", nargs="?", default=DEFAULT_SCENE, metavar="FILE",
        help=f"{SCENE_HELP}; default: {DEFAULT_SCENE}",
    )  # fmt: skip
    parser.add_argument("--up", choices=("y", "z"), default="y", help=UP_HELP)
    parser.add_argument(
        "--points", type=natural, default=1_000_000, metavar="N", help="on its surfaces; 1000000"
    )
    parser.add_argument("--lights", type=natural, default=8, metavar="N", help="of the sun; 8")
    parser.add_argument("--repeats", type=natural, default=3, metavar="N", help="timed calls; 3")
    add_output(parser, "write a table, .csv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Ask, print and save."""
    scene, _ = scene_and_views(options.scene, None, options.up)
    show(options, measure(scene, options.points, options.lights, options.repeats))


def measure(scene: Scene, count: int, lights: int, repeats: int = 3) -> list[dict[str, Any]]:
    """A row for each who answers: seconds, the median of some calls, and millions of answers for
    each of them. Embree stands beside lixel where embreex is installed, and so does the share of
    points in which the two differ."""
    random = np.random.default_rng(1)
    points, normals = on_surfaces(scene, count, random)
    toward = random.normal(size=(lights, 3)) * (1, 0.3, 1) + (0, 1.2, 0)
    toward[:, 1] = np.abs(toward[:, 1])
    suns = [DirectionalLight(-direction) for direction in toward]
    answers: dict[str, Callable[[], npt.NDArray[Any]]] = {
        "lixel.shadows_at": lambda: shadows_at(scene, points, suns, normals, progress=False),
        "without normals": lambda: shadows_at(scene, points, suns, progress=False),
    }
    if importlib.util.find_spec("embreex") and not scene.masked_count:
        answers["embreex"] = _embree(scene, points, normals, toward)
    rows: list[dict[str, Any]] = []
    expected = None
    for name, answer in answers.items():
        with waiting(f"asking {count:,} points about {lights} suns: {name}"):
            found = answer()
            seconds = statistics.median(wall_ms(answer) for _ in range(repeats)) / 1e3
        expected = found if expected is None else expected
        rows.append(
            {
                "by": name,
                "points": count,
                "lights": lights,
                "s": round(seconds, 3),
                "million answers a second": round(found.size / seconds / 1e6, 2),
                "lit": f"{found.mean():.2%}",
                "other than the first": f"{np.mean(found != expected):.4%}",
            }
        )
    return rows


def on_surfaces(
    scene: Scene, count: int, random: np.random.Generator
) -> tuple[Points, npt.NDArray[np.float64]]:
    """Points spread over all triangles by their area, and the normals of these."""
    corners = scene.vertices[scene.faces]
    first, sides = corners[:, 0], corners[:, 1:] - corners[:, :1]
    normals = np.cross(sides[:, 0], sides[:, 1])
    areas = np.linalg.norm(normals, axis=1)
    chosen = np.sort(random.choice(len(areas), count, p=areas / areas.sum()))
    shares = random.random((count, 2))
    # What falls beyond the third side is turned back into the triangle.
    beyond = shares.sum(axis=1) > 1.0
    shares[beyond] = 1.0 - shares[beyond]
    points = first[chosen] + np.einsum("ns,nsx->nx", shares, sides[chosen])
    return points, normals[chosen]


def _embree(
    scene: Scene, points: Points, normals: npt.NDArray[np.float64], toward: npt.NDArray[np.float64]
) -> Callable[[], npt.NDArray[Any]]:
    """A shadow ray for each point and sun that it faces, a little above its surface."""
    traced, offset = embree_scene(scene), ray_offset(scene)
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    starts = np.ascontiguousarray(points + offset * unit, np.float32)

    def answer() -> npt.NDArray[Any]:
        lit = np.zeros((len(toward), len(points)), np.float32)
        for row, direction in zip(lit, toward, strict=True):
            faces = normals @ direction > 0.0
            rays = np.tile(direction.astype(np.float32), (int(faces.sum()), 1))
            row[faces] = traced.run(starts[faces], rays, query="OCCLUDED") != 0
        return lit

    return answer
