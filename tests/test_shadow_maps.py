"""Shadow maps: what a texel holds, where a point falls, and what the lookup makes of it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from views import HEIGHT, WIDTH, small

import lixel as lx

METHODS = list(lx.methods.MAP_METHODS.values())
# Those whose texels lie where the light matrix puts them.
LINEAR = [lx.Uniform, lx.DesiredView]

HOMOGRAPHIES = [
    lx.Focused,
    lx.LightSpacePerspective,
    lx.LogPerspective,
    lx.Trapezoidal,
    lx.PerspectiveShadowMap,
    lx.PlaneOptimal,
    lx.SceneOptimized,
]


def one_map(method: type[lx.Method], resolution: lx.methods.Resolution) -> lx.Method:
    """The method with one layer, where it may have more."""
    if method is lx.Cascades:
        return lx.Cascades(resolution=resolution, layers=1)
    return method(resolution=resolution)


def turn(seed: int) -> np.ndarray:
    """A rotation; the identity for seed 0."""
    if seed == 0:
        return np.eye(3)
    q, r = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    return q * np.linalg.det(q)


def grid(cells: int) -> tuple[np.ndarray, np.ndarray]:
    """The square from (-1, 0, -1) to (1, 0, 1) in `cells` by `cells` quads."""
    x, z = np.meshgrid(*2 * [np.linspace(-1, 1, cells + 1)], indexing="ij")
    vertices = np.stack([x, np.zeros_like(x), z], axis=-1).reshape(-1, 3)
    a = (np.arange(cells)[:, None] * (cells + 1) + np.arange(cells)).ravel()
    b = a + cells + 1
    return vertices, np.concatenate([np.stack([a, a + 1, b], 1), np.stack([b, a + 1, b + 1], 1)])


# --- What a texel holds ---


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    ("name", "resolution"),
    [
        ("plane_and_box", 96),
        ("objects_on_floor", 96),
        ("colonnade", 96),
        ("colonnade", (150, 61)),
        ("objects_on_floor", (40, 230)),
    ],
)
def test_a_texel_holds_the_nearest_depth_on_the_ray_through_its_centre(name, resolution, method):
    if name == "colonnade":
        scene = lx.scenes.colonnade(columns=2, detail=8)
    elif name == "objects_on_floor":
        scene = lx.scenes.objects_on_floor(count=16, subdivisions=0)
    else:
        scene = small(name)
    camera = next(iter(small(name).cameras.values())).resized(WIDTH, HEIGHT)
    frame = lx.render(scene, camera, scene.lights["default"], one_map(method, resolution))
    width, height = (resolution, resolution) if isinstance(resolution, int) else resolution
    assert frame.shadow_map.shape == (1, height, width)
    nearest, farthest = cast_texels(scene, frame.light_matrix[0], linear_texels(frame))
    depth = frame.shadow_map[0]
    # Coordinates under a homography are relative to the eye, not to the middle of the map.
    # A steep triangle's depth takes up the rounding of a place: 1.8 * 2**-20 in one texel.
    tolerance = 2.0**-18 if method in HOMOGRAPHIES else 2.0**-19
    is_wrong = (depth < nearest - tolerance) | (depth > farthest + tolerance)
    # Where a warp's functions jump from row to row, float32 may take a texel for its neighbour's.
    assert np.mean(is_wrong) <= (0.005 if len(frame.warp_map) else 0.0)
    # Few texels leave a choice, and what is there is neither empty nor full.
    # A hair of one over the distance is more of a texel where that is small.
    most = 0.035 if method is lx.LogPerspective else 0.03
    assert np.mean(farthest - nearest > tolerance) < most
    assert np.mean(depth < 1.0) > 0.05


@pytest.mark.parametrize("cell", [0, 3, 7])
@pytest.mark.parametrize("method", [lx.RectilinearWarp, lx.NonOrthogonalWarp])
def test_a_cell_with_most_of_a_warp_holds_what_lies_there(method, cell):
    """The first and the last cell have an end of their functions each."""
    scene = lx.scenes.plane_and_box()
    camera = lx.Camera.look_at((0, 12, 0), (0, 0, 0), (0, 0, 1), yfov=0.5, width=96, height=96)
    weights = np.full((8, 8), 0.05)
    weights[cell, cell] = 1.0
    few = {"importance_resolution": 8, "map_weights": weights}
    chosen = {lx.RectilinearWarp: {"blur": 0.3}, lx.NonOrthogonalWarp: {"smoothing": 1}}[method]
    light = lx.DirectionalLight((0.4, -1.0, 0.0))
    frame = lx.render(scene, camera, light, method(resolution=96, **few, **chosen))
    (warp,) = frame.warp_map
    assert np.diff(warp, axis=-1).max(axis=-1)[:, cell if warp.shape[1] > 1 else 0].min() > 0.2
    nearest, farthest = cast_texels(scene, frame.light_matrix[0], linear_texels(frame))
    depth = frame.shadow_map[0]
    is_wrong = (depth < nearest - 2.0**-20) | (depth > farthest + 2.0**-20)
    assert np.mean(is_wrong) <= 0.005


def linear_texels(frame: lx.Frame) -> np.ndarray:
    """Where the matrix takes what is in the centre of each texel, [row, column], before any warp:
    (x, y)."""
    height, width = frame.shadow_map.shape[1:]
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    for along_x, along_y in frame.warp_map:
        y = inverse(along_y, x, y)
        x = inverse(along_x, y, x)
    row = y * height
    (projection,) = frame.projections
    if projection["kind"] == "log_perspective":
        # What the matrix gives for the row is one over the distance from the apex.
        row = np.exp((projection["centre"][1] - row) / projection["scale"][1])
    return np.stack([x * width, row], axis=-1)


def inverse(functions: np.ndarray, place: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Where the function at `place` across has the value."""
    count, boundaries = functions.shape
    index = np.minimum((place * count).astype(int), count - 1)
    ends = np.linspace(0, 1, boundaries)
    found = [np.interp(v, functions[i], ends) for i, v in zip(index.flat, value.flat, strict=True)]
    return np.reshape(found, value.shape)


