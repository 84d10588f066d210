"""The reference, and with it the visibility buffer, against Embree, from the same points.

Embree computes in float32 and has no rule for rays that pass an edge or start on a surface, so the
two may differ. Every pixel in which they do, and which the reference does not call a tie, is
settled by testing all triangles of the scene in float64: the reference must be right. The
visibility buffers of both engines must then have the reference's triangle wherever that is no tie.

Scenes of a folder with a scenes.json are compared too: the folder that LIXEL_SCENES names, or
shared/scenes beside the repository. LIXEL_TEST_SIZE, for example 1920x1080, sets the size of the
images.
"""

import json
import os
import platform
from pathlib import Path

import numpy as np
import pytest

import lixel as lx
from lixel.lab.rays import ray_directions, ray_offset
from lixel.lab.views import Views

if platform.machine() == "aarch64":
    pytest.skip("embreex has no wheels for this platform", allow_module_level=True)

from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

pytestmark = pytest.mark.of_checkout("it compares with another renderer")

SIZE = tuple(int(n) for n in os.environ.get("LIXEL_TEST_SIZE", "480x270").split("x"))

GENERATED = {
    "plane_and_box": lx.scenes.plane_and_box,
    "objects_on_floor": lx.scenes.objects_on_floor,
    "colonnade": lx.scenes.colonnade,
    "city": lx.scenes.city,
    "needles": lx.scenes.needles,
    "terrain": lambda: lx.scenes.terrain(cells=200),
}

FOLDER = Path(
    os.environ.get("LIXEL_SCENES", Path(__file__).parents[2] / "shared" / "scenes")
).resolve()


def listed_scenes():
    """The files of the folder, or one case that is skipped and says why."""
    if not (FOLDER / "scenes.json").is_file():
        reason = "scenes from files left out: LIXEL_SCENES names no folder with a scenes.json"
        return [pytest.param("", marks=pytest.mark.skip(reason=reason))]
    return [entry["file"] for entry in json.loads((FOLDER / "scenes.json").read_text())]


@pytest.mark.parametrize("name", GENERATED)
def test_reference_is_right_on_generated_scenes(name):
    scene = GENERATED[name]()
    compare(scene, scene.cameras["default"].resized(*SIZE), [scene.lights["default"]])


@pytest.mark.parametrize("name", listed_scenes())
def test_reference_is_right_on_scenes_of_the_folder(name):
    scene = lx.load(FOLDER / name)
    views = Views.read(FOLDER / "scenes.json", name)
    assert views.cameras, f"{name} has no camera"
    for camera in views.cameras.values():
        parallel = [
            light for light in views.lights.values() if isinstance(light, lx.DirectionalLight)
        ]
        compare(scene, camera.resized(*SIZE), parallel)


def compare(scene, camera, lights):
    embree = EmbreeScene()
    TriangleMesh(embree, scene.vertices.astype(np.float32), scene.faces.astype(np.int32))
    truths = {light: lx.reference(scene, camera, light) for light in lights}
    light, truth = next(iter(truths.items()))
    compare_first_hits(scene, camera, truth, embree)
    for device in (None, "cpu"):
        seen = lx.render(scene, camera, light, "exact", device=device).triangle_id
        differ = (seen != truth.triangle_id) & ~truth.triangle_tie
        assert not differ.any(), f"visibility buffer: {np.argwhere(differ)[:5].tolist()}"
    for light, truth in truths.items():
        compare_shadows(scene, light, truth, embree)


def compare_first_hits(scene, camera, truth, embree):
    directions = ray_directions(camera)
    eyes = np.broadcast_to(camera.eye.astype(np.float32), directions.shape).copy()
    seen = embree.run(eyes, directions.astype(np.float32)).reshape(truth.triangle_id.shape)
    differ = (seen != truth.triangle_id) & ~truth.triangle_tie
    report("first hits", np.count_nonzero(differ), truth.triangle_tie)
    assert differ.mean() < 0.01
    corners = scene.vertices[scene.faces] - camera.eye
    for row, column in np.argwhere(differ):
        direction = directions[row * camera.width + column]
        distance = distances(corners, np.zeros(3), direction)
        # The depth of a surface beyond the far plane or before the near one is not seen.
        depth = distance * -(direction @ camera.pose[:3, 2])
        distance[(depth > camera.zfar) | (depth < (camera.znear or 0.0))] = np.inf
        nearest, found = distance.min(), truth.triangle_id[row, column]
        where = f"row {row}, column {column}"
        if found < 0:
            assert nearest == np.inf, f"{where}: a surface was missed"
        else:
            # Triangles on each other are equally near.
            assert distance[found] <= nearest * (1 + 1e-12), f"{where}: not the first surface"


def compare_shadows(scene, light, truth, embree):
    # Not those that the light sees edge-on, within the rounding of float32 normals: they are dark.
    cosine = truth.normal @ -light.direction
    seen = truth.facing & (cosine > 1e-6) & ~truth.tie & ~truth.triangle_tie
    rows, columns = np.nonzero(seen)
    points = truth.position[rows, columns]
    own = truth.triangle_id[rows, columns]
    to_light = -light.direction
    lit = truth.visibility[rows, columns] == 1.0

    # Embree needs its rays to start above the surface.
    above = points + truth.normal[rows, columns] * ray_offset(scene)
    blocked = embree.run(
        above.astype(np.float32),
        np.broadcast_to(to_light.astype(np.float32), above.shape).copy(),
        query="OCCLUDED",
    )
    differ = np.flatnonzero(lit != (blocked < 0))
    report("shadows", len(differ), truth.tie)
    assert len(differ) < 0.01 * max(len(lit), 1)
    corners = scene.vertices[scene.faces]
    for i in differ:
        distance = distances(corners, points[i], to_light)
        distance[own[i]] = np.inf
        assert lit[i] == (distance.min() == np.inf), (
            f"row {rows[i]}, column {columns[i]}: the reference says lit {lit[i]}"
        )


def report(what, differing, tie):
    print(f"{what}: {differing} of {tie.size} pixels differ, {np.count_nonzero(tie)} ties left out")


def distances(corners, origin, direction):
    """Along one ray to each of the triangles, in float64; inf where it passes by or lies behind."""
    edge_1, edge_2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    across = np.cross(direction, edge_2)
    volume = np.einsum("nc,nc->n", edge_1, across)
    with np.errstate(divide="ignore", invalid="ignore"):
        start = origin - corners[:, 0]
        u = np.einsum("nc,nc->n", start, across) / volume
        turned = np.cross(start, edge_1)
        v = turned @ direction / volume
        distance = np.einsum("nc,nc->n", edge_2, turned) / volume
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
    return np.where(hit, distance, np.inf)
