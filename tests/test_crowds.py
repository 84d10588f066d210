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


def shading_crowds(size: int = 240) -> tuple[lx.Scene, lx.Camera]:
    """A floor from above, and over the camera specks in crowds, each over several cells of the
    light's grid. Over three pixels of one crowd there are crowds in it, as narrow as a cell of its
    own grid. Most triangles are elsewhere, and far more are of no crowd."""
    random = np.random.default_rng(7)
    camera = lx.Camera.look_at(
        (0, 5, 0), (0, 0, 0), (0.5, 0, -1), ymag=14.0, width=size, height=size, zfar=6.0
    )

    def under(column: int, row: int) -> np.ndarray:
        """The place on the floor that a pixel's centre sees."""
        aside = (np.array([column, row]) + 0.5 - size / 2) * 28.0 / size
        return 8.5 * np.array((0, 1, 0)) + camera.pose[:3, :2] @ (aside * (1, -1))

    def specks(count: int, middle: np.ndarray, reach: float, width: float) -> np.ndarray:
        middles = middle + random.uniform(-1, 1, (count, 1, 3)) * (reach, 0.5, reach)
        return middles + random.uniform(-width, width, (count, 3, 3))

    corners = np.concatenate(
        [
            specks(90_000, under(60, 70), 0.55, 0.007),
            specks(60_000, under(180, 150), 0.45, 0.007),
            *(specks(5_000, under(*at), 0.002, 5e-5) for at in ((60, 70), (61, 71), (59, 70))),
            specks(240_000, np.array((26, 8, 26)), 5.0, 0.05),
        ]
    )
    floor = [(-32, 0, -32), (-32, 0, 32), (32, 0, 32), (32, 0, -32)]
    faces = np.concatenate([[(0, 1, 2), (0, 2, 3)], 4 + np.arange(3 * len(corners)).reshape(-1, 3)])
    return lx.Scene(np.concatenate([floor, corners.reshape(-1, 3)]), faces), camera


@pytest.mark.parametrize("kind", ["sun", "lamp"])
def test_shadows_of_crowds_over_several_cells_are_right(kind):
    scene, camera = shading_crowds()
    light = {"sun": lx.DirectionalLight((0, -1, 0)), "lamp": lx.PointLight((0, 60, 0))}[kind]
    truth = lx.reference(scene, camera, light)
    in_shadow = truth.visibility == 0.0
    assert in_shadow[55:85, 45:75].sum() > 30
    assert in_shadow[135:165, 165:195].sum() > 30
    found = lx.render_shadows(scene, camera, light, "exact", device="cpu")
    assert lx.compare(found, truth).misclassified_count == 0
    shares = lx.coverage(scene, camera, light, samples=16)
    found = lx.coverage(scene, camera, light, "exact", samples=16, device="cpu")
    is_known = shares.tie == 0
    assert is_known.mean() > 0.99
    assert np.array_equal(found.visibility[is_known], shares.visibility[is_known])


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