def cast_texels(
    scene: lx.Scene, light_matrix: np.ndarray, texels: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Nearest depth on the rays of `texels` (x, y), in float64 over all triangles: with triangles a
    hair larger than they are, and a hair smaller. 1 where nothing is hit."""
    corners = scene.vertices[scene.faces]
    homogeneous = np.concatenate([corners, np.ones((*corners.shape[:2], 1))], axis=2)
    projected = homogeneous @ light_matrix.T
    # Homogeneous texels (x, y, w) and depths of the corners.
    places, depths = projected[..., [0, 1, 3]], projected[..., 2]
    # Of parallel rays one over w is linear in the texel: what of the rows makes the constant 1.
    rows = light_matrix[[0, 1, 3]]
    constant = np.linalg.lstsq(rows.T, np.array([0.0, 0.0, 0.0, 1.0]), rcond=None)[0]
    ends = np.concatenate([texels, np.ones((*texels.shape[:2], 1))], axis=-1)
    inverse_w = ends @ constant
    w = np.where(inverse_w > 0, 1.0 / inverse_w, np.nan)

    nearest, farthest = (np.ones(texels.shape[:2]) for _ in range(2))
    volume = np.linalg.det(places)
    usable = np.abs(volume) > 1e-12
    places, depths, volume = places[usable], depths[usable], volume[usable]
    for first in range(0, len(places), 64):
        part = slice(first, first + 64)
        p, q, r = np.moveaxis(places[part], 1, 0)
        # Edges opposite to each corner: twice the area beside them over the whole, in homogeneous
        # coordinates, so that no corner need be before the horizon.
        edges = np.stack([np.cross(q, r), np.cross(r, p), np.cross(p, q)], axis=1)
        weights = np.einsum("tec,xyc->texy", edges, ends) / volume[part, None, None, None]
        lengths = np.linalg.norm(edges[..., :2], axis=-1) / np.abs(volume[part])[:, None]
        inside = (weights / lengths[:, :, None, None]).min(axis=1)
        inside = np.where(np.isnan(w), -np.inf, inside)
        # The plane's depth; within the corners', as a texel beside a steep triangle is beside it.
        depth = np.nan_to_num(w * np.einsum("texy,te->txy", weights, depths[part]))
        p, q, r = depths[part].T
        lowest = np.minimum.reduce([p, q, r])[:, None, None]
        highest = np.maximum.reduce([p, q, r])[:, None, None]
        depth = np.clip(depth, lowest, highest)
        # Beyond the far side of the map's box nothing is stored.
        slack = 1e-6
        grown = np.where((inside > -1e-3) & (depth <= 1 + slack), depth, 1.0)
        shrunk = np.where((inside > 1e-3) & (depth <= 1 - slack), depth, 1.0)
        nearest = np.minimum(nearest, grown.min(axis=0))
        farthest = np.minimum(farthest, shrunk.min(axis=0))
    return nearest, farthest


@pytest.mark.parametrize("method", [*LINEAR, lx.MinimalShadowMap])
def test_the_light_matrix_takes_lit_receivers_into_the_map(method, view):
    frame = lx.render(*view, method(resolution=256))
    truth = lx.reference(*view)
    points = truth.position[truth.facing]
    texels = np.column_stack([points, np.ones(len(points))]) @ frame.light_matrix[0].T
    assert np.array_equal(texels[:, 3], np.ones(len(points)))
    assert (texels[:, :2] >= 0).all()
    assert (texels[:, :2] <= 256).all()
    assert ((texels[:, 2] > -1e-6) & (texels[:, 2] <= 1 + 1e-6)).all()
    # The nearest depth of the texel is the receiver's own where the light reaches it, give or take
    # what the surface rises within the texel; nearer to the light where it does not.
    column, row = texels[:, :2].astype(int).clip(0, 255).T
    stored = frame.shadow_map[0, row, column]
    lit = truth.visibility[truth.facing] == 1.0
    slope = 0.05
    assert np.mean(np.abs(stored - texels[:, 2])[lit] < slope) > 0.98
    assert np.mean((texels[:, 2] - stored)[~lit] > 0) > 0.98


def test_desired_view_spends_its_texels_on_what_is_seen():
    """The same map over a smaller box has finer texels."""
    scene = small("colonnade")
    camera, light = scene.cameras["default"].resized(WIDTH, HEIGHT), scene.lights["default"]
    uniform, fitted = (lx.render(scene, camera, light, method()) for method in LINEAR)
    assert uniform.max_effective_resolution == pytest.approx((1024, 1024), rel=1e-9)
    assert min(fitted.max_effective_resolution) > 1024
    assert np.nanmedian(fitted.aliasing_error) < np.nanmedian(uniform.aliasing_error)


@pytest.mark.parametrize("resolution", [1, 7, 512, 1000, (700, 90), (3, 500)])
def test_the_effective_resolution_of_a_uniform_map_is_its_resolution(resolution, view):
    frame = lx.render(*view, lx.Uniform(resolution=resolution))
    assert frame.max_effective_resolution == pytest.approx(frame.method.map_size, rel=1e-9)


@pytest.mark.parametrize("resolution", [300, (120, 500)])
def test_aliasing_error_of_a_plane(resolution):
    """m = (w_l / w_i) (cos theta_i / cos theta_l), with the width of a pixel's beam worked out from
    its corners."""
    vertices, faces = grid(1)
    scene = lx.Scene(20 * vertices, faces)
    camera = lx.Camera.look_at((0, 3, 5), (0.3, 0, 0), yfov=1.2, width=WIDTH, height=HEIGHT)
    light = lx.DirectionalLight((0.4, -1.0, -0.3))
    frame = lx.render(scene, camera, light, lx.Uniform(resolution=resolution))
    rows, columns = np.nonzero(frame.covered)
    points = frame.position[rows, columns]
    normal = np.array([0.0, 1.0, 0.0])

    # The beam of a texel, whose rays are parallel to the light: unproject the corners of one.
    world_from_texel = np.linalg.inv(frame.light_matrix[0])
    corner, right, down = (
        (world_from_texel @ [*at, 0.5, 1.0])[:3] for at in ((10, 10), (11, 10), (10, 11))
    )
    texel_area = abs(np.dot(np.cross(right - corner, down - corner), light.direction))

    # The beam of a pixel: its corners, on rays as long as the one through its centre.
    to_points = points - camera.eye
    distance = np.linalg.norm(to_points, axis=1)
    rotation = camera.pose[:3, :3]

    def ray(column, row):
        x = (column - camera.centre[0]) / camera.focal[0]
        y = -(row - camera.centre[1]) / camera.focal[1]
        direction = np.column_stack([x, y, -np.ones_like(x)]) @ rotation.T
        return direction / np.linalg.norm(direction, axis=1, keepdims=True)

    edges = [
        distance[:, None] * (ray(columns + a, rows + b) - ray(columns + c, rows + d))
        for a, b, c, d in ((1.0, 0.5, 0.0, 0.5), (0.5, 1.0, 0.5, 0.0))
    ]
    pixel_area = np.abs(np.einsum("nc,nc->n", np.cross(*edges), to_points / distance[:, None]))

    cos_i = np.abs(to_points @ normal) / distance
    cos_l = abs(light.direction @ normal)
    expected = np.sqrt(texel_area / pixel_area) * cos_i / cos_l
    assert np.allclose(frame.aliasing_error[rows, columns], expected, rtol=1e-3)
    assert np.isnan(frame.aliasing_error[~frame.covered]).all()


@pytest.mark.parametrize("method", ["uniform", "desired_view", "psm", "lispsm", "trapezoidal"])
@pytest.mark.parametrize(("width", "height"), [(300, 300), (400, 90)])
def test_largest_aliasing_error_of_a_frustum(view, method, width, height):
    """From the matrices alone: a texel's sides by unprojecting its neighbours at the point's depth,
    a pixel's width by the area of its beam."""
    scene, camera, light = view
    frame = lx.render(scene, camera, light, method, resolution=(width, height))
    matrix = frame.light_matrix[0]
    inverse = np.linalg.inv(matrix)
    near, far = np.nanmin(frame.depth), np.nanmax(frame.depth)
    share = (np.arange(32) + 0.5) / 32
    depth, y, x = np.meshgrid(
        near * (far / near) ** (np.arange(32) / 31),
        (share * camera.height - camera.centre[1]) / camera.focal[1],
        (share * camera.width - camera.centre[0]) / camera.focal[0],
        indexing="ij",
    )
    rays = np.stack([x, -y, -np.ones_like(x)], axis=-1) @ camera.pose[:3, :3].T
    points = camera.eye + depth[..., None] * rays
    # The plane of pixels at that depth, seen at an angle.
    pixel = depth / np.sqrt(np.prod(camera.focal) * np.linalg.norm(rays, axis=-1))
    column, row, stored, w = np.moveaxis(points @ matrix[:, :3].T + matrix[:, 3], -1, 0)
    column, row = column / w, row / w
    inside = (w > 0) & (column >= 0) & (column <= width) & (row >= 0) & (row <= height)
    assert inside.sum() > 1000

    def world(column, row):
        place = column[..., None] * inverse[:, 0] + row[..., None] * inverse[:, 1] + inverse[:, 3]
        at_depth = stored[..., None] * inverse[:, 2]
        weight = (1.0 - at_depth[..., 3]) / place[..., 3]
        return (weight[..., None] * place + at_depth)[..., :3]

    def side(dx, dy):
        h = 1e-3
        along = world(column + dx * h, row + dy * h) - world(column - dx * h, row - dy * h)
        across = along - (along @ light.direction)[..., None] * light.direction
        return np.linalg.norm(across, axis=-1) / (2 * h)

    expected = (np.maximum(side(1, 0), side(0, 1)) / pixel)[inside].max()
    assert frame.largest_aliasing_error == pytest.approx(expected, rel=1e-3)


def test_largest_aliasing_error_of_what_is_not_there(view):
    scene, camera, light = view
    assert np.isnan(lx.render(scene, camera, light, "exact").largest_aliasing_error)
    away = camera.posed(np.diag([1.0, -1.0, -1.0, 1.0]) @ camera.pose)
    assert np.isnan(lx.render(scene, away, light, "desired_view").largest_aliasing_error)
    # A culled cell has no texels.
    coarse = lx.render(scene, camera, light, lx.RectilinearWarp(resolution=256))
    assert 1.0 < coarse.largest_aliasing_error < 10.0


def test_a_perspective_across_the_light_has_a_smaller_largest_error():
    """What it is for: the light from above, the view along the ground."""
    scene = lx.scenes.objects_on_floor(count=25, subdivisions=1)
    camera = lx.Camera.look_at((0, 1.2, 9), (0, 0.8, 0), yfov=0.9, width=WIDTH, height=HEIGHT)
    light = lx.DirectionalLight((0.05, -1.0, 0.02))
    focused, warped = (
        lx.render(scene, camera, light, method).largest_aliasing_error
        for method in ("focused", "lispsm")
    )
    assert warped < 0.8 * focused


# --- No acne, no gap ---


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("degrees", [90, 45, 10, 5, 2, 1])
@pytest.mark.parametrize("cells", [1, 150], ids=["quad", "tessellated"])
def test_a_lit_plane_never_shadows_itself(method, degrees, cells):
    vertices, faces = grid(cells)
    covered = 0
    # Small triangles take time; that a map may be turned in any way shows with large ones.
    seeds = 4 if cells == 1 else 2
    for seed in range(seeds):
        rotation = turn(seed)
        scene = lx.Scene(vertices @ rotation.T, faces)
        for azimuth in (0.3, 2.0, 4.5):
            low = math.radians(degrees)
            towards = (
                math.cos(low) * math.cos(azimuth),
                -math.sin(low),
                math.cos(low) * math.sin(azimuth),
            )
            light = lx.DirectionalLight(rotation @ towards)
            for eye in ((0.2, 1.5, 1.9), (0.9, 0.05, 0.9)):
                camera = lx.Camera.look_at(
                    rotation @ eye,
                    rotation @ (0, 0, 0),
                    rotation @ (0, 1, 0),
                    yfov=1.0,
                    width=WIDTH,
                    height=HEIGHT,
                )
                for resolution in (64, 1024, (64, 8), (8, 64)):
                    visibility = lx.render_shadows(
                        scene, camera, light, method(resolution=resolution)
                    )
                    false_shadow = np.count_nonzero(visibility == 0.0)
                    assert false_shadow == 0, (seed, azimuth, eye, resolution, false_shadow)
                    covered += np.count_nonzero(visibility == 1.0)
    assert covered > 0.1 * seeds * 24 * WIDTH * HEIGHT


@pytest.mark.parametrize("method", METHODS)
def test_a_constant_bias_of_nothing_is_full_of_acne(method):
    """What the test above would see if the bias did nothing; its default does for a high light."""
    vertices, faces = grid(1)
    scene = lx.Scene(vertices, faces)
    camera = lx.Camera.look_at((0.2, 1.5, 1.9), (0, 0, 0), yfov=1.0, width=WIDTH, height=HEIGHT)

    def acne(direction, **bias):
        chosen = method(resolution=64, lookup="depth", bias="constant", **bias)
        visibility = lx.render_shadows(scene, camera, lx.DirectionalLight(direction), chosen)
        return np.mean(visibility[~np.isnan(visibility)] == 0.0)

    assert acne((1, -0.2, 0.3), constant_bias=0.0) > 0.2
    assert acne((0.5, -1, 0.3), constant_bias=0.0) > 0.2
    # The default is the width of an even texel; a warp widens a few of its own.
    assert acne((0.5, -1, 0.3)) < 0.002


@pytest.mark.parametrize("method", [lx.Uniform, lx.DesiredView])
@pytest.mark.parametrize("azimuth", [0.0, 0.3, 2.0, 4.5])
@pytest.mark.parametrize("resolution", [64, (256, 32), (32, 256)])
def test_a_slope_bias_takes_off_what_a_texel_rises(method, azimuth, resolution):
    vertices, faces = grid(1)
    camera = lx.Camera.look_at((0.2, 1.5, 1.9), (0, 0, 0), yfov=1.0, width=WIDTH, height=HEIGHT)
    for seed in range(4):
        rotation = turn(seed)
        scene = lx.Scene(vertices @ rotation.T, faces)
        seen_by = camera.posed(np.block([[rotation, np.zeros((3, 1))], [0, 0, 0, 1]]) @ camera.pose)
        for degrees in (60, 30, 10, 3):
            low = math.radians(degrees)
            across = math.cos(low) * np.array((math.cos(azimuth), 0.0, math.sin(azimuth)))
            light = lx.DirectionalLight(rotation @ (across - (0.0, math.sin(low), 0.0)))
            chosen = method(resolution=resolution, lookup="depth", bias="slope")
            visibility = lx.render_shadows(scene, seen_by, light, chosen)
            assert np.count_nonzero(visibility == 1.0) > 0.1 * WIDTH * HEIGHT
            assert not (visibility == 0.0).any(), (seed, degrees)


@pytest.mark.parametrize("method", [lx.Uniform, lx.DesiredView])
@pytest.mark.parametrize("light", [(0.3, -1.0, 0.2), "point"])
def test_the_automatic_bias_spares_hills_whose_triangles_are_smaller_than_texels(method, light):
    """Neighbours' planes differ: with the receiver's plane alone a third of the lit pixels are in
    false shadow."""
    scene = lx.scenes.terrain(cells=200)
    camera = scene.cameras["default"].resized(160, 90)
    point_light = lx.PointLight(np.add(camera.eye, (0.5, 1.0, 0.7)))
    chosen = point_light if light == "point" else lx.DirectionalLight(light)
    truth = lx.reference(scene, camera, chosen)
    false_shadow = {
        bias: lx.compare(
            lx.render_shadows(
                scene, camera, chosen, method(resolution=128, lookup="depth", bias=bias)
            ),
            truth,
        ).false_shadow_count
        for bias in ("auto", "receiver_plane")
    }
    lit = np.count_nonzero(truth.visibility == 1.0)
    assert false_shadow["receiver_plane"] > 0.2 * lit
    # Close to the light a texel of the cube's faces is seen at a grazing angle.
    assert false_shadow["auto"] <= (0.03 * lit if light == "point" else 0)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("resolution", [64, 256, 1024, (512, 64)])
@pytest.mark.parametrize("direction", [(0.2, -1, -1), (0.0, -0.3, -1), (0.5, -3, -1)])
def test_no_gap_at_a_contact_is_wider_than_a_texel(method, resolution, direction):
    """A thin wall stands on a floor: the shadow begins at its foot."""
    vertices, faces = grid(1)
    wall = np.array([[-1, 0, 0], [1, 0, 0], [1, 1, 0], [-1, 1, 0]])
    scene = lx.Scene(
        np.concatenate([4 * vertices, wall]), np.concatenate([faces, [[4, 5, 6], [4, 6, 7]]])
    )
    # From the shadow's side, down on the foot of the wall.
    camera = lx.Camera.look_at((0, 0.6, -0.5), (0, 0, -0.02), yfov=0.9, width=640, height=360)
    light = lx.DirectionalLight(direction)
    frame = lx.render(scene, camera, light, one_map(method, resolution))
    truth = lx.reference(scene, camera, light)
    floor = (truth.triangle_id >= 0) & (truth.triangle_id < 2)
    # The half of the shadow that is at the foot, away from the ends of the wall.
    reach = direction[2] / direction[1]
    x, z = truth.position[..., 0], truth.position[..., 2]
    near = floor & (np.abs(x) < 0.5) & (z < 0) & (z > -0.5 * reach)
    assert (truth.visibility[near & ~truth.tie] == 0.0).all()
    assert np.count_nonzero(near) > 10_000
    gap = -z[near & (frame.visibility == 1.0)].min(initial=0.0)
    footprint = footprint_on_floor(frame.light_matrix[0])
    print(f"gap {gap:.5f}, a texel's footprint {footprint:.5f}: {gap / footprint:.2f}")
    assert gap <= footprint


def footprint_on_floor(light_matrix: np.ndarray) -> float:
    """Diameter of the parallelogram that one texel covers on the plane y = 0, at the origin."""
    rows, w = light_matrix[:2], light_matrix[3]
    texels_per_unit = (rows[:, :3] - np.outer(rows[:, 3] / w[3], w[:3])) / w[3]
    floor_from_texel = np.linalg.inv(texels_per_unit[:, [0, 2]])
    return max(np.linalg.norm(floor_from_texel @ diagonal) for diagonal in ((1, 1), (1, -1)))


# --- What needs no lookup, or no map ---


def test_receivers_that_face_away_are_in_shadow_whatever_the_map_says():
    """A closed box: its sides away from the light are dark, though nothing but themselves is
    between them and the light."""
    scene = small("plane_and_box")
    light = scene.lights["default"]
    for eye in ((4, 5, 8), (8, 1, -6), (3, -4, 2)):
        camera = lx.Camera.look_at(eye, (0, 0.5, 0), yfov=0.9, width=WIDTH, height=HEIGHT)
        for method in METHODS:
            chosen = method(resolution=32, lookup="depth", bias="constant", constant_bias=100.0)
            frame = lx.render(scene, camera, light, chosen)
            away = frame.covered & ~frame.facing
            assert away.any()
            assert (frame.visibility[away] == 0.0).all()
            # With such a bias every lookup says lit.
            assert (frame.visibility[frame.facing] == 1.0).all()


def test_a_frame_that_faces_away_needs_no_shadow_map():
    scene = small("plane_and_box")
    camera = lx.Camera.look_at((0, -5, 1), (0, 0, 0), yfov=0.9, width=WIDTH, height=HEIGHT)
    frame = lx.render(scene, camera, scene.lights["default"], "desired_view")
    assert frame.covered.any()
    assert (frame.visibility[frame.covered] == 0.0).all()
    assert np.array_equal(np.isnan(frame.visibility), ~frame.covered)
    assert "shadow map" not in frame.timings
    assert "shadow map" in frame.stats["skipped"]
    assert frame.stats["layers"] == 0
    assert frame.stats["facing_pixels"] == 0
    assert frame.stats["covered_pixels"] == np.count_nonzero(frame.covered)
    assert frame.shadow_map.size == 0
    assert frame.light_matrix.shape == (0, 4, 4)
    assert np.isnan(frame.aliasing_error).all()
    assert np.isnan(frame.max_effective_resolution).all()
    frame.to_image()


@pytest.mark.parametrize("method", METHODS)
def test_a_view_of_nothing_is_all_nan(method):
    scene = small("plane_and_box")
    camera = lx.Camera.look_at((0, 5, 0), (1, 9, 0), yfov=0.9, width=WIDTH, height=HEIGHT)
    frame = lx.render(scene, camera, scene.lights["default"], method())
    assert np.isnan(frame.visibility).all()
    assert (frame.triangle_id == -1).all()
    assert np.isnan(frame.position).all()
    if "visibility" in frame.stats:
        assert frame.stats["visibility"]["rasterized"] == 0
    if method is lx.DesiredView:
        assert "shadow map" not in frame.timings
    assert not lx.compare(frame, lx.reference(scene, camera, scene.lights["default"])).covered.any()
    assert (frame.to_image() == 255).all()


def test_a_stage_that_is_not_needed_has_no_time():
    scene = small("plane_and_box")
    camera, light = scene.cameras["default"].resized(WIDTH, HEIGHT), scene.lights["default"]
    uniform = lx.render(scene, camera, light, "uniform")
    assert "receivers" not in uniform.timings
    assert "receivers" in uniform.stats["skipped"]
    fitted = lx.render(scene, camera, light, "desired_view")
    assert {"receivers", "shadow map", "lookup"} <= set(fitted.timings)
    assert "visibility" not in fitted.timings
    assert fitted.stats["skipped"] == ["visibility"]


# --- Culling ---


@pytest.mark.not_on_cpu("it counts the triangles of the shaders")
def test_casters_that_reach_no_receiver_are_culled_and_not_missed():
    """Nine floors of objects side by side, and a camera that sees a part of the middle one."""
    scene = small("objects_on_floor")
    offsets = [(30 * i, 0, 30 * j) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]
    vertices, faces = scene.vertices, scene.faces.astype(np.int64)
    parts = [vertices, *(vertices + np.array(o) for o in offsets)]
    crowd = lx.Scene(
        np.concatenate(parts),
        np.concatenate([faces + i * len(vertices) for i in range(len(parts))]),
    )
    camera = lx.Camera.look_at((0, 4, 4.5), (0, 0, 0), yfov=0.6, width=480, height=270)
    light = scene.lights["default"]
    method = lx.DesiredView(resolution=1024)
    frame = lx.render(crowd, camera, light, method)
    culled = frame.stats["shadow map"]
    # Eight of nine copies lie outside, and most of the ninth.
    assert culled["rasterized"] < 0.1 * crowd.triangle_count
    assert sum(culled[k] for k in ("rasterized", "culled_outside", "culled_by_depth")) == (
        crowd.triangle_count
    )
    # Casters outside the camera's view, which it sees only the shadows of, are not culled.
    seen = np.unique(frame.triangle_id[frame.covered])
    assert culled["rasterized"] > len(seen)
    result = lx.compare(frame, lx.reference(crowd, camera, light))
    print(result)
    assert result.rate_covered < 0.01
    alone = lx.render(scene, camera, light, method)
    assert np.mean(alone.visibility != frame.visibility) < 1e-4


def test_a_caster_beyond_the_view_and_far_up_still_casts():
    """A roof between the light and what is seen, a thousand units up."""
    vertices, faces = grid(1)
    roof = vertices * 50 + (0, 1000, 0)
    scene = lx.Scene(np.concatenate([vertices * 10, roof]), np.concatenate([faces, faces + 4]))
    camera = lx.Camera.look_at((0, 3, 4), (0, 0, 0), yfov=0.7, width=WIDTH, height=HEIGHT)
    for method in METHODS:
        visibility = lx.render_shadows(scene, camera, lx.DirectionalLight((0, -1, 0)), method())
        assert (visibility == 0.0).mean() > 0.9
        # Below the floor it casts on nothing.
        below = lx.Scene(
            np.concatenate([vertices * 10, roof - (0, 2000, 0)]), np.concatenate([faces, faces + 4])
        )
        assert (
            lx.render_shadows(below, camera, lx.DirectionalLight((0, -1, 0)), method()) == 1.0
        ).mean() > 0.9
