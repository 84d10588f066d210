"""Filtered maps as lookups: moments, blur and bounds against scipy and numpy; leaks; refusals."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest
from scipy import ndimage

import lixel as lx
from lixel.cli import main
from lixel.lab import filters
from lixel.lab.result_tables import read

SUN = lx.DirectionalLight((-0.3, -1.0, -0.5))
POINT = lx.PointLight((0.5, 9.0, 1.0))
SPOT = lx.SpotLight((0.5, 9.0, 1.0), (0.0, -1.0, 0.05), outer=0.9)
EVSM2 = lx.ExponentialVariance(blur=3.0, negative_exponent=None)
FILTERS = (
    lx.Variance(blur=3.0),
    EVSM2,
    lx.ExponentialVariance(blur=3.0),
    lx.Moments(blur=3.0),
)
# Without any, a floor at the end of a layer meets itself, and rounding decides.
BIAS = 0.05
EXACTLY = {"bias": "constant", "constant_bias": BIAS, "resolution": 128}


def boxes(*sizes: tuple[float, float, float, float, float]) -> lx.Scene:
    """Rectangles (x0, x1, z0, z1) at heights y."""
    quads = [[(a, y, c), (b, y, c), (b, y, d), (a, y, d)] for a, b, c, d, y in sizes]
    corners = np.array(quads, dtype=float).reshape(-1, 3)
    first = 4 * np.arange(len(quads))[:, None, None]
    faces = np.array([[0, 2, 1], [0, 3, 2]]) + first
    return lx.Scene(corners, faces.reshape(-1, 3))


@cache
def two_roofs() -> lx.Scene:
    """A floor under two roofs at different heights, whose edges cross."""
    return boxes((-8, 8, -8, 8, 0), (-6, 0.31, -3, 3, 4.0), (-2, 3, -6, 0.17, 1.2))


# Of the floor, from below the roofs.
CAMERA = lx.Camera.look_at(
    (0.1, 1.0, 0.1), (0.1, 0, 0.1), (0, 0, -1), ymag=5.0, width=96, height=64, zfar=1.5
)


def moments_of(depths: np.ndarray, lookup: lx.methods.FilteredMap) -> np.ndarray:
    """(moments, H, W) float64 of depths from -1 to 1."""
    if isinstance(lookup, lx.Moments):
        return np.stack([depths**k for k in (1, 2, 3, 4)])
    warped = [depths]
    if isinstance(lookup, lx.ExponentialVariance):
        warped = [np.exp(lookup.exponent * depths)]
        if lookup.negative_exponent is not None:
            warped.append(-np.exp(-lookup.negative_exponent * depths))
    return np.stack([w**k for w in warped for k in (1, 2)])


def blurred(plane: np.ndarray, lookup: lx.methods.FilteredMap) -> np.ndarray:
    """By scipy; what lies beyond the map is left out of the mean."""

    def blur(plane: np.ndarray) -> np.ndarray:
        for axis in (0, 1):
            if lookup.kernel == "box":
                # A width of whole texels.
                plane = ndimage.uniform_filter1d(
                    plane, round(2 * lookup.blur), axis, mode="constant"
                )
            elif lookup.blur:
                plane = ndimage.gaussian_filter1d(
                    plane, lookup.blur / 2, axis, mode="constant", radius=math.ceil(lookup.blur)
                )
        return plane

    return blur(plane) / blur(np.ones_like(plane))


def chebyshev(mean, square, t, least):
    variance = np.maximum(square - mean**2, least)
    return np.where(t <= mean, 1.0, variance / (variance + (t - mean) ** 2))


def hamburger(moments: np.ndarray, t: float, bias: float) -> float:
    """By the roots of a polynomial and a system of equations."""
    b1, b2, b3, b4 = moments + bias * (np.array([0.0, 1.0, 0.0, 1.0]) - moments)
    hankel = np.array([[1, b1, b2], [b1, b2, b3], [b2, b3, b4]])
    others = np.sort(np.roots(np.linalg.solve(hankel, [1, t, t * t])[::-1]).real)
    depths = np.array([t, *others])
    shares = np.linalg.solve(np.vander(depths, increasing=True).T, [1, b1, b2])
    return float(1.0 - shares[depths < t].sum())


def expected(frame: lx.Frame, lookup: lx.methods.FilteredMap) -> tuple[np.ndarray, np.ndarray]:
    """The share that is lit of each pixel that faces the light, and which these are."""
    seen = frame.facing & ~np.isnan(frame.visibility)
    points = frame.position[seen]
    h = np.c_[points, np.ones(len(points))] @ frame.light_matrix[0].T
    column, row = h[:, 0] / h[:, 3], h[:, 1] / h[:, 3]
    depths = 2.0 * frame.shadow_map[0].astype(np.float64) - 1.0
    bias = BIAS * np.linalg.norm(frame.light_matrix[0][2, :3])
    t = np.clip(2.0 * (h[:, 2] - bias) - 1.0, -1.0, 1.0)
    found = [
        ndimage.map_coordinates(
            blurred(plane, lookup), [row - 0.5, column - 0.5], order=1, mode="nearest"
        )
        for plane in moments_of(depths, lookup)
    ]
    if isinstance(lookup, lx.Moments):
        shares = [
            hamburger(moments, depth, lookup.moment_bias)
            for moments, depth in zip(np.array(found).T, t, strict=True)
        ]
        share = np.array(shares)
    elif isinstance(lookup, lx.Variance):
        share = chebyshev(*found, t, 4 * lookup.min_variance)
    else:
        assert isinstance(lookup, lx.ExponentialVariance)
        exponents = (lookup.exponent, lookup.negative_exponent)
        share = np.ones(len(t))
        for sign, exponent in zip((1, -1), exponents, strict=True):
            if exponent is not None:
                warped = sign * np.exp(sign * exponent * t)
                least = 4 * lookup.min_variance * (exponent * warped) ** 2
                first = 0 if sign > 0 else 2
                share = np.minimum(share, chebyshev(*found[first : first + 2], warped, least))
    b = lookup.bleeding_reduction
    return np.clip((share - b) / (1.0 - b), 0.0, 1.0), seen


@pytest.mark.parametrize("light", [SUN, SPOT], ids=["sun", "spot"])
@pytest.mark.parametrize(
    "lookup",
    [
        *FILTERS,
        lx.Variance(blur=0.0, bleeding_reduction=0.3),
        lx.Variance(blur=3.5, kernel="box"),
        lx.ExponentialVariance(blur=6.5, kernel="box", exponent=10.0, min_variance=1e-4),
        lx.Moments(blur=1.5, moment_bias=1e-4, bleeding_reduction=0.1),
    ],
    ids=lambda lookup: f"{lookup.name}-{lookup.blur:g}-{lookup.kernel}",
)
def test_shares_are_those_of_moments_in_float64(lookup, light, engine):
    """Depths along a perspective layer are linear: moments of the depths that the frame shows."""
    method = lx.Spot if light is SPOT else lx.Uniform
    frame = lx.render(two_roofs(), CAMERA, light, method(lookup=lookup, **EXACTLY))
    shares, seen = expected(frame, lookup)
    error = np.abs(frame.visibility[seen] - shares)
    assert seen.sum() > 2000
    assert ((shares > 0.02) & (shares < 0.98)).sum() > (200 if lookup.blur else 10)
    # Rounding of float32 moments, most where four of them leave little open.
    assert error.mean() < 1e-5
    assert error.max() < 2e-3


def everywhere() -> list[tuple[lx.Light, lx.Method]]:
    named = [(SUN, name) for name in lx.methods.MAP_METHODS]
    named += [(POINT, name) for name in ("cube", "dual_paraboloid", "cube+notw", "rtw", "uniform")]
    named += [(SPOT, name) for name in ("spot", "spot+rtw", "focused", "notw")]
    named += [(lx.HemisphereLight((0.5, 9.0, 1.0), (0.0, -1.0, 0.0)), "improved_paraboloid")]
    # A map of what is in shadow has no room for the lit half of a penumbra.
    more = {"scene_optimized": {"samples": "facing"}}
    return [
        (light, lx.method_from(name, resolution=256, **more.get(name, {})))  # type: ignore[arg-type]
        for light, name in named
    ]


@pytest.mark.parametrize(
    "lookup",
    [
        lx.Variance(blur=0.0, min_variance=1e-7),
        lx.ExponentialVariance(blur=0.0, min_variance=1e-7),
        lx.Moments(blur=0.0),
    ],
    ids=lambda lookup: lookup.name,
)
def test_without_blur_the_answer_is_the_depth_tests_off_borders(lookup):
    for light, method in everywhere():
        of_discs = dataclasses.replace(method, lookup=lx.Pcf(radius=2.0, samples=24))
        of_moments = dataclasses.replace(method, lookup=lookup)
        depths = lx.render_shadows(two_roofs(), CAMERA, light, of_discs)
        found = lx.render_shadows(two_roofs(), CAMERA, light, of_moments)
        assert np.array_equal(np.isnan(depths), np.isnan(found))
        off_borders = (depths == 0.0) | (depths == 1.0)
        error = np.abs(depths - found)[off_borders]
        assert off_borders.sum() > 1500
        name = (light, method.composition)
        assert error.mean() < 2e-3, name
        assert (error > 0.05).mean() < 0.01, name


@pytest.mark.parametrize("lookup", FILTERS, ids=lambda lookup: f"{lookup.name}{lookup!r}"[:40])
def test_every_map_and_light_comes_near_the_coverage(lookup):
    for light in (SUN, POINT):
        truth = lx.coverage(two_roofs(), CAMERA, light, "exact", samples=8)
        for of_light, method in everywhere():
            if of_light is light:
                filtered = dataclasses.replace(method, lookup=lookup)
                found = lx.render_shadows(two_roofs(), CAMERA, light, filtered)
                error = lx.compare(found, truth).mean_absolute_error
                # One exponential takes the farthest texel for all of a blur on a slope.
                most = 0.07 if lookup == EVSM2 else 0.05
                assert error < most, method.composition


def test_words_stand_for_filters_with_their_defaults(view, engine):
    for word, lookup in (
        ("variance", lx.Variance()),
        ("exponential_variance", lx.ExponentialVariance()),
        ("moments", lx.Moments()),
    ):
        images = {
            lx.render_shadows(*view, "desired_view", lookup=given).tobytes()
            for given in (word, lookup, lookup)
        }
        assert len(images) == 1


@cache
def leaking() -> tuple[lx.Scene, lx.Camera, lx.Light]:
    """A floor in the shadow of a low roof, under the edge of a high one: all of it is dark."""
    scene = boxes((-8, 8, -8, 8, 0), (-6, 6, -6, 6, 1.0), (-6, 0.13, -6, 6, 6.0))
    # From below the low roof.
    camera = lx.Camera.look_at((0.0, 0.9, 5.0), (0.0, 0.0, 0.0), yfov=0.7, width=120, height=40)
    return scene, camera, lx.DirectionalLight((0.02, -1.0, 0.01))


def leak(lookup: lx.methods.Filter) -> float:
    """The most light that a pixel of the dark floor gets, between two casters' edges."""
    scene, camera, light = leaking()
    method = lx.Uniform(resolution=256, lookup=lookup)
    found = lx.render(scene, camera, light, method)
    inside = (np.abs(found.position) < 3.0).all(axis=-1) & (found.position[..., 1] < 0.01)
    assert inside.sum() > 1000
    return float(found.visibility[inside].max())


