"""Whole frames, timed side by side with other renderers, in one run on the same cores.

A frame goes from a new camera to a visibility image as a numpy array: primary visibility, shadows,
readback. Scenes are uploaded and acceleration structures built before the clock starts, and every
renderer warms up first. Frames are interleaved, so that a disturbance hits all alike. No two frames
have the same camera, so that nothing of a frame can be kept for the next.
"""

from __future__ import annotations

import importlib.metadata
import importlib.util
import math
import os
import statistics
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from .. import _core
from ..camera import Camera
from ..frame import render_shadows
from ..light import DirectionalLight, Light
from ..methods import Method
from ..reference import Reference, reference
from ..scene import Scene
from .report import progress, say, table

SCENE = "colonnade"

Visibility = npt.NDArray[np.float32]
Render = Callable[[Camera], Visibility]

# A slow peer is timed less often, so that it takes about this many seconds in all.
_PATIENCE = 30.0
_FEWEST = 3


def run(
    scene: Scene,
    camera: Camera,
    light: Light,
    method: Method,
    *,
    repeats: int = 15,
) -> list[dict[str, Any]]:
    """Time whole frames of a method and of every peer that is installed; print a table.

    Parameters
    ----------
    scene, camera, light, method
        As for `render_shadows`.
    repeats : int
        Timed frames of each renderer, at least 1; slow peers get fewer.

    Returns
    -------
    list of dict
        For each renderer its version, its median, least and greatest milliseconds, the number of
        frames, and the pixels that it got wrong by `reference`, ties left out.
    """
    if repeats < 1:
        raise ValueError(f"repeats must be at least 1, got {repeats}")
    if not isinstance(light, DirectionalLight):
        raise ValueError(f"light must be directional to compare renderers, got {light}")
    say("reference: casting rays on the CPU")
    truth = reference(scene, camera, light)
    contenders = [
        _Contender(
            f"lixel {method.name} {method.map_resolution or ''}".rstrip(),
            _core.__version__,
            _lixel(scene, light, method),
            _Views(scene, camera),
        )
    ]
    bounded = with_planes(camera, truth)
    for name, (module, prepare) in PEERS.items():
        if importlib.util.find_spec(module) is None:
            say(f"left out: {name}, which needs the package {module}")
            continue
        try:
            render = prepare(scene, light)
            render(bounded)
        # A peer may lack a driver or a library of its own, and says so with errors of its own; that
        # is no reason to lose the others.
        except Exception as error:
            say(f"left out: {name}: {' '.join(str(error).split()) or type(error).__name__}")
        else:
            views = _Views(scene, bounded)
            contenders.append(_Contender(name, _version(module), render, views))

    for contender in contenders:
        contender.warm_up(repeats)
    for turn in progress(range(repeats), "round"):
        for contender in contenders:
            if turn < contender.repeats:
                contender.time()

    rows = [_row(contender, truth) for contender in contenders]
    device = _core.device()
    print(
        f"{scene.triangle_count:,} triangles, {camera.width} x {camera.height} pixels, "
        f"on {device.get('name', '?')}, driver {device.get('driver', '?')}"
    )
    print(table(rows))
    return rows


@dataclass
class _Contender:
    name: str
    version: str
    render: Render
    views: _Views
    repeats: int = 0
    milliseconds: list[float] = field(default_factory=list)

    def warm_up(self, repeats: int) -> None:
        """Compiles, allocates, and decides how often to time."""
        self.render(self.views.next())
        self.time()
        seconds = self.milliseconds.pop() / 1e3
        self.repeats = min(repeats, max(_FEWEST, int(_PATIENCE / seconds)))

    def time(self) -> None:
        camera = self.views.next()
        start = time.perf_counter()
        self.render(camera)
        self.milliseconds.append(1e3 * (time.perf_counter() - start))


class _Views:
    """The camera again and again, each time moved by a hair and therefore new."""

    def __init__(self, scene: Scene, camera: Camera) -> None:
        self.scene, self.camera = scene, camera
        self.random = np.random.default_rng(0)

    def next(self) -> Camera:
        return moved_by_a_hair(self.camera, self.scene, self.random)


def moved_by_a_hair(camera: Camera, scene: Scene, random: np.random.Generator) -> Camera:
    """The camera a millionth of the scene's diagonal away: the same image, but nothing that was
    kept for a camera serves."""
    low, high = scene.bounds
    pose = camera.pose.copy()
    pose[:3, 3] += 1e-6 * float(np.linalg.norm(high - low)) * random.standard_normal(3)
    return camera.posed(pose)


