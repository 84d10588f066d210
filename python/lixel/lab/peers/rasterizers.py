"""Peers that draw shadow maps, off screen: from a scene and a light to a function of the camera.

The camera has a near and a far plane. The light is red and casts shadows; a green one of half its
brightness, from where it is, does not: see `_visibility_of`.
"""

from __future__ import annotations

import math
import os
from typing import Any

import numpy as np
import numpy.typing as npt

from ...camera import Camera, pose_of
from ...light import DirectionalLight
from ...scene import Scene
from .ray_casters import Peer, Visibility

_GL_BLEND = 0x0BE2


def pyrender_peer(scene: Scene, light: DirectionalLight) -> Peer:
    """pyrender's shadow map of 2048 x 2048 by OpenGL, off screen."""
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    import pyglet

    # pyrender imports its viewer, which would ask for X.
    pyglet.options["headless"] = True
    import pyrender
    import trimesh

    stage = pyrender.Scene(ambient_light=(0, 0, 0), bg_color=(0.0, 0.0, 1.0, 1.0))
    matt = pyrender.MetallicRoughnessMaterial(
        baseColorFactor=(1, 1, 1, 1), metallicFactor=0, roughnessFactor=1, doubleSided=True
    )
    mesh = trimesh.Trimesh(scene.vertices, scene.faces, process=False)
    stage.add(pyrender.Mesh.from_trimesh(mesh, material=matt, smooth=False))
    stage.add(
        pyrender.DirectionalLight(color=(1, 0, 0), intensity=2 * math.pi),
        pose=_pose_along(light.direction),
    )
    # Only directional lights are asked to cast shadows.
    pose = _pose_along(light.direction)
    pose[:3, 3], distance = _far_along(scene, light)
    stage.add(pyrender.PointLight(color=(0, 1, 0), intensity=math.pi * distance**2), pose=pose)
    lens = pyrender.IntrinsicsCamera(1, 1, 0, 0)
    eye = stage.add(lens)
    renderer = pyrender.OffscreenRenderer(1, 1)

    def render(camera: Camera) -> Visibility:
        renderer.viewport_width, renderer.viewport_height = camera.width, camera.height
        (lens.fx, lens.fy), (lens.cx, lens.cy) = camera.focal, camera.centre
        lens.znear, lens.zfar = camera.znear, camera.zfar
        stage.set_pose(eye, camera.pose)
        picture, _ = renderer.render(stage, pyrender.RenderFlags.SHADOWS_DIRECTIONAL)
        return _visibility_of(picture)

    return Peer(render)


def pygfx_peer(scene: Scene, light: DirectionalLight) -> Peer:
    """pygfx's shadow map by wgpu, off screen, its camera fitted to the scene."""
    import pygfx
    from rendercanvas.offscreen import RenderCanvas

    stage = pygfx.Scene()
    stage.add(pygfx.Background.from_color("#0000ff"))
    mesh = pygfx.Mesh(
        pygfx.Geometry(
            positions=scene.vertices.astype(np.float32), indices=scene.faces.astype(np.int32)
        ),
        pygfx.MeshPhongMaterial(color="#fff", specular="#000", side="both", flat_shading=True),
    )
    mesh.cast_shadow = mesh.receive_shadow = True
    low, high = scene.bounds
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    red = pygfx.DirectionalLight("#f00", 2, cast_shadow=True)
    green = pygfx.DirectionalLight("#0f0", 1)
    for each in (red, green):
        each.local.position = middle - light.direction * 2 * radius
        each.target.local.position = middle
        stage.add(each, each.target)
    red.shadow.camera.width = red.shadow.camera.height = 2 * radius
    red.shadow.camera.depth_range = (radius, 3 * radius)
    stage.add(mesh)
    canvas = RenderCanvas(pixel_ratio=1)
    renderer = pygfx.renderers.WgpuRenderer(canvas, pixel_ratio=1)
    renderer.ppaa = "none"
    eye = pygfx.PerspectiveCamera()
    canvas.request_draw(lambda: renderer.render(stage, eye))

    def render(camera: Camera) -> Visibility:
        canvas.set_logical_size(camera.width, camera.height)
        eye.aspect = camera.width / camera.height
        # pygfx's angle is that of the mean of width and height.
        eye.fov = math.degrees(
            2 * math.atan(math.tan(_only_angle(camera) / 2) * (1 + eye.aspect) / 2)
        )
        eye.depth_range = camera.znear, camera.zfar
        eye.world.matrix = camera.pose
        return _visibility_of(np.asarray(canvas.draw()))

    return Peer(render)


