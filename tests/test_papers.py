"""The papers' tables again: what is printed beside the papers' figures, on small scenes."""

import csv
import dataclasses
from pathlib import Path

import numpy as np
import pytest

import lixel as lx
from lixel import cli
from lixel.lab import papers, passes
from lixel.lab.papers import (
    chong_gortler,
    drawings,
    figures,
    measuring,
    milet,
    path,
    rosen,
    rows as rows_of_papers,
)
from lixel.lab.papers.fence import fence
from lixel.lab.papers.tables import Row, SubstituteScene, Table, both
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


# --- The papers' own figures ---


def printed(paper, place):
    """{row: {column: figure}}, read anew from the file."""
    path = Path(papers.__file__).parent / "figures.csv"
    rows = {}
    for line in csv.DictReader(path.read_text(encoding="utf-8").splitlines()):
        if (line["paper"], line["place"]) == (paper, place):
            low, high = float(line["from"]), line["to"]
            value = (low, float(high)) if high else low
            rows.setdefault(line["row"], {})[line["column"]] = value
    return rows


def test_figures_agree_with_the_arithmetic_of_the_papers():
    # Rosen, Table 2: stages add up to the total.
    *stages, total = printed(figures.ROSEN, "Table 2").values()
    for column, whole in total.items():
        # A tessellated frame differs in the shadow map only.
        plain = column.removesuffix(", tessellated")
        parts = (stage.get(column, stage.get(plain, 0.0)) for stage in stages)
        assert sum(parts) == pytest.approx(whole)
    # Milet et al., Table 2: steps of a frame, in percent, rounded.
    for row in printed(figures.MILET, "Table 2").values():
        for scene in ("Conf. room", "Sponza", "Observatory"):
            steps = (value for name, value in row.items() if name.startswith(f"{scene}, "))
            assert sum(steps) == pytest.approx(100.0, abs=0.3)
    # The thesis prints two tables of the paper again.
    assert printed(figures.MILET, "Table 1") == printed(figures.THESIS, "Table 5.3")
    assert printed(figures.MILET, "Table 3") == printed(figures.THESIS, "Table 5.1")
    # Chong and Gortler, Table 1: percentages follow from the counts; Table 3: shares from times.
    for row in printed(figures.CHONG, "Table 1").values():
        for name in chong_gortler.COLUMNS:
            more = 100.0 * (row[name] / row["Optimal"] - 1.0)
            assert row[f"{name}, % more"] == pytest.approx(more, abs=0.011)
    frame = printed(figures.CHONG, "Table 3")
    for row in frame.values():
        for name in ("Optimal", "Normal"):
            share = 100.0 * row[name] / frame["Total scene"][name]
            assert row[f"{name}, % total"] == pytest.approx(share, abs=0.1)
    # Rosen: a map of a quarter of the side has a quarter of the effective resolution.
    small, large = (printed(figures.ROSEN, "Figure 1")[f"RTW {side}²"] for side in (512, 2048))
    for side in ("MER width", "MER height"):
        assert large[side] / small[side] == pytest.approx(4.0, rel=1e-3)


def test_the_caption_of_figure_1_of_rosen():
    rows = printed(figures.ROSEN, "Figure 1")
    assert [row["time"] for row in rows.values()] == [3.3, 4.2, 5.2]
    assert rows["RTW 512²"] == {"time": 4.2, "MER width": 2861.0, "MER height": 4083.0}
    assert rows["RTW 2048²"] == {"time": 5.2, "MER width": 11448.0, "MER height": 16333.0}


TABLES = {table: place for place, table in reversed(rows_of_papers.TABLES.items())}
"""Where the figures of each table stand; what the thesis prints again is the paper's."""


def pairs(table):
    """(row, column, figure) of the rows as published, as the paper has them."""
    for row in table.rows:
        if row.by == "published":
            for column, value in row.figures.items():
                yield row.name, column, value


