"""Cameras of parallel rays: what they see, and every method from there, on both engines."""

from __future__ import annotations

import numpy as np
import pytest
import views

import lixel as lx

EXACT = {"exact", "ray_traced"}

# Of some 5,600 pixels that see a surface: what was measured, and two more.
MAX_WRONG = 5


def camera_of(scene: lx.Scene, width: int = 160, height: int = 90, **planes: float) -> lx.Camera:
    low, high = scene.bounds
    centre, size = (low + high) / 2, float(np.linalg.norm(high - low))
    eye = centre + size * np.array([0.4, 0.5, 0.7])
    return lx.Camera.look_at(eye, centre, ymag=0.3 * size, width=width, height=height, **planes)


def rays_of(camera: lx.Camera) -> tuple[np.ndarray, np.ndarray]:
    """Where the rays of pixels start, (H * W, 3), and their direction; from the words of glTF."""
    right, up, back = camera.pose[:3, :3].T
    x = (np.arange(camera.width) + 0.5 - camera.centre[0]) / camera.focal[0]
    y = (np.arange(camera.height) + 0.5 - camera.centre[1]) / camera.focal[1]
    starts = camera.eye + x[None, :, None] * right - y[:, None, None] * up
    return starts.reshape(-1, 3), -back


def first_hits(scene: lx.Scene, camera: lx.Camera) -> tuple[np.ndarray, np.ndarray]:
    """The first triangle on each ray, -1 for none, and how far it is: Cramer's rule in float64."""
    starts, direction = rays_of(camera)
    a, b, c = scene.vertices[scene.faces].transpose(1, 0, 2)
    u, v = b - a, c - a
    p = np.cross(direction, v)
    determinant = np.einsum("fk,fk->f", u, p)
    nearest, found = np.full(len(starts), np.inf), np.full(len(starts), -1)
    znear = camera.znear or 0.0
    for face in np.flatnonzero(np.abs(determinant) > 1e-12):
        s = starts - a[face]
        along_u = s @ p[face] / determinant[face]
        q = np.cross(s, u[face])
        along_v = q @ direction / determinant[face]
        depth = q @ v[face] / determinant[face]
        hit = (along_u >= 0) & (along_v >= 0) & (along_u + along_v <= 1)
        hit &= (depth > znear) & (depth < camera.zfar) & (depth < nearest)
        nearest[hit], found[hit] = depth[hit], face
    return found, nearest


@pytest.mark.parametrize("planes", [{}, {"znear": 2.2, "zfar": 3.1}])
def test_it_sees_what_parallel_rays_meet(engine, planes):
    scene = views.soup(4, count=50)
    camera = camera_of(scene, **planes)
    found, depth = first_hits(scene, camera)
    shape = (camera.height, camera.width)
    light = lx.DirectionalLight((0.2, -1, 0.3))
    truth = lx.reference(scene, camera, light)
    frame = lx.render(scene, camera, light, "exact")
    known = ~truth.triangle_tie
    assert known.mean() > 0.98
    np.testing.assert_array_equal(truth.triangle_id[known], found.reshape(shape)[known])
    np.testing.assert_array_equal(frame.triangle_id[known], found.reshape(shape)[known])
    seen = known & frame.covered
    np.testing.assert_allclose(frame.depth[seen], depth.reshape(shape)[seen], rtol=1e-9)
    rows, columns = np.nonzero(seen)
    places = camera.project(frame.position[seen])
    np.testing.assert_allclose(places[:, 0], columns + 0.5, atol=1e-6)
    np.testing.assert_allclose(places[:, 1], rows + 0.5, atol=1e-6)
    # Normals are on the camera's side.
    assert (frame.normal[seen] @ -camera.pose[:3, 2] < 1e-6).all()


def lights_of(scene: lx.Scene, method: lx.Method) -> list[lx.Light]:
    low, high = scene.bounds
    size = high - low
    lamp = low + size * (0.55, 1.2, 0.4)
    lights: list[lx.Light] = [lx.DirectionalLight((0.3, -1.0, 0.2)), lx.PointLight(lamp)]
    lit_by = [light for light in lights if isinstance(light, method.lights)]
    return lit_by or [lx.SpotLight(lamp, (0, -1, 0), outer=0.9)]


METHODS = sorted(set(lx.METHODS) - {"auto", "pcf"})


@pytest.mark.parametrize("name", METHODS)
def test_every_method_is_near_the_reference(engine, name):
    method = lx.METHODS[name]()
    scene = views.small("colonnade")
    camera = camera_of(scene)
    for light in lights_of(scene, method):
        truth = lx.reference(scene, camera, light)
        found = lx.compare(lx.render_shadows(scene, camera, light, method), truth)
        print(f"{name}, {light}: {found}")
        # In a small image, texels as wide as its pixels are wide.
        most = 10 * MAX_WRONG if name == "virtual" else MAX_WRONG
        assert found.misclassified_count <= (0 if name in EXACT else most)


@pytest.mark.parametrize("fit", ["lispsm", "min_sm", "scene_optimized"])
def test_fits_before_a_warp_are_near_the_reference(engine, fit):
    scene = views.small("colonnade")
    camera, light = camera_of(scene), lx.DirectionalLight((0.3, -1.0, 0.2))
    truth = lx.reference(scene, camera, light)
    for method in (lx.NonOrthogonalWarp(fit=fit), lx.RectilinearWarp(fit=fit)):
        found = lx.compare(lx.render_shadows(scene, camera, light, method), truth)
        assert found.misclassified_count <= MAX_WRONG


