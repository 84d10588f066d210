"""The lights."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import lixel as lx


@pytest.mark.parametrize("length", [1e-300, 1.0, 7, 1e300])
def test_direction_is_a_unit_vector_at_any_length(length):
    light = lx.DirectionalLight(np.array([3.0, 0.0, -4.0]) * length)
    assert np.allclose(light.direction, (0.6, 0.0, -0.8), atol=1e-15)


def test_a_pose_looks_along_minus_z_whatever_its_scale():
    pose = np.array([[0, 0, -2, 5], [0, 3, 0, 6], [4, 0, 0, 7], [0, 0, 0, 1]])
    assert lx.DirectionalLight.from_pose(pose) == lx.DirectionalLight((1, 0, 0))
    with pytest.raises(ValueError, match=r"pose must have shape \(4, 4\)"):
        lx.DirectionalLight.from_pose(np.eye(3))


@given(st.tuples(*3 * [st.floats(-1e3, 1e3)]).filter(any))
def test_lights_are_values(direction):
    light = lx.DirectionalLight(direction)
    for same in (
        pickle.loads(pickle.dumps(light)),
        eval(repr(light), {"DirectionalLight": lx.DirectionalLight}),
    ):
        assert same == light
        assert hash(same) == hash(light)
    assert light != lx.DirectionalLight(-light.direction)
    with pytest.raises(ValueError, match="read-only"):
        light.direction[0] = 1.0


def test_vectors_point_to_the_light():
    vectors = lx.DirectionalLight((0, -1, 0)).vectors_from(np.zeros((2, 5, 3)))
    assert np.array_equal(vectors, np.broadcast_to((0, 1, 0), (2, 5, 3)))


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
    with pytest.raises(error, match=words):
        lx.DirectionalLight(direction)
