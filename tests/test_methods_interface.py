"""The methods as Python sees them agree with the one list in the core."""

from __future__ import annotations

import dataclasses

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