def with_planes(camera: Camera, truth: Reference) -> Camera:
    """The camera with a near and a far plane around all that it sees.

    A depth buffer is as exact as its near plane is far away, and most renderers must be told one.
    """
    seen = truth.depth[truth.covered]
    if not seen.size:
        raise ValueError("camera must see a surface to compare renderers")
    return Camera(
        camera.pose,
        focal=camera.focal,
        centre=camera.centre,
        width=camera.width,
        height=camera.height,
        # Between pixels' centres something may be nearer.
        znear=max(camera.znear or 0.0, 0.5 * float(seen.min())),
        zfar=min(camera.zfar, 2.0 * float(seen.max())),
    )


def _version(module: str) -> str:
    """Of the package that has the module, whose own name may be another."""
    packages = importlib.metadata.packages_distributions().get(module, [])
    return importlib.metadata.version(packages[0]) if packages else "?"


def _row(contender: _Contender, truth: Reference) -> dict[str, Any]:
    wrong = wrong_pixels(contender.render(contender.views.camera), truth)
    times = contender.milliseconds
    return {
        "renderer": contender.name,
        "version": contender.version,
        "ms, median": statistics.median(times),
        "least": min(times),
        "greatest": max(times),
        "frames": len(times),
        "wrong pixels": wrong,
        "% of covered": 100.0 * wrong / max(1, int(np.count_nonzero(truth.covered))),
    }


def wrong_pixels(visibility: Visibility, truth: Reference) -> int:
    """Pixels that differ from the truth, ties left out; a surface seen or missed by mistake counts.

    `compare` judges shadows alone, and refuses images of which another surface is seen.
    """
    judged = ~(truth.tie | truth.triangle_tie)
    equal = (visibility == truth.visibility) | (np.isnan(visibility) & np.isnan(truth.visibility))
    return int(np.count_nonzero(judged & ~equal))


# --- The renderers: from a scene and a light to a function of the camera, which has planes ---


def _lixel(scene: Scene, light: Light, method: Method) -> Render:
    return lambda camera: render_shadows(scene, camera, light, method)


def _mitsuba(scene: Scene, light: DirectionalLight) -> Render:
    """Primary and shadow rays of Mitsuba 3 in one kernel."""
    import drjit as dr
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    vertices = scene.vertices.astype(np.float32)
    mesh = mi.Mesh("scene", len(vertices), scene.triangle_count)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = vertices.ravel()
    parameters["faces"] = scene.faces.ravel()
    parameters.update()
    traced = mi.load_dict({"type": "scene", "mesh": mesh})
    to_light = mi.Vector3f(*(-light.direction).tolist())
    offset = ray_offset(scene)

    def render(camera: Camera) -> Visibility:
        width, height = camera.width, camera.height
        index = dr.arange(mi.UInt32, width * height)
        row = index // width
        column = index - row * width
        # Opaque, or each new camera would compile a new kernel.
        eye = mi.Point3f(*(dr.opaque(mi.Float, float(c)) for c in camera.eye))
        right, up, back = (
            mi.Vector3f(*(dr.opaque(mi.Float, float(c)) for c in camera.pose[:3, axis]))
            for axis in range(3)
        )
        x = (mi.Float(column) + (0.5 - camera.centre[0])) / camera.focal[0]
        y = (mi.Float(row) + (0.5 - camera.centre[1])) / camera.focal[1]
        ray = mi.Ray3f(eye, dr.normalize(right * x - up * y - back))
        # Neighbouring rays are alike; Embree takes them in packets when told.
        hit = traced.ray_intersect_preliminary(ray, coherent=True)
        point = hit.compute_surface_interaction(ray, mi.RayFlags.Minimal)
        normal = dr.select(dr.dot(point.n, ray.d) > 0, -point.n, point.n)
        facing = hit.is_valid() & (dr.dot(normal, to_light) > 0)
        blocked = traced.ray_test(
            mi.Ray3f(point.p + normal * offset, to_light), coherent=True, active=facing
        )
        lit = dr.select(facing & ~blocked, mi.Float(1), mi.Float(0))
        image = dr.select(hit.is_valid(), lit, dr.nan).numpy()
        return np.asarray(image, np.float32).reshape(height, width)

    return render


