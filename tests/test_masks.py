"""Triangles with holes: fences and leaves, against a float64 ray caster in numpy."""

from __future__ import annotations

import contextlib
import copy
import itertools
import pickle
from dataclasses import replace
from typing import NamedTuple

import numpy as np
import pytest

import lixel as lx
from lixel.lab.brute_force import Triangles, cast

BOTH_ENGINES = pytest.mark.usefixtures("engine")

LIGHTS = {
    "sun": lx.DirectionalLight((0.35, -1.0, -0.45)),
    "lamp": lx.PointLight((1.2, 3.1, 1.7)),
}


class Card(NamedTuple):
    """A square with an image on it."""

    origin: tuple[float, float, float]
    along: tuple[float, float, float]
    up: tuple[float, float, float]
    image: int
    repeats: float = 1.0
    start: float = 0.0


def picture(kind: str, size: int = 32) -> np.ndarray:
    """A lattice, or a leaf with a soft rim."""
    y, x = (np.mgrid[0:size, 0:size] + 0.5) / size
    if kind == "lattice":
        return np.where((x < 0.22) | (y < 0.22), 255, 0).astype(np.uint8)
    distance = np.hypot((x - 0.5) / 0.45, (y - 0.5) / 0.3)
    return np.clip(255 * 3.0 * (1.2 - distance), 0, 255).astype(np.uint8)


MASKS = (
    lx.AlphaMask(picture("lattice")),
    lx.AlphaMask(picture("leaf"), cutoff=0.3, wrap="clamp"),
    lx.AlphaMask(picture("leaf", 15), cutoff=0.7, wrap=("mirror", "repeat")),
    lx.AlphaMask(picture("leaf", 9), cutoff=0.6, wrap=("repeat", "mirror"), sampling="nearest"),
)


class Made(NamedTuple):
    """Arrays of a scene, as the caster here takes them."""

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    face_alpha: np.ndarray

    def scene(self) -> lx.Scene:
        return lx.Scene(
            self.vertices, self.faces, uv=self.uv, alpha=MASKS, face_alpha=self.face_alpha
        )

    def solid(self) -> lx.Scene:
        return lx.Scene(self.vertices, self.faces)