@pytest.mark.parametrize("name", sorted(papers.TABLES.keys() & TABLES.keys()))
def test_tables_print_every_figure_of_the_paper(name):
    """Each figure of the file is one of a row as published, and each of a row is in the file."""
    theirs = {
        (row, column, value)
        for row, of in printed(*TABLES[name]).items()
        if (*TABLES[name], row) not in rows_of_papers.WITHOUT
        for column, value in of.items()
    }
    ours = set(pairs(papers.TABLES[name]))
    if name == "rosen-2":
        # The paper's rows are our columns. A tessellated frame shares some with one that is not.
        ours = {(stage, row, value) for row, stage, value in ours if stage != "Total"}
        assert theirs < ours
        shared = {(stage, f"{row}, tessellated", value) for stage, row, value in theirs}
        assert ours - theirs < shared
    elif name == "rosen-3":
        assert {(scene, split, value) for split, scene, value in ours} == theirs
    elif name.startswith("rosen-figure"):
        # A time stands once more under its scene.
        (scene,) = papers.TABLES[name].scenes
        again = {(row, scene, value) for row, column, value in theirs if column == "time"}
        assert ours == theirs | again
    elif name == "vanek-1":
        # The cathedral stands there twice, by two lamps.
        columns = {scene: scene.partition(",")[0] for scene in papers.TABLES[name].scenes}
        names = {row: row.rsplit(" ", 1) for row, _, _ in ours}
        assert theirs == {
            (names[row][0], f"{columns[scene]}, {names[row][1]}", value)
            for row, scene, value in ours
        }
    else:
        assert ours == theirs


def test_every_row_of_the_papers_has_a_command_or_a_reason():
    """That each command prints its rows: the test above, and below for those of Chong."""
    places = list(dict.fromkeys((at.paper, at.place) for at in figures.printed()))
    assert set(places) == set(rows_of_papers.TABLES)
    assert set(rows_of_papers.TABLES.values()) <= set(papers.NAMES)
    theirs = {(*place, row) for place in places for row in printed(*place)}
    assert set(rows_of_papers.WITHOUT) < theirs
    for each, place in zip(rows_of_papers.commands(), places, strict=True):
        measured = each["rows"].split("; ")
        without = [row for row in printed(*place) if f"{row}: " in each["not measured"]]
        assert {*measured, *without} == printed(*place).keys()
        assert all(rows_of_papers.WITHOUT[(*place, row)] in each["not measured"] for row in without)
    # What is no `Table` lays out its rows by the file, but for the sizes.
    assert list(chong_gortler.SIZES) == list(printed(figures.CHONG, "Table 2"))
    # Nothing is measured that the file does not know, but Rosen's curve and what lixel adds.
    beyond = {"rosen-figure-9", "rosen-3-warps", "rosen-3-paraboloids"}
    assert set(papers.NAMES) - set(rows_of_papers.TABLES.values()) == beyond


@pytest.mark.parametrize("each", papers.TABLES.values(), ids=lambda each: each.name)
def test_rows_are_published_and_lixels(each):
    keys = [row.key for row in each.rows]
    assert len(set(keys)) == len(keys)
    assert (each.base, "published") in keys
    assert {row.name for row in each.rows} >= set(each.ranking)
    # No row that cannot run.
    methods = {row.key: method for row, method in measuring.runnable(each)}
    assert list(methods) == keys
    for row in each.rows:
        method = methods[row.key]
        if row.method.startswith("shadow_volumes"):
            continue
        if row.by == "published" and "rasterization" not in row.parameters:
            assert method.rasterization == "linear"
        if row.by == "published" and "lookup" not in row.parameters:
            assert (method.lookup, method.bias) == ("depth", "constant")
        if row.by == "lixel":
            assert (method.rasterization, method.lookup) == ("exact", "auto")
    # The edge function is why there is a hybrid analysis.
    hybrid = [m for (name, _), m in methods.items() if name.startswith("Hybrid")]
    assert all("shadow_edge" in method.importance for method in hybrid)


# --- What is printed beside them ---


def small_rows():
    return (
        Row("gbuffer", "uniform@published", {"A": 5.0, "B": 6.0}, passes=(passes.VISIBILITY,)),
        Row("SM", "uniform@published", {"A": 2.0, "B": (1.0, 3.0)}),
        *both("RTW", "rtw", "rosen-2012", {"A": (1.0, 2.0), "B": 8.0}, resolution=128),
        Row("Later", "not_yet", {"A": 1.0, "B": 1.0}),
    )


