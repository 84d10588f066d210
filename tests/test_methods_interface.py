"""The methods as Python sees them agree with the one list in the core."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest

import lixel as lx
from lixel import _core


def test_python_lists_what_the_core_lists():
    assert list(lx.METHODS) == [entry["name"] for entry in _core.methods()]
    for entry in _core.methods():
        assert entry["parameters"] == _core.parameters(entry["name"])


@pytest.mark.parametrize("name", lx.METHODS)
def test_every_method_explains_itself(name):
    method = lx.METHODS[name]
    assert method.name == name
    assert getattr(lx, method.__name__) is method
    assert method.__name__ in lx.__all__
    for part in ("Limits:", ".. math::", "References\n"):
        assert part in (method.__doc__ or ""), part


@pytest.mark.parametrize("entry", _core.methods(), ids=lambda e: e["name"])
def test_every_method_of_the_core_has_a_title_and_a_citation(entry):
    assert entry["title"]
    assert entry["citation"]


def test_names_and_objects():
    assert lx.method_from("uniform") == lx.Uniform()
    method = lx.DesiredView(resolution=64)
    assert lx.method_from(method) is method
    assert lx.method_from("min_sm+notw") == lx.NonOrthogonalWarp(fit="min_sm")
    assert lx.method_from("scene_optimized+rtw") == lx.RectilinearWarp(fit="scene_optimized")
    assert lx.method_from("principal_axes + rtw") == lx.RectilinearWarp(fit="principal_axes")
    assert dataclasses.replace(method, bias="slope").resolution == 64


@pytest.mark.parametrize(
    ("method", "error", "words"),
    [
        ("unifrom", ValueError, "one of 'uniform', 'desired_view', .*, got 'unifrom'"),
        ("", ValueError, "one of 'uniform', 'desired_view', .*, got ''"),
        ("uniform+wrap", ValueError, "where 'wrap' is unknown"),
        ("uniform+desired_view", ValueError, "joins what cannot be joined; known: 'uniform'"),
        (lx.Uniform, TypeError, r"got the class itself"),
        (7, TypeError, "method must be a name .* or a method object, got int"),
    ],
)
def test_unknown_methods_are_named(method, error, words, view):
    with pytest.raises(error, match=words):
        lx.render_shadows(*view, method)


@pytest.mark.parametrize("method", lx.METHODS.values())
def test_unknown_parameters_are_named(method):
    with pytest.raises(TypeError, match="size"):
        method(size=3)


def test_parameters_go_by_name():
    small = lx.NonOrthogonalWarp(fit="cube", resolution=64, lookup="triangle")
    assert lx.method_from("cube+notw", resolution=64, lookup="triangle") == small
    assert lx.method_from(lx.Uniform(bias="slope"), resolution=64) == lx.Uniform(
        bias="slope", resolution=64
    )
    published = lx.method_from("rtw@published", resolution=64)
    assert published == lx.RectilinearWarp.published(resolution=64)
    assert lx.method_from("auto", max_error=0.1) == lx.Auto(max_error=0.1)


def test_rendering_takes_parameters_by_name(view, engine):
    coarse = lx.Uniform(resolution=8)
    assert lx.render(*view, "uniform", resolution=8).method == coarse
    shadows = lx.render_shadows(*view, method="uniform", resolution=8)
    np.testing.assert_array_equal(shadows, lx.render_shadows(*view, coarse))
    assert lx.importance_map(*view, "rtw", importance_resolution=8).shape == (1, 8, 8)
    assert lx.warp_map(*view, importance_resolution=8).shape == (1, 2, 1, 9)


@pytest.mark.parametrize(
    ("method", "parameters", "error", "words"),
    [
        ("rtw", {"blurr": 1}, TypeError, "parameter of RectilinearWarp must be one of resolution"),
        ("cube+rtw", {"blurr": 1}, TypeError, "got 'blurr'; did you mean 'blur'?"),
        (lx.Uniform(), {"size": 9}, TypeError, "parameter of Uniform must be one of resolution"),
        ("rtw", {"resolution": 0}, ValueError, "resolution must be a whole number of texels from"),
        (None, {"resolution": 9}, TypeError, "resolution must come with a method, got None"),
    ],
)
def test_wrong_parameters_are_answered_with_the_known_ones(method, parameters, error, words, view):
    with pytest.raises(error, match=re.escape(words)):
        lx.render_shadows(*view, method, **parameters)
