"""Maps that are not square: their arrays, their texels, and what they make of shadows."""

from __future__ import annotations

import dataclasses
import itertools

import numpy as np
import pytest
from views import small

import lixel as lx
from lixel.cli import main
from lixel.methods import MAP_METHODS, OMNIDIRECTIONAL_METHODS, WARPS

pytestmark = pytest.mark.usefixtures("engine")

SUN = lx.DirectionalLight((0.5, -1.0, 0.35))
LAMP = lx.PointLight((0.9, 4.0, 0.7))
SPOT = lx.SpotLight((0.9, 5.0, 0.7), (-0.1, -1.0, -0.1), outer=0.6)
NAMES = [
    *MAP_METHODS,
    *OMNIDIRECTIONAL_METHODS,
    *(f"{fit}+{warp}" for fit, warp in itertools.product(
        ("uniform", "cascades", "lispsm", "cube", "dual_paraboloid"), WARPS
    )),
]  # fmt: skip
# The fits that choose how their map lies, and those whose axes follow the view.
LAID = ["uniform", "desired_view", "min_sm", "cascades", "focused", "scene_optimized"]
LOOKUPS = {
    "auto": "auto",
    "triangle": "triangle",
    "depth": "depth",
    "revectorized": "revectorized",
    "pcf": lx.Pcf(radius=1.5, samples=16),
    "moments": lx.Moments(blur=1.0, mips=True),
    "variance": lx.Variance(blur=1.0),
}


def view_of(method: lx.Method, name: str = "objects_on_floor") -> tuple:
    scene = small(name)
    light = next(light for light in (SUN, LAMP, SPOT) if method.takes(light))
    return scene, scene.cameras["default"].resized(160, 90), light


def wrong(method: lx.Method, name: str = "objects_on_floor") -> int:
    view = view_of(method, name)
    found = lx.compare(lx.render_shadows(*view, method), lx.reference(*view))
    return found.misclassified_count


@pytest.mark.parametrize("name", NAMES)
def test_arrays_have_the_map_s_shape(name):
    method = lx.method_from(name, resolution=(96, 40))
    frame = lx.render(*view_of(method), method)
    layers = frame.stats["layers"]
    assert layers > 0
    assert frame.shadow_map.shape == (layers, 40, 96)
    assert frame.shadow_map.min() < 1.0
    if name.endswith(("rtw", "notw")):
        # The analysis keeps its own size.
        square = lx.render(*view_of(method), lx.method_from(name, resolution=64))
        assert frame.warp_map.shape[1:] == square.warp_map.shape[1:]
        assert frame.importance_map.shape[1:] == square.importance_map.shape[1:]


@pytest.mark.parametrize("name", NAMES)
def test_more_texels_along_one_side_leave_fewer_wrong_pixels(name):
    """A map of (2n, n) or (n, 2n) is between the squares of n and of 2n, by the reference."""
    coarse, fine = (wrong(lx.method_from(name, resolution=n)) for n in (48, 96))
    between = [wrong(lx.method_from(name, resolution=shape)) for shape in ((96, 48), (48, 96))]
    print(f"{name}: {coarse}, {between}, {fine}")
    assert max(between) <= 1.1 * coarse + 10
    assert min(between) >= 0.8 * fine - 10
    assert sum(between) < 2 * coarse


@pytest.mark.parametrize("lookup", LOOKUPS)
@pytest.mark.parametrize("name", ["desired_view", "notw", "rtw", "lispsm"])
def test_every_lookup_finds_its_texels(name, lookup):
    """No more wrong pixels than a square of the shorter side, of a scene about as wide as long: a
    texel mistaken for another one is wrong all over the image."""
    chosen = LOOKUPS[lookup]
    if name == "notw" and isinstance(chosen, lx.Moments):
        chosen = dataclasses.replace(chosen, mips=False)
    square, wide = (
        wrong(lx.method_from(name, resolution=shape, lookup=chosen)) for shape in (64, (256, 64))
    )
    print(f"{name}, {lookup}: {square}, {wide}")
    assert wide <= 1.1 * square + 10


