"""The smoothing that suits a view, and the functions that it is chosen by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from views import small

import lixel as lx
from lixel import smoothing
from lixel.warps import receiver_places

PUBLISHED = lx.NonOrthogonalWarp.published(resolution=64, tessellation=None)


@pytest.mark.parametrize(
    "changes",
    [
        {"smoothing": 0.0},
        {"smoothing": 3.0},
        {"smoothing": 1.2, "function_count": 16},
        {"smoothing": 2.0, "exponent": 0.5, "even_share": 0.1},
    ],
)
def test_functions_are_those_of_the_engine(changes, engine):
    scene = small("city")
    camera, light = scene.cameras["default"].resized(160, 90), scene.lights["default"]
    method = replace(PUBLISHED, **changes)
    frame = lx.render(scene, camera, light, method)
    places = receiver_places(frame, 0)
    found = smoothing.warp_of_places(places, method, 64)
    # The engine's roots are of 24 bits. A receiver at the border of two cells may be in either.
    assert np.quantile(np.abs(found - frame.warp_map[0]), 0.99) < 1e-3
    assert np.abs(found - frame.warp_map[0]).mean() < 1e-4


def test_it_is_the_best_of_those_that_are_tried_or_nearly():
    """By the misclassified pixels of each; the papers' way by hand."""
    for name in ("city", "terrain"):
        scene = small(name)
        camera, light = scene.cameras["default"].resized(160, 90), scene.lights["default"]
        truth = lx.reference(scene, camera, light)
        method = replace(PUBLISHED, resolution=128, tessellation=0.025)
        wrong = {
            share * 128: lx.compare(
                lx.render_shadows(scene, camera, light, replace(method, smoothing=share * 128)),
                truth,
            ).misclassified_count
            for share in smoothing.SHARES
        }
        chosen = lx.automatic_smoothing(scene, camera, light, method)
        assert wrong[chosen] <= 1.15 * min(wrong.values()) + 10, wrong
        assert wrong[chosen] < 0.8 * max(wrong.values()), wrong


def test_each_light_has_its_own_and_no_receiver_any():
    scene = small("city")
    camera = scene.cameras["default"].resized(96, 54)
    found = {
        lx.automatic_smoothing(scene, camera, lx.DirectionalLight(towards), PUBLISHED)
        for towards in ((0.1, -1.0, 0.0), (1.0, -0.15, 0.3))
    }
    assert len(found) > 1
    assert found <= {share * 64 for share in smoothing.SHARES}
    below = lx.DirectionalLight((0.0, 1.0, 0.0))
    assert lx.automatic_smoothing(scene, camera, below, PUBLISHED) == 1.0


def test_other_methods_are_refused(view):
    with pytest.raises(ValueError, match="rasterization of the method must be 'linear', got 'ex"):
        lx.automatic_smoothing(*view, "notw")
    with pytest.raises(TypeError, match=r"method must be a lixel\.NonOrthogonalWarp, got"):
        lx.automatic_smoothing(*view, "rtw@published")
