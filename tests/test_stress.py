"""Views that are hard for float32 and for maps: every method within its bound, or a known limit.
`lixel lab stress` has more of each family and prints the table."""

from __future__ import annotations

import os

import numpy as np
import pandas as pd
import pytest

import lixel as lx
from lixel import cli
from lixel.lab import culling, hard_views, stress
from lixel.lab.result_tables import read

CASES = hard_views.cases()
MAPS = [name for name in lx.METHODS if name not in hard_views.WITHOUT_MAP]


@pytest.mark.parametrize("method", hard_views.WITHOUT_MAP)
@pytest.mark.parametrize("case", CASES, ids=str)
def test_methods_without_a_map_are_within_their_bounds(case, method):
    found = stress.evaluate(case, method)
    assert found["beyond"] == 0 or found["limit"], found
    if method in stress.EXACT:
        assert found["misclassified"] == 0, found


@pytest.mark.parametrize("case", [case for case in CASES if case.quick], ids=str)
def test_maps_are_within_their_bounds(case):
    for method in hard_views.methods_for(case, MAPS):
        found = stress.evaluate(case, method)
        assert found["beyond"] == 0 or found["limit"], found


@pytest.mark.parametrize("limit", stress.LIMITS, ids=lambda limit: limit.cases[0])
def test_known_limits_are_still_limits(limit):
    """One that is gone leaves the list."""
    engine = "cpu" if os.environ["LIXEL_DEVICE"] == "cpu" else "gpu"
    if engine not in limit.engines:
        pytest.skip(f"not met on the engine {engine}")
    known = [case for case in CASES if str(case) in limit.cases]
    assert len(known) == len(limit.cases)
    for case in known:
        methods = hard_views.methods_for(case, limit.methods)
        assert any(stress.evaluate(case, method)["beyond"] for method in methods), str(case)


def test_references_of_hard_views_are_more_than_ties():
    """A case in which everything is a tie would test nothing."""
    for case in CASES:
        truth = lx.reference(*(case.truth or case.make)())
        ties = np.count_nonzero(truth.covered & (truth.tie | truth.float32_tie))
        assert ties < 0.05 * truth.covered.sum(), str(case)


def test_a_wrong_picture_is_beyond_every_bound(view):
    truth = lx.reference(*view)
    frame = lx.render(*view, lx.DesiredView(resolution=hard_views.RESOLUTION))
    scene, camera, light = view
    finer = camera.resized(stress.FINER * camera.width, stress.FINER * camera.height)
    inside = stress.explained(frame, truth, lx.reference(scene, finer, light))
    assert 0 < inside.sum() < 0.7 * truth.covered.sum()
    for lit in (0.0, 1.0):
        flat = np.where(truth.covered, np.float32(lit), np.nan)
        assert (lx.compare(flat, truth).misclassified & ~inside).sum() > 10


def test_what_is_thinner_than_a_pixel_has_an_edge():
    """No pixel's middle is in the shadow of this needle."""
    case = next(case for case in CASES if case.name == "needles, point light")
    (method,) = hard_views.methods_for(case, ["scene_optimized"])
    row = stress.evaluate(case, method)
    assert row["misclassified"] > 0
    assert row["beyond"] == 0


def test_scene_optimized_layer_that_no_sample_needs_is_lit():
    """Of the faces around this light, two have receivers but no shadow to be fitted to."""
    (case,) = (case for case in CASES if case.name == "10^-4 above the floor")
    view = case.make()
    frame = lx.render(*view, lx.SceneOptimized(resolution=512, lookup="triangle"))
    assert frame.stats["skipped_layers"] > 0
    assert lx.compare(frame, lx.reference(*view)).false_shadow_count == 0


def test_culling_changes_no_pixel():
    table = pd.DataFrame(culling.measure(repeats=1))
    assert table["same"].all(), table[~table["same"]]
    if os.environ["LIXEL_DEVICE"] == "cpu":
        return
    # And something is skipped, of each kind that shaders count.
    assert (table["culled_by_depth"] > 0).any()
    assert (table["skipped_layers"] > 0).any()
    assert (table["items"] < 0.9 * table["whole_items"]).any()
    assert (table["settled"] > 0).any()
    assert table["skipped"].str.contains("visibility").all()
    assert table["skipped"].str.contains("hierarchy").any()


def test_unknown_families_and_methods_are_refused():
    with pytest.raises(ValueError, match=r"family must be one of moved, .*, got 'rain'"):
        hard_views.cases(["rain"])
    with pytest.raises(ValueError, match="unknown"):
        stress.measure(["unknown"], ["image"])


def test_stress_command_prints_and_writes_the_table(capsys, tmp_path):
    table = tmp_path / "stress.csv"
    options = ["--quick", "--family", "image", "--method", "exact", "--method", "uniform"]
    assert cli.main(["lab", "stress", *options, "-o", str(table)]) == 0
    assert "uniform" in capsys.readouterr().out
    found = read(table)
    assert set(found["method"]) == {"exact", "uniform"}
    assert (found.loc[found["method"] == "exact", "misclassified"] == 0).all()
    assert cli.main(["lab", "stress", "-o", "table.txt"]) == 2
    assert "must end in .csv or .parquet" in capsys.readouterr().err


def test_culling_command_prints_and_writes_the_table(capsys, tmp_path):
    table = tmp_path / "culling.csv"
    assert cli.main(["lab", "culling", "--method", "uniform", "-o", str(table)]) == 0
    assert "from below the floor" in capsys.readouterr().out
    found = read(table)
    assert found["same"].tolist() == [True] * 3
    assert found.attrs["command"] == "lixel lab culling --method uniform -o culling.csv"
