"""The visibility buffer of both engines: the reference's triangle in every pixel that is no tie."""

from __future__ import annotations

import os

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from views import HEIGHT, SMALL, WIDTH, cameras, small, soup

import lixel as lx
from lixel.scenes import GENERATORS

LIGHT = lx.DirectionalLight((0.3, -1.0, 0.2))

pytestmark = pytest.mark.usefixtures("engine")


def rendered(scene: lx.Scene, camera: lx.Camera) -> lx.Frame:
    """By a method that costs little on the engine."""
    is_on_cpu = os.environ["LIXEL_DEVICE"] == "cpu"
    return lx.render(scene, camera, LIGHT, lx.Exact() if is_on_cpu else lx.Uniform(resolution=64))


def assert_agrees(scene: lx.Scene, camera: lx.Camera, most_ties: float = 0.05) -> lx.Frame:
    frame = rendered(scene, camera)
    truth = lx.reference(scene, camera, LIGHT)
    differ = (frame.triangle_id != truth.triangle_id) & ~truth.triangle_tie
    places = np.argwhere(differ)[:5].tolist()
    assert not differ.any(), f"{differ.sum()} pixels (row, column): {places}"
    assert np.array_equal(np.isnan(frame.visibility), frame.triangle_id < 0)
    # A reference that calls everything a tie would prove nothing.
    assert truth.triangle_tie.mean() <= most_ties
    return frame


# From below the feet of the towers lie in the plane of the floor: every edge of theirs is a tie.
MAX_TIES = {"city": 0.10}


def test_every_generator_is_seen():
    assert set(SMALL) == set(GENERATORS)


@pytest.mark.parametrize("name", GENERATORS)
def test_first_triangle_of_generated_scenes(name):
    scene = small(name)
    covered = 0
    for label, camera in cameras(scene):
        print(f"{name}, {label}")
        frame = assert_agrees(scene, camera, MAX_TIES.get(name, 0.05))
        covered += np.count_nonzero(frame.covered)
    assert covered > WIDTH * HEIGHT


@pytest.mark.parametrize("seed", range(4))
def test_first_triangle_of_soups(seed):
    scene = soup(seed)
    for label, camera in cameras(scene):
        print(label)
        assert_agrees(scene, camera)


@pytest.mark.parametrize("name", ["plane_and_box", "objects_on_floor", "colonnade"])
def test_far_from_the_origin(name):
    """A million times its size away a scene in float32 would be dust; float64 keeps it whole."""
    near = small(name)
    offset = np.array([1.0, -0.7, 0.4]) * 1e6 * np.linalg.norm(np.diff(near.bounds, axis=0))
    far = lx.Scene(near.vertices + offset, near.faces)
    for label, camera in cameras(near):
        print(label)
        pose = camera.pose.copy()
        pose[:3, 3] += offset
        moved = lx.Camera(
            pose,
            focal=camera.focal,
            centre=camera.centre,
            width=camera.width,
            height=camera.height,
            znear=camera.znear,
            zfar=camera.zfar,
        )
        frame = assert_agrees(far, moved)
        here = rendered(near, camera)
        truth = lx.reference(near, camera, LIGHT)
        # Rounding to float64 moved the vertices by less than anything visible.
        differ = (frame.triangle_id != here.triangle_id) & ~truth.triangle_tie
        assert not differ.any(), label


def test_a_small_thing_in_a_large_scene():
    """Far from the middle of the scene float32 has no room for the details in view."""
    near = small("objects_on_floor")
    away = np.array([1e5, 0, -7e4]) / 3
    scene = lx.Scene(
        np.concatenate([near.vertices + away, -(near.vertices + away)]),
        np.concatenate([near.faces, near.faces + len(near.vertices)]).astype(np.int64),
    )
    eye, image = np.array([1, 2, 3]), {"width": WIDTH, "height": HEIGHT, "znear": 0.1}
    camera = lx.Camera.look_at(away + eye, away, yfov=0.9, **image)
    truth = lx.reference(near, lx.Camera.look_at(eye, (0, 0, 0), yfov=0.9, **image), LIGHT)
    frame = assert_agrees(scene, camera)
    differ = (frame.triangle_id != truth.triangle_id) & ~truth.triangle_tie
    assert not differ.any()
    assert frame.covered.mean() > 0.9


