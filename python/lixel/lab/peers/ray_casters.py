"""Peers that cast rays: from a scene and a light to what renders cameras."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ...camera import Camera
from ...light import DirectionalLight, PointLight
from ...scene import Scene
from ..rays import embree_scene, ray_directions, ray_offset

Visibility: TypeAlias = npt.NDArray[np.float32]
Vectors: TypeAlias = npt.NDArray[np.float32]
Render: TypeAlias = Callable[[Camera], Visibility]
CastLight: TypeAlias = DirectionalLight | PointLight


@dataclass(frozen=True)
class Peer:
    """A renderer that has a scene and a light.

    Attributes
    ----------
    render
        From a camera to the (H, W) float32 visibility.
    build
        Takes the vertices once more, as if they had moved, and builds what it needs of them; None
        where that is not tried.
    """

    render: Render
    build: Callable[[], object] | None = None


def mitsuba_peer(scene: Scene, light: CastLight) -> Peer:
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
    of_scene = mi.traverse(traced)
    offset = ray_offset(scene)

    def ray_to_light(point: Any, normal: Any) -> Any:
        start = point + normal * offset
        if isinstance(light, PointLight):
            # It ends at the light.
            return mi.Ray3f(start, mi.Point3f(*light.position.tolist()) - start, mi.Float(1), 0, [])
        return mi.Ray3f(start, mi.Vector3f(*(-light.direction).tolist()))

    def build() -> None:
        of_scene["mesh.vertex_positions"] = vertices.ravel()
        of_scene.update()

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
        to_light = ray_to_light(point.p, normal)
        facing = hit.is_valid() & (dr.dot(normal, to_light.d) > 0)
        blocked = traced.ray_test(to_light, coherent=True, active=facing)
        lit = dr.select(facing & ~blocked, mi.Float(1), mi.Float(0))
        image = dr.select(hit.is_valid(), lit, dr.nan).numpy()
        return np.asarray(image, np.float32).reshape(height, width)

    return Peer(render, build)


def embree_peer(scene: Scene, light: CastLight) -> Peer:
    """Primary and shadow rays of Embree through embreex, on one core."""
    traced = embree_scene(scene)

    def build() -> None:
        nonlocal traced
        traced = embree_scene(scene)

    def first(origins: Vectors, directions: Vectors) -> npt.NDArray[np.int32]:
        return np.asarray(traced.run(origins, directions))

    def blocked(origins: Vectors, directions: Vectors, reach: float) -> npt.NDArray[np.bool_]:
        ends = np.full(len(origins), reach, np.float32)
        return np.asarray(traced.run(origins, directions, dists=ends, query="OCCLUDED") >= 0)

    return Peer(_by_rays(scene, light, first, blocked), build)


def trimesh_peer(scene: Scene, light: CastLight) -> Peer:
    """As a user of trimesh would: `mesh.ray`, which uses embreex."""
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    def intersector() -> Any:
        mesh = trimesh.Trimesh(scene.vertices, scene.faces, process=False)
        return RayMeshIntersector(mesh)

    built = intersector()

    def build() -> None:
        nonlocal built
        built = intersector()

    def first(origins: Vectors, directions: Vectors) -> npt.NDArray[np.int64]:
        return np.asarray(built.intersects_first(origins, directions))

    def blocked(origins: Vectors, directions: Vectors, reach: float) -> npt.NDArray[np.bool_]:
        if np.isinf(reach):
            return np.asarray(built.intersects_any(origins, directions))
        # Its rays have no end: the first hit is looked up.
        triangle = first(origins, directions)
        corner, normal = built.mesh.triangles[triangle, 0], built.mesh.face_normals[triangle]
        height = np.einsum("nc,nc->n", normal, corner - origins)
        along = np.einsum("nc,nc->n", normal, directions)
        return np.asarray((triangle >= 0) & (height / along < reach))

    return Peer(_by_rays(scene, light, first, blocked), build)


def open3d_peer(scene: Scene, light: CastLight) -> Peer:
    """Primary and shadow rays of Open3D's RaycastingScene, which uses Embree on all cores."""
    import open3d as o3d

    def raycasting_scene() -> Any:
        made = o3d.t.geometry.RaycastingScene()
        made.add_triangles(scene.vertices.astype(np.float32), scene.faces)
        return made

    traced = raycasting_scene()

    def build() -> None:
        nonlocal traced
        traced = raycasting_scene()

    def first(origins: Vectors, directions: Vectors) -> npt.NDArray[np.int64]:
        hit = traced.cast_rays(np.concatenate([origins, directions], axis=1))
        triangle = hit["primitive_ids"].numpy().astype(np.int64)
        return np.where(triangle == traced.INVALID_ID, -1, triangle)

    def blocked(origins: Vectors, directions: Vectors, reach: float) -> npt.NDArray[np.bool_]:
        rays = np.concatenate([origins, directions], axis=1)
        return np.asarray(traced.test_occlusions(rays, tfar=reach).numpy())

    return Peer(_by_rays(scene, light, first, blocked), build)


