"""Warps by samples: any warp of the plane, as a table of where its texels' rays are."""

from __future__ import annotations

import pickle
import re

import numpy as np
import pytest
from conftest import TESTS_SHADERS
from test_edge_on import CAMERA as CAMERA_BESIDE, house, sun
from test_masks import CAMERA as CAMERA_OF_MASKS, LIGHTS, SCENES

import lixel as lx
from lixel.pictures import warp_plots
from lixel.warps import receiver_places

SCENE = lx.scenes.objects_on_floor(count=9, subdivisions=1)
CAMERA = lx.Camera.look_at((-3.1, 2.3, 4.2), (0.2, 0.3, 0.1), yfov=0.8, width=160, height=90)
SUN = lx.DirectionalLight((0.4, -1.0, 0.3))
VIEW = (SCENE, CAMERA, SUN)
TRUTH = lx.reference(*VIEW)
LOOKUPS = ("depth", "triangle", "auto", "auto_5x5", "revectorized", "variance", lx.Pcf(radius=2))


@pytest.fixture(autouse=True)
def _on_the_cpu_engine(monkeypatch):
    # The other has no such warps.
    monkeypatch.setenv("LIXEL_DEVICE", "cpu")


def identity(height, width=None):
    """Where the texels of a map are that is not warped."""
    x, y = ((np.arange(count) + 0.5) / count for count in (width or height, height))
    return np.stack(np.meshgrid(x, y), axis=-1)


def swirl(side, angle=0.8):
    """The plane turned around its middle, less and less towards the border, which stays."""
    from_middle = identity(side) - 0.5
    fall = np.clip(1 - 4 * (from_middle**2).sum(axis=-1), 0, None) ** 2
    return 0.5 + turned(from_middle, angle * fall)


def turned(places, angle):
    x, y = np.moveaxis(places, -1, 0)
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.stack([cosine * x - sine * y, sine * x + cosine * y], axis=-1)


def lens(side, power=0.35):
    """More texels in the middle of the plane, by the distance from it."""
    from_middle = identity(side) - 0.5
    across = np.clip(2 * np.linalg.norm(from_middle, axis=-1, keepdims=True), 1e-9, 1)
    return 0.5 + from_middle * across**power


def errors(method):
    return lx.compare(lx.render_shadows(*VIEW, method), TRUTH)


def differing(a, b):
    return np.count_nonzero((a != b) & ~(np.isnan(a) & np.isnan(b)))


# --- What it is ---


@pytest.mark.parametrize("lookup", LOOKUPS)
def test_samples_that_move_nothing_are_the_map_itself(lookup):
    plain = lx.render(*VIEW, lx.DesiredView(resolution=128, lookup=lookup))
    given = lx.render(*VIEW, lx.GivenWarp(samples=identity(128), resolution=128, lookup=lookup))
    for part in ("visibility", "shadow_map", "aliasing_error", "max_effective_resolution"):
        np.testing.assert_array_equal(getattr(given, part), getattr(plain, part))


@pytest.mark.parametrize("lookup", LOOKUPS)
def test_samples_of_functions_have_their_picture(lookup):
    small = {"resolution": 128, "lookup": lookup}
    functions = lx.warp_map(*VIEW, "rtw", resolution=128)[0]
    table = lx.unwarp_points(functions, identity(128).reshape(-1, 2)).reshape(128, 128, 2)
    by_functions, by_samples = (
        lx.render(*VIEW, lx.GivenWarp(**warp, **small))
        for warp in ({"functions": functions}, {"samples": table})
    )
    # Their inverses are rounded in different ways.
    texels = np.abs(by_functions.shadow_map - by_samples.shadow_map) > 1e-5
    apart = np.abs(by_functions.visibility - by_samples.visibility)
    assert np.count_nonzero(texels) <= 5
    # Of a disc's tests a few may fall into the texel beside.
    assert np.count_nonzero(apart > 0.1) <= 2
    assert np.count_nonzero(apart > 0.02) <= 20


