"""Experiments of papers, on as little as shows that they run."""

from __future__ import annotations

import json

import numpy as np
import pytest

import lixel as lx
from lixel import cli, scenes
from lixel.lab import papers
from lixel.lab.papers import chong_gortler
from lixel.lab.result_tables import read, save

TABLE_1 = ["lab", "papers", "chong-1", "--quick"]


def test_lights_are_the_same_at_every_call_and_come_from_above():
    towards = np.array([-light.direction for light in chong_gortler.random_lights(200)])
    again = np.array([-light.direction for light in chong_gortler.random_lights(200)])
    assert np.array_equal(towards, again)
    assert (towards[:, 1] >= 0).all()
    # Evenly: heights on the sphere are.
    assert abs(towards[:, 1].mean() - 0.5) < 0.06


def test_percentages_and_the_worst_tenth():
    wrong = np.arange(1.0, 21.0)
    rows = chong_gortler.summary(["a", "uniform"], np.stack([wrong, 3 * wrong]))
    assert rows[0]["misclassified"] == 210
    assert rows[0]["% more"] == 0.0
    assert rows[1]["% more"] == pytest.approx(200.0)
    assert rows[0]["mean of the worst tenth"] == 19.5


def test_table_1_is_laid_out_as_in_the_paper():
    """Each row's lights are the worst of its own method."""
    names = list(chong_gortler.methods(64))
    wrong = np.full((len(names), 20), 10.0)
    wrong[names.index("uniform"), 5:7] = 100.0
    wrong[names.index("lispsm, frustum")] = 15.0
    rows = chong_gortler.layout(names, wrong)
    assert [row["fits"] for row in rows] == ["the paper's"] * 6 + ["the best"] * 6
    assert rows[0]["Normal"] == "19, +90 % (+187 %)"
    assert rows[0]["LiSPSM"] == "15, +50 % (+55 %)"
    assert rows[6]["LiSPSM"] == "10, +0 % (+55 %)"
    assert rows[5]["lights"] == "Worst 10%, Normal"
    assert rows[5]["Normal"] == "100, +900 % (+379 %)"
    assert rows[5]["Optimal"] == "10, +0 % (+0 %)"


@pytest.fixture
def small(monkeypatch):
    scene = scenes.objects_on_floor(count=9, subdivisions=1)
    monkeypatch.setattr(chong_gortler, "objects_on_floor", lambda **_: scene)
    return scene


def test_papers_command_prints_table_1_and_resumes(small, capsys, tmp_path, monkeypatch):
    assert cli.main([*TABLE_1, "--lights", "2", "-o", str(tmp_path)]) == 0
    printed = capsys.readouterr().out
    for name in chong_gortler.methods(200):
        assert name in printed
    for fits in chong_gortler.FITS.values():
        assert set(fits) < set(chong_gortler.methods(200))
    path = tmp_path / "chong-1.parquet"
    whole = read(path)
    assert len(whole) == 2 * len(chong_gortler.methods(200))
    # The second light is lost and measured again, the first is not.
    save(whole[whole["light"] == 0], path)
    truths = []

    def reference(*view):
        truths.append(view)
        return lx.reference(*view)

    monkeypatch.setattr(chong_gortler, "reference", reference)
    assert cli.main([*TABLE_1, "--lights", "2", "-o", str(tmp_path)]) == 0
    assert len(truths) == 1
    assert read(path).equals(whole)
    assert read(path).attrs == whole.attrs
    assert capsys.readouterr().out == printed


def test_another_scene_is_seen_by_the_camera_of_its_views(tmp_path, capsys):
    camera = {"eye": [0, 500, 0], "target": [0, 0, 0], "up": [0, 0, 1], "fov_y_deg": 60}
    (tmp_path / "views.json").write_text(json.dumps({"cameras": [camera]}))
    given = ["--scene", "plane_and_box", "--views", str(tmp_path / "views.json")]
    assert cli.main([*TABLE_1, *given, "--lights", "1", "-o", str(tmp_path)]) == 0
    table = read(tmp_path / "chong-1.parquet")
    # From so high it is small.
    assert table["covered"].between(1, 999).all()
    assert table.attrs["command"].endswith("--quick --scene plane_and_box --views views.json")
    assert cli.main([*TABLE_1, *given[2:]]) == 2
    assert "--views must come with --scene" in capsys.readouterr().err


def test_a_folder_of_another_experiment_is_refused(small, tmp_path, capsys):
    chong_gortler.misclassified(True, tmp_path, lights=1)
    for quick, scene in ((False, None), (True, "plane_and_box")):
        with pytest.raises(ValueError, match=r"chong-1\.parquet must be the table of"):
            chong_gortler.misclassified(quick, tmp_path, lights=1, scene=scene)
    assert cli.main(["lab", "papers", "chong-2", "--lights", "1"]) == 2
    assert "--lights must come with the table chong-1 alone" in capsys.readouterr().err


def test_times_are_beside_the_papers(small, capsys, tmp_path, monkeypatch):
    monkeypatch.setattr(chong_gortler, "SIZES", {"2 lights, 500²": (2, 500)})
    found = papers.measure(["chong-2", "chong-3"], quick=True, folder=tmp_path)
    (row,) = found["chong-2"]
    assert (row["lights"], row["map"]) == (2, 250)
    # 39.3 and 44.4 frames per second.
    assert row["Optimal, ms"].endswith("(25.4)")
    assert row["Optimal / Focused"].endswith("(1.13)")
    stages = {(row["map"], row["stage"]): row for row in found["chong-3"]}
    assert len(stages) == 8
    fit, whole = (stages["Optimal", name] for name in ("Optimization", "Total scene"))
    assert 0 < fit["ours, ms"] < whole["ours, ms"]
    assert stages["Optimal", "Convex Hull"]["ours, ms"] is None
    assert stages["Normal", "Optimization"]["paper, %"] == 0.4
    assert "Render & Wait" in capsys.readouterr().out
    assert {path.name for path in tmp_path.iterdir()} == {"chong-2.csv", "chong-3.csv"}
