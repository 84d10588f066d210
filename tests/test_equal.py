"""Every method at equal texels and in equal time."""

import pandas as pd
import pytest
from views import write_folder

from lixel import cli
from lixel.lab import equal
from lixel.lab.result_tables import read


def cases(method, times, counts, scene="a", resolutions=equal.RESOLUTIONS):
    rows = zip(resolutions, times, counts, strict=True)
    return [
        {"scene": scene, "method": method, "resolution": r, "wall_ms": t, "misclassified_count": c}
        for r, t, c in rows
    ]


def test_what_is_misclassified_in_a_time_lies_between_the_sizes_of_maps():
    table = pd.DataFrame(cases("m", [10, 20, 40, 80], [999, 99, 9, 0]))
    for time, expected in [(10, 999), (20, 99), (40, 9), (80, 0), (1000, 0), (9.6, 999)]:
        assert equal.misclassified_in(table, time) == pytest.approx(expected)
    assert equal.misclassified_in(table, 9.4) is None
    # Halfway by ratio, as by a power: a root of ten of the pixels and one.
    assert equal.misclassified_in(table, 20 * 2**0.5) == pytest.approx(100 / 10**0.5 - 1)
    # A larger map that took less stands for the smaller one, too.
    odd = pd.DataFrame(cases("m", [10, 30, 20, 80], [999, 99, 9, 0]))
    assert equal.misclassified_in(odd, 20) == pytest.approx(9)
    assert equal.misclassified_in(odd, 29) < 9


def test_summary_adds_scenes_up():
    table = pd.DataFrame(
        cases("desired_view", [10, 20, 40, 80], [400, 200, 100, 50])
        + cases("desired_view", [10, 20, 40, 80], [800, 400, 300, 50], "b")
        + cases("slow", [20, 40, 80, 160], [99, 49, 20, 5])
        + cases("slow", [60, 70, 80, 160], [99, 50, 20, 5], "b")
        + cases("exact", [5], [0], resolutions=[None])
        + cases("exact", [5], [0], "b", resolutions=[None])
    )
    rows = equal.summary(table).set_index("method")
    assert rows["misclassified"].to_dict() == {"desired_view": 400, "slow": 40, "exact": 0}
    assert rows["times desired_view's"].to_dict() == {"desired_view": 1, "slow": 0.1, "exact": 0}
    assert rows["time"].to_dict() == {"desired_view": 1, "slow": 2, "exact": 0.12}
    assert rows["scenes in equal time"].to_dict() == {"desired_view": 2, "slow": 1, "exact": 2}
    assert rows["in equal time"].to_dict() == {"desired_view": 1, "slow": 0.49, "exact": 0}


def test_command_measures_every_method_and_goes_on(tmp_path, view, capfd, monkeypatch):
    monkeypatch.setenv("LIXEL_DEVICE", "cpu")
    monkeypatch.setattr(equal, "RESOLUTIONS", (16, equal.EQUAL))
    write_folder(tmp_path, view.scene, [{"kind": "directional", "direction": [0.5, -1.0, -0.3]}])
    path = tmp_path / "equal.csv"
    line = ["lab", "equal", str(tmp_path), "--size", "48x32", "--repeats", "1", "-o", str(path)]
    assert cli.main(line) == 0
    table = read(path)
    assert {"exact", "ray_traced", "virtual", "cascades", "rtw", "notw"} <= set(table["method"])
    assert (table.groupby("method").size() <= 2).all()
    assert table.query("method == 'exact'")["misclassified_count"].sum() == 0
    assert "in equal time" in capfd.readouterr().out
    # What is there is not measured again.
    monkeypatch.setattr(equal, "study", None)
    assert cli.main(line) == 0
    assert read(path).equals(table)