def test_measured_rows_are_beside_the_papers_figures(with_tables, tmp_path, capfd):
    small = Table(
        "small", "Small", "nobody, 2000", base="SM", without=(passes.VISIBILITY,), path=2,
        rows=small_rows(), has_mer=True, remark="So it is.",
        left_out={"Never": "it was never built"}, **SMALL,
    )  # fmt: skip
    with_tables(small)
    rows = papers.measure(folder=tmp_path, repeats=2)["small"]
    assert [(row["scene"], row["row"], row["by"]) for row in rows] == [
        (scene, *key)
        for scene in "AB"
        for key in (
            ("gbuffer", "published"), ("SM", "published"), ("RTW", "published"), ("RTW", "lixel"),
        )
    ]  # fmt: skip
    ratios = [row["paper, ratio"] for row in rows]
    assert ratios == [2.5, 1.0, 0.75, 0.75, 3.0, 1.0, 4.0, 4.0]
    assert [row["paper, ms"] for row in rows] == ["5", "2", "1-2", "1-2", "6", "1-3", "8", "8"]
    assert [row["ours"] for row in rows[2:4]] == ["uniform+rtw 128²", "rtw 128²"]
    measured = read(tmp_path / "small.csv")
    ms = measured.assign(ms=measured["gpu_ms"] - measured["pass_ms.visibility"].fillna(0.0))
    ms = ms.groupby(["scene", "method", "rasterization"])["ms"].median()
    of_sm = ms["A", "uniform", "linear"]
    assert rows[2]["ours, ratio"] == pytest.approx(ms["A", "rtw", "linear"] / of_sm)
    assert rows[3]["ours, ratio"] == pytest.approx(ms["A", "rtw", "exact"] / of_sm)
    wrong = measured.groupby(["scene", "method", "rasterization"])["misclassified_count"].sum()
    assert rows[7]["misclassified"] == wrong["B", "rtw", "exact"]
    assert rows[6]["misclassified"] == wrong["B", "rtw", "linear"]
    assert "misclassified" not in rows[0]
    assert rows[1]["ours, MER"] == "64 x 64"
    out = capfd.readouterr().out
    assert "for A: needles(count=40), 242 triangles" in out
    assert "left out, because this version has no such method: Later" in out
    assert "left out: Never, because it was never built" in out
    assert "So it is." in out
    # What was measured is kept, and the same table is made of it.
    papers.measure(folder=tmp_path, repeats=2)
    again = read(tmp_path / "small.csv")
    assert again.equals(measured)
    assert again.attrs["command"] == "lixel lab papers small"
    made = [[*row.items()] for row in measuring.beside(small, again)]
    assert [row[:5] for row in made] == [[*row.items()][:5] for row in rows]
    assert made[3][5][1] == pytest.approx(rows[3]["ours, ratio"])


def test_stages_are_shares_of_the_frame(with_tables):
    rest = (*passes.IMPORTANCE, *passes.RECEIVERS, passes.LOOKUP)
    joint = {"all": (passes.SHADOW_MAP, *rest)}
    with_tables(
        Table(
            "stages", "Stages", "nobody, 2000", base="RTW", as_shares=True,
            rows=(
                Row("RTW", "rtw@published", {"map": 3.0, "rest": 1.0}),
                Row("joint", "rtw", {"all": 7.0}, stages=joint),
            ),
            stages={"map": (passes.SHADOW_MAP,), "rest": rest},
            **{**SMALL, "scenes": {"A": SubstituteScene("needles", {"count": 40})}},
        )
    )  # fmt: skip
    rows = papers.measure(repeats=1)["stages"]
    assert [row["stage"] for row in rows] == ["map", "rest", "all"]
    assert [row["paper, %"] for row in rows] == [75.0, 25.0, 100.0]
    assert sum(row["ours, %"] for row in rows) == pytest.approx(200.0)


def test_a_row_by_a_spot_light_and_columns_in_milliseconds(with_tables):
    lamp, spot = lx.PointLight((0, 9, 0)), lx.SpotLight((0, 9, 0), (0, -1, 0), 0.9)
    with_tables(
        Table(
            "spot", "Spot", "nobody, 2000", base="DPSM", unit="fps",
            rows=(
                Row("Uniform", "uniform@published", {"whole": 200.0}, by_spot=True),
                Row("DPSM", "dual_paraboloid@published", {"whole": 100.0}),
            ),
            stages={"whole": None, "map": (passes.SHADOW_MAP,)},
            **{**SMALL, "scenes": {"A": SubstituteScene("needles", {"count": 40}, lamp, spot)}},
        )
    )  # fmt: skip
    uniform, _, part, _ = papers.measure(repeats=1)["spot"]
    assert uniform["paper, ratio"] == 0.5
    assert uniform["ours, ratio"] > 0.0
    assert (part["stage"], part["paper, fps"]) == ("map", "-")


