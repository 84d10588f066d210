"""The methods as Python sees them agree with the one list in the core."""

from __future__ import annotations

import dataclasses

import pytest

import lixel as lx
from lixel import _core


def test_python_lists_what_the_core_lists():
    listed = {entry["name"]: entry["parameters"] for entry in _core.methods()}
    assert {name: cls().parameters() for name, cls in lx.METHODS.items()} == listed


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
        (None, TypeError, "method must be a name .* or a method object, got NoneType"),
    ],
)
def test_unknown_methods_are_named(method, error, words, view):
    with pytest.raises(error, match=words):
        lx.render_shadows(*view, method)


@pytest.mark.parametrize("method", lx.methods.MAP_METHODS.values())
@pytest.mark.parametrize(
    ("parameters", "error", "words"),
    [
        ({"resolution": 0}, ValueError, "resolution must be at least 1 .* got 0"),
        ({"resolution": -1}, ValueError, "resolution must be at least 1 .* got -1"),
        ({"resolution": 1024.0}, TypeError, "resolution must be an integer, got 1024.0"),
        ({"bias": "some"}, ValueError, "bias must be one of 'auto', .* got 'some'"),
        ({"bias": 0.1}, ValueError, "bias must be one of 'auto', .* got 0.1"),
        ({"constant_bias": -0.1}, ValueError, "constant_bias must be .* not negative, got -0.1"),
        ({"constant_bias": float("nan")}, ValueError, "constant_bias must be finite"),
        ({"constant_bias": "1"}, TypeError, "constant_bias must be a real number, got '1'"),
        ({"slope_bias": float("inf")}, ValueError, "slope_bias must be finite"),
        ({"slope_bias": None}, TypeError, "slope_bias must be a real number, got None"),
        ({"size": 3}, TypeError, "size"),
    ],
)
def test_bad_parameters_are_named(method, parameters, error, words):
    with pytest.raises(error, match=words):
        method(**parameters)
