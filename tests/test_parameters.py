"""Parameters are declared in the core; classes, types and docstrings agree with it."""

from __future__ import annotations

import dataclasses
import pickle
import re
import types
import typing
from typing import Any, Literal

import numpy as np
import pytest

import lixel as lx
from lixel import _core

FILTERS = (lx.Pcf, lx.Variance, lx.ExponentialVariance, lx.Moments)
CLASSES = {**lx.METHODS, "auto": lx.Auto, **{cls.name: cls for cls in FILTERS}}
DECLARED = [
    pytest.param(cls, parameter, id=f"{name}-{parameter['name']}")
    for name, cls in CLASSES.items()
    for parameter in _core.parameters(name)
]
TYPES: dict[str, set[Any]] = {
    "flag": {bool},
    "count": {int},
    "map_size": {int, tuple[int, int]},
    "number": {float},
    "lookup": set(FILTERS),
    "choice": set(),
}


def parts_of(hint: Any) -> tuple[Any, ...]:
    """A | B: A and B."""
    is_union = typing.get_origin(hint) in (typing.Union, types.UnionType)
    return typing.get_args(hint) if is_union else (hint,)


def docstrings(cls: type) -> str:
    """Those of the class and its bases."""
    return "\n".join(base.__doc__ or "" for base in cls.__mro__ if base is not object)


@pytest.mark.parametrize("name", CLASSES)
def test_the_fields_are_the_declared_parameters(name):
    declared = {parameter["name"]: parameter["default"] for parameter in _core.parameters(name)}
    fields = {field.name: field.default for field in dataclasses.fields(CLASSES[name])}
    assert fields == declared
    assert CLASSES[name]().parameters() == declared


@pytest.mark.parametrize(("cls", "parameter"), DECLARED)
def test_types_are_those_of_the_rules(cls, parameter):
    hints = set(parts_of(typing.get_type_hints(cls)[parameter["name"]]))
    assert (type(None) in hints or Any in hints) == parameter["is_optional"]
    if parameter["rule"] in TYPES:
        words = [hint for hint in hints if typing.get_origin(hint) is Literal]
        assert [list(typing.get_args(hint)) for hint in words] == (
            [parameter["choices"]] if parameter["choices"] else []
        )
        assert hints - {*words, type(None)} == TYPES[parameter["rule"]]


@pytest.mark.parametrize(("cls", "parameter"), DECLARED)
def test_parameters_and_their_choices_are_described(cls, parameter):
    described = re.search(
        rf"^    {parameter['name']} : (.*\n(?:(?:        .*)?\n)*)", docstrings(cls), re.MULTILINE
    )
    assert described
    text = docstrings(cls) if parameter["rule"] == "product" else described[1]
    for choice in parameter["choices"]:
        assert f'"{choice}"' in text, choice
    if parameter["rule"] == "choice":
        listed = re.search(r"^\{(.*?)\}", described[1])
        if listed:
            assert set(re.findall('"(.*?)"', listed[1])) == set(parameter["choices"])
    if parameter["is_optional"]:
        assert re.search("optional|None", described[1])


def test_a_field_that_is_not_declared_fails():
    @dataclasses.dataclass(frozen=True, kw_only=True)
    class Coloured(lx.Uniform):
        colour: str = "red"

    with pytest.raises(ValueError, match=r"'uniform' has the parameters resolution.* got 'colour'"):
        Coloured()


