"""Peers that cast rays: from a scene and a light to a function of the camera."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt

from ...camera import Camera
from ...light import DirectionalLight
from ...scene import Scene
from ..rays import embree_scene, ray_directions, ray_offset

Visibility: TypeAlias = npt.NDArray[np.float32]
Vectors: TypeAlias = npt.NDArray[np.float32]
Render: TypeAlias = Callable[[Camera], Visibility]


def mitsuba_peer(scene: Scene, light: DirectionalLight) -> Render:
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


def embree_peer(scene: Scene, light: DirectionalLight) -> Render:
    """Primary and shadow rays of Embree through embreex, on one core."""
    traced = embree_scene(scene)

    def blocked(origins: Vectors, directions: Vectors) -> npt.NDArray[np.bool_]:
        return np.asarray(traced.run(origins, directions, query="OCCLUDED") >= 0)

    return _by_rays(scene, light, traced.run, blocked)


def trimesh_peer(scene: Scene, light: DirectionalLight) -> Render:
    """As a user of trimesh would: `mesh.ray`, which uses embreex."""
    import trimesh
    from trimesh.ray.ray_pyembree import RayMeshIntersector

    mesh = trimesh.Trimesh(scene.vertices, scene.faces, process=False)
    intersector = RayMeshIntersector(mesh)
    return _by_rays(scene, light, intersector.intersects_first, intersector.intersects_any)


def open3d_peer(scene: Scene, light: DirectionalLight) -> Render:
    """Primary and shadow rays of Open3D's RaycastingScene, which uses Embree on all cores."""
    import open3d as o3d

    traced = o3d.t.geometry.RaycastingScene()
    traced.add_triangles(scene.vertices.astype(np.float32), scene.faces)

    def first(origins: Vectors, directions: Vectors) -> npt.NDArray[np.int64]:
        hit = traced.cast_rays(np.concatenate([origins, directions], axis=1))
        triangle = hit["primitive_ids"].numpy().astype(np.int64)
        return np.where(triangle == traced.INVALID_ID, -1, triangle)

    def blocked(origins: Vectors, directions: Vectors) -> npt.NDArray[np.bool_]:
        rays = np.concatenate([origins, directions], axis=1)
        return np.asarray(traced.test_occlusions(rays).numpy())

    return _by_rays(scene, light, first, blocked)


def warp_peer(scene: Scene, light: DirectionalLight) -> Render:
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

    def first(origins: Vectors, directions: Vectors) -> npt.NDArray[np.int32]:
        triangles = wp.empty(len(origins), dtype=wp.int32)
        rays = [wp.array(each, dtype=wp.vec3) for each in (origins, directions)]
        wp.launch(kernel, dim=len(origins), inputs=[mesh.id, *rays], outputs=[triangles])
        return np.asarray(triangles.numpy())

    return _by_rays(scene, light, first, lambda o, d: first(o, d) >= 0)


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
        directions = ray_directions(camera).astype(np.float32)
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
