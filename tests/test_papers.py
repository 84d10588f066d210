"""The papers' tables again: what is printed beside the papers' figures, on small scenes."""

import dataclasses

import pytest

import lixel as lx
from lixel import cli
from lixel.lab import papers, passes
from lixel.lab.papers import measuring, rosen
from lixel.lab.papers.tables import Row, SubstituteScene, Table
from lixel.lab.result_tables import read

SMALL = {
    "size": (128, 96),
    "resolution": 64,
    "scenes": {
        "A": SubstituteScene("needles", {"count": 40}),
        "B": SubstituteScene("city", {"blocks": 3}),
    },
}


@pytest.fixture
def with_tables(monkeypatch):
    def use(*tables):
        monkeypatch.setattr(papers, "TABLES", {each.name: each for each in tables})
        monkeypatch.setattr(papers, "NAMES", tuple(each.name for each in tables))

    return use


@pytest.mark.parametrize("each", papers.TABLES.values(), ids=lambda each: each.name)
def test_paper_tables_have_a_figure_for_each_column(each):
    columns = each.stages or each.scenes
    assert each.base in {row.name for row in each.rows}
    assert len({row.name for row in each.rows}) == len(each.rows)
    for row in each.rows:
        assert len(row.figures) == len(columns)
    # No row that cannot run.
    assert [row for row, _ in measuring.runnable(each)] == list(each.rows)
    if each.stages:
        assert len(each.scenes) == 1
        figures = [sum(row.figures) for row in each.rows]
        assert all(figures)


def test_measured_rows_are_beside_the_papers_figures(with_tables, tmp_path, capfd):
    with_tables(
        Table(
            "small", "Small", "nobody, 2000", base="SM", without=(passes.VISIBILITY,), path=2,
            rows=(
                Row("gbuffer", "uniform", (5.0, 6.0), passes=(passes.VISIBILITY,)),
                Row("SM", "uniform", (2.0, (1.0, 3.0))),
                Row("RTW", "rtw", ((1.0, 2.0), 8.0), {"resolution": 128}),
                Row("Later", "not_yet", (1.0, 1.0)),
            ),
            remark="So it is.",
            **SMALL,
        )
    )  # fmt: skip
    rows = papers.measure(folder=tmp_path, repeats=2)["small"]
    assert [(row["scene"], row["row"]) for row in rows] == [
        (scene, name) for scene in "AB" for name in ("gbuffer", "SM", "RTW")
    ]
    assert [row["paper, ratio"] for row in rows] == [2.5, 1.0, 0.75, 3.0, 1.0, 4.0]
    assert [row["paper, ms"] for row in rows] == ["5", "2", "1-2", "6", "1-3", "8"]
    assert rows[2]["ours"] == "rtw 128²"
    measured = read(tmp_path / "small.csv")
    ms = measured.assign(ms=measured["gpu_ms"] - measured["pass_ms.visibility"])
    ms = ms.groupby(["scene", "method"])["ms"].median()
    assert rows[2]["ours, ratio"] == pytest.approx(ms["A", "rtw"] / ms["A", "uniform"])
    wrong = measured.groupby(["scene", "method"])["misclassified_count"].sum()
    assert rows[5]["misclassified"] == wrong["B", "rtw"]
    assert "misclassified" not in rows[0]
    out = capfd.readouterr().out
    assert "for A: needles(count=40), 242 triangles" in out
    assert "left out, because this version has no such method: Later" in out
    assert "So it is." in out
    # What was measured is kept.
    papers.measure(folder=tmp_path, repeats=2)
    assert read(tmp_path / "small.csv").equals(measured)


def test_stages_are_shares_of_the_frame(with_tables):
    rest = (*passes.IMPORTANCE, *passes.RECEIVERS, passes.LOOKUP)
    with_tables(
        Table(
            "stages", "Stages", "nobody, 2000", base="RTW",
            rows=(Row("RTW", "rtw", (3.0, 1.0)),),
            stages={"map": (passes.SHADOW_MAP,), "rest": rest},
            **{**SMALL, "scenes": {"A": SubstituteScene("needles", {"count": 40})}},
        )
    )  # fmt: skip
    rows = papers.measure(repeats=1)["stages"]
    assert [row["stage"] for row in rows] == ["map", "rest"]
    assert [row["paper, %"] for row in rows] == [75.0, 25.0]
    assert sum(row["ours, %"] for row in rows) == pytest.approx(100.0)


def test_rows_in_another_order_than_the_papers_are_named():
    def row(name, paper, ours):
        return {"scene": "A", "row": name, "paper, ratio": paper, "ours, ratio": ours}

    rows = [row("SM", 1.0, 1.0), row("DV", 1.5, 0.9), row("RTW", 2.0, 1.02), row("Far", 9.0, 9.0)]
    assert list(measuring.turned(rows)) == ["A: DV is slower than SM only in the paper"]


def test_quick_halves_images_and_maps(with_tables, monkeypatch, capfd):
    each = Table(
        "small", "Small", "nobody, 2000", base="SM", path=9,
        rows=(
            Row("SM", "uniform", (1.0, 1.0)),
            Row("S", "uniform", (1.0, 1.0), {"resolution": 32}),
        ),
        **SMALL,
    )  # fmt: skip
    with_tables(each)
    seen = []
    monkeypatch.setattr(papers, "measure_table", lambda *given: seen.append(given) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        papers.measure(quick=True)
    ((halved, repeats, _),) = seen
    assert (halved.size, halved.resolution, halved.path) == ((64, 48), 32, 2)
    assert halved.rows[1].parameters == {"resolution": 16}
    assert repeats == 3
    assert (
        dataclasses.replace(halved, rows=each.rows, path=9, size=(128, 96), resolution=64) == each
    )


def test_a_path_turns_the_camera():
    camera = lx.scenes.city(blocks=2).cameras["default"]
    path = measuring._path(camera, 3)
    assert path["1"].pose == pytest.approx(camera.pose)
    assert path["0"].pose != pytest.approx(camera.pose)
    assert all(each.eye == pytest.approx(camera.eye) for each in path.values())


def test_an_unknown_table_is_refused(capfd):
    assert cli.main(["lab", "papers", "rosen-9"]) == 2
    assert "table must be one of rosen-1" in capfd.readouterr().err


def test_rows_without_a_figure_of_the_paper_are_measured(with_tables, capfd):
    with_tables(
        Table(
            "straight", "Straight", "nobody, 2000", base="rtw, not split",
            rows=rosen.straight_and_exact("rtw", (((1.0), (2.0, 3.0)),) * 4),
            details=rosen.DRAWN,
            **SMALL,
        )
    )  # fmt: skip
    rows = papers.measure(repeats=1)["straight"]
    assert [row["paper, ratio"] for row in rows[:5]] == [1.0, 1.0, 1.0, 1.0, None]
    assert [row["paper, ms"] for row in rows[5:]] == ["2-3"] * 4 + ["-"]
    drawn = [row["triangles drawn"] for row in rows[5:]]
    assert drawn[:4] == sorted(drawn[:4])
    assert drawn[3] > drawn[0]
    assert rows[5]["misclassified"] > rows[9]["misclassified"]
