"""The rankings of the papers' methods: whose pixels are counted, and that a table goes on."""

import numpy as np
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
    suns, lamps = rankings.sun_methods(scene), rankings.lamp_methods(scene)
    for name, method in {**suns, **lamps}.items():
        if ", exact" in name or ", straight" in name:
            expected = "exact" if ", exact" in name else "linear"
            assert method.rasterization == expected
            assert (method.constant_bias is not None) == name.endswith("fixed bias")
    published = suns["notw 8, straight"]
    assert published == lx.NonOrthogonalWarp.published(
        smoothing=8.0, resolution=256, tessellation=0.025
    )
    assert lamps["cut of the frustum, exact"].cut == "frustum"
    assert suns["uniform, 4 times"].resolution == 4 * suns["rtw, straight"].resolution


def test_a_stopped_table_goes_on(monkeypatch, tmp_path, capsys):
    few = {name: (lambda scene: {"uniform": lx.Uniform(resolution=64)}) for name in ("sun", "lamp")}
    monkeypatch.setattr(rankings, "METHODS", few)
    monkeypatch.setattr(rankings, "BUILT_IN", LITTLE)
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
    capsys.readouterr()
    sums = rankings.sums(read(tmp_path / "a.csv")).set_index("kind")
    of_suns = table[table["kind"] == "sun"]
    assert sums.loc["sun", "misclassified"] == of_suns["misclassified"].sum()
    share = 100.0 * of_suns["misclassified"].sum() / of_suns["covered"].sum()
    assert sums.loc["sun", "% of covered"] == pytest.approx(share)
