"""The scene generators: the same bytes every time, of the size they say, with something to see."""

from __future__ import annotations

import re

import numpy as np
import pytest

import lixel as lx
from lixel.scenes import GENERATORS

SMALL = {
    "plane_and_box": {},
    "objects_on_floor": {"count": 9, "subdivisions": 1},
    "colonnade": {"columns": 3, "detail": 8},
    "city": {"blocks": 3},
    "grass": {"blades": 5000},
    "needles": {},
    "terrain": {"cells": 20},
}


def test_every_generator_is_listed():
    assert set(lx.scenes.__all__) == set(GENERATORS) == set(SMALL)


@pytest.mark.parametrize("name", GENERATORS)
def test_same_bytes_and_no_degenerate_triangles(name):
    first, second = (GENERATORS[name](**SMALL[name]) for _ in range(2))
    assert np.array_equal(first.vertices, second.vertices)
    assert np.array_equal(first.faces, second.faces)
    assert first.cameras == second.cameras
    assert first.lights == second.lights
    assert first.degenerate_count == 0


@pytest.mark.parametrize("name", [n for n in GENERATORS if n not in ("plane_and_box", "colonnade")])
def test_seeds_matter_where_there_are_any(name):
    first, second = (GENERATORS[name](**SMALL[name], seed=seed) for seed in (1, 2))
    assert not np.array_equal(first.vertices, second.vertices)


@pytest.mark.parametrize("name", GENERATORS)
def test_docstrings_tell_the_triangle_count(name):
    generator = GENERATORS[name]
    count = int(re.search(r"([\d,]+) triangles", generator.__doc__)[1].replace(",", ""))
    assert generator().triangle_count == count


@pytest.mark.parametrize("name", GENERATORS)
def test_the_default_view_shows_lit_and_shadowed_surfaces(name):
    scene = GENERATORS[name](**SMALL[name])
    camera, light = scene.cameras["default"].resized(96, 54), scene.lights["default"]
    truth = lx.reference(scene, camera, light)
    assert np.mean(truth.covered) > 0.2
    lit = np.nanmean(truth.visibility)
    assert 0.05 < lit < 0.98


def test_parameters_are_checked():
    with pytest.raises(ValueError, match=r"count must be at least 1 .* got 0"):
        lx.scenes.objects_on_floor(count=0)
    with pytest.raises(ValueError, match="subdivisions must be an integer from 0 to 6, got 9"):
        lx.scenes.objects_on_floor(subdivisions=9)
    with pytest.raises(ValueError, match=r"columns must be at least 2 .* got 1"):
        lx.scenes.colonnade(columns=1)
    with pytest.raises(TypeError, match=r"blades must be an integer, got 0.5"):
        lx.scenes.grass(blades=0.5)