def _embree(scene: Scene, light: DirectionalLight) -> Render:
    """Primary and shadow rays of Embree through embreex, on one core."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    traced = EmbreeScene()
    TriangleMesh(traced, scene.vertices.astype(np.float32), scene.faces.astype(np.int32))

    def first(
        origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.int32]:
        return np.asarray(traced.run(origins, directions))

    def blocked(
        origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.bool_]:
        return np.asarray(traced.run(origins, directions, query="OCCLUDED") >= 0)

    return _by_rays(scene, light, first, blocked)


def _trimesh(scene: Scene, light: DirectionalLight) -> Render:
    """As a user of trimesh would: `mesh.ray`, which uses embreex."""
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    mesh = trimesh.Trimesh(scene.vertices, scene.faces, process=False)
    intersector = RayMeshIntersector(mesh)
    return _by_rays(scene, light, intersector.intersects_first, intersector.intersects_any)


def _open3d(scene: Scene, light: DirectionalLight) -> Render:
    """Primary and shadow rays of Open3D's RaycastingScene, which uses Embree on all cores."""
    import open3d as o3d

    traced = o3d.t.geometry.RaycastingScene()
    traced.add_triangles(scene.vertices.astype(np.float32), scene.faces)

    def first(
        origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.int64]:
        hit = traced.cast_rays(np.concatenate([origins, directions], axis=1))
        triangle = hit["primitive_ids"].numpy().astype(np.int64)
        return np.where(triangle == traced.INVALID_ID, -1, triangle)

    def blocked(
        origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.bool_]:
        rays = np.concatenate([origins, directions], axis=1)
        return np.asarray(traced.test_occlusions(rays).numpy())

    return _by_rays(scene, light, first, blocked)


def _warp(scene: Scene, light: DirectionalLight) -> Render:
    """Primary and shadow rays by mesh queries in a kernel of NVIDIA Warp, on the CPU or on CUDA."""
    import warp as wp

    wp.config.quiet = True
    # What newer versions have in its place: errors only.
    wp.config.log_level = 40
    wp.init()
    mesh = wp.Mesh(
        points=wp.array(scene.vertices.astype(np.float32), dtype=wp.vec3),
        indices=wp.array(scene.faces.astype(np.int32).ravel(), dtype=wp.int32),
    )

    def nearest(mesh, origins, directions, triangles):  # type: ignore[no-untyped-def]
        i = wp.tid()
        query = wp.mesh_query_ray(mesh, origins[i], directions[i], 1.0e30)
        triangles[i] = wp.where(query.result, query.face, -1)

    # Written out, because as source the annotations would be texts.
    vectors = wp.array(dtype=wp.vec3)
    nearest.__annotations__ = {
        "mesh": wp.uint64, "origins": vectors, "directions": vectors,
        "triangles": wp.array(dtype=wp.int32),
    }  # fmt: skip
    kernel = wp.kernel(nearest)

    def first(
        origins: npt.NDArray[np.float32], directions: npt.NDArray[np.float32]
    ) -> npt.NDArray[np.int32]:
        triangles = wp.empty(len(origins), dtype=wp.int32)
        rays = [wp.array(each, dtype=wp.vec3) for each in (origins, directions)]
        wp.launch(kernel, dim=len(origins), inputs=[mesh.id, *rays], outputs=[triangles])
        return np.asarray(triangles.numpy())

    return _by_rays(scene, light, first, lambda o, d: first(o, d) >= 0)


def _pyrender(scene: Scene, light: DirectionalLight) -> Render:
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
    lamp = _pose_along(light.direction)
    lamp[:3, 3], distance = _far_along(scene, light)
    stage.add(pyrender.PointLight(color=(0, 1, 0), intensity=math.pi * distance**2), pose=lamp)
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

    return render


def _pygfx(scene: Scene, light: DirectionalLight) -> Render:
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
    sun = pygfx.DirectionalLight("#f00", 2, cast_shadow=True)
    lamp = pygfx.DirectionalLight("#0f0", 1)
    for each in (sun, lamp):
        each.local.position = middle - light.direction * 2 * radius
        each.target.local.position = middle
        stage.add(each, each.target)
    sun.shadow.camera.width = sun.shadow.camera.height = 2 * radius
    sun.shadow.camera.depth_range = (radius, 3 * radius)
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

    return render


