"""How time grows, on as little as shows that it is measured."""

import math

from lixel import cli
from lixel.lab import growth
from lixel.lab.result_tables import read


def test_growth_command_writes_both_series(tmp_path, monkeypatch, capsys):
    path = tmp_path / "growth.csv"
    monkeypatch.setattr(growth, "SUBDIVISIONS", (0, 1))
    monkeypatch.setattr(growth, "SIZES", ((32, 20), (64, 40)))
    monkeypatch.setattr(growth, "SUBDIVISION", 0)
    monkeypatch.setattr(growth, "SIZE", (32, 20))
    assert cli.main(["lab", "growth", "--repeats", "1", "-o", str(path)]) == 0
    table = read(path)
    assert list(table["method"]) == list(growth.METHODS) * 4
    by = dict(iter(table.groupby(["grows", "method"], sort=False)))
    triangles, pixels = by["triangles", "exact"], by["pixels", "exact"]
    assert list(triangles["triangles"]) == [4098, 17794]
    assert list(pixels["pixels"]) == [640, 2560]
    first, second = triangles["gpu_ms"]
    expected = math.log(second / first) / math.log(17794 / 4098)
    assert math.isclose(triangles["exponent"].iloc[1], expected, rel_tol=1e-6)
    assert math.isnan(triangles["exponent"].iloc[0])
    # The warp makes the lists of the shaders shorter; the CPU engine has none.
    plain = by["pixels", "exact without a warp"]["longest list"]
    if plain.notna().any():
        assert (pixels["longest list"].to_numpy() <= plain.to_numpy()).all()
    assert (table.loc[table["method"] != "desired_view", "misclassified"] == 0).all()
    assert table.attrs["command"] == "lixel lab growth --repeats 1 -o growth.csv"
    assert "exponent" in capsys.readouterr().out