def test_light_leaks_where_two_casters_edges_are_in_a_blur(engine):
    """The share of Chebyshev's bound: of a blur half over both roofs, at depths d and d + 5 before
    a receiver 1 below the lower one, variance says 6.25 / (6.25 + 3.5^2) = 0.34, and more where
    less of the high roof is in it."""
    assert leak(lx.Pcf(radius=6.0, samples=32)) == 0.0
    assert 0.25 < leak(lx.Variance(blur=6.0)) < 0.6
    assert leak(lx.Variance(blur=6.0, bleeding_reduction=0.7)) == 0.0
    assert leak(lx.ExponentialVariance(blur=6.0)) < 0.05
    # Two depths are all that four moments need.
    assert leak(lx.Moments(blur=6.0)) < 0.03


@cache
def fence() -> tuple[lx.Scene, lx.Camera, lx.Light]:
    """A floor that is seen from afar, in the stripes of a fence that are narrower than a pixel."""
    slats = [(-4 + 0.1 * i, -3.95 + 0.1 * i, -4, 4, 1.0) for i in range(80)]
    scene = boxes((-5, 5, -5, 5, 0), *slats)
    camera = lx.Camera.look_at(
        (0.0, 0.5, 0.0), (0, 0, 0), (0, 0, -1), ymag=3.0, width=41, height=41
    )
    return scene, camera, lx.DirectionalLight((0.31, -1.0, 0.17))


