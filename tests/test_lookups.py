"""The ways to compare a receiver with the map."""

from __future__ import annotations

import pytest

import lixel as lx
from lixel.scenes import GENERATORS

SCENES = {
    "colonnade": {"columns": 8, "detail": 16},
    "objects_on_floor": {"subdivisions": 3},
    "city": {},
}


@pytest.fixture(scope="module", params=SCENES)
def judged(request):
    scene = GENERATORS[request.param](**SCENES[request.param])
    view = scene, scene.cameras["default"].resized(640, 360), scene.lights["default"]
    return *view, lx.reference(*view)


@pytest.mark.parametrize("lookup", ["triangle_1x1", "triangle", "triangle_5x5"])
@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_triangle_lookup_has_no_false_shadow(judged, method, lookup):
    *view, truth = judged
    for resolution in (64, 512):
        chosen = lx.methods.MAP_METHODS[method](lookup=lookup, resolution=resolution)
        assert lx.compare(lx.render(*view, chosen), truth).false_shadow_count == 0


@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_more_texels_miss_less(judged, method):
    *view, truth = judged
    wrong = [
        lx.compare(
            lx.render(*view, lx.methods.MAP_METHODS[method](lookup=lookup)), truth
        ).misclassified_count
        for lookup in ("triangle_1x1", "triangle", "triangle_5x5")
    ]
    assert wrong[0] >= wrong[1] >= wrong[2]


@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_auto_is_as_good_as_the_better_one(judged, method):
    *view, truth = judged
    # The frustum's map is so coarse that depths alone do better: triangles are finer than texels.
    cut = {"cut": "receivers"} if method == "improved_paraboloid" else {}
    wrong = {
        lookup: lx.compare(
            lx.render(*view, lx.methods.MAP_METHODS[method](lookup=lookup, **cut)), truth
        ).misclassified_count
        for lookup in ("auto", "depth", "triangle")
    }
    print(wrong)
    # Where all casters are larger than texels, as in `city`, triangles alone miss next to nothing,
    # and the depth tests add their few false shadows: there `auto` is up to a quarter worse, with
    # the torn footprints of notw up to a half (131 pixels; triangles 93, depth 875).
    worse = 1.5 if method == "notw" else 1.25
    assert wrong["auto"] <= worse * min(wrong["depth"], wrong["triangle"]) + 10
    assert wrong["auto"] <= 0.9 * wrong["depth"]


def test_depth_lookup_stores_no_triangles(judged):
    """What a lookup does not read is not stored: half the memory, the same depths."""
    *view, _ = judged
    maps = [
        lx.render(*view, lx.DesiredView(lookup=lookup)).shadow_map for lookup in ("depth", "auto")
    ]
    assert maps[0].tobytes() == maps[1].tobytes()