def made(cards: list[Card]) -> Made:
    """A floor under cards, each two triangles."""
    floor = Card((-6.0, 0.0, 6.0), (12.0, 0.0, 0.0), (0.0, 0.0, -12.0), -1)
    vertices, uv, face_alpha = [], [], []
    for card in [floor, *cards]:
        origin, along, up = (np.array(v) for v in card[:3])
        vertices += [origin, origin + along, origin + along + up, origin + up]
        first, last = card.start, card.start + card.repeats
        uv += [(first, last), (last, last), (last, first), (first, first)]
        face_alpha += 2 * [card.image]
    quads = 4 * np.arange(len(cards) + 1)[:, None, None]
    faces = (quads + np.array([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3)
    return Made(np.array(vertices), faces, np.array(uv, float), np.array(face_alpha))


def fence() -> Made:
    """A lattice across the view, and one that lies flat above the floor."""
    return made(
        [
            Card((-3.0, 0.0, 0.3), (6.0, 0.0, -0.6), (0.0, 1.6, 0.0), 0, 7.0),
            Card((-2.5, 2.2, -0.5), (4.0, 0.0, 0.4), (0.3, 0.2, -2.5), 0, 5.0),
        ]
    )


def leaves() -> Made:
    """Many cards in the air, turned to all sides."""
    random = np.random.default_rng(7)
    cards = []
    for i in range(40):
        along, aside = random.normal(size=(2, 3))
        along /= np.linalg.norm(along)
        up = np.cross(along, aside)
        size = random.uniform(0.3, 0.9)
        origin = random.uniform((-2.0, 0.7, -2.0), (2.0, 2.3, 2.0))
        up *= size / np.linalg.norm(up)
        # Some go on beyond the image's sides, below 0 and above 1.
        uv = (1.7, -0.6) if i % 4 > 1 else (1.0, 0.0)
        cards.append(Card(tuple(origin), tuple(size * along), tuple(up), 1 + i % 3, *uv))
    return made(cards)


SCENES = {"fence": fence(), "leaves": leaves()}
SPOT = lx.SpotLight((1.2, 3.1, 1.7), (-0.3, -1.0, -0.5), outer=0.7)
CAMERA = lx.Camera.look_at((3.1, 3.3, 5.2), (0.0, 0.6, 0.0), yfov=0.8, width=120, height=80)


def every_pixel(made: Made, light: lx.Light) -> np.ndarray:
    """What brute force in numpy says: 1 lit, 0 in shadow, NaN where nothing is seen."""
    pixels = np.argwhere(np.ones((CAMERA.height, CAMERA.width), bool))
    triangles = Triangles(made.vertices, made.faces, made.uv[made.faces], made.face_alpha, MASKS)
    return cast(triangles, CAMERA, light, pixels).reshape(CAMERA.height, CAMERA.width)


@pytest.fixture(scope="module", params=[(s, k) for s in SCENES for k in LIGHTS], ids="-".join)
def case(request: pytest.FixtureRequest) -> tuple[Made, lx.Light, np.ndarray]:
    scene, light = request.param
    return SCENES[scene], LIGHTS[light], every_pixel(SCENES[scene], LIGHTS[light])


def wrong(found: np.ndarray, truth: np.ndarray, ignored: np.ndarray) -> int:
    differs = (found > 0.5) != (truth > 0.5)
    differs |= np.isnan(found) != np.isnan(truth)
    return int(np.count_nonzero(differs & ~ignored))


def test_the_reference_is_right(case):
    made, light, truth = case
    reference = lx.reference(made.scene(), CAMERA, light)
    assert wrong(reference.visibility, truth, reference.tie) == 0
    assert np.count_nonzero(reference.tie) < 3
    solid = lx.reference(made.solid(), CAMERA, light)
    assert wrong(solid.visibility, truth, solid.tie) > 300


@BOTH_ENGINES
@pytest.mark.parametrize("method", [lx.Exact(), lx.RayTraced(traversal="compute")])
def test_no_pixel_is_wrong(case, method):
    made, light, truth = case
    scene = made.scene()
    reference = lx.reference(scene, CAMERA, light)
    found = lx.render_shadows(scene, CAMERA, light, method)
    assert wrong(found, truth, reference.tie | reference.float32_tie) == 0
    assert np.count_nonzero(reference.float32_tie) < 10


@BOTH_ENGINES
@pytest.mark.parametrize("method", [lx.Exact(), lx.RayTraced(traversal="compute")])
def test_alpha_that_float32_cannot_tell_from_the_cutoff_is_decided(method):
    """Half of a roof is a hole, by less than float32 rounds off its place in the image."""
    arrays = made([Card((-2.0, 3.5, 2.0), (4.0, 0.0, 0.0), (0.0, 0.0, -4.0), 0)])
    # At 3/10 of the way from texel 1500 to the next, give or take 2e-5 of it.
    uv = (1500.8 + 4e-5 * (arrays.uv - 0.5)) / 2048
    mask = lx.AlphaMask(np.repeat(np.uint8([[0, 255]]), (1501, 547), axis=1), cutoff=0.3)
    scene = lx.Scene(
        arrays.vertices, arrays.faces, uv=uv, alpha=[mask], face_alpha=arrays.face_alpha
    )
    truth = lx.reference(scene, CAMERA, LIGHTS["sun"])
    found = lx.render_shadows(scene, CAMERA, LIGHTS["sun"], method)
    ignored = truth.tie | truth.float32_tie
    assert wrong(found, truth.visibility, ignored) == 0
    solid = lx.reference(arrays.solid(), CAMERA, LIGHTS["sun"])
    of_roof = (solid.visibility == 0) & ~ignored
    assert 0.2 < truth.visibility[of_roof].mean() < 0.8
    assert np.count_nonzero(of_roof) > 1000


MAPS = {
    lx.DirectionalLight: ["uniform", "lispsm", "notw", "rtw", "cascades"],
    lx.PointLight: ["cube", "dual_paraboloid", "cube+notw", "improved_paraboloid"],
}


@BOTH_ENGINES
def test_maps_have_the_holes(case):
    made, light, truth = case
    scene = made.scene()
    tie = lx.reference(scene, CAMERA, light).tie
    solid = wrong(lx.render_shadows(made.solid(), CAMERA, light, "exact"), truth, tie)
    lookups = itertools.cycle(["auto", "triangle", "depth"])
    for name, lookup in zip(MAPS[light.__class__], lookups, strict=False):
        method = replace(lx.method_from(name), resolution=512, lookup=lookup)
        found = lx.render_shadows(scene, CAMERA, light, method)
        # What a map of so few texels misses are the rims of holes.
        assert wrong(found, truth, tie) < 0.25 * solid, name
        if lookup == "triangle":
            false_shadow = (found < 0.5) & (truth > 0.5) & ~tie
            assert np.count_nonzero(false_shadow) <= 2, name


@BOTH_ENGINES
def test_a_mask_that_hides_everything_costs_nothing():
    made = fence()
    whole = lx.AlphaMask(np.full((2, 2), 255, np.uint8))
    scene = lx.Scene(made.vertices, made.faces, uv=made.uv, alpha=whole)
    assert scene.masked_count == 0
    light = LIGHTS["sun"]
    found = lx.render_shadows(scene, CAMERA, light, "exact")
    assert np.array_equal(
        found, lx.render_shadows(made.solid(), CAMERA, light, "exact"), equal_nan=True
    )


@BOTH_ENGINES
@pytest.mark.parametrize("name", lx.METHODS)
def test_what_knows_no_holes_is_refused(name):
    scene = fence().scene()
    camera = CAMERA.resized(12, 8)
    method = lx.METHODS[name]()
    variants = [method]
    if "rasterization" in method.parameters():
        # Not every one can be: `virtual` cannot.
        with contextlib.suppress(ValueError):
            variants.append(replace(method, rasterization="linear"))
    for variant in variants:
        light = next(light for light in (*LIGHTS.values(), SPOT) if variant.takes(light))
        if variant.takes_holes():
            continue
        with pytest.raises(ValueError, match=r"4 masked triangles .* without their holes"):
            lx.render_shadows(scene, camera, light, variant)


def test_bad_masks_are_named():
    made = fence()
    cases = [
        ({"uv": made.uv}, "uv and alpha must come together"),
        ({"alpha": MASKS[0]}, "uv and alpha must come together"),
        ({"uv": made.uv, "alpha": MASKS}, "face_alpha must say which of 4"),
        ({"uv": made.uv[:3], "alpha": MASKS[0]}, "uv must have shape"),
        ({"uv": made.uv * np.nan, "alpha": MASKS[0]}, "uv must be finite"),
        (
            {"uv": made.uv, "alpha": MASKS[0], "face_alpha": np.where(made.face_alpha < 0, -1, 2)},
            "face_alpha must be -1 or index one of 1 alpha images: face 2 has 2",
        ),
    ]
    for arguments, message in cases:
        with pytest.raises(ValueError, match=message):
            lx.Scene(made.vertices, made.faces, **arguments)
    with pytest.raises(TypeError, match="uint8 or bool, got dtype float64"):
        lx.AlphaMask(np.ones((2, 2)))
    for arguments in ({"cutoff": -0.1}, {"wrap": "border"}, {"sampling": "cubic"}):
        with pytest.raises(ValueError, match=next(iter(arguments))):
            lx.AlphaMask(np.ones((2, 2), bool), **arguments)


def test_alpha_images_have_a_bound():
    # Pages of zeros that nobody touches take no memory.
    with pytest.raises(ValueError, match="1 to 134217728 texels"):
        lx.AlphaMask(np.zeros((1, 2**27 + 1), np.uint8))


def test_copies_keep_the_holes():
    made = leaves()
    scene = made.scene()
    assert scene.masked_count == 80
    truth = lx.reference(scene, CAMERA, LIGHTS["sun"]).visibility
    for twin in (copy.copy(scene), pickle.loads(pickle.dumps(scene))):
        found = lx.reference(twin, CAMERA, LIGHTS["sun"]).visibility
        assert np.array_equal(found, truth, equal_nan=True)


@pytest.mark.parametrize("count", [50, 50_000], ids=["few points", "many points"])
def test_points_under_a_hole_are_lit(count):
    """A card whose left half is open: few points are traced, many go through a grid."""
    card = [(-1, 1, -1), (-1, 1, 1), (1, 1, 1), (1, 1, -1)]
    alpha = np.zeros((4, 4), np.uint8)
    alpha[:, 2:] = 255
    scene = lx.Scene(
        card,
        [(0, 1, 2), (0, 2, 3)],
        uv=[(0, 0), (0, 1), (1, 1), (1, 0)],
        alpha=lx.AlphaMask(alpha, sampling="nearest"),
    )
    points = np.random.default_rng(0).uniform(-0.9, 0.9, (count, 3)) * (1, 0, 1)
    points = points[np.abs(points[:, 0]) > 0.05]
    for light in (lx.DirectionalLight((0, -1, 0)), lx.PointLight((0, 50, 0))):
        lit = lx.shadows_at(scene, points, light)
        np.testing.assert_array_equal(lit == 1, points[:, 0] < 0)
