"""The smoothing that suits a view: as a word, as a number, and computed anew from the receivers."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from views import small

import lixel as lx
from lixel import cli
from lixel.lab.study import study
from lixel.warps import receiver_places, warp_points

PUBLISHED = lx.NonOrthogonalWarp.published(resolution=64, tessellation=None)
AUTOMATIC = replace(PUBLISHED, smoothing="automatic")
SHARES = (1 / 64, 1 / 32, 1 / 16, 1 / 8, 1 / 4)


def city():
    scene = small("city")
    return scene, scene.cameras["default"].resized(160, 90), scene.lights["default"]


# --- The estimate once more, from the receivers in numpy ---


def warp_of_places(places, method, cells):
    """(2, functions, cells + 1): the warp that spreads receivers at places of a map (Milet et al.,
    Eq. 1 to 6)."""
    along_x = functions_of_counts(counted(places, cells), method)
    identity = np.broadcast_to(np.linspace(0.0, 1.0, cells + 1), along_x.shape)
    after_rows = warp_points(np.stack([along_x, identity]), places)
    return np.stack([along_x, functions_of_counts(counted(after_rows, cells).T, method)])


def functions_of_counts(counts, method):
    """(functions, cells + 1): prefix sums of the rows, smoothed among them."""
    cells = len(counts)
    functions = method.function_count or cells
    # Twice a window of 2 h + 1 rows has the variance ((2 h + 1)^2 - 1) / 6.
    half = min(round((math.sqrt(6.0 * method.smoothing**2 + 1.0) - 1.0) / 2.0), cells)
    if half:
        for _ in range(2):
            sums = np.pad(counts, ((half + 1, half), (0, 0))).cumsum(axis=0)
            counts = sums[2 * half + 1 :] - sums[: -2 * half - 1]
    served = np.arange(functions) * cells // functions
    sums = np.add.reduceat(counts, served, axis=0)
    weights = np.where(sums > 0.0, sums**method.exponent, 0.0)
    totals = weights.sum(axis=1, keepdims=True)
    even = np.linspace(0.0, 1.0, cells + 1)
    prefix = np.pad(weights.cumsum(axis=1), ((0, 0), (1, 0)))
    values = np.where(totals > 0.0, prefix / np.maximum(totals, 1e-300), even)
    values[:, -1] = 1.0
    return (1.0 - method.even_share) * values + method.even_share * even


def counted(places, cells):
    """(cells, cells): how many are in each cell, row by row."""
    column, row = cells_of(places, cells).T
    found = np.bincount(row * cells + column, minlength=cells * cells)
    return found.reshape(cells, cells).astype(np.float64)


def cells_of(places, cells):
    return np.minimum((places * cells).astype(np.int64), cells - 1)


def estimated(places, method, cells):
    """How many pixels are wrong, but for a factor, of the receivers at places of a layer."""
    counts, warp = counted(places, cells), warp_of_places(places, method, cells)
    column, row = cells_of(places, cells).T
    middle = warp_points(warp, places)
    missed, stretched = np.zeros(len(places)), np.ones(len(places))
    for axis in (0, 1):
        step = np.zeros(2)
        step[axis] = 0.5 / cells
        before, after = (warp_points(warp, places + sign * step) for sign in (-1.0, 1.0))
        miss = method.resolution * np.linalg.norm((before + after) / 2 - middle, axis=1)
        missed = np.maximum(missed, miss)
        stretched *= np.maximum(cells * (after - before)[:, axis], 1e-3)
    return float(np.sum(np.sqrt(counts[row, column] / stretched) * (1.0 + missed)))


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
    view = city()
    method = replace(PUBLISHED, **changes)
    frame = lx.render(*view, method)
    places = receiver_places(frame, 0)
    found = warp_of_places(places, method, 64)
    # The engine's roots are of 24 bits. A receiver at the border of two cells may be in either.
    assert np.quantile(np.abs(found - frame.warp_map[0]), 0.99) < 1e-3
    assert np.abs(found - frame.warp_map[0]).mean() < 1e-4


@pytest.mark.parametrize("changes", [{}, {"fit": "cascades"}, {"exponent": 0.5, "even_share": 0.1}])
def test_the_estimate_is_least_for_it(changes, engine):
    """Of all receivers in numpy, where the engine asks some of them: to a hundredth."""
    view = city()
    method = replace(AUTOMATIC, importance_resolution=48, **changes)
    frame = lx.render(*view, method)
    of_layers = [receiver_places(frame, layer) for layer in range(len(frame.shadow_map))]
    errors = {
        share * 48: sum(
            estimated(places, replace(method, smoothing=share * 48), 48) for places in of_layers
        )
        for share in SHARES
    }
    assert errors[frame.stats["smoothing"]] <= 1.01 * min(errors.values()), errors
    assert max(errors.values()) > 1.1 * min(errors.values()), errors


# --- The word and the number ---


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"fit": "cascades", "importance_resolution": 32},
        {"importance": "count*shadow_edge", "analysis_resolution": 64},
    ],
)
def test_the_word_renders_as_its_number_does(changes, engine):
    view = city()
    automatic = replace(AUTOMATIC, **changes)
    number = lx.automatic_smoothing(*view, replace(PUBLISHED, **changes))
    by_word = lx.render(*view, automatic)
    assert by_word.stats["smoothing"] == number
    assert by_word.method.smoothing == "automatic"
    by_hand = lx.render(*view, replace(automatic, smoothing=number))
    assert "smoothing" not in by_hand.stats
    for output in ("visibility", "warp_map", "shadow_map", "importance_map"):
        assert getattr(by_word, output).tobytes() == getattr(by_hand, output).tobytes(), output
    # Another number would be seen.
    other = lx.render(*view, replace(automatic, smoothing=number + 3.0))
    assert other.warp_map.tobytes() != by_word.warp_map.tobytes()


def test_lights_together_have_each_their_own(engine):
    scene, camera, _ = city()
    lights = [lx.DirectionalLight((0.1, -1.0, 0.0)), lx.DirectionalLight((1.0, -0.15, 0.3))]
    together = lx.render_shadows(scene, camera, lights, AUTOMATIC)
    alone = [lx.render_shadows(scene, camera, light, AUTOMATIC) for light in lights]
    assert np.stack(alone).tobytes() == np.asarray(together).tobytes()


def test_words_are_refused_by_name_with_the_nearest():
    with pytest.raises(ValueError, match=r"smoothing must be a finite number, at least 0 or 'autom"
                       r"atic' or None, got 'automatc'; did you mean 'automatic'\?"):  # fmt: skip
        replace(PUBLISHED, smoothing="automatc")
    with pytest.raises(ValueError, match=r"smoothing must be .* got -1"):
        replace(PUBLISHED, smoothing=-1)
    with pytest.raises(TypeError, match=r"smoothing must be .* got \[\]"):
        replace(PUBLISHED, smoothing=[])
    with pytest.raises(ValueError, match="must be 'linear' with smoothing='automatic', got 'exact"):
        lx.NonOrthogonalWarp(smoothing="automatic")


def test_the_command_line_takes_the_word(tmp_path):
    picture = tmp_path / "word.npy"
    method = ["--method", "notw@published", "--resolution", "64", "--set", "tessellation=None"]
    command = ["render", "city", "--size", "64x36", *method, "--set", "smoothing=automatic"]
    assert cli.main([*command, "-o", str(picture)]) == 0
    scene = lx.scenes.city()
    camera, light = scene.cameras["default"].resized(64, 36), scene.lights["default"]
    assert (
        np.load(picture).tobytes() == lx.render_shadows(scene, camera, light, AUTOMATIC).tobytes()
    )


def test_studies_take_the_word():
    found = study(
        {"city": ("city", {"blocks": 3})},
        methods=["notw@published"],
        parameters={"smoothing": ["automatic", 2.0], "resolution": [64], "tessellation": [None]},
        size=(64, 36),
        repeats=1,
        progress=False,
    )
    assert found["smoothing"].tolist() == ["automatic", 2.0]
    assert found["error"].isna().all()
    assert found["stats.smoothing"].iloc[0] in {64 * share for share in SHARES}


# --- What it is good for ---


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
            for share in SHARES
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
    assert found <= {share * 64 for share in SHARES}
    below = lx.DirectionalLight((0.0, 1.0, 0.0))
    assert lx.automatic_smoothing(scene, camera, below, PUBLISHED) == 1.0


def test_other_methods_are_refused(view):
    with pytest.raises(
        ValueError, match="rasterization must be 'linear' with smoothing='automatic"
    ):
        lx.automatic_smoothing(*view, "notw")
    with pytest.raises(TypeError, match=r"method must be a lixel\.NonOrthogonalWarp, got"):
        lx.automatic_smoothing(*view, "rtw@published")