def test_rows_in_another_order_than_the_papers_are_named():
    def row(name, paper, ours, wrong, by="published"):
        return {"scene": "A", "row": name, "by": by, "paper, ratio": paper, "ours, ratio": ours,
                "misclassified": wrong}  # fmt: skip

    rows = [
        row("SM", 1.0, 1.0, 9), row("DV", 1.5, 0.9, 5), row("RTW", 2.0, 1.02, 6),
        row("Far", 9.0, 9.0, 0), row("DV", 1.5, 0.5, 1, "lixel"),
    ]  # fmt: skip
    said = "A, published: DV is slower than SM only in the paper"
    assert list(measuring.turned(rows)) == [said]
    table = Table("a", "A", "b", (1, 1), 1, {}, (), "SM", ranking=("SM", "DV", "RTW", "Far"))
    (line,) = measuring.misranked(table, rows)
    assert line.startswith("A, published: RTW misclassifies 6 pixels and DV 5")


def test_quick_is_smaller(with_tables, monkeypatch, capfd):
    each = Table(
        "small", "Small", "nobody, 2000", base="SM", path=9,
        rows=(
            Row("SM", "uniform@published", {}),
            Row("S", "uniform@published", {}, {"resolution": 32}),
        ),
        **{**SMALL, "scenes": {"C": SubstituteScene("needles", {"count": 40}, quick={"count": 9})}},
    )  # fmt: skip
    with_tables(each)
    seen = []
    monkeypatch.setattr(papers, "measure_table", lambda *given: seen.append(given) or 1 / 0)
    with pytest.raises(ZeroDivisionError):
        papers.measure(quick=True)
    ((small, repeats, _),) = seen
    assert (small.size, small.resolution, small.path) == ((32, 24), 16, 2)
    assert small.rows[1].parameters == {"resolution": 8}
    assert repeats == 1
    assert small.scenes["C"].arguments == {"count": 9}
    back = {"rows": each.rows, "path": 9, "size": (128, 96), "resolution": 64}
    assert dataclasses.replace(small, scenes=each.scenes, **back) == each


def test_a_path_turns_the_camera():
    camera = lx.scenes.city(blocks=2).cameras["default"]
    path = measuring._path(camera, 3)
    assert path["1"].pose == pytest.approx(camera.pose)
    assert path["0"].pose != pytest.approx(camera.pose)
    assert all(each.eye == pytest.approx(camera.eye) for each in path.values())


def test_an_unknown_table_is_refused(capfd):
    assert cli.main(["lab", "papers", "rosen-9"]) == 2
    assert "table must be one of rosen-1" in capfd.readouterr().err


def test_rows_without_a_figure_of_the_paper_are_measured(with_tables):
    own = {words: {"A": 1.0, "B": (2.0, 3.0)} for _, words in rosen.SPLIT}
    with_tables(
        Table(
            "straight", "Straight", "nobody, 2000", base="Disabled",
            rows=rosen.straight_and_exact("rtw", own), details=rosen.DRAWN, **SMALL,
        )
    )  # fmt: skip
    rows = papers.measure(repeats=1)["straight"]
    assert [row["paper, ratio"] for row in rows[:6]] == [1.0, 1.0, 1.0, 1.0, None, None]
    assert [row["paper, ms"] for row in rows[6:]] == ["2-3"] * 4 + ["-", "-"]
    drawn = [row["triangles drawn"] for row in rows[6:]]
    assert drawn[:4] == sorted(drawn[:4])
    assert drawn[3] > drawn[0]
    assert rows[6]["misclassified"] > rows[10]["misclassified"]


def test_the_path_of_figure_9_goes_on_where_it_was_stopped(monkeypatch, tmp_path):
    town = SubstituteScene("city", {"blocks": 3})
    monkeypatch.setattr(path, "TOWN", town)
    monkeypatch.setattr(path, "FRAMES", 12)
    monkeypatch.setattr(path, "cameras", lambda scene, size, numbers: (
        scene.cameras["default"].resized(64, 36) for _ in numbers
    ))  # fmt: skip
    some = path.methods(64)
    chosen = {name: some[name] for name in ("conventional", "RTW, lixel")}
    monkeypatch.setattr(path, "methods", lambda part: chosen)
    rows = path.along_a_path(True, tmp_path)
    assert [(row["method"], row["frames"]) for row in rows] == [
        ("conventional", 12),
        ("RTW, lixel", 12),
    ]
    assert rows[0]["ratio"] == 1.0
    assert rows[1]["ratio"] == pytest.approx(rows[1]["median ms"] / rows[0]["median ms"])
    monkeypatch.setattr(path, "frame_parts", None)
    assert path.along_a_path(True, tmp_path) == rows