@pytest.mark.parametrize("name", ["desired_view", "notw", "cube", "dual_paraboloid", "lispsm"])
@pytest.mark.parametrize("lookup", ["auto", "depth"])
def test_straight_rasterization_has_the_same_shadows(name, lookup):
    few = {"function_count": 1, "tessellation": 0.02} if name == "notw" else {}
    exact, linear = (
        wrong(lx.method_from(name, resolution=(160, 40), lookup=lookup, rasterization=how, **few))
        for how in ("exact", "linear")
    )
    assert linear <= 1.3 * exact + 40


@pytest.mark.parametrize("name", LAID)
def test_a_box_lies_along_the_more_texels(name):
    """So that it does not matter which of the two sides is named first."""
    # What is chosen by what a first map finds differs where that lies otherwise.
    own = {"samples": "facing"} if name == "scene_optimized" else {}
    wide, high = (
        lx.render(*view_of(lx.Uniform()), name, resolution=shape, **own)
        for shape in ((192, 32), (32, 192))
    )
    assert wide.shadow_map.shape[1:] == high.shadow_map.shape[:0:-1]
    np.testing.assert_allclose(wide.aliasing_error, high.aliasing_error, rtol=1e-5)
    assert wide.largest_aliasing_error == pytest.approx(high.largest_aliasing_error, rel=1e-5)
    # The other way it would be longer and thinner.
    turned = lx.LightMatrix.of(wide, resolution=(32, 192))
    square = lx.render(*view_of(lx.Uniform()), name, resolution=64, **own)
    if name != "cascades":
        crossed = lx.render(*view_of(lx.Uniform()), turned).largest_aliasing_error
        assert wide.largest_aliasing_error < crossed
        assert square.largest_aliasing_error < crossed


def test_the_longer_side_of_the_rectangle_has_more_samples():
    """Chong and Gortler, section 2.4, by the corners of the rectangle around what is seen."""
    vertices = [(-6, 0, -1), (6, 0, -1), (6, 0, 1), (-6, 0, 1)]
    turn = np.array([[np.cos(0.4), 0, np.sin(0.4)], [0, 1, 0], [-np.sin(0.4), 0, np.cos(0.4)]])
    scene = lx.Scene(vertices @ turn, [(0, 2, 1), (0, 3, 2)])
    camera = lx.Camera.look_at((0, 14, 0.1), (0, 0, 0), (0, 0, 1), yfov=0.9, width=96, height=96)
    along = turn.T @ (1, 0, 0)
    for method, (width, height) in itertools.product(
        ("focused", "scene_optimized@published"), ((200, 50), (50, 200))
    ):
        frame = lx.render(
            scene, camera, lx.DirectionalLight((0, -1, 0)), method, resolution=(width, height)
        )
        texels = frame.light_matrix[0][:2, :3] @ along
        longer = int(height > width)
        assert abs(texels[longer]) > 0.9 * max(width, height) / 12
        assert abs(texels[1 - longer]) < 1e-3 * abs(texels[longer])


def test_rows_are_those_of_the_map_twice_as_high():
    """The same texels: a map of (2n, n), and the half of the square of 2n whose matrix takes as
    much again below it."""
    scene, camera, light = view_of(lx.Uniform())
    frame = lx.render(scene, camera, light, "uniform", resolution=64)
    matrix = frame.light_matrix[0] / np.array([64.0, 64.0, 1.0, 1.0])[:, None]
    above = matrix * np.array([1.0, 0.5, 1.0, 1.0])[:, None]
    for lookup in ("auto", "depth"):
        shared = {"lookup": lookup, "bias": "receiver_plane"}
        wide, square = (
            lx.render(scene, camera, light, lx.LightMatrix(given, resolution=shape, **shared))
            for given, shape in ((matrix, (128, 64)), (above, 128))
        )
        of_square = square.shadow_map[0, :64]
        assert np.mean(np.abs(wide.shadow_map[0] - of_square) > 1e-6) < 1e-3
        assert (square.shadow_map[0, 66:] == 1.0).all()
        apart = (wide.visibility != square.visibility) & wide.covered
        assert np.count_nonzero(apart) <= 2
        np.testing.assert_allclose(wide.aliasing_error, square.aliasing_error, rtol=1e-5)