@pytest.mark.parametrize("turns", [1, 2, 3, "mirror"])
@pytest.mark.parametrize(
    ("scene", "camera", "light"),
    [VIEW, (house(False), CAMERA_BESIDE, sun(1e-5)), (house(True), CAMERA_BESIDE, sun(1e-8))],
    ids=["objects", "a wall along the light", "a wall along the light under a roof"],
)
def test_a_turned_map_has_the_same_shadows(scene, camera, light, turns):
    table = identity(128)
    table = table[:, ::-1] if turns == "mirror" else np.rot90(table, turns)
    for lookup in ("depth", "triangle_1x1", "triangle", "auto"):
        small = {"resolution": 128, "lookup": lookup}
        plain = lx.render(scene, camera, light, lx.DesiredView(**small))
        given = lx.render(scene, camera, light, lx.GivenWarp(samples=table, **small))
        assert differing(given.visibility, plain.visibility) <= 3
        facing = plain.facing
        np.testing.assert_allclose(
            given.aliasing_error[facing], plain.aliasing_error[facing], rtol=1e-4
        )


@pytest.mark.parametrize("warp", [swirl, lens])
def test_warps_that_no_functions_make_have_right_shadows(warp):
    fine = errors(lx.GivenWarp(samples=warp(1024), resolution=1024, lookup="triangle"))
    assert fine.misclassified_count == 0
    for lookup in LOOKUPS[:4]:
        small = {"resolution": 192, "lookup": lookup}
        given = errors(lx.GivenWarp(samples=warp(192), **small)).misclassified_count
        plain = errors(lx.DesiredView(**small)).misclassified_count
        assert given <= 1.5 * plain + 10


def test_a_table_of_another_size_is_interpolated():
    """Samples between which the warp is linear: two triangles for each four."""
    coarse = swirl(17, angle=0.5)
    bound = np.linspace(0, 1, 5)
    points = np.stack(np.meshgrid(bound, bound), axis=-1).reshape(-1, 2) * 0.8 + 0.1
    cell = points * 17 - 0.5
    first = np.floor(cell).astype(int)
    (u, v), (x, y) = (cell - first).T[..., None], first.T
    corners = [coarse[y + j, x + i] for j in (0, 1) for i in (0, 1)]
    near = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0])
    far = corners[3] + (1 - u) * (corners[2] - corners[3]) + (1 - v) * (corners[1] - corners[3])
    expected = np.where(u + v <= 1, near, far)
    np.testing.assert_allclose(lx.unwarp_points(coarse, points), expected, atol=1e-6)
    np.testing.assert_allclose(lx.warp_points(coarse, expected), points, atol=1e-6)
    for side in (17, 64):
        small = {"resolution": 256, "lookup": "triangle"}
        given = errors(lx.GivenWarp(samples=swirl(side, angle=0.5), **small))
        plain = errors(lx.DesiredView(**small))
        assert given.false_shadow_count == 0
        assert given.misclassified_count <= 1.5 * plain.misclassified_count + 5


def horseshoe(side, gap):
    """A band around a circle, whose ends are so many of its steps apart."""
    places = identity(8, side)
    angle = 2 * np.pi * places[..., 0] * side / (side - 1 + gap)
    radius = 0.2 + 0.2 * (1 - places[..., 1])
    return 0.5 + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


def test_what_goes_on_beyond_a_table_hides_nothing_of_it():
    """Beyond its ends a table goes on for a step: here over its other end."""
    table = horseshoe(32, gap=0.4)
    random = np.random.default_rng(8)
    texels = random.uniform(1 / 64, 63 / 64, (20_000, 2)) * (1, 0.8) + (0, 0.1)
    places = lx.unwarp_points(table, texels)
    np.testing.assert_allclose(lx.warp_points(table, places), texels, atol=1e-6)


def test_the_effective_resolution_is_that_of_the_narrowest_step():
    small = {"resolution": 96, "lookup": "depth"}
    table = identity(96)
    table[..., 0] **= 1.5
    plain = lx.render(*VIEW, lx.DesiredView(**small)).max_effective_resolution
    given = lx.render(*VIEW, lx.GivenWarp(samples=table, **small)).max_effective_resolution
    widened = 1 / (96 * np.diff(table[0, :, 0]).min())
    np.testing.assert_allclose(given, np.array(plain) * (widened, 1), rtol=1e-3)