@pytest.mark.parametrize("lookup", [lx.Variance(blur=0.0), lx.Moments(blur=0.0)], ids=str)
@pytest.mark.parametrize("method", ["uniform", "rtw", "focused"])
def test_mips_answer_for_pixels_that_cover_many_texels(lookup, method, engine):
    truth = lx.coverage(*fence(), "exact", samples=32)
    errors = [
        lx.compare(
            lx.render_shadows(
                *fence(), method, resolution=1024,
                lookup=dataclasses.replace(lookup, mips=mips),
            ),
            truth,
        ).mean_absolute_error
        for mips in (False, True)
    ]  # fmt: skip
    assert errors[1] < 0.6 * errors[0], errors


def test_mips_change_nothing_where_texels_are_wider_than_pixels():
    seen = two_roofs(), CAMERA, SUN
    plain, mips = (
        lx.render_shadows(*seen, "uniform", resolution=64, lookup=lx.Variance(mips=mips))
        for mips in (False, True)
    )
    assert plain.tobytes() == mips.tobytes()


@pytest.mark.parametrize("lookup", FILTERS[1:], ids=lambda lookup: lookup.name)
def test_same_bytes_at_every_run_and_with_any_threads(view, lookup):
    for name in ("rtw", "notw", "cascades"):
        method = lx.method_from(name, resolution=256, lookup=lookup)
        runs = {
            lx.render_shadows(*view, method, threads=threads).tobytes() for threads in (1, 2, 3)
        }
        assert len(runs) == 1


