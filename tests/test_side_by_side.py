"""The picture of one view by several methods."""

import numpy as np

import lixel as lx
from lixel import cli
from lixel.compare import FALSE_LIT
from lixel.lab import side_by_side


def test_a_column_for_each_method(view, truth):
    methods = [lx.Uniform(resolution=16), lx.NonOrthogonalWarp(resolution=16), lx.Exact()]
    figure = side_by_side.drawn(*view, methods)
    above, below = figure.axes[:3], figure.axes[3:]
    for method, ax in zip(methods, above, strict=True):
        found = lx.compare(lx.render_shadows(*view, method), truth)
        name, count = ax.get_title().split("\n")
        assert name.startswith(method.name)
        assert count == f"{found.misclassified_count:,} pixels misclassified"
        is_red = (np.asarray(ax.images[0].get_array()) == FALSE_LIT).all(axis=-1)
        np.testing.assert_array_equal(is_red, found.false_lit)
    regular, warped, pixels = below
    lines = [np.array([line.get_xydata() for line in ax.lines]) for ax in (regular, warped)]
    assert len(lines[0]) == len(lines[1]) == 2 * side_by_side.LINES
    # Of the uniform map each line is straight, of the other not all.
    is_straight = [(np.ptp(line, axis=1) == 0).any(axis=1) for line in lines]
    assert is_straight[0].all()
    assert not is_straight[1].all()
    assert len(pixels.lines[0].get_xydata()) > 100
    assert "no map" in pixels.texts[0].get_text()


def test_the_command_writes_a_picture_that_tells_it(tmp_path):
    path = tmp_path / "a.png"
    given = ["plane_and_box", "--size", "64x48", "--resolution", "16", "-o", str(path)]
    assert cli.main(["lab", "side_by_side", *given]) == 0
    assert lx.read_metadata(path)["command"].startswith("lixel lab side_by_side plane_and_box")
