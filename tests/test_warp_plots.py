"""Pictures of warps: each draws one layer, and what has no warp is refused."""

from __future__ import annotations

import matplotlib as mpl
import matplotlib.figure
import numpy as np
import pytest

import lixel as lx
from lixel.pictures import warp_plots

mpl.use("Agg")

PLOTS = (
    warp_plots.importance,
    warp_plots.warp_grid,
    warp_plots.receiver_counts,
    warp_plots.shadow_map,
)


@pytest.mark.parametrize("plot", PLOTS)
@pytest.mark.parametrize("method", ["rtw", "notw"])
def test_each_draws_into_axes(view, plot, method):
    frame = lx.render(*view, method)
    ax = plot(frame)
    assert ax.images
    assert ax.get_title()
    assert plot(frame, ax) is ax


@pytest.mark.parametrize("plot", PLOTS[:-1])
def test_no_warp_and_no_layer(view, plot):
    with pytest.raises(ValueError, match="layer must be one of the frame's 0 layers"):
        plot(lx.render(*view, "desired_view"))
    with pytest.raises(ValueError, match="1 layers with a warp, got 1"):
        plot(lx.render(*view, "rtw"), layer=1)


def test_a_map_without_a_warp_is_drawn(view):
    frame = lx.render(*view, "desired_view")
    shown = warp_plots.shadow_map(frame).images[0].get_array()
    assert np.array_equal(np.ma.getmaskarray(shown), frame.shadow_map[0] == 1.0)
    with pytest.raises(ValueError, match="layer must be one of the map's 1, got 1"):
        warp_plots.shadow_map(frame, layer=1)


def test_the_grid_is_where_the_warp_came_from(view):
    frame = lx.render(*view, lx.RectilinearWarp(resolution=64))
    lines = [line.get_xydata() for line in warp_plots.warp_grid(frame, lines=5).lines]
    assert len(lines) == 10
    for i, place in enumerate(np.linspace(0, 1, 5)):
        across, along = (
            lx.warp_points(frame.warp_map[0], line) for line in lines[2 * i : 2 * i + 2]
        )
        assert across[:, 0] == pytest.approx(place, abs=1e-6)
        assert along[:, 1] == pytest.approx(place, abs=1e-6)


def test_the_warp_spreads_what_the_plot_counts(view):
    frame = lx.render(*view, "notw")
    before, after = (
        np.asarray(
            warp_plots.receiver_counts(frame, warped=warped, cells=16).images[0].get_array()
        ).max()
        for warped in (False, True)
    )
    assert after < before


# In the plane of no side of the box: such a side is edge-on to the device, not to float32 normals.
POINT, SPOT = lx.PointLight((1.1, 4.0, 2.1)), lx.SpotLight((1.1, 4.0, 2.1), (-0.3, -1, -0.4), 0.8)
FITS = {
    "desired_view": None,
    "lispsm": None,
    "trapezoidal": None,
    "log_psm": None,
    "scene_optimized": None,
    "cube": POINT,
    "dual_paraboloid": POINT,
    "improved_paraboloid": POINT,
    "spot": SPOT,
    "desired_view, far": lx.PointLight((3e4, 9e4, 2e4)),
    "lispsm, far": lx.PointLight((30.0, 90.0, 20.0)),
    "log_psm, far": lx.PointLight((30.0, 90.0, 20.0)),
    "lispsm, near": POINT,
}


@pytest.mark.parametrize("fit", FITS)
def test_receivers_are_counted_where_the_device_counts_them(view, fit):
    """By the formulas of each projection in numpy: the device has counted them for `notw`."""
    cells = 64
    method = lx.NonOrthogonalWarp(fit=fit.split(",")[0], importance_resolution=cells)
    frame = lx.render(view.scene, view.camera, FITS[fit] or view.light, method)
    assert len(frame.importance_map) > 0
    ax = mpl.figure.Figure().add_subplot()

    def counted(**options):
        ax.clear()
        drawn = warp_plots.receiver_counts(frame, ax, **options).images[0].get_array()
        return np.ma.filled(drawn, 0)

    for layer, expected in enumerate(frame.importance_map):
        found = counted(layer=layer, warped=False, cells=cells)
        assert expected.sum() > 0
        assert found.sum() == pytest.approx(expected.sum(), rel=0.005, abs=3)
        # A receiver within rounding of a cell's border may fall on either side.
        assert np.abs(found - expected).sum() <= 0.01 * expected.sum() + 4
        after, before = (counted(layer=layer, warped=w, cells=16) for w in (True, False))
        assert after.max() < before.max()


def test_too_few_lines(view):
    with pytest.raises(ValueError, match=r"lines must be at least 2 .* got 1"):
        warp_plots.warp_grid(lx.render(*view, "rtw"), lines=1)