def _pyvista(scene: Scene, light: DirectionalLight) -> Render:
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
        lamp = pyvista.Light(
            position=far,
            focal_point=far + distance * light.direction,
            color=color,
            light_type="scene light",
            intensity=intensity,
        )
        # A point light casts no shadow.
        lamp.positional, lamp.cone_angle = color == "lime", 180
        plotter.add_light(lamp)

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
        sun = renderer.GetActiveCamera()
        if sun is plotter.camera:
            return
        # VTK looks its map up as a square, but draws it with the window's aspect ratio.
        sun.SetExplicitAspectRatio(1)
        sun.UseExplicitAspectRatioOn()
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

    return render


_GL_BLEND = 0x0BE2


def _visibility_of(picture: npt.NDArray[np.uint8]) -> Visibility:
    """Visibility from a picture with a red sun, a green light from where the sun is, half as bright
    and without shadows, and a blue background.

    Red is as bright as green where half of the sun is left, however the renderer filters shadows,
    and whatever curve its colours go through. Where there is no green the surface faces away.
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
    """A point so far towards the sun that its light is parallel, and its distance."""
    low, high = scene.bounds
    distance = 1e4 * float(np.linalg.norm(high - low))
    return (low + high) / 2 - distance * light.direction, distance


def _pose_along(direction: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """A pose that looks along a direction."""
    back = -direction
    right = np.cross((0.0, 1.0, 0.0) if abs(back[1]) < 0.9 else (1.0, 0.0, 0.0), back)
    pose = np.eye(4)
    pose[:3, 0] = right / np.linalg.norm(right)
    pose[:3, 1] = np.cross(back, pose[:3, 0])
    pose[:3, 2] = back
    return pose


def _by_rays(
    scene: Scene, light: DirectionalLight, first: Callable[..., Any], blocked: Callable[..., Any]
) -> Render:
    """A frame by numpy around two functions of rays."""
    corners = scene.vertices[scene.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = (normals / np.where(length > 0, length, 1)).astype(np.float32)
    anchors = corners[:, 0].astype(np.float32)
    to_light = (-light.direction).astype(np.float32)
    offset = np.float32(ray_offset(scene))

    def render(camera: Camera) -> Visibility:
        directions = ray_directions(camera)
        eye = camera.eye.astype(np.float32)
        triangle = first(np.broadcast_to(eye, directions.shape).copy(), directions)
        covered = np.flatnonzero(triangle >= 0)
        triangle, directions = triangle[covered], directions[covered]
        normal = normals[triangle]
        along = np.einsum("nc,nc->n", normal, directions)
        distance = np.einsum("nc,nc->n", normal, anchors[triangle] - eye) / along
        normal[along > 0] *= -1
        facing = np.flatnonzero(normal @ to_light > 0)
        origins = eye + directions[facing] * distance[facing, None] + normal[facing] * offset
        lit = ~blocked(origins, np.broadcast_to(to_light, origins.shape).copy())
        visibility = np.full(camera.height * camera.width, np.nan, np.float32)
        visibility[covered] = 0.0
        visibility[covered[facing]] = lit
        return visibility.reshape(camera.height, camera.width)

    return render


def ray_directions(camera: Camera) -> npt.NDArray[np.float32]:
    """(H * W, 3) float32: directions of the rays through the pixels' centres in world space, at
    depth 1."""
    x = (np.arange(camera.width) + 0.5 - camera.centre[0]) / camera.focal[0]
    y = (np.arange(camera.height) + 0.5 - camera.centre[1]) / camera.focal[1]
    right, up, back = camera.pose[:3, :3].T
    directions = x[None, :, None] * right - y[:, None, None] * up - back
    return np.asarray(directions.reshape(-1, 3), np.float32)


def ray_offset(scene: Scene) -> float:
    """How far the peers' shadow rays start above the surface, so that it does not shadow itself:
    a few float32 steps of the largest coordinate."""
    return 1e-6 * float(np.abs(scene.bounds).max())


# The package that each peer needs, and what prepares it.
PEERS: dict[str, tuple[str, Callable[[Scene, DirectionalLight], Render]]] = {
    "Mitsuba 3 llvm_ad_rgb": ("mitsuba", _mitsuba),
    "embreex": ("embreex", _embree),
    "trimesh with embreex": ("embreex", _trimesh),
    "Open3D": ("open3d", _open3d),
    "Warp": ("warp", _warp),
    # Before pyrender: VTK ends other EGL contexts of the process when it opens a window.
    "PyVista": ("pyvista", _pyvista),
    "pyrender": ("pyrender", _pyrender),
    "pygfx": ("pygfx", _pygfx),
}
