"""The reference against pyrender, which renders directional shadows with OpenGL.

What this can show: both see the same surfaces from the same camera, at the same depth, and the same
shadows fall in the same places and the same direction. Cameras and light poses need no conversion.

What it cannot show: which of the two is right in a pixel. pyrender has one map of 2048 x 2048
texels around the whole scene, a slope-dependent bias and a 3 x 3 filter; 3 to 7 % of its pixels are
wrong. So the bounds here are wide; tests/test_reference_against_embree.py compares exactly.
"""

import os

import numpy as np
import pytest
from skimage.metrics import structural_similarity

import lixel as lx

pytestmark = pytest.mark.of_checkout("it compares with another renderer")

# Off screen; set before the first import of OpenGL.
os.environ.setdefault("PYOPENGL_PLATFORM", "egl")

WIDTH, HEIGHT = 480, 270


@pytest.fixture(scope="module")
def pyrender():
    import pyglet

    # pyrender imports its viewer, which would ask for X.
    pyglet.options["headless"] = True
    import pyrender

    return pyrender


@pytest.mark.parametrize("name", ["plane_and_box", "colonnade", "objects_on_floor"])
def test_pyrender_sees_the_same_surfaces_and_shadows(pyrender, name):
    scene = getattr(lx.scenes, name)()
    camera = scene.cameras["default"].resized(WIDTH, HEIGHT)
    light = scene.lights["default"]
    truth = lx.reference(scene, camera, light)
    visibility, depth, _ = render(pyrender, scene, camera, light)

    # The same surfaces, but for silhouettes: pyrender's depth is that of one of four samples in the
    # pixel, not of its centre.
    covered = truth.covered & (depth > 0)
    assert np.mean(truth.covered != (depth > 0)) < 0.005
    assert np.mean(~np.isclose(depth[covered], truth.depth[covered], rtol=0.01)) < 0.05

    # The same shadows, where pyrender's shading tells lit from shadow at all.
    counted = covered & ~np.isnan(visibility)
    assert counted.sum() > 0.3 * covered.sum()
    differ = (visibility != truth.visibility) & counted
    print(f"{name}: {differ.sum() / counted.sum():.2%} of {counted.sum()} pixels differ")
    assert differ.sum() < 0.10 * counted.sum()

    filled = [np.where(counted, v, 1.0) for v in (visibility, truth.visibility)]
    assert structural_similarity(*filled, data_range=1.0) > 0.7
    # A light from elsewhere fails the same test.
    turned = lx.DirectionalLight(light.direction * (-1, 1, -1))
    other = lx.reference(scene, camera, turned).visibility
    assert ((other != truth.visibility) & counted).sum() > 2 * differ.sum()


def test_shadows_are_those_of_the_shadow_map_of_pyrender(pyrender):
    """Its map, looked up at what lixel's camera sees, with the receiver's plane for a bias: nothing
    of its shading, its bias and its filter is left. What differs are the edges of its texels."""
    scene = lx.scenes.colonnade(columns=4, detail=10)
    camera = scene.cameras["default"].resized(WIDTH, HEIGHT)
    light = scene.lights["default"]
    *_, shadow_map = render(pyrender, scene, camera, light)
    truth = lx.reference(scene, camera, light)
    expected = look_up(shadow_map, truth.position, truth.normal)
    facing = truth.facing & ~np.isnan(expected)
    for method in ("exact", "uniform", "desired_view", "rtw", "notw"):
        image = lx.render_shadows(scene, camera, light, method, device="cpu")
        differ = (image != expected)[facing].mean()
        print(f"{method}: {differ:.2%} of {facing.sum()} pixels differ")
        assert differ < 0.005
    turned = lx.render_shadows(scene, camera, lx.DirectionalLight(light.direction * (-1, 1, -1)))
    assert (turned != expected)[facing].mean() > 0.1


