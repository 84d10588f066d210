"""What departures from the papers gain: the command, and what it compares."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

import lixel as lx
from lixel import cli
from lixel.lab import departures
from lixel.lab.result_tables import read


@pytest.mark.parametrize("name", departures.runs())
def test_each_departure_changes_what_it_names(name):
    tried = departures.departures(name, 64)
    published, default = tried[""], tried[departures.ALL]
    assert published.map_resolution == default.map_resolution == 64
    together = dict(published.parameters())
    for departure, method in tried.items():
        changed = {
            parameter: value
            for parameter, value in method.parameters().items()
            if value != published.parameters()[parameter]
        }
        if departure not in ("", departures.ALL):
            assert departure in changed
            together.update({key: default.parameters()[key] for key in changed})
    # One at a time they are all of the way to the default.
    assert together == default.parameters()


@pytest.mark.of_checkout("it reads the results of the repository")
@pytest.mark.parametrize("name", departures.runs())
def test_the_gain_of_each_departure_is_known(name):
    path = Path(__file__).parents[1] / "docs" / "results" / "departures" / "cpu.parquet"
    summary = departures.summary(read(path).query("method == @name"))
    known = dict(zip(summary["departure"], summary["views"], strict=True))
    assert set(known) == set(departures.departures(name, departures.RESOLUTION)) - {""}
    assert min(known.values()) >= 5


def test_shared_functions_are_those_of_the_default(view):
    frame = lx.render(*view, lx.NonOrthogonalWarp(resolution=64))
    rows = frame.warp_map[0]
    assert departures.SHARED_FUNCTIONS in rows.shape


def test_a_summary_is_of_views():
    table = pd.DataFrame(
        {
            "scene": ["a", "a", "b", "b", "c", "c"],
            "light": "0",
            "method": "rtw",
            "departure": ["published", "lookup"] * 3,
            "misclassified": [100, 50, 10, 1, 0, 3],
        }
    )
    [row] = departures.summary(table).to_dict("records")
    assert row["views"] == 3
    assert (row["published"], row["departed"]) == (110, 54)
    assert row["median ratio"] == pytest.approx(0.3)


def test_the_command_resumes(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(departures, "SCENES", {"plane_and_box": {}})
    path = tmp_path / "table.csv"
    command = ["lab", "departures", "--size", "48x27", "--lights", "1", "--method", "uniform"]
    assert cli.main([*command, "-o", str(path)]) == 0
    table = read(path)
    departed = ["published", "rasterization", "lookup", "rotation", "all"]
    assert table["departure"].tolist() == departed
    assert cli.main([*command, "-o", str(path)]) == 0
    assert len(read(path)) == len(table)
    assert "median ratio" in capsys.readouterr().out
