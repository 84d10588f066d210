"""How many pixels each method may get wrong on each built-in scene.

The counts are of 640 x 360 pixels with the default parameters, ties left out, in the scene's own
light or, where a method needs a position, in a light above its middle. They are about a tenth above
what was measured: a change that makes a method worse fails here, and one that makes it better
should lower its bounds. `pytest -rP tests/test_methods.py` prints what is measured now.
"""

from __future__ import annotations

import dataclasses
from functools import cache

import pytest

import lixel as lx
from lixel.scenes import GENERATORS

# Fewer triangles where the default has a million and more.
ARGUMENTS = {"objects_on_floor": {"subdivisions": 3}, "terrain": {"cells": 300}}

# Raised: uniform, cascades, rtw and desired_view in colonnade. Maps turned across the scene's edges
# leave fewer wrong pixels over lights and scenes, but not in this view (desired_view 296 where an
# unturned map has 271). Sixteen turns instead of eight leave as many over 336 lights; in this view
# uniform has 380 for 330, cascades 53 for 43, rtw 120 for 104, desired_view 296 for 326. cascades
# has 789 for 737 in grass and 152 for 190 in objects_on_floor; four others have 2 to 9 % fewer in
# grass. Raised, too, where pixels are judged that were ties before: cascades in colonnade by one,
# shadow_volumes in grass by five.
MAX_WRONG = {
    "uniform": {
        "plane_and_box": 4,
        "objects_on_floor": 403,
        "colonnade": 418,
        "city": 29,
        "grass": 7827,
        "needles": 2393,
        "terrain": 497,
    },
    "desired_view": {
        "plane_and_box": 4,
        "objects_on_floor": 319,
        "colonnade": 325,
        "city": 19,
        "grass": 6600,
        "needles": 2429,
        "terrain": 492,
    },
    "min_sm": {
        "plane_and_box": 4,
        "objects_on_floor": 327,
        "colonnade": 342,
        "city": 68,
        "grass": 7825,
        "needles": 2547,
        "terrain": 454,
    },
    "focused": {
        "plane_and_box": 4,
        "objects_on_floor": 300,
        "colonnade": 266,
        "city": 58,
        "grass": 7797,
        "needles": 2468,
        "terrain": 414,
    },
    "lispsm": {
        "plane_and_box": 4,
        "objects_on_floor": 328,
        "colonnade": 144,
        "city": 33,
        "grass": 2543,
        "needles": 2160,
        "terrain": 626,
    },
    "log_psm": {
        "plane_and_box": 4,
        "objects_on_floor": 305,
        "colonnade": 133,
        "city": 36,
        "grass": 2800,
        "needles": 2395,
        "terrain": 588,
    },
    "trapezoidal": {
        "plane_and_box": 4,
        "objects_on_floor": 323,
        "colonnade": 139,
        "city": 46,
        "grass": 2810,
        "needles": 2281,
        "terrain": 981,
    },
    "psm": {
        "plane_and_box": 4,
        "objects_on_floor": 417,
        "colonnade": 316,
        "city": 89,
        "grass": 3202,
        "needles": 2541,
        "terrain": 1704,
    },
    "plane_optimal": {
        "plane_and_box": 6,
        "objects_on_floor": 223,
        "colonnade": 188,
        "city": 34,
        "grass": 2956,
        "needles": 1831,
        "terrain": 795,
    },
    "scene_optimized": {
        "plane_and_box": 4,
        "objects_on_floor": 268,
        "colonnade": 110,
        "city": 109,
        "grass": 2910,
        "needles": 1670,
        "terrain": 418,
    },
    "cascades": {
        "plane_and_box": 4,
        "objects_on_floor": 167,
        "colonnade": 59,
        "city": 13,
        "grass": 867,
        "needles": 1196,
        "terrain": 244,
    },
    "rtw": {
        "plane_and_box": 4,
        "objects_on_floor": 262,
        "colonnade": 132,
        "city": 15,
        "grass": 2652,
        "needles": 2037,
        "terrain": 469,
    },
    "notw": {
        "plane_and_box": 4,
        "objects_on_floor": 174,
        "colonnade": 62,
        "city": 23,
        "grass": 1570,
        "needles": 1605,
        "terrain": 235,
    },
    "ray_traced": dict.fromkeys(GENERATORS, 0),
    "improved_paraboloid": {
        "plane_and_box": 2,
        "objects_on_floor": 340,
        "colonnade": 342,
        "city": 74,
        "grass": 7600,
        "needles": 2600,
        "terrain": 460,
    },
    "cube": {
        "plane_and_box": 3,
        "objects_on_floor": 343,
        "colonnade": 185,
        "city": 144,
        "grass": 4488,
        "needles": 2326,
        "terrain": 21,
    },
    "dual_paraboloid": {
        "plane_and_box": 3,
        "objects_on_floor": 1305,
        "colonnade": 1628,
        "city": 575,
        "grass": 11_047,
        "needles": 3535,
        "terrain": 208,
    },
    "spot": {
        "plane_and_box": 3,
        "objects_on_floor": 464,
        "colonnade": 317,
        "city": 179,
        "grass": 5807,
        "needles": 2397,
        "terrain": 53,
    },
    # Texels as wide as pixels, wherever they are: fewer than those of the maps above.
    "virtual": {
        "plane_and_box": 1,
        "objects_on_floor": 307,
        "colonnade": 141,
        "city": 23,
        "grass": 1620,
        "needles": 2200,
        "terrain": 1280,
    },
    "exact": dict.fromkeys(GENERATORS, 0),
    "shadow_volumes": {
        "plane_and_box": 0,
        "objects_on_floor": 0,
        "colonnade": 2,
        "city": 4,
        "grass": 38,
        "needles": 30,
        "terrain": 9,
    },
}


