"""Fixtures that the tests share: a small view, and the truth for it."""

from __future__ import annotations

from typing import NamedTuple

import pytest

import lixel as lx


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


@pytest.fixture
def ray_queries() -> lx.RayTraced:
    """`ray_traced` by the device's own ray queries; skips, and says so, where it has none."""
    device = lx.info().device
    assert device is not None
    if "EXPERIMENTAL_RAY_QUERY" not in device["used_features"]:
        pytest.skip(f"the adapter {device['name']} ({device['driver']}) has no ray queries")
    return lx.RayTraced(traversal="hardware")
