"""What the device cannot hold is refused in words, before it is asked; nothing panics or hangs.

Wrong arguments have their tests beside the classes that refuse them: scenes in test_scene.py,
cameras in test_camera.py, lights in test_light.py, methods in test_methods_interface.py, files in
test_load.py."""

from __future__ import annotations

import numpy as np
import pytest

import lixel as lx
from lixel import _core

METHODS = list(lx.methods.MAP_METHODS.values())


@pytest.mark.not_on_cpu("memory bounds its maps")
@pytest.mark.parametrize("method", METHODS)
def test_a_map_beyond_the_device_is_refused(method, view):
    most = lx.info().device["limits"]["storage_binding_bytes"]
    if most >= 8 * 32768**2:
        pytest.fail("this device holds the largest map there is; the test needs another")
    with pytest.raises(lx.DeviceError, match=r"map needs \d+ bytes .* allows \d+"):
        lx.render(*view, method(resolution=32768))
    # And the next frame is as if nothing had happened.
    assert not np.isnan(lx.render_shadows(*view, method())).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("resolution", [32769, 2**31, 2**32 - 1])
def test_a_map_beyond_all_devices_is_refused(method, resolution, view):
    with pytest.raises(ValueError, match=rf"resolution .* 1 to 32768, .*got {resolution}"):
        lx.render(*view, method(resolution=resolution))


@pytest.mark.parametrize("method", METHODS)
def test_a_map_of_one_texel_and_a_large_one_work(method, view):
    truth = lx.reference(*view)
    coarse = lx.compare(lx.render(*view, method(resolution=1)), truth)
    fine = lx.compare(lx.render(*view, method(resolution=4096)), truth)
    assert fine.misclassified_count <= coarse.misclassified_count
    assert fine.rate_covered < 0.001


@pytest.mark.parametrize("size", [(100_000, 100_000), (2**32 - 1, 2**32 - 1), (2**32 - 1, 1)])
def test_an_image_beyond_the_device_is_refused(size, view):
    scene, camera, light = view
    huge = camera.resized(*size)
    with pytest.raises(ValueError, match=rf"image size .* {size[0]} .*{size[1]}"):
        lx.render_shadows(scene, huge, light)
    assert not np.isnan(lx.render_shadows(*view)).all()


@pytest.mark.parametrize("outputs", [[], ["triangle_id"], ["unknown"]])
def test_the_core_checks_for_itself(outputs, view):
    """Whoever calls the core without the facade gets an error in words, too."""
    scene, camera, light = view
    core = (scene._core, camera._core_for(scene), [light._core])
    with pytest.raises(ValueError, match="unknown"):
        _core.render(*core, ("unknown", {}), outputs)
    for parameters, words in (
        ({"resolution": 0}, "resolution .* got 0"),
        ({"colour": 1}, "colour"),
    ):
        with pytest.raises(ValueError, match=words):
            _core.render(*core, ("uniform", parameters), outputs)


@pytest.mark.parametrize("scale", [1e-25, 1e-12, 1e-3, 1e9, 1e25])
@pytest.mark.parametrize("method", METHODS)
def test_scenes_of_any_size(scale, method, view):
    """Lengths are world units, whatever those are: a frame has the same shadows in all of them."""
    scene, camera, light = view
    pose = camera.pose.copy()
    pose[:3, 3] *= scale
    scaled = lx.Scene(scene.vertices * scale, scene.faces)
    moved = lx.Camera(
        pose, focal=camera.focal, centre=camera.centre, width=camera.width, height=camera.height
    )
    truth = lx.reference(scene, camera, light)
    frame = lx.render(scaled, moved, light, method())
    differ = (frame.triangle_id != truth.triangle_id) & ~truth.triangle_tie
    assert not differ.any()
    assert lx.compare(frame.visibility, truth).rate_covered < 0.01


def test_vertices_beyond_all_measure_are_refused():
    with pytest.raises(ValueError, match=r"vertices must be smaller than 1e30 .* got 1e31"):
        lx.Scene([[0, 0, 0], [1e31, 0, 0], [0, 1, 0]], [[0, 1, 2]])


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "direction", [(0, -1, 0), (0, 1, 0), (0, -1, 1e-9), (1, 0, 0), (0, 0, -1), (1e-8, -1, 0)]
)
def test_lights_along_the_axes_and_in_the_plane(method, direction, view):
    scene, camera, _ = view
    light = lx.DirectionalLight(direction)
    result = lx.compare(
        lx.render(scene, camera, light, method()), lx.reference(scene, camera, light)
    )
    assert result.rate_covered < 0.01


@pytest.mark.parametrize("method", METHODS)
def test_a_scene_without_area_shows_nothing(method, view):
    _, camera, light = view
    scene = lx.Scene([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [[0, 1, 2], [0, 0, 0]])
    assert scene.degenerate_count == 2
    frame = lx.render(scene, camera, light, method())
    assert np.isnan(frame.visibility).all()
    assert np.isnan(lx.reference(scene, camera, light).visibility).all()