# --- Figures ---


@pytest.fixture
def small_scenes(monkeypatch):
    """The same few triangles and pixels in place of each scene, and lixel's own methods, which need
    no driver."""
    monkeypatch.setenv("LIXEL_DEVICE", "cpu")
    own = drawings.method_of
    monkeypatch.setattr(
        drawings, "method_of", lambda name, **changes: own(name.partition("@")[0], **changes)
    )
    monkeypatch.setattr(drawings, "QUICK", 24)
    small = {"objects_on_floor": {"count": 12, "subdivisions": 1}, "colonnade": {"columns": 2},
             "terrain": {"cells": 12}, "city": {"blocks": 3}, "grass": {"blades": 40}}  # fmt: skip
    original = drawings.GENERATORS
    monkeypatch.setattr(
        drawings, "GENERATORS",
        {name: lambda name=name, of=of, **_: original[name](**of) for name, of in small.items()},
    )  # fmt: skip


@pytest.mark.parametrize("name", drawings.FIGURES)
def test_every_figure_has_titles_and_panels(small_scenes, name):
    for row in drawings.FIGURES[name](24):
        for title, panel in row:
            assert title
            assert callable(panel)


def test_figures_are_drawn_by_a_command(small_scenes, tmp_path, capsys):
    names = ["milet-figure-4", "thesis-figure-5.5", "chong-figure-2"]
    command = ["lab", "papers", "--figures", "--quick", "-o", str(tmp_path)]
    assert cli.main([*command, *names]) == 0
    assert {file.name for file in tmp_path.iterdir()} == {f"{name}.png" for name in names}
    assert cli.main([*command, "vanek-figure-3"]) == 2
    assert "figure must be one of rosen-figure-1" in capsys.readouterr().err


def test_the_fence_has_holes_and_is_sharper_in_the_cut_paraboloid():
    scene = fence()
    camera, light = scene.cameras["default"].resized(160, 120), scene.lights["default"]
    truth = lx.reference(scene, camera, light)
    solid = lx.reference(lx.Scene(scene.vertices, scene.faces), camera, light)
    assert (truth.visibility == 1).sum() > 1.2 * (solid.visibility == 1).sum()
    given = {"rasterization": "exact", "resolution": 512}
    whole, cut = (
        lx.compare(
            lx.render(scene, camera, light, lx.METHODS[name].published(**given)), truth
        ).misclassified_count
        for name in ("dual_paraboloid", "improved_paraboloid")
    )
    assert cut < 0.8 * whole


def test_details_are_where_a_plain_map_is_most_wrong(small_scenes):
    view = drawings.view_of(rosen.PLAYGROUND, (1920, 1080), 2048, 24)
    wrong = view.compared(view.frame("uniform@published")).misclassified
    rows, columns = view.detail
    height, width = rows.stop - rows.start, columns.stop - columns.start
    assert (height, width) == (wrong.shape[0] // 6, wrong.shape[1] // 6)
    most = max(
        wrong[row : row + height, column : column + width].sum()
        for row in range(wrong.shape[0] - height + 1)
        for column in range(wrong.shape[1] - width + 1)
    )
    assert wrong[view.detail].sum() == most


def test_receivers_spread_step_by_step(small_scenes):
    """Counts after the rows' functions are even along rows, after both everywhere."""
    view = drawings.view_of(milet.OBSERVATORY, milet.SIZE, milet.RESOLUTION, 4)
    steps = drawings._steps(view.frame("notw@published", smoothing=0.0))
    spread = [
        np.histogram2d(places[:, 1], places[:, 0], bins=8, range=((0, 1), (0, 1)))[0].std()
        for places in steps
    ]
    assert spread[0] > 1.5 * spread[2]
    assert spread[1] > spread[2]
    assert [len(places) for places in steps] == [len(steps[0])] * 3
