"""Several samples in each pixel, and images of shares against them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from test_masks import CAMERA as CAMERA_OF_MASKS, SCENES as MASKED, SPOT

import lixel as lx
from lixel import _core
from lixel.coverage import cameras_of_samples, sample_places
from lixel.lab import growth

SAMPLES = 64

LAMP = lx.PointLight((1.2, 3.1, 1.7))


def together(scene: lx.Scene, camera: lx.Camera, light: lx.Light, samples: int) -> dict:
    """What the CPU engine counts and does."""
    places = [(x, y) for x, y in sample_places(samples).tolist()]
    return _core.count_samples(scene._core, camera._core_for(scene), light._core, places)


def lights_over(scene: lx.Scene) -> dict[str, lx.Light]:
    """A light of each kind."""
    low, high = scene.bounds
    above = (low + high) / 2 + [0.1, 0.8 * (high - low).max(), 0.2]
    return {
        "sun": lx.DirectionalLight((0.35, -1.0, -0.45)),
        "lamp": lx.PointLight(above),
        "spot": lx.SpotLight(above, (0.1, -1.0, 0.0), outer=0.4),
        "dome": lx.HemisphereLight(above, (0.0, -1.0, 0.1)),
    }


def half_plane(slope: float) -> tuple[lx.Scene, lx.Camera, lx.Light]:
    """A floor from above, a pixel for each unit, and over it the edge x = slope * y of a sheet
    that shades what is to the right, without hiding it from the camera."""
    floor = [(-32, 0, -32), (-32, 0, 32), (32, 0, 32), (32, 0, -32)]
    # Above the camera, which looks down between both.
    sheet = [(slope * -32, 9, -32), (slope * 32, 9, 32), (64, 9, 32), (64, 9, -32)]
    scene = lx.Scene([*floor, *sheet], [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)])
    camera = lx.Camera.look_at(
        (0, 5, 0), (0, 0, 0), (0, 0, -1), ymag=16.0, width=32, height=32, zfar=6.0
    )
    return scene, camera, lx.DirectionalLight((0, -1, 0))


def lit_share(slope: float, size: int = 32, parts: int = 200) -> np.ndarray:
    """How much of each pixel lies to the left of the edge: integrated along the rows."""
    rows = (np.arange(size * parts) + 0.5) / parts - size / 2
    edges = slope * rows[:, None] + size / 2 - np.arange(size)
    return np.clip(edges, 0.0, 1.0).reshape(size, parts, size).mean(axis=1)


def test_places_are_around_the_centre_and_even():
    assert sample_places(1).tolist() == [[0.0, 0.0]]
    for samples in (2, 7, 32, 100):
        places = sample_places(samples)
        assert places.shape == (samples, 2)
        assert (places >= -0.5).all()
        assert (places < 0.5).all()
        # Of any corner's box the share of samples is near to its area: the star discrepancy.
        for corner in places:
            share = (places <= corner).all(axis=1).mean()
            assert abs(share - np.prod(corner + 0.5)) < 3.0 * math.log(samples + 1) / samples


@pytest.mark.parametrize("slope", [0.1, 0.37, -0.8])
def test_a_straight_edge_covers_what_it_does(slope):
    view = half_plane(slope)
    expected = lit_share(slope)
    for method in (None, "exact"):
        found = lx.coverage(*view, method, samples=SAMPLES)
        assert found.visibility.shape == (32, 32)
        assert (found.surface == 1.0).all()
        error = np.abs(found.visibility - expected)
        # An edge parts a lattice to within a few of its samples.
        assert error.max() < 4 / SAMPLES
        assert error[(expected > 0) & (expected < 1)].mean() < 1 / SAMPLES


def test_one_sample_is_the_image(view):
    truth = lx.reference(*view)
    found = lx.coverage(*view, samples=1)
    assert np.array_equal(found.visibility, truth.visibility, equal_nan=True)
    assert np.array_equal(found.covered, truth.covered)
    assert np.array_equal(found.tie > 0, truth.covered & (truth.tie | truth.float32_tie))


def test_exact_has_the_reference_s_shares(view):
    truth = lx.coverage(*view, samples=16)
    found = lx.compare(lx.coverage(*view, "exact", samples=16), truth)
    assert found.beyond_count == 0
    # What float32 sees at the rims of objects may be of the neighbour.
    assert found.mean_absolute_error < 1e-4
    assert found.ssim > 0.9999


def test_filtered_maps_are_judged_by_shares():
    view = half_plane(0.37)
    truth = lx.coverage(*view, samples=SAMPLES)
    hard = lx.compare(lx.render_shadows(*view, "exact"), truth)
    partly = (truth.visibility > 0) & (truth.visibility < 1)
    assert hard.beyond_count >= 0.8 * partly.sum()
    # A filter as wide as a pixel is nearer to the lit share than lit or dark is; a wide one is not.
    map_of_texels = lx.DesiredView(resolution=256)
    errors = []
    for radius in (4.0, 40.0):
        soft = dataclasses.replace(map_of_texels, lookup=lx.Pcf(radius=radius, samples=64))
        errors.append(lx.compare(lx.render_shadows(*view, soft), truth).rmse)
    assert errors[0] < 0.5 * hard.rmse < errors[1]


def test_numbers_are_those_of_the_difference():
    truth = lx.Coverage(
        visibility=np.array([[0.5, 1.0, 0.25], [np.nan, 0.0, 0.75], [1.0, 1.0, 1.0]], np.float32),
        surface=np.array([[1, 1, 1], [0, 1, 1], [1, 1, 1]], np.float32),
        tie=np.array([[0, 0, 0.25], [0, 0, 0], [0, 0, 0]], np.float32),
        samples=4,
        scene=lx.scenes.plane_and_box(),
        camera=lx.Camera.look_at((0, 1, 1), (0, 0, 0), yfov=1.0, width=3, height=3),
        light=lx.DirectionalLight((0, -1, 0)),
    )
    image = np.array([[1.0, 1.0, 0.75], [1.0, np.nan, 0.5], [1.0, 1.0, 1.0]])
    found = lx.compare(image, truth)
    assert found.difference.tolist() == [[0.5, 0.0, 0.25], [0.0, 0.0, -0.25], [0.0, 0.0, 0.0]]
    assert found.covered_count == 7
    assert found.other_surface_count == 2
    assert found.mean_absolute_error == pytest.approx(1.0 / 7)
    assert found.rmse == pytest.approx(math.sqrt(0.375 / 7))
    assert found.beyond_count == 1
    assert found.rate_beyond == pytest.approx(1 / 7)
    assert set(found.as_dict()) >= {"mean_absolute_error", "rmse", "beyond_count", "ssim"}
    picture = found.picture()
    assert picture.shape == (3, 3, 3)
    assert picture[0, 0, 0] > picture[0, 0, 1]
    assert "off by more than one of 4 samples" in str(found)


def test_what_is_no_number_of_samples_is_refused(view):
    for samples, error in ((0, ValueError), (-1, ValueError), (1.5, TypeError), ("4", TypeError)):
        with pytest.raises(error, match="samples must"):
            lx.coverage(*view, samples=samples)
    with pytest.raises(ValueError, match="shape of reference"):
        lx.compare(np.ones((3, 3)), lx.coverage(*view, samples=1))


def assert_one_by_one(scene: lx.Scene, camera: lx.Camera, light: lx.Light, samples: int) -> None:
    """That exact shadows of the samples are those of so many frames, to the byte."""
    shape = camera.height, camera.width
    lit, seen = np.zeros(shape, int), np.zeros(shape, int)
    for moved in cameras_of_samples(camera, samples):
        visibility = lx.render_shadows(scene, moved, light, "exact", device="cpu")
        lit += visibility == 1.0
        seen += ~np.isnan(visibility)
    found = lx.coverage(scene, camera, light, "exact", samples=samples, device="cpu")
    assert np.array_equal(np.rint(found.surface * samples), seen)
    assert np.array_equal(found.covered, seen > 0)
    assert np.array_equal(np.rint(np.nan_to_num(found.visibility) * seen), lit)
    assert 0 < lit.sum() < seen.sum()


SCENES = {
    "box": lx.scenes.plane_and_box,
    "objects": lambda: lx.scenes.objects_on_floor(40, 3),
    "needles": lambda: lx.scenes.needles(300),
    "grass": lambda: lx.scenes.grass(2000),
}


@pytest.mark.parametrize("kind", ["sun", "lamp", "spot", "dome"])
@pytest.mark.parametrize("name", SCENES)
def test_samples_together_are_those_of_moved_cameras(name, kind):
    scene = SCENES[name]()
    camera = next(iter(scene.cameras.values())).resized(101, 67)
    for samples in (1, 6, 32):
        assert_one_by_one(scene, camera, lights_over(scene)[kind], samples)
    # Pixels so small that most fall in few cells of the light's grid.
    assert_one_by_one(scene, camera.resized(307, 203), lights_over(scene)[kind], 9)


def test_more_samples_than_are_together_at_once(view):
    assert_one_by_one(*view, 70)


@pytest.mark.parametrize("kind", ["sun", "lamp"])
def test_samples_of_a_crowd(kind):
    """So many triangles lie in one place that the light has a finer grid of them."""
    scene = growth.heap(20_000)
    camera = lx.Camera.look_at((1.5, 2.0, 2.5), (0, 0.4, 0), yfov=0.9, width=101, height=67)
    light = {"sun": scene.lights["default"], "lamp": lx.PointLight((20.0, 30.0, 10.0))}[kind]
    assert_one_by_one(scene, camera, light, 32)


def crumbs(size: int, lies: bool) -> tuple[lx.Scene, lx.Camera, lx.Light]:
    """A floor from above, and crumbs that shade it, which the camera does not see: over it, or just
    above the floor, before what it sees. Each is less wide than a pixel and than half a cell of the
    light's grid."""
    random = np.random.default_rng(7)
    floor = [(-32, 0, -32), (-32, 0, 32), (32, 0, 32), (32, 0, -32)]
    count = 3000
    low, high = (0.02, 0.04) if lies else (8.0, 9.0)
    middles = random.uniform((-14, low, -14), (14, high, 14), (count, 1, 3))
    corners = middles + random.uniform(-0.06, 0.06, (count, 3, 3)) * (1.0, 0.2, 1.0)
    faces = [(0, 1, 2), (0, 2, 3), *(4 + np.arange(3 * count)).reshape(-1, 3).tolist()]
    scene = lx.Scene([*floor, *corners.reshape(-1, 3).tolist()], faces)
    # Turned, so that the light sees pixels askew.
    seen = {"znear": 4.995, "zfar": 6.0}
    camera = lx.Camera.look_at(
        (0, 5, 0), (0, 0, 0), (0.5, 0, -1), ymag=14.0, width=size, height=size, **seen
    )
    return scene, camera, lx.DirectionalLight((0.8, -1, 0.3) if lies else (0, -1, 0))


