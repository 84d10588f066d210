"""What float32 leaves open float64 decides: lights on surfaces, suns along walls, far eyes."""

from __future__ import annotations

import time

import numpy as np
import pytest
from views import soup

import lixel as lx

LOW, HIGH = np.array([-4.0, 0.0, -4.0]), np.array([4.0, 3.0, 4.0])
EXACT = ("exact", "ray_traced")
GAPS = (0.0, 1e-12, 1e-9, 1e-7, 1e-6, 1e-5)
PLACES = {
    "ceiling": ((2.1, 3.0, -2.3), (0.0, 1.0, 0.0)),
    "wall": ((4.0, 1.3, 0.7), (1.0, 0.0, 0.0)),
    "floor": ((0.3, 0.0, 1.1), (0.0, -1.0, 0.0)),
    "edge": ((4.0, 3.0, 0.7), (1.0, 1.0, 0.0)),
    "corner": ((4.0, 3.0, 4.0), (1.0, 1.0, 1.0)),
}
"""Where a lamp is, and the way out of the room."""


@pytest.fixture(scope="module")
def room() -> tuple[lx.Scene, lx.Camera]:
    """An empty box, seen from inside."""
    corners = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
    quads = np.array(
        [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    )
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    camera = lx.Camera.look_at((-3.5, 1.6, -3.5), (1, 1, 1), yfov=1.2, width=96, height=54)
    return lx.Scene(LOW + corners * (HIGH - LOW), faces), camera


def lamps(place: str, gap: float) -> list[lx.Light]:
    """Of every kind, inwards by the gap."""
    position, out = (np.array(v) for v in PLACES[place])
    position = position - gap * out
    return [
        lx.PointLight(position),
        lx.SpotLight(position, -out, outer=1.3),
        lx.HemisphereLight(position, -out),
    ]


def seen_by(light: lx.Light, positions: np.ndarray, place: str) -> np.ndarray:
    """Where a convex room shows the lamp: in its cone, and not in a plane that the lamp is in."""
    to_points = positions - light.position
    out = np.array(PLACES[place][1])
    # A wall that holds the lamp is seen edge-on, or as good as that.
    on_wall = ((np.abs(to_points) < 1e-4) & (out != 0)).any(axis=-1)
    cosine = np.einsum("...i,i->...", to_points, -out)
    cosine /= np.linalg.norm(to_points, axis=-1) * np.linalg.norm(out)
    least = {lx.PointLight: -2.0, lx.SpotLight: np.cos(1.3), lx.HemisphereLight: 0.0}[type(light)]
    return (cosine > least + 1e-4) & ~on_wall


@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("place", PLACES)
def test_a_lamp_on_a_surface_lights_what_it_sees(room, place, gap):
    scene, camera = room
    for light in lamps(place, gap):
        truth = lx.reference(scene, camera, light)
        must_be_lit = seen_by(light, truth.position, place)
        assert must_be_lit.sum() > 500
        assert (truth.visibility[must_be_lit] == 1.0).all(), light
        assert not truth.tie[must_be_lit].any(), light
        for method in (*EXACT, "auto", "shadow_volumes", "desired_view"):
            image = lx.render_shadows(scene, camera, light, method)
            assert (image[must_be_lit] == 1.0).all(), (light, method)
        for method in EXACT:
            image = lx.render_shadows(scene, camera, light, method)
            assert lx.compare(image, truth).misclassified_count == 0, (light, method)


@pytest.mark.parametrize("gap", GAPS[1:])
@pytest.mark.parametrize("place", PLACES)
def test_a_lamp_behind_a_surface_lights_nothing_before_it(room, place, gap):
    scene, camera = room
    for light in lamps(place, -gap):
        truth = lx.reference(scene, camera, light)
        assert (truth.visibility == 0.0).all()
        assert not truth.tie.any()
        methods = [lx.method_from(name) for name in lx.METHODS]
        for method in (method for method in methods if method.takes(light)):
            image = lx.render_shadows(scene, camera, light, method)
            assert (image == 0.0).all(), (light, method.name)


@pytest.mark.parametrize("method", EXACT)
@pytest.mark.parametrize("turn", [1e-12, 1e-9, 1e-7, 1e-5])
def test_a_sun_along_walls_is_on_one_side_of_them(room, method, turn):
    """A roofless room; the wall at x = 4 faces the sun by a hair, the one at x = -4 does not."""
    scene, camera = room
    above = np.isclose(scene.vertices[scene.faces][..., 1], 3.0).all(axis=1)
    roofless = lx.Scene(scene.vertices, scene.faces[~above])
    sun = lx.DirectionalLight((turn, -1.0, 0.0))
    truth = lx.reference(roofless, camera, sun)
    image = lx.render_shadows(roofless, camera, sun, method)
    for x, lit in ((4.0, 1.0), (-4.0, 0.0)):
        wall = np.isclose(truth.position[..., 0], x) & (truth.position[..., 1] > 0.01)
        assert wall.sum() > 20
        assert (truth.visibility[wall] == lit).all()
        assert (image[wall] == lit).all()
    assert not truth.tie.any()


def test_walls_that_a_light_runs_along_do_not_face_it():
    """Slanted walls of a tower: float32 rounds their normals to either side of the rays."""
    angle = np.radians(np.arange(0.0, 360.0, 30.0) + 7.0)
    ring = np.column_stack([np.cos(angle), np.zeros(12), np.sin(angle)])
    along = np.array([0.3, 1.0, -0.2])
    here, there = np.arange(12), np.roll(np.arange(12), -1)
    sides = [[here, there, there + 12], [here, there + 12, here + 12]]
    faces = np.concatenate([np.column_stack(side) for side in sides])
    tower = lx.Scene(np.concatenate([ring, ring + 3.0 * along]), faces)
    camera = lx.Camera.look_at((5, 2, 1), (0.4, 1.5, -0.3), yfov=0.9, width=96, height=54)
    sun = lx.DirectionalLight(-along)
    for seen in (lx.reference(tower, camera, sun), lx.render(tower, camera, sun, "exact")):
        assert seen.covered.sum() > 500
        assert not seen.facing.any()


@pytest.mark.parametrize("method", EXACT)
@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_a_tie_that_float64_can_tell(method, seed):
    """Triangles in no special places: a tie has no chance, and no pixel is wrong."""
    scene = soup(seed, count=150)
    camera = lx.Camera.look_at((1.5, 1.1, 2.5), (0, 0, 0), yfov=0.9, width=320, height=180)
    for light in (lx.DirectionalLight((0.3, -1, 0.2)), lx.PointLight((0.9, 1.6, 0.7))):
        truth = lx.reference(scene, camera, light)
        assert np.count_nonzero(truth.tie) == 0
        assert np.count_nonzero(truth.float32_tie) < 10
        image = lx.render_shadows(scene, camera, light, method)
        assert lx.compare(image, truth).misclassified_count == 0


@pytest.mark.parametrize("method", EXACT)
def test_a_hill_shadows_its_neighbour_across_their_edge(method):
    """A low sun on folds that are flatter than what an engine granted to float32 once."""
    x = np.linspace(-1.0, 1.0, 41)
    height = 1e-3 * (np.arange(41) % 2) + 3e-4 * x**2
    vertices = [[a, h, z] for a, h in zip(x, height, strict=True) for z in (-1.0, 1.0)]
    first = 2 * np.arange(40)[:, None]
    faces = np.concatenate([np.add(first, [0, 1, 2]), np.add(first, [1, 3, 2])])
    scene = lx.Scene(np.array(vertices) * 1e4, faces)
    camera = lx.Camera.look_at((0, 1e4, 1e4), (0, 0, 0), yfov=1.0, width=320, height=180)
    for degrees in (0.4, 0.6, 1.05):
        angle = np.radians(degrees)
        sun = lx.DirectionalLight((np.cos(angle), -np.sin(angle), 0.0))
        truth = lx.reference(scene, camera, sun)
        assert 0.05 < (truth.visibility[truth.covered] == 0.0).mean() < 0.95
        assert np.count_nonzero(truth.tie) == 0
        found = lx.compare(lx.render_shadows(scene, camera, sun, method), truth)
        assert found.misclassified_count == 0


def far_view(sizes: float) -> tuple[lx.Scene, lx.Camera, lx.Light]:
    """Objects on a floor from so many sizes away, through a lens that shows as much from all."""
    scene = lx.scenes.objects_on_floor(count=9, subdivisions=1)
    size = np.linalg.norm(np.subtract(*scene.bounds))
    eye = sizes * size * np.array([-0.6, 0.4, 0.7])
    yfov = 2.0 * np.arctan(0.25 / sizes)
    camera = lx.Camera.look_at(eye, (0, 0.3, 0), yfov=yfov, width=96, height=54)
    return scene, camera, scene.lights["default"]


@pytest.mark.parametrize("sizes", [1e4, 1e6, 1e8])
def test_the_reference_sees_from_far_away_and_maps_say_that_they_cannot(sizes, engine):
    near, far = (lx.reference(*far_view(s)) for s in (1e3, sizes))
    both = near.covered & far.covered
    differ = near.visibility[both] != far.visibility[both]
    assert both.sum() > 2000
    assert np.count_nonzero(differ) < 0.01 * both.sum()
    assert np.count_nonzero(far.tie) < 5
    assert np.count_nonzero(far.visibility == 0.0) > 50
    for method in (*EXACT, "auto", "desired_view", "notw"):
        if engine == "cpu" and method in (*EXACT, "auto"):
            image = lx.render_shadows(*far_view(sizes), method)
            assert (image == far.visibility)[far.covered & ~far.tie].all(), method
            continue
        with pytest.raises(ValueError, match=r"camera eye must be within 2048 times .* got \d"):
            lx.render_shadows(*far_view(sizes), method)
    with pytest.raises(ValueError, match=r"camera eye must be within 2048 times .* got \d"):
        lx.warp_map(*far_view(sizes), "notw")


@pytest.mark.parametrize("sizes", [1.0, 1e2, 1e3, 2e3])
@pytest.mark.parametrize("method", EXACT)
def test_no_pixel_is_wrong_from_as_far_as_float32_sees(sizes, method):
    view = far_view(sizes)
    truth = lx.reference(*view)
    image = lx.render_shadows(*view, method)
    judged = ~truth.tie & ~truth.float32_tie
    assert (image == truth.visibility)[judged & truth.covered].all()
    assert judged[truth.covered].mean() > 0.9


def test_the_search_from_far_away_takes_no_longer():
    view = far_view(1e6)
    start = time.perf_counter()
    lx.reference(*view)
    assert time.perf_counter() - start < 5.0


def test_pixels_too_narrow_for_float32_are_refused():
    scene, camera, light = far_view(1.0)
    narrow = camera._replaced(focal=(1e7, 1e7))
    with pytest.raises(ValueError, match="camera focal lengths must be at most 2097152 pixels"):
        lx.render_shadows(scene, narrow, light, "uniform")
    lx.reference(scene, narrow, light)
