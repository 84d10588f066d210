"""Rendering the same thing twice, in parallel, in other processes, and after a change."""

from __future__ import annotations

import dataclasses
import multiprocessing
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor

import numpy as np
import pytest
from views import HEIGHT, WIDTH, cameras, small

import lixel as lx
from lixel import _core
from lixel.frame import OUTPUTS, frame_parts

METHODS = list(lx.methods.MAP_METHODS.values())
ARRAYS = ("visibility", "triangle_id", "shadow_map", "light_matrix", "aliasing_error")


def assert_same(a: lx.Frame, b: lx.Frame) -> None:
    """To the bit."""
    for name in ARRAYS:
        assert getattr(a, name).tobytes() == getattr(b, name).tobytes(), name
    assert a.max_effective_resolution == b.max_effective_resolution


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("name", ["objects_on_floor", "needles", "terrain"])
def test_the_same_call_gives_the_same_bytes(name, method):
    scene, twin = small(name), small(name)
    camera, light = scene.cameras["default"].resized(640, 360), scene.lights["default"]
    first = lx.render(scene, camera, light, method())
    # The second frame finds the visibility buffer, the third does not, the fourth is another scene.
    assert_same(first, lx.render(scene, camera, light, method()))
    lx.render(scene, camera.resized(64, 64), light, method())
    assert_same(first, lx.render(scene, camera, light, method()))
    assert_same(first, lx.render(twin, camera, light, method()))


def test_another_light_starts_at_the_receivers():
    scene, method = small("colonnade"), lx.DesiredView()
    camera = scene.cameras["default"].resized(WIDTH, HEIGHT)
    light, other = scene.lights["default"], lx.DirectionalLight((-0.5, -1, 0.1))
    first = lx.render(scene, camera, light, method)
    assert "visibility" in first.timings
    second = lx.render(scene, camera, other, method)
    assert "visibility" not in second.timings
    assert "visibility" in second.stats["skipped"]
    assert_same(second, lx.render(small("colonnade"), camera, other, method))
    # An equal camera is the same camera; another one is not.
    again = small("colonnade").cameras["default"].resized(WIDTH, HEIGHT)
    assert "visibility" not in lx.render(scene, again, light, method).timings
    assert "visibility" in lx.render(scene, again.resized(WIDTH, HEIGHT + 1), light, method).timings


@pytest.mark.parametrize("method", METHODS)
def test_moved_vertices_are_a_new_scene(method):
    scene = small("objects_on_floor")
    camera, light = scene.cameras["default"].resized(WIDTH, HEIGHT), scene.lights["default"]
    # Without this the near plane would move with the scene, and the camera would be another one.
    camera = dataclasses.replace(camera, znear=0.1)
    start = scene.vertices
    before = lx.render(scene, camera, light, method())
    random = np.random.default_rng(5)
    # Float32 coordinates, others, a flattened scene, then back.
    for vertices in (
        np.round(start * 64) / 64 + (0.5, 0, 0),
        start * 1.1 + random.normal(scale=0.02, size=start.shape),
        start * (1, 0, 1),
        start,
    ):
        scene.update_vertices(vertices)
        frame = lx.render(scene, camera, light, method())
        assert "visibility" in frame.timings
        assert_same(frame, lx.render(lx.Scene(vertices, scene.faces), camera, light, method()))
        truth = lx.reference(scene, camera, light)
        differ = (frame.triangle_id != truth.triangle_id) & ~truth.triangle_tie
        assert not differ.any()
    assert_same(frame, before)


def test_threads_render_what_one_thread_renders():
    names = ["objects_on_floor", "colonnade", "city", "plane_and_box"]
    shared = small("objects_on_floor")
    jobs = [
        (scene, camera, scene.lights["default"], method(resolution=resolution))
        for scene in (shared, *map(small, names))
        for _, camera in list(cameras(scene))[:3]
        for method in METHODS
        for resolution in (128, 512)
    ]
    serial = [lx.render(*job) for job in jobs]
    with ThreadPoolExecutor(4) as pool:
        parallel = list(pool.map(lambda job: lx.render(*job), jobs))
        backwards = list(pool.map(lambda job: lx.render(*job), reversed(jobs)))
    for one, other, third in zip(serial, parallel, reversed(backwards), strict=True):
        assert_same(one, other)
        assert_same(one, third)


