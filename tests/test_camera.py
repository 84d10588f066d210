"""The camera: its constructors agree, and nonsense is refused by name."""

from __future__ import annotations

import dataclasses
import math
import pickle
from types import SimpleNamespace

import numpy as np
import pytest
import trimesh
from hypothesis import given, strategies as st

import lixel as lx

SIZE = {"width": 64, "height": 48}
coordinates = st.tuples(*3 * [st.floats(-1e6, 1e6)]).map(np.array)


def image_of(camera: lx.Camera, point) -> np.ndarray:
    """Where a point in world space falls in the image, in pixels, by the textbook."""
    x, y, z, _ = np.linalg.inv(camera.pose) @ [*point, 1.0]
    return camera.intrinsics[:2] @ [x / -z, y / z, 1.0]


@given(eye=coordinates, target=coordinates)
def test_look_at_has_the_target_in_the_middle_and_up_upwards(eye, target):
    if np.linalg.norm((target - eye)[[0, 2]]) < 1e-3 * np.linalg.norm(target - eye) or np.allclose(
        eye, target, atol=1e-2
    ):
        return  # along the up vector, or too close for the tolerance below
    camera = lx.Camera.look_at(eye, target, yfov=1.0, **SIZE)
    view = (target - eye) / np.linalg.norm(target - eye)
    assert np.allclose(camera.pose[:3, 2], -view, atol=1e-12)
    assert camera.pose[1, 1] > 0.0
    assert np.allclose(camera.pose[:3, :3].T @ camera.pose[:3, :3], np.eye(3), atol=1e-12)
    assert np.linalg.det(camera.pose[:3, :3]) > 0.0
    assert np.array_equal(camera.eye, eye)


def test_image_conventions():
    camera = lx.Camera(np.eye(4), yfov=math.pi / 2, **SIZE)
    assert np.allclose(image_of(camera, (0, 0, -2)), (32, 24))
    # Half the height up is the top edge, row 0; to the right is to the right.
    assert np.allclose(image_of(camera, (0, 2, -2)), (32, 0))
    assert image_of(camera, (1, 0, -2))[0] > 32


def test_project_puts_what_a_pixel_sees_into_its_middle():
    scene = lx.scenes.plane_and_box()
    camera = scene.cameras["default"].resized(64, 48)
    camera = lx.Camera(camera.pose, focal=(50, 40), centre=(20, 30), **SIZE)
    seen = lx.reference(scene, camera, scene.lights["default"])
    row, column = np.nonzero(seen.covered)
    places = camera.project(seen.position[seen.covered])
    assert np.allclose(places[:, :2], np.stack([column, row], axis=1) + 0.5, atol=1e-9)
    assert np.allclose(places[:, 2], seen.depth[seen.covered])


def test_what_is_behind_the_camera_is_nowhere_in_the_image():
    camera = lx.Camera(np.eye(4), yfov=1.0, **SIZE)
    places = camera.project([(0.5, 0, 2), (0.5, 0, 0), (0, 0, -2)])
    assert np.isnan(places[:2, :2]).all()
    assert places[:, 2].tolist() == [-2, 0, 2]
    assert places[2, :2].tolist() == [32, 24]
    with pytest.raises(ValueError, match=r"points must have shape \(N, 3\), got \(3,\)"):
        camera.project((0, 0, -2))


def test_all_constructors_agree():
    pose = lx.Camera.look_at((1, 2, 3), (0, 0, 0), yfov=0.8, **SIZE).pose
    camera = lx.Camera(pose, yfov=0.8, **SIZE)
    f = 24 / math.tan(0.4)
    k = [[f, 0, 32], [0, f, 24], [0, 0, 1]]
    perspective = SimpleNamespace(yfov=0.8, aspectRatio=None, znear=None, zfar=None)
    intrinsics = SimpleNamespace(fx=f, fy=f, cx=32, cy=24, znear=None, zfar=math.inf)
    node = SimpleNamespace(camera=perspective, matrix=pose)
    held = trimesh.scene.Camera(resolution=(64, 48), focal=(f, f))
    scene = trimesh.Scene(trimesh.creation.box(), camera=held, camera_transform=pose)
    for other in (
        lx.Camera.look_at((1, 2, 3), (0, 0, 0), yfov=0.8, **SIZE),
        lx.Camera(pose, focal=f, **SIZE),
        lx.Camera.from_intrinsics(k, pose, **SIZE),
        lx.Camera.from_pyrender(perspective, pose, **SIZE),
        lx.Camera.from_pyrender(intrinsics, pose, **SIZE),
        lx.Camera.from_pyrender(node, **SIZE),
        lx.Camera.from_trimesh(held, pose),
        lx.Camera.from_trimesh(scene),
    ):
        assert np.allclose(other.pose, camera.pose, atol=1e-15)
        assert np.allclose(other.intrinsics, camera.intrinsics, rtol=1e-14)
        assert (other.width, other.height, other.zfar) == (64, 48, math.inf)
        assert other.yfov == pytest.approx(0.8)


def test_an_aspect_ratio_of_pyrender_stretches_the_image():
    square = SimpleNamespace(yfov=0.8, aspectRatio=1.0, znear=0.05, zfar=None)
    camera = lx.Camera.from_pyrender(square, np.eye(4), width=200, height=100)
    assert camera.focal[0] == pytest.approx(2 * camera.focal[1])
    assert camera.znear == 0.05


def test_resized_keeps_the_vertical_angle():
    camera = lx.Camera(np.eye(4), focal=(50, 60), centre=(30, 20), znear=0.1, **SIZE)
    twice = camera.resized(128, 96)
    assert twice.focal == (100, 120)
    assert twice.centre == (60, 40)
    assert twice.znear == 0.1
    assert camera.resized(256, 48).yfov == camera.yfov


