"""Plots: what they show and what they refuse; that they look right is for the eye."""

import matplotlib as mpl
import numpy as np
import pandas as pd
import pytest

import lixel as lx
from lixel.pictures import plots

mpl.use("agg")


@pytest.fixture(autouse=True)
def _closed_figures():
    yield
    mpl.pyplot.close("all")


@pytest.fixture
def table():
    rows = [
        ("uniform", 256, 1.0, 900, 0.6, 0.4, np.nan),
        ("uniform", 512, 2.0, 400, 1.0, 1.0, np.nan),
        ("rtw", 256, 1.8, 300, 0.6, 1.0, 0.2),
        ("rtw", 512, 3.0, 0, 0.6, 2.2, 0.2),
    ]
    columns = ["method", "resolution", "gpu_ms", "misclassified_count"]
    columns += [f"pass_ms.{name}" for name in ("shadow map", "lookup", "warp map")]
    made = pd.DataFrame(rows, columns=columns)
    made["gpu_ms_q1"], made["gpu_ms_q3"] = made["gpu_ms"] * 0.9, made["gpu_ms"] * 1.1
    return made.assign(scene="city", camera="0", light="0", error=None)


def test_time_against_error_shows_every_case_and_the_front(table):
    ax = plots.time_against_error(table)
    lines = {line.get_label(): line.get_xydata().tolist() for line in ax.lines}
    assert lines["uniform"] == [[1.0, 900], [2.0, 400]]
    assert lines["rtw"] == [[1.8, 300], [3.0, 0]]
    # uniform at 512 is beaten by rtw at 256 in both.
    assert lines["Pareto front"] == [[1.0, 900], [1.8, 300], [3.0, 0]]
    assert {text.get_text() for text in ax.texts} == {"256", "512"}
    # Drawn where it can be seen, no error at all too.
    low, high = ax.get_ylim()
    assert low < 0
    assert high > 900
    assert ax.get_xlabel() == "time of all passes, ms"


def test_many_series_are_named_beside_the_axes(table):
    many = pd.concat([table.assign(method=f"method {i}") for i in range(7)], ignore_index=True)
    many["gpu_ms"] *= 1.1 ** many["method"].str[-1].astype(int)
    ax = plots.time_against_error(many)
    assert ax.get_legend() is None
    names = [text for text in ax.texts if text.get_text().startswith("method")]
    assert sorted(text.get_text() for text in names) == [f"method {i}" for i in range(7)]
    heights = sorted(text.xyann[1] for text in ax.texts)
    assert min(np.diff(heights)) > 0.03  # none over another
    assert 0.0 <= heights[0] < heights[-1] <= 1.0
    # Those that never are on the front are grey.
    colours = {text.get_text(): text.arrow_patch.get_edgecolor() for text in names}
    grey = mpl.colors.to_rgba("0.55")
    assert [name for name, colour in sorted(colours.items()) if colour != grey] == ["method 0"]
    assert ax.get_xlabel().endswith("along each line: resolution of the map, texels, 256, 512")


def test_other_renderers_are_marks(table):
    peers = pd.DataFrame(
        {
            "renderer": ["lixel desired_view 2048", "Mitsuba 3", "Warp"],
            "ms, median": [1.0, 0.5, 9.0],
            "misclassified": [5, 3, 4000],
            "scene": "city",
        }
    )
    ax = plots.time_against_error(table, peers=peers)
    (marks,) = (line for line in ax.lines if line.get_label() == "other renderers")
    assert marks.get_xydata().tolist() == [[0.5, 3], [9.0, 4000]]
    assert ax.get_ylim()[1] > 4000
    with pytest.raises(ValueError, match=r"peers must be of the table's scene, {'city'}, got {'to"):
        plots.time_against_error(table, peers=peers.assign(scene="town"))


def test_a_method_without_a_resolution_has_no_label(table):
    table.loc[3, "resolution"] = np.nan
    assert [text.get_text() for text in plots.time_against_error(table).texts] == [
        "256",
        "512",
        "256",
    ]


def test_series_differ_without_colour(table):
    many = pd.concat([table.assign(method=f"method {i}") for i in range(10)])
    ax = plots.error_against_resolution(many)
    looks = {(line.get_marker(), line.get_linestyle()) for line in ax.lines}
    assert len(looks) == 10


def test_cases_that_failed_are_left_out(table):
    table.loc[0, "error"] = "ValueError: no"
    ax = plots.error_against_resolution(table)
    assert ax.lines[0].get_xydata().tolist() == [[512, 400]]


def test_a_bar_for_each_case_adds_up(table):
    ax = plots.pass_times(table)
    assert [text.get_text() for text in ax.get_yticklabels()] == [
        "uniform 256", "uniform 512", "rtw 256", "rtw 512",
    ]  # fmt: skip
    ends = {}
    for bar in ax.patches:
        row = round(bar.get_y() + bar.get_height() / 2)
        ends[row] = max(ends.get(row, 0.0), bar.get_x() + bar.get_width())
    assert [ends[row] for row in range(4)] == pytest.approx(table["gpu_ms"].tolist())
    assert len({bar.get_hatch() for bar in ax.patches}) == 3


def test_axes_that_are_given_are_drawn_into(table, view, truth):
    frame = lx.render(*view, lx.DesiredView())
    _, axes = mpl.pyplot.subplots(2, 3)
    given = list(axes.flat)
    assert plots.time_against_error(table, given[0]) is given[0]
    assert plots.error_against_resolution(table, given[1]) is given[1]
    assert plots.pass_times(table, given[2]) is given[2]
    assert plots.difference(lx.compare(frame, truth), given[3]) is given[3]
    assert plots.aliasing_error(frame, given[4]) is given[4]


def test_the_difference_counts_in_words(view, truth):
    found = lx.compare(lx.render(*view, lx.Uniform(resolution=16)), truth)
    ax = plots.difference(found)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        f"{found.false_lit_count:,} false lit",
        f"{found.false_shadow_count:,} false shadow",
    ]
    np.testing.assert_array_equal(ax.images[0].get_array(), found.picture())


def test_aliasing_error_is_shown_where_surfaces_face_the_light(view):
    frame = lx.render(*view, lx.DesiredView())
    shown = plots.aliasing_error(frame).images[0].get_array()
    np.testing.assert_array_equal(np.ma.getmaskarray(shown), ~frame.facing)
    with pytest.raises(ValueError, match="limit must be greater than 1"):
        plots.aliasing_error(frame, limit=1.0)


@pytest.mark.parametrize("plot", [plots.time_against_error, plots.pass_times])
def test_several_views_are_refused(plot, table):
    table.loc[0, "light"] = "1"
    with pytest.raises(ValueError, match=r"table must hold one light, .* got 1, 0"):
        plot(table)
    plot(table, by=["light", "method"])


def test_a_missing_column_is_named(table):
    with pytest.raises(ValueError, match="table must have the column 'ssim'"):
        plots.time_against_error(table, error="ssim")


def test_several_views_have_axes_each(table):
    both = pd.concat([table, table.assign(scene="terrain")])
    axes = plots.time_against_error_by_view(both)
    assert [ax.get_title() for ax in axes] == ["city", "terrain"]
    (ax,) = plots.time_against_error_by_view(table)
    assert ax.get_title() == ""
