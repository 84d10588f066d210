"""The pytest plugin: the fixture `assert_shadows_match`, and where its pictures go.

pytest finds it by its entry point; nothing needs to be imported. In a test::

    def test_shadows_of_my_renderer(assert_shadows_match):
        truth = lx.reference(scene, camera, light)
        assert_shadows_match(my_renderer(scene, camera, light), truth, max_misclassified=0.001)

On failure the picture with the misclassified pixels in red is in the test's `tmp_path`, or in the
folder of ``--lixel-artifacts``, named after the test.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from pathlib import Path

import numpy.typing as npt
import pytest

from . import testing
from .receivers import Receivers
from .reference import Reference


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.getgroup("lixel").addoption(
        "--lixel-artifacts",
        type=Path,
        metavar="FOLDER",
        help="where pictures of wrong shadows go; default: the test's tmp_path",
    )


@pytest.fixture
def assert_shadows_match(request: pytest.FixtureRequest, tmp_path: Path) -> Callable[..., None]:
    """`lixel.testing.assert_shadows_match` that saves its picture on failure.

    A failed test keeps one picture for each call that failed, `TEST.png`, `TEST-2.png` and so on.
    """
    folder: Path = request.config.getoption("--lixel-artifacts") or tmp_path
    names = [request.path.stem, *request.node.nodeid.split("::")[1:]]
    # Those of parametrized tests hold brackets.
    stem = re.sub(r"[^\w.-]+", "-", "-".join(names)).strip("-")
    numbers = itertools.count(1)

    def check(
        visibility: npt.ArrayLike | Receivers,
        reference: Reference | npt.ArrayLike,
        *,
        max_misclassified: int | float = 0,
    ) -> None:
        __tracebackhide__ = True
        number = next(numbers)
        folder.mkdir(parents=True, exist_ok=True)
        picture = folder / f"{stem}{f'-{number}' if number > 1 else ''}.png"
        testing.assert_shadows_match(
            visibility, reference, max_misclassified=max_misclassified, picture=picture
        )

    return check