@pytest.mark.parametrize("shape", [(256, 32), (32, 256)])
@pytest.mark.parametrize("bias", ["auto", "receiver_plane", "slope", "constant"])
@pytest.mark.parametrize("name", ["uniform", "desired_view", "notw", "rtw", "lispsm", "cube"])
def test_no_bias_has_acne_where_texels_are_eight_times_as_long(name, bias, shape):
    floor = lx.Scene([(-4, 0, -4), (4, 0, -4), (4, 0, 4), (-4, 0, 4)], [(0, 2, 1), (0, 3, 2)])
    camera = lx.Camera.look_at((0.5, 4, 6), (0, 0, 0), yfov=0.9, width=96, height=64)
    # The slope bias is of maps whose texels are even, the constant one of a light that is high.
    if bias in ("slope", "constant") and name in ("notw", "rtw", "lispsm"):
        pytest.skip("texels of these differ in width")
    for azimuth in (0.2, 1.4, 2.9):
        low = 1.3 if bias == "constant" else 0.5
        across = np.cos(low) * np.array((np.cos(azimuth), 0.0, np.sin(azimuth)))
        towards = across - (0.0, np.sin(low), 0.0)
        light = lx.PointLight(-9 * towards) if name == "cube" else lx.DirectionalLight(towards)
        visibility = lx.render_shadows(
            floor, camera, light, name, resolution=shape, lookup="depth", bias=bias
        )
        assert np.count_nonzero(visibility == 1.0) > 1000
        assert np.count_nonzero(visibility == 0.0) == 0, azimuth


@pytest.mark.not_on_cpu("it compares the engines")
@pytest.mark.parametrize("name", NAMES)
def test_engines_agree(name):
    method = lx.method_from(name, resolution=(128, 48))
    cpu, gpu = (lx.render(*view_of(method), method, device=device) for device in ("cpu", "gpu"))
    apart = (cpu.visibility != gpu.visibility) & cpu.covered
    assert np.count_nonzero(apart) <= 0.004 * np.count_nonzero(cpu.covered)
    # Of a face of a cube that sees a plane from its edge, the box is rounded in other ways.
    is_same = [
        np.allclose(*pair, rtol=1e-4)
        for pair in zip(cpu.light_matrix, gpu.light_matrix, strict=True)
    ]
    assert any(is_same)
    texels = np.abs(cpu.shadow_map - gpu.shadow_map)[is_same] > 1e-4
    assert np.mean(texels) < 0.01


@pytest.mark.parametrize("snap", [False, True])
def test_texels_of_a_map_that_moves_hold_still(snap):
    """By whole texels along both axes, each by the width that it has."""
    scene, camera, light = view_of(lx.DesiredView())
    method = lx.DesiredView(resolution=(200, 50), snap=snap)
    offsets = []
    for step in np.linspace(0, 0.4, 8):
        pose = camera.pose.copy()
        pose[:3, 3] += step * pose[:3, 0]
        frame = lx.render(scene, camera.posed(pose), light, method)
        offsets.append(frame.light_matrix[0][:2] @ (0.3, 0.1, 0.2, 1.0))
    shares = np.abs(np.subtract(offsets, np.round(offsets)) - (np.array(offsets[0]) % 1.0))
    shares = np.minimum(shares % 1.0, 1.0 - shares % 1.0)
    assert (shares.max() < 1e-3) == snap


def identity(width: int, height: int) -> np.ndarray:
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    return np.stack([x, y], axis=-1)


@pytest.mark.parametrize("lookup", ["depth", "triangle_1x1", "triangle"])
def test_a_turned_table_turns_the_map(lookup):
    """A warp by a quarter of a turn in a map of (n, 2n) is the map of (2n, n): steps from texel to
    texel are in other units along each axis."""
    scene, camera, light = view_of(lx.Uniform())
    # A bias by the width of a texel is that of the map before the warp.
    shared = {"lookup": lookup, "bias": "receiver_plane"}
    fitted = lx.LightMatrix.of(lx.render(scene, camera, light, "desired_view", resolution=64))
    plain, turned = (
        lx.render(scene, camera, light, method, device="cpu")
        for method in (
            dataclasses.replace(fitted, resolution=(128, 64), **shared),
            lx.GivenWarp(
                samples=np.rot90(identity(128, 64)), fit=fitted, resolution=(64, 128), **shared
            ),
        )
    )
    np.testing.assert_allclose(np.rot90(plain.shadow_map[0]), turned.shadow_map[0], atol=1e-5)
    apart = (plain.visibility != turned.visibility) & plain.covered
    assert np.count_nonzero(apart) <= 3
    np.testing.assert_allclose(turned.aliasing_error, plain.aliasing_error, rtol=1e-3)
    assert turned.largest_aliasing_error == pytest.approx(plain.largest_aliasing_error, rel=1e-3)


