"""The lights."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, strategies as st

import lixel as lx
from lixel.light import WITH_POSITION

EVERY_KIND = [
    lx.DirectionalLight((0.6, 0, -0.8)),
    lx.PointLight((1, 2, 3)),
    lx.SpotLight((1, 2, 3), (0, -1, 0), outer=0.5, inner=0.2),
    lx.HemisphereLight((1, 2, 3), (0, -1, 0)),
]


def name_of(light):
    return type(light).__name__


@pytest.mark.parametrize("length", [1e-300, 1.0, 7, 1e300])
def test_direction_is_a_unit_vector_at_any_length(length):
    vector = np.array([3.0, 0.0, -4.0]) * length
    for unit in (
        lx.DirectionalLight(vector).direction,
        lx.SpotLight((0, 0, 0), vector).direction,
        lx.HemisphereLight((0, 0, 0), vector).axis,
    ):
        assert np.allclose(unit, (0.6, 0.0, -0.8), atol=1e-15)


def test_a_pose_looks_along_minus_z_whatever_its_scale():
    pose = np.array([[0, 0, -2, 5], [0, 3, 0, 6], [4, 0, 0, 7], [0, 0, 0, 1]])
    assert lx.DirectionalLight.from_pose(pose) == lx.DirectionalLight((1, 0, 0))
    assert lx.PointLight.from_pose(pose) == lx.PointLight((5, 6, 7))
    spot = lx.SpotLight.from_pose(pose, outer=0.3)
    assert spot == lx.SpotLight((5, 6, 7), (1, 0, 0), outer=0.3)
    with pytest.raises(ValueError, match=r"pose must have shape \(4, 4\)"):
        lx.DirectionalLight.from_pose(np.eye(3))


def check_value(light):
    names = {name_of(light): type(light)}
    for same in (pickle.loads(pickle.dumps(light)), eval(repr(light), names)):
        assert same == light
        assert hash(same) == hash(light)


@given(st.tuples(*3 * [st.floats(-1e3, 1e3)]).filter(any))
def test_lights_are_values(direction):
    light = lx.DirectionalLight(direction)
    check_value(light)
    check_value(lx.SpotLight(direction, direction, 1.0, 0.5))
    assert light != lx.DirectionalLight(-light.direction)


@pytest.mark.parametrize("light", EVERY_KIND, ids=name_of)
def test_every_kind_is_an_immutable_value(light):
    check_value(light)
    assert [light == other for other in EVERY_KIND].count(True) == 1
    for name in light._fields:
        with pytest.raises(AttributeError, match="immutable"):
            setattr(light, name, 0.0)
        if isinstance(value := getattr(light, name), np.ndarray):
            with pytest.raises(ValueError, match="read-only"):
                value[0] = 1.0


def test_strength_is_kept():
    lamp = lx.PointLight((1, 2, 3), intensity=40, range=5)
    check_value(lamp)
    assert (lamp.intensity, lamp.range) == (40.0, 5.0)
    assert repr(lamp) == "PointLight((1.0, 2.0, 3.0), intensity=40.0, range=5.0)"
    assert lamp != lx.PointLight((1, 2, 3))
    check_value(lx.DirectionalLight((0, -1, 0), intensity=3.0))
    check_value(lx.SpotLight((0, 1, 0), (0, -1, 0), 0.5, 0.2, range=2.0))
    plain = lx.PointLight((1, 2, 3))
    assert (plain.intensity, plain.range) == (1.0, math.inf)


def test_what_is_beyond_the_range_is_dark_where_that_is_asked_for():
    scene = lx.Scene([[-9, 0, -9], [-9, 0, 9], [9, 0, 9], [9, 0, -9]], [[0, 1, 2], [0, 2, 3]])
    camera = lx.Camera.look_at((0, 5, 0.1), (0, 0, 0), yfov=1.5, width=40, height=30)
    frame = lx.render(scene, camera, lx.PointLight((0, 1, 0), range=2.0), "exact")
    assert (frame.visibility == 1.0).all()
    near = np.linalg.norm(frame.position - (0, 1, 0), axis=-1) <= 2.0
    assert near.any()
    assert not near.all()
    assert np.array_equal(frame.visibility_in_range, near.astype(np.float32))


def test_vectors_point_to_the_light():
    vectors = lx.DirectionalLight((0, -1, 0)).vectors_from(np.zeros((2, 5, 3)))
    assert np.array_equal(vectors, np.broadcast_to((0, 1, 0), (2, 5, 3)))
    for light in [light for light in EVERY_KIND if isinstance(light, WITH_POSITION)]:
        vectors = light.vectors_from(np.full((2, 5, 3), 0.5))
        assert np.array_equal(vectors, np.broadcast_to((0.5, 1.5, 2.5), (2, 5, 3)))


def test_cones_end_at_their_angle():
    angles = np.array([0.0, 0.4, 0.6, 1.5, 1.6, 3.0])
    around = np.array((1, 2, 3)) + np.stack([np.sin(angles), -np.cos(angles), 0 * angles], axis=-1)
    place, down = (1, 2, 3), (0, -1, 0)
    assert lx.PointLight(place).reaches(around).all()
    spot, half = lx.SpotLight(place, down, outer=0.5), lx.HemisphereLight(place, down)
    assert spot.reaches(around).tolist() == [True, True, False, False, False, False]
    assert half.reaches(around).tolist() == [True, True, True, True, False, False]


@pytest.mark.parametrize(
    ("direction", "error", "words"),
    [
        ((0, 0, 0), ValueError, r"direction must not have zero length, got \[0.0, 0.0, 0.0\]"),
        ((0, np.nan, 1), ValueError, "direction must be finite"),
        ((0, np.inf, 1), ValueError, "direction must be finite"),
        ((0, 1), ValueError, r"direction must have shape \(3,\), got \(2,\)"),
        (("a", "b", "c"), TypeError, "direction must be an array of real numbers"),
        ((True, False, True), TypeError, "direction must be an array of real numbers"),
    ],
)
def test_bad_directions_are_named(direction, error, words):
    for make in (lx.DirectionalLight, lambda d: lx.SpotLight((0, 0, 0), d)):
        with pytest.raises(error, match=words):
            make(direction)
    with pytest.raises(error, match=words.replace("direction", "axis")):
        lx.HemisphereLight((0, 0, 0), direction)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: lx.PointLight((0, 1)), r"position must have shape \(3,\)"),
        (lambda: lx.PointLight((0, 1, np.inf)), "position must be finite"),
        (lambda: lx.SpotLight((0, 0, 0), (0, -1, 0), outer=0.0), "outer must be above 0"),
        (lambda: lx.SpotLight((0, 0, 0), (0, -1, 0), outer=1.6), "outer must be above 0"),
        (lambda: lx.SpotLight((0, 0, 0), (0, -1, 0), outer=math.nan), "outer must be above 0"),
        (lambda: lx.SpotLight((0, 0, 0), (0, -1, 0), 0.5, 0.5), "inner must be at least 0"),
        (lambda: lx.PointLight((0, 0, 0), range=0.0), "range must be above 0, got 0.0"),
        (lambda: lx.DirectionalLight((0, 0, 1), intensity=-1.0), "intensity must be at least 0"),
    ],
)
def test_bad_values_are_named(make, words):
    with pytest.raises(ValueError, match=words):
        make()
