"""Fixtures that the tests share: a small view, the truth for it, and the engines."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import NamedTuple

import pytest

import lixel as lx

# The engine of all tests that name none. With "gpu", the shaders are tested as well, on whatever
# adapter there is: by these tests, and by those that take the fixture `engine`.
DEVICE = os.environ.setdefault("LIXEL_DEVICE", "cpu")
TESTS_SHADERS = DEVICE != "cpu"
ENGINES = ("gpu", "cpu") if TESTS_SHADERS else ("cpu",)


class View(NamedTuple):
    scene: lx.Scene
    camera: lx.Camera
    light: lx.DirectionalLight


@pytest.fixture
def view() -> View:
    """A box on a plane, 96 x 64 pixels: a shadow that can be worked out by hand."""
    scene = lx.scenes.plane_and_box()
    return View(scene, scene.cameras["default"].resized(96, 64), scene.lights["default"])


@pytest.fixture
def truth(view: View) -> lx.Reference:
    return lx.reference(*view)


@pytest.fixture(scope="module", params=ENGINES)
def engine(request: pytest.FixtureRequest) -> Iterator[str]:
    """The engines that are tested, in turn, as the device of all that names none."""
    with pytest.MonkeyPatch.context() as patch:
        if request.param == "cpu":
            patch.setenv("LIXEL_DEVICE", "cpu")
        yield request.param


@pytest.fixture(autouse=True)
def _leave_out_what_differs(request: pytest.FixtureRequest) -> None:
    marker = request.node.get_closest_marker("not_on_cpu")
    takes_both = "engine" in request.fixturenames
    engine = request.getfixturevalue("engine") if takes_both else os.environ["LIXEL_DEVICE"]
    if marker is not None and engine == "cpu":
        pytest.skip(f"on the CPU engine: {marker.args[0]}")


@pytest.fixture
def ray_queries() -> lx.RayTraced:
    """`ray_traced` by the device's own ray queries; skips, and says so, where it has none."""
    device = lx.info().device
    assert device is not None
    if "EXPERIMENTAL_RAY_QUERY" not in device.get("used_features", ()):
        pytest.skip(f"{device['name']} ({device['driver']}) has no ray queries")
    return lx.RayTraced(traversal="hardware")


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    if not TESTS_SHADERS:
        terminalreporter.write_line("The shaders were not tested: LIXEL_DEVICE is cpu.")