def test_what_samples_do_not_reach_is_lit():
    half = identity(64) * [0.5, 1.0]
    given = lx.render(*VIEW, lx.GivenWarp(samples=half, resolution=64))
    places = np.full(given.visibility.shape, np.nan)
    places[given.facing] = receiver_places(given, 0)[:, 0]
    assert (given.visibility[places > 0.5 + 1 / 64] == 1).all()
    assert (given.visibility[places < 0.5] == 0).any()
    beside = lx.warp_points(half, [[0.75, 0.5], [0.25, 0.5]])
    assert np.isnan(beside[0]).all()
    np.testing.assert_allclose(beside[1], [0.5, 0.5], atol=1e-6)


def test_a_frame_gives_the_samples_back():
    table = swirl(96)
    method = lx.GivenWarp(samples=table, resolution=96)
    assert method.samples.dtype == np.float32
    assert not method.samples.flags.writeable
    np.testing.assert_array_equal(pickle.loads(pickle.dumps(method)).samples, method.samples)
    frame = lx.render(*VIEW, method)
    np.testing.assert_array_equal(frame.warp_map, table[None].astype(np.float32))
    np.testing.assert_array_equal(lx.warp_map(*VIEW, method), frame.warp_map)
    assert frame.importance_map.size == 0
    # A turn changes no area: the map is as fine as it was, but where places move apart.
    plain = lx.render(*VIEW, lx.DesiredView(resolution=96))
    ratio = frame.aliasing_error / plain.aliasing_error
    assert 0.9 < np.nanmedian(ratio) < 1.1
    dense = lx.render(*VIEW, lx.GivenWarp(samples=identity(96) / 2 + 0.25, resolution=96))
    covered = ~np.isnan(dense.aliasing_error)
    assert 0 < np.count_nonzero(covered) < np.count_nonzero(~np.isnan(plain.aliasing_error))
    np.testing.assert_allclose(
        dense.aliasing_error[covered], plain.aliasing_error[covered] / 2, rtol=1e-4
    )
    np.testing.assert_allclose(
        dense.max_effective_resolution, 2 * np.array(plain.max_effective_resolution), rtol=1e-4
    )


def test_tables_are_of_all_layers_or_of_each():
    light = lx.PointLight((0.3, 2.5, 0.2))
    small = {"fit": "cube", "resolution": 96}
    plain = lx.render(SCENE, CAMERA, light, "cube", resolution=96)
    layers = plain.stats["layers"]
    assert layers > 1
    one = lx.render(SCENE, CAMERA, light, lx.GivenWarp(samples=identity(96), **small))
    each = np.stack([identity(96)] * layers)
    np.testing.assert_array_equal(one.warp_map, each.astype(np.float32))
    each = lx.render(SCENE, CAMERA, light, lx.GivenWarp(samples=each, **small))
    np.testing.assert_array_equal(each.visibility, one.visibility)
    truth = lx.reference(SCENE, CAMERA, light)
    assert lx.compare(one, truth).misclassified_count < 150
    too_many = np.stack([identity(4)] * 7)
    with pytest.raises(ValueError, match=f"or of as many as the fit makes here, {layers}, got 7"):
        lx.render_shadows(SCENE, CAMERA, light, lx.GivenWarp(samples=too_many, **small))


def test_holes_of_masked_triangles_are_seen():
    made, light = SCENES["leaves"], LIGHTS["sun"]
    truth = lx.reference(made.scene(), CAMERA_OF_MASKS, light)
    warp = lx.GivenWarp(samples=swirl(512), resolution=512, lookup="triangle")
    found = lx.compare(lx.render_shadows(made.scene(), CAMERA_OF_MASKS, light, warp), truth)
    solid = lx.render_shadows(made.solid(), CAMERA_OF_MASKS, light, "exact")
    assert found.false_shadow_count <= 2
    assert found.misclassified_count < 0.1 * np.count_nonzero(solid != truth.visibility)


def test_plots_draw_samples():
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    frame = lx.render(*VIEW, lx.GivenWarp(samples=swirl(64), resolution=64))
    axes = warp_plots.warp_grid(frame, lines=5)
    assert len(axes.lines) == 10
    middle = axes.lines[4].get_xydata()
    assert np.ptp(middle[:, 0]) > 0.05  # Straight lines of texels are none before a swirl.
    assert warp_plots.unwarped_depths(frame).shape == (128, 128)
    warp_plots.receiver_counts(frame)
    with pytest.raises(ValueError, match="importance map; 'given_warp' makes none"):
        warp_plots.importance(frame)


# --- What is refused ---