def test_processes_render_what_this_one_renders():
    """Scenes, cameras, lights and methods travel to fresh processes, as Dask or MPI send them."""
    jobs = [
        (small(name), method(resolution=256))
        for name in ("plane_and_box", "objects_on_floor")
        for method in METHODS
    ]
    views = [
        (scene, scene.cameras["default"].resized(WIDTH, HEIGHT), scene.lights["default"], method)
        for scene, method in jobs
    ]
    here = [lx.render_shadows(*view) for view in views]
    with ProcessPoolExecutor(2, multiprocessing.get_context("spawn")) as pool:
        futures = [pool.submit(lx.render_shadows, *view) for view in views]
        there = [future.result(timeout=120) for future in futures]
    assert [a.tobytes() for a in here] == [b.tobytes() for b in there]


def test_the_shaders_stay_inside_their_arrays():
    """The shipped shaders are compiled without bounds checks. With checks, in a process of its own,
    they must give the same bytes: a read outside an array would give another value."""
    scene = small("objects_on_floor")
    views = [
        (scene, camera, scene.lights["default"], method(resolution=257))
        for _, camera in cameras(scene)
        for method in METHODS
    ]
    here = [lx.render_shadows(*view).tobytes() for view in views]
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, context, initializer=_check_shaders) as pool:
        there = [pool.submit(lx.render_shadows, *view) for view in views]
        assert here == [future.result(timeout=300).tobytes() for future in there]


def _check_shaders() -> None:
    import os

    os.environ["LIXEL_CHECKED_SHADERS"] = "1"


def test_large_and_small_frames_in_turn():
    """Scratch memory is kept from frame to frame; nothing of the last one shows in the next."""
    scene = small("objects_on_floor")
    light = scene.lights["default"]
    camera = scene.cameras["default"]
    small_frame = lx.render(scene, camera.resized(64, 36), light, lx.DesiredView(resolution=64))
    for size, resolution in (((800, 450), 1500), ((64, 36), 64), ((31, 77), 2000), ((64, 36), 64)):
        frame = lx.render(
            scene, camera.resized(*size), light, lx.DesiredView(resolution=resolution)
        )
        if size == (64, 36):
            assert_same(frame, small_frame)
    lx._core.clear_cache()
    assert_same(
        small_frame,
        lx.render(scene, camera.resized(64, 36), light, lx.DesiredView(resolution=64)),
    )


def test_a_list_of_lights_gives_a_layer_for_each(view):
    scene, camera, directional = view
    # More than are rendered at a time, and one that no surface faces.
    others = [lx.DirectionalLight((x, -1.0, 0.3)) for x in (-0.4, -0.2, 0.0, 0.5)]
    lights = [
        directional,
        *others,
        lx.DirectionalLight((0.0, 1.0, 0.0)),
        lx.PointLight((2.0, 6.0, 1.0)),
    ]
    names = ("desired_view", "scene_optimized", "notw", "exact", "ray_traced", "shadow_volumes")
    for method in names:
        # Moved vertices: nothing is known of what the camera sees.
        scene.update_vertices(scene.vertices)
        layers = lx.render_shadows(scene, camera, lights, method)
        assert layers.shape == (7, camera.height, camera.width)
        assert layers.dtype == np.float32
        for layer, light in zip(layers, lights, strict=True):
            assert layer.tobytes() == lx.render_shadows(scene, camera, light, method).tobytes()
    assert lx.render_shadows(scene, camera, ()).shape == (0, camera.height, camera.width)


def test_several_lights_share_what_the_camera_sees(view):
    scene, camera, directional = view
    lx.render_shadows(scene, camera, (directional, directional))
    assert "visibility" in lx.render(scene, camera, directional).stats["skipped"]


def test_what_is_no_light_in_a_list_is_named(view):
    scene, camera, directional = view
    with pytest.raises(TypeError, match="light must be"):
        lx.render_shadows(scene, camera, [directional, "light"])