def pyvista_peer(scene: Scene, light: DirectionalLight) -> Peer:
    """VTK's exponential shadow map of 2048 x 2048 by OpenGL, off screen.

    Light leaks in where caster and receiver are close. The exponential constant is the greatest
    that VTK's documentation calls practical, which leaks least.
    """
    import pyvista
    from vtkmodules.vtkRenderingOpenGL2 import (
        vtkCameraPass,
        vtkRenderPassCollection,
        vtkSequencePass,
        vtkShadowMapPass,
    )

    plotter = pyvista.Plotter(off_screen=True, lighting="none")
    plotter.disable_anti_aliasing()
    plotter.set_background("blue")
    mesh = pyvista.PolyData.from_regular_faces(scene.vertices.astype(np.float32), scene.faces)
    plotter.add_mesh(mesh, color="white", ambient=0, diffuse=1, specular=0)
    far, distance = _far_along(scene, light)
    for color, intensity in (("red", 2), ("lime", 1)):
        source = pyvista.Light(
            position=far,
            focal_point=far + distance * light.direction,
            color=color,
            light_type="scene light",
            intensity=intensity,
        )
        # A point light casts no shadow.
        source.positional, source.cone_angle = color == "lime", 180
        plotter.add_light(source)

    shadows = vtkShadowMapPass()
    baker = shadows.GetShadowMapBakerPass()
    baker.SetResolution(2048)
    baker.SetExponentialConstant(80)
    passes = vtkRenderPassCollection()
    passes.AddItem(baker)
    passes.AddItem(shadows)
    sequence = vtkSequencePass()
    sequence.SetPasses(passes)
    frame = vtkCameraPass()
    frame.SetDelegatePass(sequence)
    plotter.renderer.SetPass(frame)

    def before_baking(renderer: Any, _: str) -> None:
        from_light = renderer.GetActiveCamera()
        if from_light is plotter.camera:
            return
        # VTK looks its map up as a square, but draws it with the window's aspect ratio.
        from_light.SetExplicitAspectRatio(1)
        from_light.UseExplicitAspectRatioOn()
        # Exponentials cancel each other where llvmpipe blends them.
        plotter.render_window.GetState().vtkglDisable(_GL_BLEND)

    plotter.renderer.AddObserver("ActiveCameraEvent", before_baking)

    def render(camera: Camera) -> Visibility:
        plotter.window_size = camera.width, camera.height
        eye = plotter.camera
        eye.position = camera.eye
        eye.focal_point = camera.eye - camera.pose[:3, 2]
        eye.up = camera.pose[:3, 1]
        eye.view_angle = math.degrees(_only_angle(camera))
        eye.clipping_range = camera.znear, camera.zfar
        # The first time, this does nothing; later, a screenshot does not render.
        plotter.render()
        return _visibility_of(plotter.screenshot(return_img=True))

    return Peer(render)


def _visibility_of(picture: npt.NDArray[np.uint8]) -> Visibility:
    """Visibility from a picture with a red light, a green one from where it is, half as bright and
    without shadows, and a blue background.

    Red is as bright as green where half of the red light is left, however the renderer filters
    shadows, and whatever curve its colours go through. Where there is no green the surface faces
    away.
    """
    red, green, blue = np.moveaxis(picture[..., :3], -1, 0)
    return np.where(blue > 127, np.nan, (red >= green) & (green > 0)).astype(np.float32)


def _only_angle(camera: Camera) -> float:
    """The vertical angle, for renderers whose cameras have that and nothing more."""
    (x, y), centre = camera.focal, (camera.width / 2, camera.height / 2)
    if not (math.isclose(x, y) and np.allclose(camera.centre, centre, rtol=0, atol=1e-6)):
        raise ValueError("camera must have square pixels and the centre of the image on its axis")
    return camera.yfov


def _far_along(scene: Scene, light: DirectionalLight) -> tuple[npt.NDArray[np.float64], float]:
    """A point so far towards the light that its rays are parallel, and its distance."""
    low, high = scene.bounds
    distance = 1e4 * float(np.linalg.norm(high - low))
    return (low + high) / 2 - distance * light.direction, distance


def _pose_along(direction: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """A pose that looks along a direction."""
    back = -direction
    right = np.cross((0.0, 1.0, 0.0) if abs(back[1]) < 0.9 else (1.0, 0.0, 0.0), back)
    return pose_of(np.zeros(3), direction, right / np.linalg.norm(right))