def test_an_earlier_frame_may_have_another_shape():
    scene, camera, light = view_of(lx.Uniform())
    for name in ("rtw", "notw", "scene_optimized"):
        first = lx.render(scene, camera, light, name, resolution=(128, 32))
        plain = lx.render(scene, camera, light, name, resolution=(32, 128))
        method = lx.method_from(name, resolution=(32, 128), previous=first)
        after = lx.render(scene, camera, light, method)
        assert after.shadow_map.shape == (1, 128, 32)
        if name != "scene_optimized":
            # Importance lies where it did.
            np.testing.assert_allclose(
                after.importance_map / after.importance_map.max(),
                plain.importance_map / plain.importance_map.max(),
                atol=0.35,
            )


def test_values_are_kept_in_one_form():
    for given in ((64, 32), [64, 32], np.array([64, 32])):
        method = lx.Uniform(resolution=given)
        assert method.resolution == (64, 32)
        assert method.map_size == (64, 32)
    assert lx.Uniform(resolution=(64, 64)).resolution == 64
    assert lx.Uniform(resolution=(64, 64)) == lx.Uniform(resolution=64)
    assert lx.Uniform(resolution=64).map_size == (64, 64)
    assert lx.Exact().map_size is None
    assert dataclasses.replace(lx.Uniform(), resolution=(2, 3)).resolution == (2, 3)
    assert lx.RectilinearWarp.published(resolution=(64, 32)).published_in == "rosen-2012"


@pytest.mark.parametrize("shape", [(1, 1), (1, 33), (33, 1), (2, 129)])
@pytest.mark.parametrize("name", ["uniform", "desired_view", "notw", "rtw", "scene_optimized"])
def test_the_smallest_maps_are_maps(name, shape):
    few = {"importance_resolution": 8, "function_count": 2} if name == "notw" else {}
    for lookup in ("auto", "revectorized", lx.Moments(), lx.Pcf(radius=1.5, samples=16)):
        frame = lx.render(*view_of(lx.Uniform()), name, resolution=shape, lookup=lookup, **few)
        assert frame.shadow_map.shape[1:] == shape[::-1]
        assert not np.isnan(frame.visibility[frame.covered]).any()


def test_maps_in_pages_are_squares():
    with pytest.raises(ValueError, match=r"with method 'virtual', whose pages .* got \(512, 256\)"):
        lx.VirtualShadowMap(resolution=(512, 256))
    assert lx.VirtualShadowMap(resolution=(512, 512)).resolution == 512


# --- The command line and studies ---


def test_the_command_line_takes_both_forms(tmp_path, capsys):
    picture = tmp_path / "shadows.png"
    scene = ["plane_and_box", "--size", "64x36"]
    main(["render", *scene, "--method", "rtw", "--resolution", "96x32", "-o", str(picture)])
    assert picture.exists()
    assert main(["render", *scene, "--resolution", "96x", "-o", str(picture)]) == 2
    assert "must be N or WIDTHxHEIGHT in texels, got '96x'" in capsys.readouterr().err
    assert main(["render", *scene, "--resolution", "96x0", "-o", str(picture)]) == 2
    assert "or (width, height) of such numbers, got (96, 0)" in capsys.readouterr().err


def test_studies_take_both_forms(tmp_path):
    table = lx.study(
        "plane_and_box", methods=["uniform", "ray_traced"], size=(64, 36), repeats=1,
        parameters={"resolution": [64, (96, 32)]}, progress=False,
    )  # fmt: skip
    of_maps = table[table["method"] == "uniform"]
    assert of_maps["resolution"].tolist() == ["64", "96x32"]
    table.to_parquet(tmp_path / "study.parquet")
