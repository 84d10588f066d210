"""The rankings of the papers' methods: whose pixels are counted, and that a table goes on."""

import dataclasses

import numpy as np
import pandas as pd
import pytest

import lixel as lx
from lixel import cli
from lixel.lab import rankings
from lixel.lab.random_views import is_in_view
from lixel.lab.result_tables import read

LITTLE = {"needles": {"count": 40}, "city": {"blocks": 3}}


def test_lights_are_the_same_at_every_call_and_lamps_outside_of_the_view():
    scene = lx.scenes.objects_on_floor(count=9, subdivisions=1)
    camera = scene.cameras["default"].resized(64, 36)
    for number in range(4):
        lamp, again = (rankings.light_of("a", "lamp", number, scene, camera) for _ in range(2))
        assert np.array_equal(lamp.position, again.position)
        assert not is_in_view(camera, lamp.position)
        sun = rankings.light_of("a", "sun", number, scene, camera)
        assert isinstance(sun, lx.DirectionalLight)
        assert sun.direction[1] < 0.0
    other = rankings.light_of("b", "lamp", 0, scene, camera)
    assert not np.array_equal(other.position, lamp.position)


def test_methods_differ_by_what_their_names_say():
    scene = lx.scenes.plane_and_box()
    suns, lamps = (methods(scene) for methods in rankings.METHODS.values())
    for name, method in {**suns, **lamps}.items():
        if ", exact" in name or ", straight" in name:
            expected = "exact" if ", exact" in name else "linear"
            assert method.rasterization == expected
            assert (method.constant_bias is not None) == name.endswith("fixed bias")
    published = suns["notw 8, straight"]
    assert published == lx.NonOrthogonalWarp.published(
        smoothing=8.0, resolution=256, tessellation=0.025
    )
    automatic = suns["notw automatic, straight"]
    assert automatic == dataclasses.replace(published, smoothing="automatic")
    assert lamps["cut of the frustum, exact"].cut == "frustum"
    assert suns["uniform, 4 times"].resolution == 4 * suns["rtw, straight"].resolution


def test_a_stopped_table_goes_on(monkeypatch, tmp_path, capsys):
    few = {name: (lambda *_: {"uniform": lx.Uniform(resolution=64)}) for name in ("sun", "lamp")}
    monkeypatch.setenv("LIXEL_DEVICE", "cpu")
    monkeypatch.setattr(rankings, "METHODS", few)
    monkeypatch.setattr(rankings, "BUILT_IN", LITTLE)
    for of_methods in ("by_smoothing", "by_scene"):
        monkeypatch.setattr(rankings, of_methods, lambda table: [])
    monkeypatch.chdir(tmp_path)
    command = ["lab", "rankings", "--size", "64x36", "--lights", "2", "-o", "a.csv"]
    assert cli.main(command) == 0
    whole = (tmp_path / "a.csv").read_text()
    table = read(tmp_path / "a.csv")
    # A light of every scene before the second of any.
    assert table["light"].tolist() == [0] * 4 + [1] * 4
    assert table["scene"].tolist() == ["needles", "needles", "city", "city"] * 2
    (tmp_path / "a.csv").write_text("".join(whole.splitlines(keepends=True)[:-3]))
    assert cli.main(command) == 0
    assert (tmp_path / "a.csv").read_text() == whole
    # Methods that are new are measured where the others were.
    lamp = few["lamp"]
    few["lamp"] = lambda *_: {**lamp(), "cube": lx.Cube(resolution=64)}
    assert cli.main(command) == 0
    more = read(tmp_path / "a.csv")["method"].tolist()
    assert more == ["uniform"] * 8 + ["cube"] * 4
    (tmp_path / "a.csv").write_text(whole)
    capsys.readouterr()
    sums = rankings.sums(read(tmp_path / "a.csv")).set_index("kind")
    of_suns = table[table["kind"] == "sun"]
    assert sums.loc["sun", "misclassified"] == of_suns["misclassified"].sum()
    share = 100.0 * of_suns["misclassified"].sum() / of_suns["covered"].sum()
    assert sums.loc["sun", "% of covered"] == pytest.approx(share)


def table_of(wrong):
    """Two views of each of two scenes, in which a method's pixels are by its name."""
    scene = lx.scenes.plane_and_box()
    return pd.DataFrame(
        {"scene": name, "kind": kind, "light": light, "method": method,
         "misclassified": wrong(name, light, method), "covered": 1000}
        for name in ("a", "b")
        for light in (0, 1)
        for kind, methods in rankings.METHODS.items()
        for method in methods(scene)
    )  # fmt: skip


def test_ratios_are_those_of_sums_and_views_are_counted():
    def wrong(scene, light, method):
        if method.startswith("notw 16, straight"):
            return 30 if scene == "a" else 5
        if method.startswith("notw 64, straight"):
            return 8
        return 40 if method.startswith("cut of the frustum") and scene == "b" else 10

    table = table_of(wrong)
    rows = {row["smoothing, cells"]: row for row in rankings.by_smoothing(table)}
    assert rows["16"]["straight: notw / rtw"] == 70 / 40
    assert rows["16"]["straight: fewer in"] == "2 of 4"
    # In each view the best: 8 where 16 cells have 30, 5 elsewhere.
    assert rows["best"]["straight: notw / rtw"] == 26 / 40
    assert rows["4"]["exact: fewer in"] == "0 of 4"
    assert rows["automatic"]["straight: notw / rtw"] == 1.0
    assert rows["automatic"]["exact: fewer in"] == ""
    scenes = {row["scene"]: row for row in rankings.by_scene(table)}
    assert scenes["a"]["notw / rtw, straight"] == 3.0
    assert scenes["b"]["notw / rtw, straight"] == 0.5
    assert scenes["all"]["cut / whole"] == 2.5
    ax = rankings.plot(table)
    thick = [line for line in ax.lines if line.get_label().startswith("straight")]
    assert [list(line.get_ydata()) for line in thick] == [[1.0, 1.0, 70 / 40, 0.8]]


def test_a_view_in_which_a_method_failed_is_left_out():
    table = table_of(lambda *_: 10)
    is_failed = (table["method"] == "rtw, exact") & (table["light"] == 1) & (table["scene"] == "a")
    table.loc[is_failed, "misclassified"] = np.nan
    assert len(rankings.by_view(table, "sun")) == 3
    assert len(rankings.by_view(table, "lamp")) == 4