@cache
def made(name: str) -> lx.Scene:
    return GENERATORS[name](**ARGUMENTS.get(name, {}))


@cache
def lit_by(name: str, light: lx.Light) -> tuple[lx.Scene, lx.Camera, lx.Light, lx.Reference]:
    scene = made(name)
    view = scene, scene.cameras["default"].resized(640, 360), light
    return *view, lx.reference(*view)


def view_and_truth(name: str) -> tuple[lx.Scene, lx.Camera, lx.Light, lx.Reference]:
    return lit_by(name, made(name).lights["default"])


def light_for(method: str, name: str) -> lx.Light:
    """The scene's light, or a light above its middle for a method that needs one."""
    scene = made(name)
    low, high = scene.bounds
    size = high - low
    position = (low + high) / 2 + (0.13 * size[0], 0.37 * size.max(), 0.07 * size[2])
    spot = lx.SpotLight(position, (-0.1, -1, 0.1), 0.9)
    lights = (scene.lights["default"], lx.PointLight(position), spot)
    return next(light for light in lights if lx.METHODS[method]().takes(light))


@pytest.mark.parametrize("method", lx.METHODS)
def test_every_method_has_a_bound_for_every_scene(method):
    assert set(MAX_WRONG[method]) == set(GENERATORS)


def test_every_bound_is_of_a_method():
    assert set(MAX_WRONG) == set(lx.METHODS)


# Scene by scene, so that each is made once and its reference is traced once.
@pytest.mark.parametrize("name", GENERATORS)
@pytest.mark.parametrize(
    ("device", "method"),
    [
        *((None, method) for method in lx.METHODS),
        *(("cpu", method) for method in lx.METHODS),
    ],
)
def test_misclassified_pixels(name, device, method):
    *view, truth = lit_by(name, light_for(method, name))
    result = lx.compare(lx.render(*view, method, device=device), truth)
    print(f"{method}, {name}: {result}")
    assert result.misclassified_count <= MAX_WRONG[method][name]
    # Ties are not counted, so there must be few.
    assert result.tie_count < 0.01 * result.covered_count


@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_finer_maps_are_less_wrong(method):
    *view, truth = view_and_truth("colonnade")
    chosen = lx.method_from(method)
    wrong = [
        lx.compare(
            lx.render(*view, dataclasses.replace(chosen, resolution=resolution)), truth
        ).misclassified_count
        for resolution in (128, 512, 2048)
    ]
    assert wrong[0] > 1.5 * wrong[1] > 2.25 * wrong[2]


@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_the_automatic_bias_is_among_the_best(method):
    """It is not the best on every scene: none is."""
    *view, truth = view_and_truth("objects_on_floor")
    wrong = {
        bias: lx.compare(
            lx.render(*view, lx.methods.MAP_METHODS[method](lookup="depth", bias=bias)), truth
        ).misclassified_count
        for bias in ("auto", "constant", "slope", "receiver_plane")
    }
    print(wrong)
    # Texels of a light matrix may be long; a slope's bias knows their direction.
    most = 1.25 if method in ("psm", "plane_optimal", "scene_optimized") else 1.15
    assert wrong["auto"] <= most * min(wrong.values())
    assert wrong["auto"] < 0.5 * wrong["constant"]
