"""Surfaces that the light's rays run along: walls beside a sun or a lamp, the ground at sunrise."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest

import lixel as lx
from lixel.lab import hard_views
from lixel.scene import joined

LOOKUPS: dict[str, dict[str, object]] = {
    "auto": {},
    "auto_5x5": {"lookup": "auto_5x5"},
    "depth": {"lookup": "depth"},
    "constant": {"lookup": "depth", "bias": "constant"},
    "slope": {"lookup": "depth", "bias": "slope"},
    "receiver_plane": {"lookup": "depth", "bias": "receiver_plane"},
    "triangle": {"lookup": "triangle"},
    "triangle_1x1": {"lookup": "triangle_1x1"},
    "triangle_5x5": {"lookup": "triangle_5x5"},
    "pcf": {"lookup": lx.Pcf(radius=2.0, samples=16)},
    "soft": {"lookup": lx.Pcf(radius=0.05, samples=16, space="unwarped")},
}
OF_DIRECTIONAL = lx.methods.MAP_METHODS
OF_POINT = (
    "cube",
    "dual_paraboloid",
    "improved_paraboloid",
    "cube+notw",
    "dual_paraboloid+rtw",
    "lispsm",
)

COSINES = (5e-3, 1e-3, 1e-5, 1e-8, 1e-16, 0.0)
"""Of the angle between the wall's normal and the light: less than half a degree from its plane."""

ONE_DEGREE = math.sin(math.radians(1.0))

MIDDLE = np.array([2.0, 1.5, 0.0])
"""Of the wall that faces along x."""


def box(low: tuple[float, ...], high: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    vertices, faces = hard_views.created("box")
    return (vertices + 0.5) * np.subtract(high, low) + low, faces


@cache
def house(has_roof: bool) -> lx.Scene:
    """A block on the ground, and above it a roof that juts out over its wall."""
    parts = [box((-30, -1, -30), (30, 0, 30)), box((-2, 0, -4), (2, 3, 4))]
    roof = box((-3, 3, -16), (4, 3.2, 5))
    return joined([*parts, roof] if has_roof else parts)


CAMERA = lx.Camera.look_at((12.0, 1.5, 0.0), MIDDLE, yfov=0.5, width=96, height=54)


def towards(cosine: float) -> np.ndarray:
    """To a light 15 degrees above the horizon, along the wall but for its cosine."""
    return np.array([cosine, math.sin(0.26), -math.cos(0.26)])


def sun(cosine: float) -> lx.DirectionalLight:
    return lx.DirectionalLight(-towards(cosine))


def lamp(cosine: float) -> lx.PointLight:
    """Beyond the end of the roof, which is between it and all of the wall."""
    return lx.PointLight(MIDDLE + 20.0 * towards(cosine))


@cache
def wall() -> np.ndarray:
    """Pixels of the wall, away from its edges."""
    frame = lx.render(house(False), CAMERA, sun(0.5), "exact")
    x, y, z = np.moveaxis(frame.position, -1, 0)
    return (np.abs(x - 2.0) < 1e-4) & (np.abs(y - 1.5) < 1.2) & (np.abs(z) < 3.5)


def lit_pixels(has_roof: bool, light: lx.Light, method: str, lookup: str) -> float:
    made = dataclasses.replace(lx.method_from(method), resolution=512, **LOOKUPS[lookup])
    return float(lx.render_shadows(house(has_roof), CAMERA, light, made)[wall()].sum())


@pytest.mark.parametrize("lookup", LOOKUPS)
@pytest.mark.parametrize(
    ("make", "method"),
    [(sun, method) for method in OF_DIRECTIONAL] + [(lamp, method) for method in OF_POINT],
)
def test_a_wall_along_the_rays_under_a_roof_is_dark(make, method, lookup):
    """Rounding over the cosine was more than the way to the roof: all of the wall was lit."""
    count = wall().sum()
    assert count > 1000
    for cosine in COSINES:
        # One texel alone leaks along the edges of the casters' triangles.
        most = 0.02 * count if lookup == "triangle_1x1" else 3
        at_one_degree = lit_pixels(True, make(ONE_DEGREE), method, lookup)
        assert lit_pixels(True, make(cosine), method, lookup) <= at_one_degree + most, cosine


@pytest.mark.parametrize("lookup", LOOKUPS)
@pytest.mark.parametrize(
    ("make", "method"),
    [(sun, method) for method in OF_DIRECTIONAL] + [(lamp, method) for method in OF_POINT],
)
def test_a_wall_along_the_rays_without_a_roof_is_lit(make, method, lookup):
    """Beside its rays are its top, and the ground, which is nearer than its plane there."""
    count = wall().sum()
    at_one_degree = lit_pixels(False, make(ONE_DEGREE), method, lookup)
    for cosine in (5e-3, 1e-3, 1e-5):
        assert lit_pixels(False, make(cosine), method, lookup) >= at_one_degree - 0.003 * count, (
            cosine
        )
    assert at_one_degree >= 0.9 * count or lookup in ("constant", "pcf", "slope")


@pytest.mark.parametrize("method", ["exact", "ray_traced"])
@pytest.mark.parametrize("make", [sun, lamp])
def test_methods_without_a_map_know_it(make, method):
    for cosine in COSINES:
        dark = lx.render_shadows(house(True), CAMERA, make(cosine), method)
        assert (dark[wall()] == 0).all()
    for cosine in (5e-3, 1e-5):
        free = lx.render_shadows(house(False), CAMERA, make(cosine), method)
        assert (free[wall()] == 1).all()


@pytest.mark.parametrize("method", OF_DIRECTIONAL)
def test_ground_under_a_low_sun_is_lit_as_at_one_degree(method):
    """Within a texel the plane of the ground went below all that stands on it."""
    made = dataclasses.replace(lx.method_from(method), resolution=512)
    wrong = {}
    for degrees in (1.0, 0.5, 0.1, 0.03, 0.01, 1e-3, 1e-4):
        view = hard_views._blocks_lit_by(hard_views.sun_at(90.0, degrees))
        wrong[degrees] = lx.compare(lx.render(*view, made), lx.reference(*view)).misclassified_count
    assert max(wrong.values()) <= wrong[1.0] + 8, wrong