def test_a_blur_ends_at_a_seam(engine):
    """Of a torn map: with texels from beyond, the error was that of no warp."""
    made = lx.scenes.colonnade()
    seen = made, made.cameras["default"].resized(320, 180), made.lights["default"]
    truth = lx.coverage(*seen, "exact", samples=8)
    torn, whole = (
        lx.compare(
            lx.render_shadows(*seen, name, resolution=512, lookup=lx.Moments(blur=2.0)),
            truth,
        ).mean_absolute_error
        for name in ("notw", "desired_view")
    )
    assert torn < 0.8 * whole


def test_boundaries_are_those_of_hard_shadows(view):
    warps = [
        lx.render(
            *view,
            lx.RectilinearWarp(
                importance="distance*boundary", resolution=128, analysis_resolution=64,
                lookup=lookup,
            ),
        ).warp_map.tobytes()
        for lookup in ("depth", lx.Moments(blur=8.0))
    ]  # fmt: skip
    assert warps[0] == warps[1]


@pytest.mark.parametrize(
    ("cls", "arguments", "error", "words"),
    [
        (lx.Variance, {"blur": -1}, ValueError, "blur must be a number from 0 to 256, got -1"),
        (lx.Variance, {"blur": 257.0}, ValueError, "blur must be a number from 0 to 256, got 257"),
        (lx.Moments, {"blur": "2"}, TypeError, "blur must be a number from 0 to 256, got '2'"),
        (lx.Moments, {"kernel": "tent"}, ValueError, "must be one of 'gaussian', 'box', got"),
        (lx.Moments, {"moment_bias": 2.0}, ValueError, "moment_bias must be a number from 0 to 1"),
        (lx.Variance, {"min_variance": math.nan}, ValueError, "min_variance must be a number from"),
        (lx.Variance, {"bleeding_reduction": 1.0}, ValueError, "must be a number from 0 to 0.99"),
        (lx.Variance, {"mips": 1}, TypeError, "mips must be True or False, got 1"),
        (lx.ExponentialVariance, {"exponent": 43}, ValueError, "above 0 and at most 42, got 43"),
        (lx.ExponentialVariance, {"exponent": None}, TypeError, "at most 42, got None"),
        (lx.ExponentialVariance, {"negative_exponent": 0}, ValueError, "at most 42 or None, got 0"),
        (lx.Variance, {"moment_bias": 0.1}, TypeError, "parameter of Variance must be one of"),
    ],
)  # fmt: skip
def test_bad_filters_are_named(cls, arguments, error, words):
    with pytest.raises(error, match=words):
        cls(**arguments)


def test_no_mips_where_the_map_is_torn(view, engine):
    torn = lx.NonOrthogonalWarp(resolution=256, lookup=lx.Variance(mips=True))
    with pytest.raises(ValueError, match="mips must be False where a warp tears the map"):
        lx.render_shadows(*view, torn)
    whole = dataclasses.replace(torn, function_count=1)
    assert np.nanmin(lx.render_shadows(*view, whole)) < 0.1


def test_the_command_measures_filters_and_goes_on(tmp_path, capsys):
    table, plot = tmp_path / "filters.csv", tmp_path / "filters.png"
    line = ["lab", "filters", "-o", str(table), "--plot", str(plot), "--size", "60x40"]
    line += ["--samples", "4", "--resolution", "64"]
    assert main(line) == 0
    assert "moments, mips" in capsys.readouterr().out
    rows = read(table)
    first = table.read_bytes()
    assert len(rows) == len(filters.UNFILTERED) + len(filters.FILTERS) * len(filters.RADII)
    leaks = rows[rows["radius"] == 8.0].set_index("filter")["leak"]
    assert leaks["variance"] > 5 * leaks["moments"]
    assert leaks["pcf"] == 0.0
    assert plot.stat().st_size > 1000
    # Nothing is left to measure.
    assert main(line) == 0
    assert table.read_bytes() == first