def warp_peer(scene: Scene, light: CastLight) -> Peer:
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

    def nearest(mesh, origins, directions, reach, triangles):  # type: ignore[no-untyped-def]
        i = wp.tid()
        query = wp.mesh_query_ray(mesh, origins[i], directions[i], reach)
        triangles[i] = wp.where(query.result, query.face, -1)

    # Written out, because as source the annotations would be texts.
    vectors = wp.array(dtype=wp.vec3)
    nearest.__annotations__ = {
        "mesh": wp.uint64, "origins": vectors, "directions": vectors, "reach": wp.float32,
        "triangles": wp.array(dtype=wp.int32),
    }  # fmt: skip
    kernel = wp.kernel(nearest)

    def first(
        origins: Vectors, directions: Vectors, reach: float = math.inf
    ) -> npt.NDArray[np.int32]:
        triangles = wp.empty(len(origins), dtype=wp.int32)
        rays = [wp.array(each, dtype=wp.vec3) for each in (origins, directions)]
        inputs = [mesh.id, *rays, min(reach, 1.0e30)]
        wp.launch(kernel, dim=len(origins), inputs=inputs, outputs=[triangles])
        return np.asarray(triangles.numpy())

    # `Mesh.refit` keeps the hierarchy of the vertices before, so it is no building.
    return Peer(_by_rays(scene, light, first, lambda o, d, reach: first(o, d, reach) >= 0))


def _by_rays(
    scene: Scene, light: CastLight, first: Callable[..., Any], blocked: Callable[..., Any]
) -> Render:
    """A frame by numpy around two functions of rays; what is beyond a reach blocks no light."""
    corners = scene.vertices[scene.faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = (normals / np.where(length > 0, length, 1)).astype(np.float32)
    anchors = corners[:, 0].astype(np.float32)
    offset = np.float32(ray_offset(scene))

    def to_light_from(points: Vectors) -> tuple[Vectors, float]:
        if isinstance(light, PointLight):
            return light.position.astype(np.float32) - points, 1.0
        return np.broadcast_to((-light.direction).astype(np.float32), points.shape), math.inf

    def render(camera: Camera) -> Visibility:
        directions = ray_directions(camera).astype(np.float32)
        eye = camera.eye.astype(np.float32)
        triangle = first(np.broadcast_to(eye, directions.shape).copy(), directions)
        covered = np.flatnonzero(triangle >= 0)
        triangle, directions = triangle[covered], directions[covered]
        normal = normals[triangle]
        along = np.einsum("nc,nc->n", normal, directions)
        distance = np.einsum("nc,nc->n", normal, anchors[triangle] - eye) / along
        normal[along > 0] *= -1
        points = eye + directions * distance[:, None] + normal * offset
        to_light, reach = to_light_from(points)
        facing = np.flatnonzero(np.einsum("nc,nc->n", normal, to_light) > 0)
        lit = ~blocked(points[facing], to_light[facing].copy(), reach)
        visibility = np.full(camera.height * camera.width, np.nan, np.float32)
        visibility[covered] = 0.0
        visibility[covered[facing]] = lit
        return visibility.reshape(camera.height, camera.width)

    return render
