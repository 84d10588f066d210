"""Many triangles in little of what is seen, where `exact` on the CPU engine makes finer grids."""

from __future__ import annotations

import numpy as np
import pytest

import lixel as lx
from lixel.lab import growth

SIZE = (120, 75)

HEAP = 20_000
"""Triangles of a heap: several times as many as a cell of the light's grid may hold."""


def seen(name: str) -> tuple[lx.Scene, list[lx.Camera]]:
    """A scene, and cameras that see all of it and what is crowded."""
    if name == "heap":
        scene = growth.heap(HEAP)
        near = lx.Camera.look_at((1.5, 2.0, 2.5), (0, 0.4, 0), yfov=0.9, width=120, height=75)
    else:
        scene = growth.on_wider_floor(float(name))
        near = lx.Camera.look_at((6.0, 3.0, 6.0), (0, 0.5, 0), yfov=0.7, width=120, height=75)
    return scene, [scene.cameras["default"].resized(*SIZE), near]


LIGHTS: dict[str, lx.Light] = {
    "sun": lx.DirectionalLight((0.55, -0.7, -0.35)),
    "lamp": lx.PointLight((20.0, 30.0, 10.0)),
    "lamp inside": lx.PointLight((0.3, 1.5, 0.2)),
    "spot": lx.SpotLight((20.0, 30.0, 10.0), (-0.5, -0.8, -0.25), outer=0.9),
}


@pytest.fixture(autouse=True)
def _few_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(growth, "SUBDIVISIONS", 2)


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
@pytest.mark.parametrize("name", ["heap", "100", "1000"])
def test_no_pixel_of_a_crowd_is_wrong(name, light):
    scene, cameras = seen(name)
    for camera in cameras:
        truth = lx.reference(scene, camera, light)
        found = lx.render_shadows(scene, camera, light, "exact", device="cpu")
        assert lx.compare(found, truth).misclassified_count == 0
        by_rays = lx.render_shadows(scene, camera, light, "ray_traced", device="cpu")
        assert found.tobytes() == by_rays.tobytes()
        # What the first frames made of the light serves the next, on any number of threads.
        for threads in (1, 2):
            again = lx.render_shadows(scene, camera, light, "exact", device="cpu", threads=threads)
            assert again.tobytes() == found.tobytes()


def test_large_triangles_over_each_other_share_no_places():
    """They are so many that the cells of a tile share them."""
    y = 5.0 + 0.01 * np.arange(600)
    layers = np.array([(-1000.0, 0.0, -1000.0), (1000.0, 0.0, -1000.0), (0.0, 1.0, 1000.0)])
    layers = layers + y[:, None, None] * (0, 1, 0)
    layers *= np.random.default_rng(0).uniform(0.2, 1.0, (600, 1, 1))
    scene = lx.Scene(layers.reshape(-1, 3), np.arange(1800).reshape(-1, 3))
    camera = lx.Camera.look_at((0, 600.0, 450.0), (0, 0, 0), yfov=0.9, width=160, height=100)
    truth = lx.reference(scene, camera, LIGHTS["sun"])
    found = lx.render_shadows(scene, camera, LIGHTS["sun"], "exact", device="cpu")
    assert truth.covered.sum() > 10_000
    assert lx.compare(found, truth).misclassified_count == 0
