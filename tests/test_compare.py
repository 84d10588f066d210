"""Counting misclassified pixels, and measuring how far the edges are off."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest

import lixel as lx


def half_plane(column: int, height: int = 40, width: int = 60) -> np.ndarray:
    """Lit to the left of a column, in shadow from there on."""
    image = np.ones((height, width), np.float32)
    image[:, column:] = 0.0
    return image


def test_false_lit_and_false_shadow_are_told_apart():
    truth = half_plane(30)
    truth[:5] = np.nan
    image = truth.copy()
    image[10, 40:43] = 1.0
    image[20, 3:5] = 0.0
    result = lx.compare(image, truth)
    assert (result.false_lit_count, result.false_shadow_count) == (3, 2)
    assert np.array_equal(np.argwhere(result.false_lit), [[10, 40], [10, 41], [10, 42]])
    assert np.array_equal(np.argwhere(result.false_shadow), [[20, 3], [20, 4]])
    assert (result.misclassified_count, result.covered_count) == (5, 35 * 60)
    assert np.count_nonzero(result.misclassified) == 5
    assert result.expected[:5].all()  # the background, lit in both
    assert result.lit[:5].all()
    assert result.rate_covered == 5 / (35 * 60)
    assert result.rate_facing is None
    assert str(result) == (
        "5 of 2,100 covered pixels misclassified (0.238%): 3 false lit, 2 false shadow; "
        "0 ties not counted"
    )


def test_equal_images_have_no_error():
    result = lx.compare(half_plane(30), half_plane(30))
    assert result.misclassified_count == 0
    assert result.ssim == 1.0
    assert result.hausdorff == 0.0
    assert (result.edge_displacement_mean, result.edge_displacement_p95) == (0.0, 0.0)


def test_a_shifted_edge_is_as_far_as_it_was_shifted():
    result = lx.compare(half_plane(33), half_plane(30))
    assert result.false_lit_count == 3 * 40
    assert result.hausdorff == 3.0
    assert result.edge_displacement_mean == 3.0
    assert result.edge_displacement_p95 == 3.0
    assert lx.compare(half_plane(31), half_plane(30)).ssim > result.ssim


def test_one_wrong_speck_moves_the_hausdorff_distance_but_not_the_mean():
    image = half_plane(30)
    image[20, 5] = 0.0
    result = lx.compare(image, half_plane(30))
    assert result.hausdorff == pytest.approx(25.0, abs=1.0)
    assert result.edge_displacement_mean < 2.0


def test_images_without_edges():
    lit = np.ones((8, 9), np.float32)
    assert lx.compare(lit, lit).hausdorff == 0.0
    missed = lx.compare(np.ones((40, 60), np.float32), half_plane(30))
    assert missed.hausdorff == math.inf
    assert missed.edge_displacement_mean == math.inf
    assert missed.edge_displacement_p95 == math.inf


def test_the_rim_of_a_surface_is_no_shadow_edge():
    truth = np.zeros((40, 60), np.float32)
    truth[:, 30:] = np.nan
    assert lx.compare(truth, truth).edge_displacement.size == 0


def test_small_and_empty_images():
    assert math.isnan(lx.compare(np.ones((2, 2)), np.ones((2, 2))).ssim)
    assert lx.compare(np.ones((5, 5)), np.ones((5, 5))).ssim == 1.0
    nothing = lx.compare(np.full((9, 9), np.nan), np.full((9, 9), np.nan))
    assert (nothing.rate_covered, nothing.hausdorff) == (0.0, 0.0)


def test_partly_lit_counts_as_lit_from_one_half_on():
    image = np.array([[0.5, 0.49]])
    assert lx.compare(image, np.array([[1.0, 0.0]])).misclassified_count == 0
    image = np.array([[0.3, 0.0, 1.0, 0.7, 0.5, np.nan]])
    result = lx.compare(image, np.array([[1.0, 0.0, 1.0, 0.0, 1.0, np.nan]]))
    assert (result.false_shadow_count, result.false_lit_count) == (1, 1)
    assert result.partly_lit_count == 3
    assert np.array_equal(result.partly_lit, [[True, False, False, True, True, False]])
    assert str(result).endswith("0 ties not counted; 3 partly lit")


def test_ties_are_not_counted(view, truth):
    flipped = 1.0 - truth.visibility
    wrong = lx.compare(flipped, truth)
    assert wrong.misclassified_count == wrong.covered_count - wrong.tie_count
    tie = np.zeros_like(truth.tie)
    tie[:40] = True
    with pytest.warns(UserWarning, match="pixels are ties and not judged, as against .* face the"):
        result = lx.compare(flipped, dataclasses.replace(truth, tie=tie))
    assert not result.misclassified[:40].any()
    assert result.tie_count >= np.count_nonzero(truth.covered[:40])
    assert 0 < result.misclassified_count < wrong.misclassified_count
    assert result.judged_share == 1.0 - result.tie_count / result.covered_count
    assert "WARNING" in repr(result)
    assert "WARNING" not in repr(wrong)


def test_ties_of_float32_are_counted_on_their_own(truth):
    rows, columns = np.nonzero(truth.covered & ~truth.tie)
    float32_tie = np.zeros_like(truth.tie)
    float32_tie[rows[:7], columns[:7]] = True
    found = lx.compare(1.0 - truth.visibility, dataclasses.replace(truth, float32_tie=float32_tie))
    assert (found.tie_count, found.float32_tie_count) == (np.count_nonzero(truth.tie), 7)
    assert not found.misclassified[float32_tie].any()
    assert "ties not counted, 7 of float32" in str(found)


@pytest.mark.parametrize("share", [0.009, 0.011])
def test_more_ties_than_a_hundredth_of_what_faces_the_light_are_warned_of(truth, share):
    rows, columns = np.nonzero(truth.covered)
    count = int(share * np.count_nonzero(truth.facing))
    tie = np.zeros_like(truth.tie)
    tie[rows[:count], columns[:count]] = True
    marked = dataclasses.replace(truth, tie=tie, float32_tie=np.zeros_like(tie))
    if share < 0.01:
        assert lx.compare(truth.visibility, marked).warning is None
        return
    with pytest.warns(UserWarning, match=rf"{count} pixels are ties"):
        lx.compare(truth.visibility, marked)


def test_a_rim_pixel_may_lose_its_surface_only_where_the_first_hit_is_a_tie(truth):
    image = truth.visibility.copy()
    row, column = np.argwhere(truth.covered & ~truth.triangle_tie)[100]
    image[row, column] = np.nan
    with pytest.raises(
        ValueError, match=rf"1 only in reference, 0 only in .* row {row}, column {column}"
    ):
        lx.compare(image, truth)
    triangle_tie = truth.triangle_tie.copy()
    triangle_tie[row, column] = True
    result = lx.compare(image, dataclasses.replace(truth, triangle_tie=triangle_tie))
    assert result.misclassified_count == 0


def test_a_surface_that_only_one_image_sees_is_refused_or_misclassified(truth):
    image = truth.visibility.copy()
    image[truth.covered] = np.nan
    image[0, 0] = 1.0
    truth.triangle_tie[1, :] = True
    with pytest.raises(ValueError, match="must see surfaces in the same pixels"):
        lx.compare(image, truth)
    found = lx.compare(image, truth, other_surfaces="count")
    expected = truth.covered & ~truth.triangle_tie
    expected[0, 0] = True
    assert np.array_equal(found.misclassified, expected)
    assert np.array_equal(found.other_surface, expected)
    assert found.misclassified_count == np.count_nonzero(expected)
    assert found.false_lit_count == found.false_shadow_count == 0
    with pytest.raises(ValueError, match="other_surfaces must be 'refuse' or 'count', got 'skip'"):
        lx.compare(image, truth, other_surfaces="skip")


def test_rates_over_what_faces_the_light(view, truth):
    result = lx.compare(1.0 - truth.visibility, truth)
    assert result.facing_count == np.count_nonzero(truth.facing)
    assert 0 < result.facing_count < result.covered_count
    assert result.rate_facing > result.rate_covered
    assert "of lit-facing" in str(result)


def test_frames_are_compared_as_they_are(view, truth):
    frame = lx.render(*view, lx.DesiredView(resolution=512))
    assert lx.compare(frame, truth).as_dict() == lx.compare(frame.visibility, truth).as_dict()


def test_picture_has_misclassified_pixels_in_red():
    truth, image = half_plane(30), half_plane(30)
    truth[0] = image[0] = np.nan
    image[10, 40], image[20, 3] = 1.0, 0.0
    result = lx.compare(image, truth)
    picture = result.picture().astype(int)
    assert picture.shape == (40, 60, 3)
    red, green, blue = np.moveaxis(picture, 2, 0)
    assert np.array_equal((red > 2 * green) & (red > 2 * blue), result.misclassified)
    assert red[10, 40] > red[20, 3]
    html = result._repr_html_()
    assert "data:image/png;base64," in html
    assert "false_lit_count" in html


@pytest.mark.parametrize(
    ("image", "error", "words"),
    [
        (np.ones((40, 61)), ValueError, r"shape of reference, \(40, 60\), got \(40, 61\)"),
        (np.ones(40), ValueError, r"visibility must have shape \(H, W\), got \(40,\)"),
        (np.ones((40, 60), bool), TypeError, "visibility must be an array of real numbers"),
        (np.full((40, 60), 1.5), ValueError, r"visibility must be in \[0, 1\] or NaN, got 1.5"),
        (np.full((40, 60), np.nan), ValueError, "2400 only in reference, 0 only in visibility"),
    ],
)
def test_bad_images_are_named(image, error, words):
    with pytest.raises(error, match=words):
        lx.compare(image, half_plane(30))
    if "only" not in words and "shape of" not in words:
        with pytest.raises(error, match=words.replace("visibility", "reference")):
            lx.compare(half_plane(30), image)
