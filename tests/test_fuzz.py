"""Inputs of every wrong kind, some of each; `python tests/tools/fuzz.py` for long."""

from __future__ import annotations

import random

import fuzz
import fuzz_guided
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings, strategies as st

import lixel as lx

# The same cases every time: what is found by chance is found by the long run.
SOME = settings(
    max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)


@pytest.mark.parametrize("case", [*fuzz.QUICK, *fuzz.SLOW], ids=lambda case: case.__name__)
def test_what_is_wrong_is_refused_in_words(case):
    @SOME
    @given(st.integers(0, 2**64))
    def run(seed):
        with np.errstate(all="ignore"):
            fuzz.attempt(case, random.Random(seed))

    run()


def test_a_panic_and_a_wordless_refusal_are_faults():
    def panics(_):
        raise BaseException("a panic")

    def has_no_words(_):
        raise ValueError

    with pytest.raises(BaseException, match="a panic"):
        fuzz.attempt(panics, random.Random(0))
    with pytest.raises(AssertionError, match="no words"):
        fuzz.attempt(has_no_words, random.Random(0))


def test_bytes_spell_out_random_numbers():
    r = fuzz_guided.FromBytes(bytes([0, 128, 1, 255, 7, 3]))
    assert r.random() == 0.5
    assert (r.getrandbits(8), r.getrandbits(4), r.randrange(8)) == (1, 15, 0)
    assert (r.randrange(2), r.choice("abc"), r.random()) == (0, "a", 0.0)
    # Guided inputs are none that the others refuse.
    for case in fuzz.QUICK:
        fuzz.attempt(case, fuzz_guided.FromBytes(bytes(range(256)) * 4))


def test_places_that_are_no_numbers_are_refused():
    for function in (lx.warp_points, lx.unwarp_points):
        with pytest.raises(ValueError, match=r"points must be numbers, got \[nan, 0.5\] in row 1"):
            function(fuzz.WARP, [[0.5, 0.5], [np.nan, 0.5]])


def test_an_angle_without_a_tangent_is_refused():
    with pytest.raises(ValueError, match=r"yfov must be an angle .* got 5e-324"):
        lx.Camera(np.eye(4), yfov=5e-324, width=8, height=8)