SIZES = "texels from 1 to 32768, or (width, height) of such numbers"
BAD: list[tuple[str, str, Any, type[Exception], str]] = [
    ("uniform", "resolution", 0, ValueError, f"a whole number of {SIZES}, got 0"),
    ("uniform", "resolution", 10**30, ValueError, f"{SIZES}, got {10**30}"),
    ("uniform", "resolution", 1.5, TypeError, f"{SIZES}, got 1.5"),
    ("uniform", "resolution", True, TypeError, f"{SIZES}, got True"),
    ("uniform", "resolution", [], TypeError, f"{SIZES}, got []"),
    ("uniform", "resolution", (64, 0), ValueError, f"{SIZES}, got (64, 0)"),
    ("uniform", "resolution", (32769, 1), ValueError, f"{SIZES}, got (32769, 1)"),
    ("uniform", "resolution", (10**30, 1), ValueError, f"{SIZES}, got ({10**30}, 1)"),
    ("uniform", "resolution", (64, 32, 3), TypeError, f"{SIZES}, got (64, 32, 3)"),
    ("uniform", "resolution", (64, 1.5), TypeError, f"{SIZES}, got (64, 1.5)"),
    ("uniform", "resolution", (64, True), TypeError, f"{SIZES}, got (64, True)"),
    ("uniform", "resolution", "64x32", TypeError, f"{SIZES}, got '64x32'"),
    ("virtual", "resolution", (64, 32), ValueError, "one whole number of texels with method 'virt"),
    ("exact", "resolution", (64, 32), TypeError, "texels from 1 to 4096 or None, got (64, 32)"),
    ("rtw", "analysis_resolution", (64, 32), TypeError, "texels from 1 to 32768, got (64, 32)"),
    ("uniform", "bias", "much", ValueError, "'slope', 'receiver_plane', got 'much'"),
    ("uniform", "bias", 0.1, TypeError, "'slope', 'receiver_plane', got 0.1"),
    ("uniform", "slope_bias", None, TypeError, "a finite number, at least 0, got None"),
    ("uniform", "slope_bias", np.inf, ValueError, "a finite number, at least 0, got inf"),
    ("uniform", "constant_bias", "1", TypeError, "at least 0 or None, got '1'"),
    ("uniform", "tessellation", 0, ValueError, "above 0 and at most 1 or None, got 0"),
    ("uniform", "lookup", "pcf", ValueError, "'moments' or a lixel.Pcf, Variance, Exponential"),
    ("uniform", "lookup", 3, TypeError, "or a lixel.Pcf, Variance, ExponentialVariance or Moments"),
    ("uniform", "lookup", lx.Uniform(), TypeError, "or Moments, got <class 'lixel"),
    ("desired_view", "snap", 1, TypeError, "True or False, got 1"),
    ("cascades", "layers", 9, ValueError, "a whole number of layers from 1 to 8, got 9"),
    ("cascades", "layers", 0, ValueError, "a whole number of layers from 1 to 8, got 0"),
    ("rtw", "importance", "distance*count", ValueError, "'boundary', got 'count'"),
    ("rtw", "importance", (), ValueError, "'boundary', got ''"),
    ("rtw", "importance", [1], TypeError, "'boundary', got [1]"),
    ("rtw", "edge_floor", 2, ValueError, "a number from 0 to 1, got 2"),
    ("rtw", "pixel_weights", [[1, -1]], ValueError, "at least 0 or None, got -1"),
    ("rtw", "pixel_weights", [1, 2], ValueError, "got shape (2,)"),
    ("rtw", "pixel_weights", [[1], [1, 2]], ValueError, "got a ragged list"),
    ("rtw", "pixel_weights", [["1"]], TypeError, "at least 0 or None, got [['1']]"),
    ("rtw", "map_weights", np.ones((0, 3)), ValueError, "got shape (0, 3)"),
    ("rtw", "previous", 3, TypeError, "a frame with finite maps and matrices or None, got 3"),
    ("scene_optimized", "previous", "last", TypeError, "shape (4, 4) or None, got 'last'"),
    ("scene_optimized", "previous", np.ones((3, 4)), ValueError, "got shape (3, 4)"),
    ("scene_optimized", "previous", [[1.0, 0, 0, np.nan]] * 4, ValueError, "shape (4, 4) or None"),
]


@pytest.mark.parametrize(("name", "parameter", "value", "error", "words"), BAD)
def test_both_entries_refuse_in_the_same_words(name, parameter, value, error, words, view):
    scene, camera, light = view
    with pytest.raises(error) as of_class:
        CLASSES[name](**{parameter: value})
    assert str(of_class.value).startswith(f"{parameter} must be ")
    assert words in str(of_class.value)
    core = (scene._core, camera._core_for(scene), [light._core])
    with pytest.raises(error) as of_core:
        _core.render(*core, (name, {parameter: value}), [])
    assert str(of_core.value) == str(of_class.value)


def test_values_are_kept_in_one_form():
    method = lx.RectilinearWarp(
        resolution=np.uint16(64),
        snap=np.bool_(True),
        slope_bias=np.float32(2),
        constant_bias=1,
        importance=("normal", "distance"),
        map_weights=[[1, 2], [3, 4]],
        lookup=lx.Pcf(samples=np.int64(3)),
    )
    assert [type(getattr(method, name)) for name in ("resolution", "snap", "constant_bias")] == [
        int,
        bool,
        float,
    ]
    assert method.importance == "distance*normal"
    assert type(method.lookup.samples) is int
    weights = method.map_weights
    assert isinstance(weights, np.ndarray)
    assert weights.dtype == np.float32
    assert weights.flags.c_contiguous
    assert not weights.flags.writeable
    assert pickle.loads(pickle.dumps(method)) == method
    assert dataclasses.replace(method, blur=1.0).blur == 1.0
    matrix = lx.SceneOptimized(previous=np.arange(16).reshape(4, 4)).previous
    assert matrix == ((0, 1, 2, 3), (4, 5, 6, 7), (8, 9, 10, 11), (12, 13, 14, 15))


def test_rules_between_parameters_are_asked_at_once():
    with pytest.raises(ValueError, match="snap must come with one of the fits"):
        lx.RectilinearWarp(fit="min_sm", snap=True)
    with pytest.raises(ValueError, match="analysis must be 'forward' or 'hybrid'"):
        lx.RectilinearWarp(importance="shadow_edge")
    with pytest.raises(ValueError, match="analysis must be 'backward' or 'hybrid'"):
        lx.RectilinearWarp(importance="boundary", analysis="forward")
    with pytest.raises(ValueError, match=r"function_count must be at most .*, 64, got 65"):
        lx.NonOrthogonalWarp(importance_resolution=64, function_count=65)
    with pytest.raises(ValueError, match="function_count must be at most 255 with a map of 32768"):
        lx.NonOrthogonalWarp(resolution=32768, importance_resolution=2048, function_count=2000)
