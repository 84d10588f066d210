"""What `render` and `render_shadows` return, and how it is shown and kept."""

from __future__ import annotations

import io
import pickle
import threading

import numpy as np
import pytest
from PIL import Image

import lixel as lx


@pytest.fixture
def frame(view) -> lx.Frame:
    return lx.render(*view, lx.DesiredView(resolution=128))


def test_shapes_and_dtypes(frame):
    for name, shape, dtype in (
        ("visibility", (64, 96), np.float32),
        ("triangle_id", (64, 96), np.int32),
        ("position", (64, 96, 3), np.float64),
        ("normal", (64, 96, 3), np.float32),
        ("depth", (64, 96), np.float64),
        ("facing", (64, 96), np.bool_),
        ("covered", (64, 96), np.bool_),
        ("aliasing_error", (64, 96), np.float32),
        ("light_matrix", (1, 4, 4), np.float64),
    ):
        array = getattr(frame, name)
        assert array.shape == shape, name
        assert array.dtype == dtype, name
    assert frame.shadow_map.ndim == 3
    assert frame.shadow_map.dtype == np.float32
    assert len(frame.max_effective_resolution) == 2
    assert frame.method == lx.DesiredView(resolution=128)
    assert all(ms >= 0.0 for ms in frame.timings.values())


def test_background_is_nan_everywhere(frame):
    background = ~frame.covered
    assert background.any()
    assert frame.covered.any()
    for array in (frame.visibility, frame.position, frame.normal, frame.depth):
        assert np.array_equal(np.isnan(array).reshape(64, 96, -1).all(axis=2), background)
    assert not frame.facing[background].any()


def test_points_lie_on_their_triangles_and_depth_along_the_view(view, frame):
    covered = frame.covered
    points, depth = frame.position[covered], frame.depth[covered]
    forward = -view.camera.pose[:3, 2]
    assert np.allclose((points - view.camera.eye) @ forward, depth, rtol=1e-12)
    corner = view.scene.vertices[view.scene.faces[frame.triangle_id[covered], 0]]
    assert np.allclose(np.sum((points - corner) * frame.normal[covered], axis=1), 0.0, atol=1e-5)
    to_eye = view.camera.eye - points
    assert (np.sum(to_eye * frame.normal[covered], axis=1) > 0.0).all()


def test_the_side_of_the_box_away_from_the_light_is_in_shadow(frame):
    away = frame.covered & ~frame.facing
    assert away.any()
    assert (frame.visibility[away] == 0.0).all()


def test_render_shadows_is_the_frame_without_the_rest(view, frame):
    visibility = lx.render_shadows(*view, lx.DesiredView(resolution=128))
    assert visibility.dtype == np.float32
    assert np.array_equal(visibility, frame.visibility, equal_nan=True)


@pytest.mark.parametrize("lookup", ["auto", lx.Pcf()])
def test_images_are_the_callers_own(view, engine, lookup):
    """Later frames do not change them, and what is written into them changes no later frame."""
    scene, _, light = view
    method = lx.DesiredView(resolution=64, lookup=lookup)
    cameras = [
        lx.Camera.look_at((x, 3.0, 5.0), (0.0, 0.0, 0.0), yfov=0.8, width=37, height=23)
        for x in (-2.0, -1.0, 0.0, 1.0, 2.0)
    ]

    def images() -> list[np.ndarray]:
        return [lx.render_shadows(scene, camera, light, method) for camera in cameras]

    kept = images() + images()
    before = [image.tobytes() for image in kept]
    assert len(set(before)) == len(cameras)
    for image in kept[::2]:
        image[:] = 0.5
    assert [image.tobytes() for image in images()] == before[: len(cameras)]
    # On another thread than theirs, while some of them stay.
    others = kept[::2]
    del kept[::2]
    dropper = threading.Thread(target=others.clear)
    dropper.start()
    dropper.join()
    lx.clear_cache()
    assert [image.tobytes() for image in images()] == before[: len(cameras)]
    assert [image.tobytes() for image in kept] == before[1::2]


def test_points_of_a_scene_that_moved_are_refused(view):
    frame = lx.render(*view)
    before = lx.render(*view)
    position = before.position
    view.scene.update_vertices(view.scene.vertices + 1.0)
    assert not frame.is_current
    with pytest.raises(RuntimeError, match="vertices were updated"):
        _ = frame.position
    assert before.position is position  # read in time, they stay
    frame._repr_html_()


def test_picture(frame):
    picture = frame.to_image()
    assert picture.shape == (64, 96, 3)
    assert picture.dtype == np.uint8
    assert (picture[~frame.covered] == 255).all()
    facing = frame.facing
    lit, dark = (picture[facing & (frame.visibility == v)].mean() for v in (1.0, 0.0))
    assert lit > dark + 50
    flat = frame.to_image(shaded=False)
    assert len(np.unique(flat[frame.covered & (frame.visibility == 1.0)], axis=0)) == 1


def test_notebooks_show_a_picture_and_a_table(frame):
    shown = np.asarray(Image.open(io.BytesIO(frame._repr_png_())))
    assert np.array_equal(shown, frame.to_image())
    html = frame._repr_html_()
    assert "data:image/png;base64," in html
    for name in (*frame.timings, *frame.stats):
        assert str(name) in html
    assert "desired_view" in repr(frame) or "DesiredView" in repr(frame)


def test_save(frame, tmp_path):
    frame.save(tmp_path / "a.png")
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), frame.to_image())
    frame.save(str(tmp_path / "a.npy"))
    assert np.array_equal(np.load(tmp_path / "a.npy"), frame.visibility, equal_nan=True)
    with pytest.raises(ValueError, match=r"path must end in .png, .npy, .*, got '.*a.jpg'"):
        frame.save(tmp_path / "a.jpg")


def test_frames_survive_pickling(frame):
    twin = pickle.loads(pickle.dumps(frame))
    assert np.array_equal(twin.visibility, frame.visibility, equal_nan=True)
    assert np.array_equal(twin.position, frame.position, equal_nan=True)
    assert twin.method == frame.method


@pytest.mark.parametrize("function", [lx.render, lx.render_shadows, lx.reference])
def test_arguments_of_other_types_are_named(function, view):
    scene, camera, light = view
    for arguments, words in (
        (("scene", camera, light), "scene must be a lixel.Scene, got str"),
        ((scene, light, camera), "camera must be a lixel.Camera, got DirectionalLight"),
        ((scene, camera, (0, -1, 0)), "light must be a lixel.DirectionalLight or .*, got tuple"),
    ):
        with pytest.raises(TypeError, match=words):
            function(*arguments)