def test_a_huge_floor_seen_from_a_hand_above_it():
    """Two triangles over half of the image, their corners far outside of it."""
    side = 2e3
    floor = [[-side, 0, -side], [side, 0, -side], [side, 0, side], [-side, 0, side]]
    scene = lx.Scene(floor, [[0, 1, 2], [0, 2, 3]])
    camera = lx.Camera.look_at((3, 0.1, 7), (40, 0, 90), yfov=1.0, width=1024, height=576)
    frame = assert_agrees(scene, camera)
    assert frame.covered.mean() > 0.4


def test_a_triangle_through_the_eye_plane():
    """Corners before, behind and in the plane of the eye, where a projection has its pole."""
    eye_plane = [[-3, -1, 1], [4, -1, 2], [0.5, -1, -50], [-2, -0.5, 0], [2, -0.5, 0], [0, 3, -9]]
    scene = lx.Scene(eye_plane, [[0, 1, 2], [3, 4, 5]])
    for znear in (None, 1e-4, 0.5):
        camera = lx.Camera(np.eye(4), yfov=1.5, width=WIDTH, height=HEIGHT, znear=znear)
        frame = assert_agrees(scene, camera)
        assert frame.covered.mean() > 0.3


@pytest.mark.parametrize(("width", "height"), [(1, 1), (1, 200), (333, 1), (7, 5), (2000, 3)])
def test_images_of_any_shape(width, height):
    scene = small("objects_on_floor")
    frame = assert_agrees(scene, scene.cameras["default"].resized(width, height), most_ties=0.2)
    assert frame.visibility.shape == (height, width)


def test_triangles_of_zero_area_change_nothing():
    scene = small("objects_on_floor")
    camera = scene.cameras["default"].resized(WIDTH, HEIGHT)
    faces = scene.faces.astype(np.int64)
    line = faces[:500, [0, 1, 1]]
    point = faces[:500, [2, 2, 2]]
    vertices = scene.vertices
    sliver = np.arange(len(vertices), len(vertices) + 3)
    # In one line to the last bit, with three different corners.
    vertices = np.concatenate([vertices, [[-4.0, 1, 0], [0, 1, 0], [4.0, 1, 0]]])
    spoilt = lx.Scene(vertices, np.concatenate([faces, line, point, [sliver]]))
    assert spoilt.degenerate_count == 1001
    frame = assert_agrees(spoilt, camera)
    clean = rendered(scene, camera)
    assert np.array_equal(frame.triangle_id, clean.triangle_id)
    assert np.array_equal(frame.visibility, clean.visibility, equal_nan=True)
    assert frame.stats["degenerate_triangles"] == 1001


coordinate = st.floats(-2, 2, width=32)
point = st.tuples(coordinate, coordinate, coordinate)


@settings(max_examples=60, deadline=None)
@given(
    corners=st.lists(point, min_size=3, max_size=15),
    eye=point,
    target=point,
    yfov=st.floats(0.05, 3.0),
    znear=st.none() | st.floats(1e-3, 2.0),
)
def test_any_soup_from_anywhere(corners, eye, target, yfov, znear):
    if eye in corners:
        return  # the test below
    view = np.subtract(target, eye)
    if np.linalg.norm(np.cross(view, (0, 1, 0))) <= 1e-3 * np.linalg.norm(view):
        return  # no view, or one along the up vector
    count = len(corners) - 2
    # A strip, so that edges are shared.
    scene = lx.Scene(corners, np.arange(count)[:, None] + np.arange(3))
    camera = lx.Camera.look_at(eye, target, yfov=yfov, width=40, height=30, znear=znear)
    assert_agrees(scene, camera, most_ties=1.0)


def test_an_eye_on_a_corner_sees_the_triangle_edge_on():
    scene = lx.Scene([(0, 0, 1), (0, 1, 0), (0.75, 0, 0)], [[0, 1, 2]])
    camera = lx.Camera.look_at((0, 1, 0), (1, 0, 0), yfov=1.0, width=40, height=30)
    assert_agrees(scene, camera)


def test_no_gap_where_pixels_look_along_a_shared_edge():
    """The middle column and row of an odd image meet edges, and a corner, exactly."""
    around = [(1, 0, 0), (0, 1, 0), (-1, 0, 0), (0, -1, 0)]
    scene = lx.Scene([(0, 0, 0), *around], [(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1)])
    camera = lx.Camera.look_at((0, 0, 3), (0, 0, 0), yfov=0.3, width=65, height=65)
    frame = assert_agrees(scene, camera, most_ties=1.0)
    assert (frame.triangle_id >= 0).all()