def test_cameras_are_values():
    camera = lx.Camera.look_at((1, 2, 3), (0, 0, 0), yfov=0.8, zfar=50.0, **SIZE)
    for same in (pickle.loads(pickle.dumps(camera)), eval(repr(camera), {"Camera": lx.Camera})):
        assert same == camera
        assert hash(same) == hash(camera)
    other = dataclasses.replace(camera, znear=0.5)
    assert other != camera
    assert other.znear == 0.5
    assert len({camera, other}) == 2
    with pytest.raises(dataclasses.FrozenInstanceError):
        camera.width = 7
    with pytest.raises(ValueError, match="read-only"):
        camera.pose[0, 0] = 7.0


def test_the_near_plane_follows_the_scene():
    scene = lx.scenes.plane_and_box()
    diagonal = np.linalg.norm(np.diff(scene.bounds, axis=0))
    inside = lx.Camera.look_at((0, 1, 0), (1, 1, 0), yfov=1.0, **SIZE)
    assert inside._znear_for(scene) == pytest.approx(1e-9 * diagonal)
    away = lx.Camera.look_at((0, 1, 105), (0, 1, 0), yfov=1.0, **SIZE)
    assert away._znear_for(scene) == pytest.approx(50.0)
    short = lx.Camera.look_at((0, 1, 105), (0, 1, 0), yfov=1.0, zfar=3.0, **SIZE)
    assert 0.0 < short._znear_for(scene) < 3.0
    # The core sees the same object again, so that it knows what it has done for it.
    assert away._core_for(scene) is away._core_for(scene)


def test_degenerate_views_are_named():
    def look(eye=(0, 0, 0), target=(0, 0, -1), up=(0, 1, 0), yfov=1.0):
        return lx.Camera.look_at(eye, target, up, yfov=yfov, **SIZE)

    nan = float("nan")
    for arguments, words in (
        ({"target": (0, 0, 0)}, "target must differ from eye"),
        ({"up": (0, 0, 3)}, "up must not be parallel to the view"),
        ({"up": (0, 1e-12, -1)}, "up must not be parallel to the view"),
        ({"up": (0, 0, 0)}, "up must not have zero length"),
        ({"eye": (0, nan, 0)}, "eye must be finite"),
        ({"target": (0, nan, 0)}, "target must be finite"),
        ({"up": (0, nan, 0)}, "up must be finite"),
        ({"eye": (0, 0)}, r"eye must have shape \(3,\), got \(2,\)"),
        ({"yfov": 0.0}, r"yfov must be an angle in radians in \(0, pi\), got 0.0"),
        ({"yfov": 3.2}, "yfov .* got 3.2"),
        ({"yfov": nan}, "yfov .* got nan"),
    ):
        with pytest.raises(ValueError, match=words):
            look(**arguments)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"width": 0}, ValueError, "width must be at least 1 .* got 0"),
        ({"height": -3}, ValueError, "height must be at least 1 .* got -3"),
        ({"width": 2**40}, ValueError, "width must be .* below 2\\*\\*32, got 1099511627776"),
        ({"width": 64.0}, TypeError, "width must be an integer, got 64.0"),
        ({"height": True}, TypeError, "height must be an integer, got True"),
        ({"yfov": "wide"}, TypeError, "yfov must be a real number, got 'wide'"),
        ({"yfov": None}, TypeError, "either yfov .* or focal"),
        ({"focal": 5.0}, TypeError, "either yfov .* or focal"),
        ({"yfov": None, "focal": (1, 0)}, ValueError, "focal"),
        ({"centre": (1, float("inf"))}, ValueError, "principal point"),
        ({"znear": 0.0}, ValueError, "znear"),
        ({"znear": 2.0, "zfar": 1.0}, ValueError, "znear 2.*zfar 1"),
        ({"zfar": -1.0}, ValueError, "zfar must be greater than 0, got -1.0"),
        ({"zfar": float("nan")}, ValueError, "zfar must be greater than 0, got nan"),
        ({"pose": np.eye(3)}, ValueError, r"pose must have shape \(4, 4\), got \(3, 3\)"),
        ({"pose": np.eye(4) * 1j}, TypeError, "pose must be an array of real numbers"),
        ({"pose": np.diag([2, 2, 2, 1])}, ValueError, "pose must be a rotation"),
        ({"pose": np.diag([-1, 1, 1, 1])}, ValueError, "pose must be a rotation .* mirror"),
        ({"pose": np.full((4, 4), np.nan)}, ValueError, "pose must be finite"),
    ],
)
def test_bad_arguments_are_named(arguments, error, words):
    with pytest.raises(error, match=words):
        lx.Camera(**{"pose": np.eye(4), "yfov": 1.0, **SIZE, **arguments})


def test_other_peoples_cameras_are_checked():
    skewed = [[50, 1, 32], [0, 50, 24], [0, 0, 1]]
    with pytest.raises(ValueError, match=r"intrinsics must be .* without skew"):
        lx.Camera.from_intrinsics(skewed, np.eye(4), **SIZE)
    fisheye = SimpleNamespace(znear=0.1, zfar=1.0)
    with pytest.raises(TypeError, match="PerspectiveCamera, IntrinsicsCamera or Orthographic"):
        lx.Camera.from_pyrender(fisheye, np.eye(4), **SIZE)
    with pytest.raises(TypeError, match="pose must be given"):
        lx.Camera.from_pyrender(SimpleNamespace(yfov=1.0), **SIZE)
    with pytest.raises(TypeError, match="trimesh"):
        lx.Camera.from_trimesh("camera")
    with pytest.raises(TypeError, match="pose must be given"):
        lx.Camera.from_trimesh(trimesh.scene.Camera(fov=(60, 45)))
