"""Map the hours of sun that a town gets: every point of it against every position of the sun."""

from __future__ import annotations

import argparse
import math
import time
from pathlib import Path

import numpy as np
import numpy.typing as npt

from .. import scenes
from ..arguments import needs
from ..camera import Camera
from ..light import DirectionalLight
from ..pictures import plots
from ..points import shadows_at
from ..reference import reference
from .options import PICTURES, add_output, natural
from .report import status, waiting

TILT = math.radians(23.44)
"""Of the Earth's axis."""

DAYS = tuple(range(15, 346, 30))
"""Of the year, about one in each month."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab sun_hours`."""
    parser.add_argument("--latitude", type=float, default=49.0, help="degrees north (49)")
    parser.add_argument("--size", type=natural, default=480, help="pixels along each side (480)")
    add_output(parser, "the picture (sun_hours.png)", PICTURES, default=Path("sun_hours.png"))


def run(options: argparse.Namespace) -> None:
    """Find the hours and draw them."""
    suns = suns_of_year(options.latitude)
    scene = scenes.city(blocks=12)
    low, high = scene.bounds
    # From above, north at the top: a plan of roofs and streets, all at one scale.
    plan = Camera.look_at(
        ((low[0] + high[0]) / 2, 2 * high[1], (low[2] + high[2]) / 2),
        ((low[0] + high[0]) / 2, 0.0, (low[2] + high[2]) / 2),
        (0, 0, -1),
        ymag=0.4 * float(high[2] - low[2]),
        width=options.size,
        height=options.size,
    )
    seen = reference(scene, plan, suns[0])
    points, normals = seen.position[seen.covered], seen.normal[seen.covered]
    start = time.perf_counter()
    with waiting(f"asking {len(points):,} points about {len(suns)} suns"):
        lit = shadows_at(scene, points, suns, normals)
    seconds = time.perf_counter() - start
    status(
        f"{len(points):,} points, {len(suns)} positions of the sun: {seconds:.2f} s, "
        f"{lit.size / seconds / 1e6:.1f} million answers a second"
    )
    hours = np.full(seen.covered.shape, np.nan)
    hours[seen.covered] = lit.sum(axis=0, dtype=np.float64) / len(DAYS)
    _draw(hours, options.output, options.line)


def suns_of_year(latitude: float) -> list[DirectionalLight]:
    """The sun at every hour of one day in each month, wherever it is above the horizon.

    Parameters
    ----------
    latitude : float
        Degrees north. X is east, Y is up, Z is south.
    """
    phi = math.radians(latitude)
    suns = []
    for day in DAYS:
        declination = TILT * math.sin(2 * math.pi * (284 + day) / 365)
        for hour in np.arange(0.5, 24.0):
            angle = math.radians(15.0 * (hour - 12.0))
            up = math.sin(phi) * math.sin(declination)
            up += math.cos(phi) * math.cos(declination) * math.cos(angle)
            east = -math.cos(declination) * math.sin(angle)
            south = math.sin(phi) * math.cos(declination) * math.cos(angle)
            south -= math.cos(phi) * math.sin(declination)
            if up > 0.0:
                suns.append(DirectionalLight((-east, -up, -south)))
    return suns


def _draw(hours: npt.NDArray[np.float64], path: Path, command: str) -> None:
    figure = needs("matplotlib.figure", "plot").Figure((8, 7), layout="constrained")
    axes = figure.subplots()
    image = axes.imshow(hours, cmap="inferno", interpolation="none")
    axes.set_axis_off()
    axes.set_title("Hours of sun on an average day of the year")
    figure.colorbar(image, shrink=0.8)
    plots.save(figure, path, command, dpi=72)
