"""What `render_shadows` gives, by every method and every kind of light, against rays of Embree.

Nothing here is lixel's: the rays of the pixels follow from the pose of the camera, trimesh holds
the triangles, Embree finds what the eye sees and what is between it and the light. Embree computes
in float32, which is why a few pixels of the reference differ, too.
"""

import functools

import numpy as np
import pytest
import trimesh
from skimage.metrics import hausdorff_distance, structural_similarity

import lixel as lx

pytestmark = pytest.mark.of_checkout("it compares with another renderer")

WIDTH, HEIGHT = 240, 135

SCENES = {
    "objects_on_floor": {"count": 30, "subdivisions": 2},
    "colonnade": {"columns": 4, "detail": 10},
}


def lights_of(scene, moved=0.0):
    """One of each kind, with shadows in the middle of the view, moved by a share of the scene."""
    low, high = scene.bounds
    middle, size = (low + high) / 2, high - low
    lamp = middle + (0.2 + moved, 0.9, 0.15) * size
    return {
        "directional": lx.DirectionalLight((0.4 + moved, -1.0, 0.3)),
        "point": lx.PointLight(lamp),
        "spot": lx.SpotLight(lamp, middle - lamp, 0.9),
        "hemisphere": lx.HemisphereLight(lamp, middle - lamp),
    }


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def ray_cast(scene, camera, light):
    """1 lit, 0 in shadow, NaN where nothing is seen."""
    mesh = trimesh.Trimesh(scene.vertices, scene.faces, process=False)
    rows, columns = np.mgrid[:HEIGHT, :WIDTH]
    half = np.tan(camera.yfov / 2)
    x = (2 * (columns.ravel() + 0.5) / WIDTH - 1) * half * WIDTH / HEIGHT
    y = (1 - 2 * (rows.ravel() + 0.5) / HEIGHT) * half
    directions = np.column_stack([x, y, np.full(x.shape, -1.0)]) @ camera.pose[:3, :3].T
    eye = camera.pose[:3, 3]
    seen = mesh.ray.intersects_first(np.broadcast_to(eye, directions.shape), directions)
    visibility = np.where(seen >= 0, 0.0, np.nan)
    pixels = np.flatnonzero(seen >= 0)
    # The point on the plane of the triangle, in float64.
    corner = mesh.triangles[seen[pixels], 0]
    normal = np.cross(*(mesh.triangles[seen[pixels], i] - corner for i in (1, 2)))
    along = np.einsum("nc,nc->n", corner - eye, normal)
    along /= np.einsum("nc,nc->n", directions[pixels], normal)
    point = eye + along[:, None] * directions[pixels]
    normal = unit(normal) * -np.sign(np.einsum("nc,nc->n", directions[pixels], normal))[:, None]
    if isinstance(light, lx.DirectionalLight):
        to_light = np.broadcast_to(-light.direction, point.shape)
    else:
        to_light = light.position - point
    faces = np.einsum("nc,nc->n", normal, to_light) > 0.0
    if isinstance(light, lx.SpotLight):
        faces &= -unit(to_light) @ light.direction > np.cos(light.outer)
    if isinstance(light, lx.HemisphereLight):
        faces &= to_light @ light.axis < 0.0
    # Embree needs its rays to start above the surface.
    start = point[faces] + 2e-5 * np.ptp(scene.bounds) * normal[faces]
    way = to_light[faces]
    hits, rays, _ = mesh.ray.intersects_location(start, way, multiple_hits=False)
    beyond = np.linalg.norm(hits - start[rays], axis=1) > np.linalg.norm(way[rays], axis=1)
    if isinstance(light, lx.DirectionalLight):
        beyond[:] = False
    is_lit = np.ones(len(start), bool)
    is_lit[rays[~beyond]] = False
    visibility[pixels[faces]] = is_lit
    return visibility.reshape(HEIGHT, WIDTH)


def own_methods(light):
    """All there are for the light, with maps of 1024², or pages whose texels are as small."""
    fine = {"virtual": {"level_bias": -4}}
    methods = (method(**fine.get(name, {})) for name, method in lx.METHODS.items())
    return [method for method in methods if method.takes(light)]


@functools.cache
def scene_of(name):
    return lx.scenes.GENERATORS[name](**SCENES[name])


# Measured: 11 at most by a map, 2 by what samples nothing and by the reference.
MAX_WRONG_OF_MAP, MAX_WRONG = 14, 2
MAX_DISTANCE = 1.5
MIN_SSIM = 0.998

# A trapezoid has few texels where a lamp lights what is far from the eye. Measured: 22.
LIMITS = {("objects_on_floor", "trapezoidal", "point"): 25}
# Three pixels in a row at the border of the plane's map. Measured: 4.
LIMITS["objects_on_floor", "plane_optimal", "point"] = 6


@pytest.mark.parametrize("kind", ["directional", "point", "spot", "hemisphere"])
@pytest.mark.parametrize("name", SCENES)
def test_every_method_agrees_with_rays_of_embree(name, kind):
    scene = scene_of(name)
    camera = scene.cameras["default"].resized(WIDTH, HEIGHT)
    light = lights_of(scene)[kind]
    truth = ray_cast(scene, camera, light)
    covered = ~np.isnan(truth)
    # There is a shadow to be wrong about, beside what is turned away.
    reference = lx.reference(scene, camera, light)
    assert 0.01 < np.mean(reference.facing & (truth == 0)) < 0.2
    images = {"reference": reference.visibility}
    for method in own_methods(light):
        images[method.name] = lx.render_shadows(scene, camera, light, method, device="cpu")
    failed = {}
    for method, image in images.items():
        assert np.array_equal(np.isnan(image), ~covered)
        wrong = int(np.count_nonzero(image[covered] != truth[covered]))
        lit, expected = (np.where(covered, picture, 1.0) for picture in (image, truth))
        ssim = structural_similarity(lit, expected, data_range=1.0)
        distance = hausdorff_distance(lit == 0.0, expected == 0.0)
        limit = LIMITS.get((name, method, kind))
        samples_nothing = method in ("reference", "exact", "ray_traced", "shadow_volumes")
        bound = limit or (MAX_WRONG if samples_nothing else MAX_WRONG_OF_MAP)
        is_like = limit is not None or (ssim >= MIN_SSIM and distance <= MAX_DISTANCE)
        if wrong > bound or not is_like:
            failed[method] = f"{wrong} wrong, SSIM {ssim:.4f}, Hausdorff distance {distance:.1f}"
    assert failed == {}


@pytest.mark.parametrize("kind", ["directional", "point", "spot", "hemisphere"])
def test_a_light_from_elsewhere_is_noticed(kind):
    """What the bounds are worth: a light that is moved by half a percent exceeds them."""
    scene = scene_of("objects_on_floor")
    camera = scene.cameras["default"].resized(WIDTH, HEIGHT)
    truth = ray_cast(scene, camera, lights_of(scene)[kind])
    light = lights_of(scene, moved=0.005)[kind]
    image = lx.render_shadows(scene, camera, light, "exact", device="cpu")
    covered = ~np.isnan(truth)
    assert np.count_nonzero(image[covered] != truth[covered]) > MAX_WRONG_OF_MAP
