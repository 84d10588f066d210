"""The assertion for other people's tests, and the plugin that brings it to pytest."""

import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import lixel as lx
from lixel.compare import FALSE_LIT
from lixel.testing import assert_shadows_match

pytest_plugins = ["pytester"]

SUITE = """
    import numpy as np
    import pytest

    TRUTH = np.array([[1, 0], [0, np.nan]], np.float32)

    def test_right(assert_shadows_match):
        assert_shadows_match(TRUTH, TRUTH)

    @pytest.mark.parametrize("value", [0.0, 1.0])
    def test_wrong(assert_shadows_match, value):
        seen = np.where(np.isnan(TRUTH), np.nan, value)
        with pytest.raises(AssertionError):
            assert_shadows_match(seen, TRUTH)
        assert_shadows_match(seen, TRUTH, max_misclassified=2)
        assert_shadows_match(seen, TRUTH, max_misclassified=0.1)
"""


@pytest.fixture
def suite(pytester):
    pytester.makepyfile(test_suite=SUITE)
    pyproject = (Path(__file__).parents[1] / "pyproject.toml").read_text()
    # As pytest finds it where lixel is installed.
    (module,) = re.findall(
        r'^\[project\.entry-points\.pytest11\]\nlixel = "([\w.]+)"$', pyproject, re.M
    )
    # In a process of its own: the plugin may be loaded in this one.
    return lambda *options: pytester.runpytest_subprocess(*plugin(pytester, module), *options)


def plugin(pytester, module):
    loaded = "lixel" in {e.name for e in entry_points()}
    return [] if loaded else ["-p", module]


def entry_points():
    from importlib.metadata import entry_points

    return entry_points(group="pytest11")


def test_failures_leave_pictures(suite, pytester):
    result = suite(f"--lixel-artifacts={pytester.path / 'red'}")
    result.assert_outcomes(passed=1, failed=2)
    result.stdout.fnmatch_lines(
        ["E*AssertionError: 2 pixels misclassified, at most 0 allowed: 2 false lit*"]
    )
    names = {path.name for path in (pytester.path / "red").iterdir()}
    assert names == {
        f"test_suite-test_wrong-{value}{number}.png"
        for value in ("0.0", "1.0")
        for number in ("", "-3")
    }
    picture = np.asarray(
        Image.open(pytester.path / "red" / "test_suite-test_wrong-1.0.png").convert("RGB")
    )
    assert picture[0, 1].tolist() == list(FALSE_LIT)


def test_without_a_folder_pictures_are_with_the_test(suite, pytester):
    result = suite("--basetemp", str(pytester.path / "tmp"))
    result.assert_outcomes(passed=1, failed=2)
    # pytest links to the newest folder of each test.
    found = {path.resolve() for path in (pytester.path / "tmp").glob("*/test_suite*.png")}
    assert len(found) == 4


def test_an_integer_is_pixels_and_a_float_a_share():
    truth = np.ones((10, 10), np.float32)
    seen = truth.copy()
    seen[0, :3] = 0.0
    assert_shadows_match(seen, truth, max_misclassified=3)
    assert_shadows_match(seen, truth, max_misclassified=np.int64(3))
    assert_shadows_match(seen, truth, max_misclassified=0.03)
    for limit in (2, 0.029, 0.0, 0):
        with pytest.raises(AssertionError, match="3 pixels misclassified"):
            assert_shadows_match(seen, truth, max_misclassified=limit)


@pytest.mark.parametrize("limit", [-1, 1.0, float("nan"), float("inf")])
def test_limits_out_of_range_are_refused(limit):
    with pytest.raises(ValueError, match="max_misclassified must be a number of pixels"):
        assert_shadows_match([[1.0]], [[1.0]], max_misclassified=limit)


def test_frames_and_references_are_taken(view, truth):
    frame = lx.render(*view, lx.DesiredView(resolution=2048))
    assert_shadows_match(frame, truth, max_misclassified=0.01)
    with pytest.raises(AssertionError):
        assert_shadows_match(lx.render(*view, lx.Uniform(resolution=4)), truth, max_misclassified=5)
