"""Several samples in each pixel, and images of shares against them."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import lixel as lx
from lixel.coverage import sample_places

SAMPLES = 64


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