@pytest.mark.parametrize("lies", [False, True])
@pytest.mark.parametrize(("size", "is_in_few_cells"), [(80, False), (160, True), (240, True)])
def test_a_pixel_is_tested_in_every_cell_of_the_light_that_it_touches(size, is_in_few_cells, lies):
    """Most crumbs are in one cell's list, and their shadow is in pixels of which most is in another
    cell. Footprints are of whole pixels where they are in two cells along an axis, at most."""
    view = crumbs(size, lies)
    effort = together(*view, 16)["effort"]
    assert (effort["open_pixels"] < 0.4 * effort["whole_pixels"]) == is_in_few_cells
    truth = lx.coverage(*view, samples=16)
    found = lx.coverage(*view, "exact", samples=16, device="cpu")
    is_partly = (truth.visibility > 0) & (truth.visibility < 1)
    assert is_partly.sum() > 300
    is_known = truth.tie == 0
    assert is_known.mean() > 0.99
    assert np.array_equal(found.visibility[is_known], truth.visibility[is_known])


def test_samples_of_parallel_rays():
    assert_one_by_one(*half_plane(0.37), 16)


@pytest.mark.parametrize("light", [lx.DirectionalLight((0.35, -1.0, -0.45)), LAMP, SPOT])
@pytest.mark.parametrize("name", MASKED)
def test_samples_in_holes(name, light):
    assert_one_by_one(MASKED[name].scene(), CAMERA_OF_MASKS, light, 20)