def look_up(shadow_map, position, normal):
    """1 lit, 0 in shadow by depths of a map; NaN beside it."""
    depths, clip_from_world = shadow_map
    size = len(depths)
    homogeneous = np.concatenate([position, np.ones((*position.shape[:2], 1))], axis=-1)
    clip = homogeneous @ clip_from_world.T
    texel = (clip[..., :2] / 2 + 0.5) * size
    column, row = np.moveaxis(np.nan_to_num(np.floor(texel)).astype(int), -1, 0)
    is_inside = (np.minimum(column, row) >= 0) & (np.maximum(column, row) < size)
    column, row = column.clip(0, size - 1), row.clip(0, size - 1)
    # The receiver's plane in the space of the map, at the middle of the texel.
    plane = normal @ np.linalg.inv(clip_from_world[:3, :3])
    away = (np.stack([column, row], axis=-1) + 0.5 - texel) * 2 / size
    depth = clip[..., 2] - np.einsum("...c,...c->...", plane[..., :2], away) / plane[..., 2]
    is_lit = depth / 2 + 0.5 <= depths[row, column] + 1e-4
    return np.where(is_inside & ~np.isnan(clip[..., 0]), is_lit, np.nan)


def test_pyrender_sees_the_same_along_parallel_rays(pyrender):
    scene = lx.scenes.colonnade()
    pose = lx.Camera.look_at((9, 14, 12), (0, 0, -8), yfov=1.0, width=8, height=8).pose
    theirs = pyrender.OrthographicCamera(xmag=7.0, ymag=7.0, znear=0.5, zfar=60.0)
    camera = lx.Camera.from_pyrender(theirs, pose, WIDTH, HEIGHT)
    assert camera.is_orthographic
    truth = lx.reference(scene, camera, scene.lights["default"])
    visibility, depth, _ = render(pyrender, scene, camera, scene.lights["default"], theirs)
    covered = truth.covered & (depth > 0)
    # pyrender takes the values of the depth buffer, which are linear here, for a pinhole's.
    depth[covered] = 60.5 - 0.5 * 60.0 / depth[covered]
    assert covered.mean() > 0.5
    assert np.mean(truth.covered != (depth > 0)) < 0.01
    assert np.mean(~np.isclose(depth[covered], truth.depth[covered], rtol=0.01)) < 0.05
    counted = covered & ~np.isnan(visibility)
    assert ((visibility != truth.visibility) & counted).sum() < 0.10 * counted.sum()


def render(pyrender, scene, camera, light, theirs=None):
    """pyrender's visibility, 1 lit, 0 in shadow, NaN where the surface is turned away from the
    light or too dark to tell; its depth, 0 where there is no surface; and its shadow map, depths
    and the matrix to its clip space, row 0 at the bottom."""
    import trimesh
    from OpenGL import GL

    stage = pyrender.Scene(ambient_light=(0, 0, 0), bg_color=(0, 0, 0, 0))
    material = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=(1, 1, 1, 1), metallicFactor=0, roughnessFactor=1, doubleSided=True
    )
    mesh = trimesh.Trimesh(scene.vertices, scene.faces, process=False)
    stage.add(pyrender.Mesh.from_trimesh(mesh, material=material, smooth=False))
    if theirs is None:
        lens = (*camera.focal, *camera.centre)
        theirs = pyrender.IntrinsicsCamera(*lens, znear=0.05, zfar=500.0)
    stage.add(theirs, pose=camera.pose)
    sun = pyrender.DirectionalLight(intensity=5.0)
    node = stage.add(sun, pose=pose_along(light.direction))
    renderer = pyrender.OffscreenRenderer(camera.width, camera.height)
    try:
        shadowed, depth = renderer.render(stage, pyrender.RenderFlags.SHADOWS_DIRECTIONAL)
        GL.glBindTexture(GL.GL_TEXTURE_2D, sun.shadow_texture._texid)
        depths = GL.glGetTexImage(GL.GL_TEXTURE_2D, 0, GL.GL_DEPTH_COMPONENT, GL.GL_FLOAT)
        view, projection = renderer._renderer._get_light_cam_matrices(stage, node, None)
        plain, _ = renderer.render(stage)
    finally:
        renderer.delete()
    shadowed, plain = (picture.sum(-1, dtype=float) for picture in (shadowed, plain))
    tells = (depth > 0) & (plain > 60)
    visibility = np.where(tells, (shadowed > 0.5 * plain).astype(float), np.nan)
    return visibility, depth, (np.asarray(depths), projection @ view)


def pose_along(direction):
    """A pose that looks along a direction."""
    back = -direction
    right = np.cross((0.0, 1.0, 0.0) if abs(back[1]) < 0.9 else (1.0, 0.0, 0.0), back)
    pose = np.eye(4)
    pose[:3, 0] = right / np.linalg.norm(right)
    pose[:3, 1] = np.cross(back, pose[:3, 0])
    pose[:3, 2] = back
    return pose
