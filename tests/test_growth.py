"""How time and memory grow, on as little as shows that it is measured."""

import math
import multiprocessing

import numpy as np
import pandas as pd
import pytest

import lixel as lx
from lixel import cli
from lixel.lab import growth
from lixel.lab.own_process import in_own_process, peak_megabytes
from lixel.lab.result_tables import read


def test_growth_command_measures_every_series_and_goes_on(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    steps = (
        *(growth.Step("triangles", growth.objects, n, (32, 20)) for n in (0, 1)),
        *(growth.Step("threads", growth.objects, 0, (32, 20), count) for count in (1, 2)),
    )
    monkeypatch.setattr(growth, "QUICK", steps[:3])
    monkeypatch.setattr(growth, "METHODS", {"exact": lx.Exact(), "uniform": lx.Uniform()})
    command = ["lab", "growth", "--quick", "--repeats", "1", "-o", "growth.csv"]
    assert cli.main(command) == 0
    before = read(tmp_path / "growth.csv")
    monkeypatch.setattr(growth, "QUICK", steps)
    assert cli.main(command) == 0
    table = read(tmp_path / "growth.csv")
    # What was there is not measured again.
    pd.testing.assert_frame_equal(table.head(len(before)), before)
    assert list(table["series"]) == ["triangles"] * 4 + ["threads"] * 4
    assert list(table["method"]) == ["exact", "uniform"] * 4
    assert list(table["triangles"].unique()) == [4098, 17794]
    assert list(table["threads"].iloc[4:]) == [1, 1, 2, 2]
    assert (table[["ms", "processor ms", "ms with building"]] > 0.0).all().all()
    assert (table["MB of scene"] > 5.0).all()
    assert (table["MB"] >= table["MB of scene"]).all()
    assert (table.loc[table["method"] == "exact", "misclassified"] == 0).all()
    assert (table["covered"] > 100).all()
    assert table.attrs["command"] == "lixel lab growth --quick --repeats 1 -o growth.csv"
    assert "exponent" in capsys.readouterr().out


def test_rates_are_of_the_step_before_and_of_one_thread():
    shared = {"method": "exact", "pixels": 100}
    rows = [
        {"series": "triangles", "step": 0, "triangles": 10, "ms": 1.0},
        {"series": "triangles", "step": 1, "triangles": 40, "ms": 2.0},
        {"series": "triangles", "step": 2, "triangles": 160, "ms": 32.0},
        {"series": "threads", "step": 1, "triangles": 10, "ms": 8.0},
        {"series": "threads", "step": 2, "triangles": 10, "ms": 4.0},
        {"series": "threads", "step": 4, "triangles": 10, "ms": 2.5},
        {"series": "heap", "step": 1, "triangles": 10, "ms": 1.0},
        {"series": "heap", "step": 2, "triangles": 90, "ms": 3.0},
    ]
    table = growth.with_rates(pd.DataFrame([{**shared, **row} for row in rows]))
    np.testing.assert_allclose(table["exponent"], [math.nan, 0.5, 2.0, *5 * [math.nan]])
    expected = [*4 * [math.nan], 2.0, 3.2, math.nan, math.nan]
    np.testing.assert_allclose(table["speed-up"], expected)


def test_floors_below_each_other_do_not_coincide(monkeypatch):
    """Which of them a pixel sees is no matter of rounding, but where both are far away."""
    monkeypatch.setattr(growth, "SUBDIVISIONS", 0)
    scene = growth.on_wider_floor(100.0)
    camera = scene.cameras["default"].resized(96, 60)
    truth = lx.reference(scene, camera, scene.lights["default"])
    assert truth.covered.mean() > 0.75
    assert truth.triangle_tie.mean() < 0.05


def test_a_heap_lies_in_the_middle_of_all_that_is_seen():
    scene = growth.heap(500.0)
    assert scene.triangle_count == 502
    camera = scene.cameras["default"].resized(96, 60)
    truth = lx.reference(scene, camera, scene.lights["default"])
    places = truth.position[truth.covered]
    assert np.ptp(places[:, 0]) > 0.9 * 2 * growth.HEAP_FLOOR
    assert np.abs(scene.vertices[4:, [0, 2]]).max() < 2.0


def test_every_step_is_another():
    for steps in (growth.SERIES, growth.QUICK):
        assert len({(step.series, step.grows) for step in steps}) == len(steps)


def filled(megabytes: int) -> tuple[float, str]:
    array = np.ones(megabytes * 1_000_000, np.uint8)
    return peak_megabytes() + 0.0 * array[0], multiprocessing.current_process().name


def test_a_process_by_itself_knows_its_own_memory():
    ballast = np.ones(300_000_000, np.uint8)
    few, name = in_own_process(filled, 1)
    many, _ = in_own_process(filled, 200)
    assert name != multiprocessing.current_process().name
    assert many - few == pytest.approx(199.0, abs=20.0)
    # What this process has is none of theirs.
    assert few < 250.0 < ballast.nbytes / 1e6 < peak_megabytes()
