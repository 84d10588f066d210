"""The ways to compare a receiver with the map."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import lixel as lx
from lixel.scenes import GENERATORS, rotation

SCENES = {
    "colonnade": {"columns": 8, "detail": 16},
    "objects_on_floor": {"subdivisions": 3},
    "city": {},
}


class KnownView:
    """A scene with the truth for it, and how wrong each method is, which several tests ask."""

    def __init__(self, name: str) -> None:
        scene = GENERATORS[name](**SCENES[name])
        self.view = scene, scene.cameras["default"].resized(640, 360), scene.lights["default"]
        self.truth = lx.reference(*self.view)
        self._known: dict[lx.Method, lx.Comparison] = {}

    def compare(self, name: str, **parameters: Any) -> lx.Comparison:
        method = lx.methods.MAP_METHODS[name](**parameters)
        if method not in self._known:
            self._known[method] = lx.compare(lx.render(*self.view, method), self.truth)
        return self._known[method]


@pytest.fixture(scope="module", params=SCENES)
def known_view(request):
    return KnownView(request.param)


TRIANGLES = ("triangle_1x1", "triangle", "triangle_5x5")


@pytest.mark.parametrize("lookup", TRIANGLES)
@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_triangle_lookup_has_no_false_shadow(known_view, method, lookup):
    coarse = known_view.compare(method, lookup=lookup, resolution=64)
    assert coarse.false_shadow_count == 0
    assert known_view.compare(method, lookup=lookup).false_shadow_count == 0


@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_more_texels_miss_less(known_view, method):
    wrong = [known_view.compare(method, lookup=lookup).misclassified_count for lookup in TRIANGLES]
    assert wrong[0] >= wrong[1] >= wrong[2]


@pytest.mark.parametrize("method", lx.methods.MAP_METHODS)
def test_auto_is_as_good_as_the_better_one(known_view, method):
    wrong = {
        lookup: known_view.compare(method, lookup=lookup).misclassified_count
        for lookup in ("auto", "auto_5x5", "depth", "triangle")
    }
    print(wrong)
    # Where all casters are larger than texels, as in `city`, triangles alone miss next to nothing,
    # and the depth tests add their few false shadows (100 pixels; triangles 77, depth 1,125).
    assert wrong["auto"] <= 1.25 * min(wrong["depth"], wrong["triangle"]) + 10
    assert wrong["auto"] <= 0.9 * wrong["depth"]
    assert wrong["auto_5x5"] <= wrong["auto"]


class KnownSuns:
    """The same under three suns in a small image: of one alone it is luck how the texels fall."""

    def __init__(self, name: str) -> None:
        scene = GENERATORS[name](**SCENES[name])
        camera, light = scene.cameras["default"].resized(320, 180), scene.lights["default"]
        suns = [lx.DirectionalLight(rotation(0.7 * i) @ light.direction) for i in range(3)]
        self.views = [(scene, camera, sun) for sun in suns]
        self.truths = [lx.reference(*view) for view in self.views]

    def count(self, method: lx.Method) -> int:
        found = (lx.render_shadows(*view, method) for view in self.views)
        pairs = zip(found, self.truths, strict=True)
        return sum(lx.compare(*pair).misclassified_count for pair in pairs)


@pytest.fixture(scope="module", params=SCENES)
def known_suns(request):
    return KnownSuns(request.param)


@pytest.mark.parametrize(
    ("lookup", "share"),
    # Of 25 texels around half lie across a seam where it is never more than two texels away.
    [("depth", 1.05), ("triangle", 1.05), ("auto", 1.05), ("auto_5x5", 1.25)],
)
def test_seams_cost_nothing(known_suns, lookup, share):
    """Every four texels there are two functions that know nothing of each other. What lies across
    was taken for a neighbour once, which gave 1.4 to 3.5 times the wrong pixels of fewer seams; by
    triangles, on the floor, as many."""
    few = lx.NonOrthogonalWarp(lookup=lookup, resolution=512, function_count=16)
    many = lx.NonOrthogonalWarp(lookup=lookup, resolution=512, function_count=128, smoothing=0.0)
    assert known_suns.count(many) <= share * known_suns.count(few) + 10


@pytest.mark.parametrize("lookup", ["depth", "auto"])
@pytest.mark.parametrize("method", ["desired_view", "rtw", "notw"])
def test_a_hilly_land_has_no_shadow_at_noon(method, lookup):
    """Where a warp stretches texels, hills depart from their planes by more within one."""
    land = GENERATORS["terrain"](cells=300)
    camera, noon = land.cameras["default"].resized(480, 270), lx.DirectionalLight((0.1, -1, 0.1))
    truth = lx.reference(land, camera, noon)
    assert not (truth.visibility == 0).any()
    for resolution in (64, 128, 256):
        made = lx.METHODS[method](resolution=resolution, lookup=lookup)
        found = lx.compare(lx.render(land, camera, noon, made), truth)
        # Of some 100,000; hundreds where a texel's bias knows nothing of how far it reaches.
        assert found.false_shadow_count <= 10


@pytest.mark.parametrize("direction", [(0.2, -1, 0.1), (0.6, -1, 0.3)])
def test_what_one_row_of_texels_saw_is_no_shadow_beside_it(direction):
    """Slats a fifth of a texel wide: depth tests alone shadow the width of a texel."""
    random = np.random.default_rng(0)
    places = random.uniform((-4, 0.5, -4), (4, 1.5, 4), (40, 3))
    angles = random.uniform(0, np.pi, 40)
    along = np.stack([np.cos(angles), np.zeros(40), np.sin(angles)], axis=1)
    across = np.stack([-np.sin(angles), np.zeros(40), np.cos(angles)], axis=1) * 0.01
    slats = [places + i * along + j * across for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    floor = np.array([[(-5, 0, -5), (5, 0, -5), (5, 0, 5), (-5, 0, 5)]], dtype=float)
    quads = np.concatenate([floor, np.stack(slats, axis=1)]).reshape(-1, 3)
    faces = 4 * np.arange(41)[:, None, None] + np.array([(0, 1, 2), (0, 2, 3)])
    scene = lx.Scene(quads, faces.reshape(-1, 3))
    camera = lx.Camera.look_at((0, 12, 0.1), (0, 0, 0), yfov=0.8, width=480, height=480)
    view = scene, camera, lx.DirectionalLight(direction)
    truth = lx.reference(*view)
    false_shadow = {
        lookup: lx.compare(
            lx.render(*view, lx.DesiredView(resolution=100, lookup=lookup)), truth
        ).false_shadow_count
        for lookup in ("auto", "depth")
    }
    assert false_shadow["auto"] < 10
    assert false_shadow["depth"] > 1000


def test_depth_lookup_stores_no_triangles(known_view):
    """What a lookup does not read is not stored: half the memory, the same depths."""
    maps = [
        lx.render(*known_view.view, lx.DesiredView(lookup=lookup)).shadow_map
        for lookup in ("depth", "auto")
    ]
    assert maps[0].tobytes() == maps[1].tobytes()