def test_samples_within_the_range_of_depths():
    scene = lx.scenes.objects_on_floor(40, 3)
    camera = next(iter(scene.cameras.values())).resized(96, 64)
    truth = lx.reference(scene, camera, next(iter(scene.lights.values())))
    near, far = np.nanquantile(truth.depth, [0.2, 0.7])
    camera = camera._replaced(znear=float(near), zfar=float(far))
    assert_one_by_one(scene, camera, next(iter(scene.lights.values())), 8)


def test_what_moved_is_counted_anew(view):
    scene, camera, light = view
    before = together(scene, camera, light, 8)
    scene.update_vertices(scene.vertices + np.array([0.0, 0.0, 0.3]))
    after = together(scene, camera, light, 8)
    assert (before["lit"] != after["lit"]).any()
    fresh = lx.Scene(scene.vertices, scene.faces)
    assert np.array_equal(after["lit"], together(fresh, camera, light, 8)["lit"])


def test_threads_change_nothing(view):
    one, three = (
        lx.coverage(*view, "exact", samples=16, device="cpu", threads=threads) for threads in (1, 3)
    )
    assert np.array_equal(one.visibility, three.visibility, equal_nan=True)


@pytest.mark.parametrize("kind", ["sun", "lamp", "spot"])
@pytest.mark.parametrize(("name", "whole", "tested"), [("box", 0.9, 0.25), ("objects", 0.6, 0.45)])
def test_few_samples_are_tested_one_by_one(name, whole, tested, kind):
    """The shares are those of large triangles, and of triangles that are a few pixels wide."""
    scene = SCENES[name]()
    camera = next(iter(scene.cameras.values())).resized(480, 270)
    found = together(scene, camera, lights_over(scene)[kind], 32)
    effort, seen = found["effort"], int(found["seen"].sum())
    pixels = np.count_nonzero(found["seen"])
    assert effort["whole_pixels"] > whole * pixels
    assert pixels <= effort["whole_pixels"] + effort["mixed_pixels"] < 1.02 * pixels
    assert effort["open_pixels"] < 0.25 * effort["whole_pixels"]
    assert 0 < effort["tested_samples"] < tested * seen
    assert set(found["timings"]) <= set(_core.labels())


def test_what_is_no_place_of_a_sample_is_refused(view):
    scene, camera, light = view
    core = scene._core, camera._core_for(scene), light._core
    for places in ([], [(0.0, 0.6)], [(float("nan"), 0.0)], 65 * [(0.0, 0.0)]):
        with pytest.raises(ValueError, match="places must be"):
            _core.count_samples(*core, places)
    with pytest.raises(ValueError, match="threads must be"):
        lx.coverage(*view, "exact", device="cpu", threads=0)