def test_pixels_and_texels_have_one_width_each(engine):
    """A floor from straight above, a light from straight above: everywhere a texel over a pixel."""
    floor = lx.Scene([(-4, 0, -4), (-4, 0, 4), (4, 0, 4), (4, 0, -4)], [(0, 1, 2), (0, 2, 3)])
    camera = lx.Camera.look_at((0, 9, 0), (0, 0, 0), (0, 0, -1), ymag=2.0, width=96, height=64)
    frame = lx.render(floor, camera, lx.DirectionalLight((0, -1, 0)), lx.Uniform(resolution=256))
    [x, y, *_] = frame.light_matrix[0, :2, :3]
    texel = 1 / np.sqrt(np.linalg.norm(x) * np.linalg.norm(y))
    np.testing.assert_allclose(frame.aliasing_error, texel / (4.0 / 64), rtol=1e-5)
    assert frame.largest_aliasing_error == pytest.approx(frame.aliasing_error.max(), rel=1e-3)
    # What is important is the same everywhere, too.
    importance = lx.importance_map(
        floor, camera, lx.DirectionalLight((0, -1, 0)), lx.RectilinearWarp(importance=("distance",))
    )
    positive = importance[importance > 0]
    np.testing.assert_allclose(positive, positive.max(), rtol=1e-5)


@pytest.mark.parametrize("analysis", ["backward", "forward"])
def test_a_plane_is_seen_at_one_angle(engine, analysis):
    """Down by 3 while ahead by 4: the cosine between a line of sight and the normal is 3 / 5."""
    floor = lx.Scene([(-4, 0, -4), (-4, 0, 4), (4, 0, 4), (4, 0, -4)], [(0, 1, 2), (0, 2, 3)])
    camera = lx.Camera.look_at((0, 3, 4), (0, 0, 0), ymag=2.0, width=96, height=64)
    method = lx.RectilinearWarp(importance="normal", normal_bonus=3, analysis=analysis)
    importance = lx.importance_map(floor, camera, lx.DirectionalLight((0, -1, 0)), method)
    np.testing.assert_allclose(importance[importance > 0], 1 + 3 * 3 / 5, rtol=1e-5)


def test_it_is_the_limit_of_a_pinhole_far_away(engine):
    scene = views.small("colonnade")
    camera = camera_of(scene)
    light = lx.DirectionalLight((0.3, -1.0, 0.2))
    far = 400.0
    pose = camera.pose.copy()
    pose[:3, 3] += far * pose[:3, 2]
    depth = far + float(np.linalg.norm(scene.bounds[1] - scene.bounds[0]))
    pinhole = lx.Camera(
        pose,
        focal=(camera.focal[0] * depth, camera.focal[1] * depth),
        width=camera.width,
        height=camera.height,
    )
    near, distant = (lx.render_shadows(scene, c, light, "exact") for c in (camera, pinhole))
    assert (near != distant)[~np.isnan(near) & ~np.isnan(distant)].mean() < 0.1


def test_the_ends_of_the_view_are_world_units():
    camera = lx.Camera.orthographic(np.eye(4), ymag=3.0, width=200, height=100, znear=0.0)
    assert camera.project([(-6.0, 3.0, -1.0), (6.0, -3.0, -1.0)])[:, :2].tolist() == [
        [0.0, 0.0],
        [200.0, 100.0],
    ]
    stretched = lx.Camera.orthographic(np.eye(4), xmag=1.0, ymag=4.0, width=50, height=50)
    assert stretched.focal == (25.0, 6.25)
    assert lx.Camera.orthographic(np.eye(4), xmag=2.0, width=50, height=30).focal == (12.5, 12.5)
    assert eval(repr(camera), {"Camera": lx.Camera, "math": np}) == camera
    assert camera.resized(400, 200).project([(6.0, -3.0, -1.0)])[0, :2].tolist() == [400.0, 200.0]
    assert np.isnan(camera.project([(0.0, 0.0, 1.0)])[0, :2]).all()


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({}, TypeError, "ymag, xmag or both, got neither"),
        ({"ymag": 0.0}, ValueError, "ymag must be positive and finite, got 0.0"),
        ({"xmag": np.inf}, ValueError, "xmag must be positive and finite, got inf"),
        ({"ymag": 1.0, "znear": -1.0}, ValueError, "0 <= znear < zfar, got znear -1"),
    ],
)
def test_views_without_a_size_are_refused(arguments, error, words):
    with pytest.raises(error, match=words):
        lx.Camera.orthographic(np.eye(4), width=8, height=8, **arguments)


def test_a_view_has_an_angle_or_a_size():
    with pytest.raises(TypeError, match=r"either yfov .* or ymag"):
        lx.Camera.look_at((0, 1, 2), (0, 0, 0), width=8, height=8)
    with pytest.raises(TypeError, match="orthographic camera has no yfov"):
        lx.Camera(np.eye(4), yfov=1.0, width=8, height=8, is_orthographic=True)