def test_outputs_are_those_of_the_core(view):
    """The Literal, the attributes and the core's own list have the same words."""
    scene, camera, light = view
    core = (scene._core, camera._core_for(scene), [light._core])
    with pytest.raises(ValueError, match=r"outputs must be among .*, got 'colour'") as refused:
        _core.render(*core, ("uniform", {}), ["colour"])
    assert tuple(str(refused.value).split("'")[1:-2:2]) == OUTPUTS
    for name in OUTPUTS:
        [rendered] = _core.render(*core, ("rtw", {}), [name])
        shown = [other for other in OUTPUTS if getattr(rendered, other) is not None]
        assert shown == [name]
        assert rendered.visibility.shape == (camera.height, camera.width)


@pytest.mark.parametrize("method", ["uniform", "auto"])
def test_a_frame_has_no_parts_that_nobody_asked_for(method, view):
    parts = frame_parts(*view, method, ["light_matrix"])
    assert parts.method.map_resolution is None or parts.outputs.light_matrix.shape[1:] == (4, 4)
    assert parts.outputs.shadow_map is None
    assert parts.visibility.tobytes() == lx.render_shadows(*view, method).tobytes()


# --- dtype ---


@pytest.mark.parametrize("dtype", [np.uint8, "uint8", np.dtype("u1")])
def test_bytes_are_the_image_times_255_and_white_behind_it(dtype, view):
    soft = lx.DesiredView(resolution=64, lookup=lx.Pcf(radius=3.0))
    for method in ("exact", soft):
        image = lx.render_shadows(*view, method)
        found = lx.render_shadows(*view, method, dtype=dtype)
        assert (found.dtype, found.shape) == (np.uint8, image.shape)
        # Nothing that is kept was overwritten.
        assert image.tobytes() == lx.render_shadows(*view, method).tobytes()
        assert (found[np.isnan(image)] == 255).all()
        values = found[~np.isnan(image)]
        assert np.array_equal(values, np.round(255 * image[~np.isnan(image)]))
        assert {0, 255} <= set(values.tolist())
    assert len(set(values.tolist())) > 2


def test_several_lights_are_layers_of_bytes(view):
    lights = [view.light, lx.PointLight((1, 4, 1))]
    images = lx.render_shadows(*view[:2], lights, "exact", dtype=np.uint8)
    assert images.dtype == np.uint8
    for image, light in zip(images, lights, strict=True):
        alone = lx.render_shadows(*view[:2], light, "exact", dtype=np.uint8)
        assert image.tobytes() == alone.tobytes()
    none = lx.render_shadows(*view[:2], [], "exact", dtype=np.uint8)
    assert (none.dtype, none.shape) == (np.uint8, (0, 64, 96))


def test_a_frame_of_bytes_shows_what_one_of_floats_does(view, truth, tmp_path):
    frame = lx.render(*view, "desired_view", resolution=64)
    found = lx.render(*view, "desired_view", dtype=np.uint8, resolution=64)
    expected = lx.render_shadows(*view, "desired_view", dtype=np.uint8, resolution=64)
    assert found.visibility.dtype == np.uint8
    assert np.array_equal(found.visibility, expected)
    assert np.array_equal(found.to_image(), frame.to_image())
    assert repr(lx.compare(found, truth)) == repr(lx.compare(frame, truth))
    near = lx.PointLight((1, 4, 1), range=4.0)
    images = [
        lx.render(*view[:2], near, "exact", dtype=dtype).visibility_in_range
        for dtype in ("float32", "uint8")
    ]
    assert np.array_equal(*images, equal_nan=True)
    assert np.array_equal(found.visibility_in(frame), frame.visibility_in(found), equal_nan=True)
    for ending in ("npy", "npz", "mask.png"):
        for kind in (found, frame):
            kind.save(tmp_path / f"{kind.visibility.dtype}.{ending}")
        images = [lx.read_visibility(tmp_path / f"{t}.{ending}") for t in ("uint8", "float32")]
        assert np.array_equal(*images, equal_nan=True)


@pytest.mark.parametrize("dtype", [None, bool, np.float64, "bytes", np.int8, object()])
@pytest.mark.parametrize("render", [lx.render, lx.render_shadows])
def test_another_dtype_is_refused(dtype, render, view):
    with pytest.raises(ValueError, match="dtype must be float32 or uint8, got "):
        render(*view, dtype=dtype)