def changed(row, column, place):
    table = identity(8)
    table[row, column] = place
    return table


def slipped():
    table = identity(32) * [1.0, 0.5]
    table[:, 16:] += [0.0, 0.4]
    return table


def curled():
    """A band around a circle, and over its own beginning."""
    places = identity(8, 64)
    angle, radius = 7 * places[..., 0], 0.2 + 0.2 * (1 - places[..., 1])
    return 0.5 + np.stack([radius * np.cos(angle), radius * np.sin(angle)], axis=-1)


RULE = (
    "samples must be an array (h, w, 2), or (layers, h, w, 2), of places (x, y) from 0 to 1, "
    "h and w from 2 to 32768, that is neither folded nor torn or None, got "
)


@pytest.mark.parametrize(
    ("samples", "got"),
    [
        (changed(3, 5, (np.nan, 0.5)), "(NaN, 0.5) at row 3, column 5 of layer 0"),
        (changed(3, 5, (0.5, 1.25)), "(0.5, 1.25) at row 3, column 5 of layer 0"),
        (changed(3, 5, (-0.25, 0.5)), "(-0.25, 0.5) at row 3, column 5 of layer 0"),
        (np.stack([identity(8), changed(0, 0, (np.inf, 0))]), "(inf, 0) at row 0, column 0 of"),
        (changed(3, 5, (0.1, 0.1)), "a fold at row 2, column 4 of layer 0"),
        (changed(0, 0, (0.2, 0.2)), "a fold at row 0, column 0 of layer 0"),
        (np.repeat(identity(8, 4), 2, axis=1), "a fold at row 0, column 0 of layer 0"),
        (np.roll(identity(8), 4, axis=1), "a fold at row 0, column 3 of layer 0"),
        (np.full((8, 8, 2), 0.5), "a fold at row 0, column 0"),
        (slipped(), "a tear at row 0, column 15 of layer 0"),
        (curled(), "a border that meets itself at row "),
        (np.ones((4, 4)), "shape (4, 4)"),
        (np.ones((4, 4, 3)), "shape [4, 4, 3]"),
        (np.ones((0, 4, 4, 2)), "shape [0, 4, 4, 2]"),
        (np.ones((1, 4, 2)), "1 rows of 4 places"),
        (np.ones((4, 0, 2)), "shape [4, 0, 2]"),
    ],
)
def test_tables_that_are_no_warps_are_named(samples, got):
    with pytest.raises(ValueError, match=re.escape(RULE + got)):
        lx.GivenWarp(samples=samples)


def test_a_warp_with_seams_has_functions_in_place_of_samples():
    functions = lx.warp_map(*VIEW, "notw", resolution=256)[0]
    table = lx.unwarp_points(functions, identity(256).reshape(-1, 2)).reshape(256, 256, 2)
    with pytest.raises(ValueError, match=r"got a (tear|fold) at row "):
        lx.GivenWarp(samples=table)


def test_what_does_not_go_with_samples_is_named():
    with pytest.raises(TypeError, match="samples must be an array"):
        lx.GivenWarp(samples="swirl")
    with pytest.raises(ValueError, match="functions or samples must be given, got neither"):
        lx.GivenWarp()
    with pytest.raises(ValueError, match="functions or samples must be given, got both"):
        lx.GivenWarp(np.broadcast_to([0, 1.0], (2, 1, 2)), samples=identity(4))
    with pytest.raises(ValueError, match="rasterization must be 'exact' with samples"):
        lx.GivenWarp(samples=identity(4), rasterization="linear")


@pytest.mark.skipif(not TESTS_SHADERS, reason="there is no GPU to be named")
def test_a_gpu_has_no_form_of_samples(monkeypatch):
    method = lx.GivenWarp(samples=identity(16), resolution=16)
    with pytest.raises(lx.DeviceError, match="warps by samples have no form on the GPU engine"):
        lx.render_shadows(*VIEW, method, device="gpu")


def test_a_function_in_python_may_return_samples():
    def own_swirl(receivers, light, scene, *, resolution=96):
        return lx.GivenWarp(samples=swirl(resolution), resolution=resolution)

    method = lx.shadow_method(own_swirl)
    given = lx.render_shadows(*VIEW, lx.GivenWarp(samples=swirl(96), resolution=96))
    np.testing.assert_array_equal(lx.render_shadows(*VIEW, method()), given)
