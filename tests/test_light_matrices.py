"""Light matrices: what they hold, how good they are, and what is kept of the frame before."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from views import small

import lixel as lx

MATRIX_METHODS = [
    lx.Focused,
    lx.LightSpacePerspective,
    lx.Trapezoidal,
    lx.PerspectiveShadowMap,
    lx.PlaneOptimal,
    lx.SceneOptimized,
]


@pytest.fixture(scope="module")
def objects() -> tuple[lx.Scene, lx.Camera]:
    scene = small("objects_on_floor")
    return scene, scene.cameras["default"].resized(240, 180)


def texels(frame: lx.Frame, points: np.ndarray) -> np.ndarray:
    """Places (x, y) in the map, nan behind its horizon."""
    homogeneous = np.concatenate([points, np.ones((*points.shape[:-1], 1))], axis=-1)
    x, y, _, w = np.moveaxis(homogeneous @ frame.light_matrix[0].T, -1, 0)
    return np.stack([x, y], axis=-1) / np.where(w > 0, w, np.nan)[..., None]


@pytest.mark.parametrize("direction", [(0.3, -1, 0.2), (-0.9, -0.3, 0.1), (0.1, -0.15, -1)])
@pytest.mark.parametrize("fit", ["receivers", "frustum"])
@pytest.mark.parametrize(
    "method", [lx.Focused, lx.LightSpacePerspective, lx.Trapezoidal, lx.PerspectiveShadowMap]
)
def test_what_is_seen_is_in_the_map(method, fit, direction, objects):
    frame = lx.render(*objects, lx.DirectionalLight(direction), method(resolution=200, fit=fit))
    places = texels(frame, frame.position[frame.facing])
    held = ((places >= 0) & (places <= 200)).all(axis=-1)
    # Between the samples something may stick out, of the frustum nothing may.
    assert held.mean() > (0.999 if fit == "receivers" else 0.999999)


@pytest.mark.parametrize("method", MATRIX_METHODS)
@pytest.mark.parametrize("light", [(0.5, -1, -0.3), (-0.4, -0.2, 0.9)])
def test_the_aliasing_error_is_the_footprint_of_a_texel(method, light, objects):
    """m = (w_l / w_i) (cos i / cos l), widths across the beams as roots of their areas. On the
    surface both areas are over their cosines, and their quotient is one over the determinant of the
    Jacobian of the map by the image; that by finite differences over neighbouring pixels."""
    frame = lx.render(*objects, lx.DirectionalLight(light), method(resolution=200))
    places = texels(frame, frame.position)
    along_x = 0.5 * (places[1:-1, 2:] - places[1:-1, :-2])
    along_y = 0.5 * (places[2:, 1:-1] - places[:-2, 1:-1])
    area = along_x[..., 0] * along_y[..., 1] - along_x[..., 1] * along_y[..., 0]
    error = frame.aliasing_error[1:-1, 1:-1]
    normal = frame.normal
    is_flat = frame.facing[1:-1, 1:-1]
    for rows, columns in ((0, 1), (2, 1), (1, 0), (1, 2)):
        part = (slice(rows, rows + 178), slice(columns, columns + 238))
        is_flat = is_flat & (np.abs(normal[part] - normal[1:-1, 1:-1]).max(axis=-1) < 1e-6)
    is_flat &= np.isfinite(area) & (np.abs(area) > 0)
    to_light, to_eye = -np.array(light), objects[1].eye - frame.position[1:-1, 1:-1][is_flat]
    surface = normal[1:-1, 1:-1][is_flat]
    cos_light = surface @ to_light / np.linalg.norm(to_light)
    cos_eye = (surface * to_eye).sum(axis=-1) / np.linalg.norm(to_eye, axis=-1)
    expected = np.sqrt(cos_eye / cos_light / np.abs(area[is_flat]))
    ratio = error[is_flat] / expected
    assert is_flat.sum() > 1000
    # Depth steps between coplanar surfaces, and the curvature of a perspective, remain.
    assert np.mean(np.abs(ratio - 1) < 0.05) > 0.95


def test_receivers_without_a_place_on_the_plane_have_a_map_of_their_own():
    """The light moves them behind the camera, or far before what is seen of the plane."""
    scene = lx.scenes.colonnade()
    view = (
        scene,
        scene.cameras["default"].resized(240, 135),
        lx.DirectionalLight((0.05, -0.15, 1.0)),
    )
    truth = lx.reference(*view)
    frames = {
        fit: lx.render(*view, lx.PlaneOptimal(resolution=512, fit=fit))
        for fit in ("receivers", "frustum")
    }
    assert len(frames["receivers"].light_matrix) == 2
    assert len(frames["frustum"].light_matrix) == 1
    wrong = {fit: lx.compare(frame, truth) for fit, frame in frames.items()}
    focused = lx.compare(lx.render(*view, lx.Focused(resolution=512)), truth)
    assert wrong["receivers"].misclassified_count < 1.5 * focused.misclassified_count
    assert wrong["frustum"].false_lit_count > 4 * wrong["receivers"].false_lit_count


@pytest.mark.parametrize("height", [0.02, 0.5])
def test_the_plane_is_the_one_that_most_light_falls_on(height):
    """A low sun lights the wall more than the floor, which has more pixels."""
    floor = [(-5, 0, -5), (5, 0, -5), (5, 0, 5), (-5, 0, 5)]
    wall = [(-5, 0, -5), (5, 0, -5), (5, 4, -5), (-5, 4, -5)]
    faces = [(0, 2, 1), (0, 3, 2), (4, 5, 6), (4, 6, 7)]
    scene = lx.Scene(np.array(floor + wall, float), np.array(faces))
    camera = lx.Camera.look_at((0, 3, 8), (0, 1, -5), yfov=1.0, width=160, height=120)
    frame = lx.render(scene, camera, lx.DirectionalLight((0, -height, -1)), lx.PlaneOptimal())
    plane = wall if height == 0.02 else floor
    points = np.mean([np.roll(plane, k, axis=0) for k in (0, 0, 1)], axis=0)
    # Even: w is the depth in the image, so that it takes texels to pixels by the same matrix.
    w = np.concatenate([points, np.ones((len(points), 1))], 1) @ frame.light_matrix[0][3]
    depth = (points - camera.eye) @ -camera.pose[:3, 2]
    np.testing.assert_allclose(w / depth, w[0] / depth[0], rtol=1e-6)


def test_the_optimizer_lowers_h_and_the_simplex_lowers_it_further(objects):
    for direction in [(0.3, -1, 0.2), (-0.9, -0.3, 0.1), (0.1, -0.15, -1), (0.0, -0.2, -1)]:
        light = lx.DirectionalLight(direction)
        h = {}
        for optimizer in ("paper", "simplex"):
            method = lx.SceneOptimized(resolution=200, optimizer=optimizer)
            frame = lx.render(*objects, light, method)
            h[optimizer] = frame.stats["h"]
            assert np.isfinite(frame.light_matrix).all()
            assert "fit light matrix (CPU)" in frame.timings
        assert 0 < h["simplex"] <= h["paper"]


def test_the_map_holds_the_samples_that_are_chosen():
    scene = small("plane_and_box")
    view = scene, scene.cameras["default"].resized(240, 180)
    light = lx.DirectionalLight((0.4, -1, 0.2))
    held = {}
    for samples in ("boundary", "shadow", "facing"):
        method = lx.SceneOptimized(resolution=200, samples=samples)
        frame = lx.render(*view, light, method)
        places = texels(frame, frame.position[frame.facing])
        held[samples] = ((places >= 0) & (places <= 200)).all(axis=-1).mean()
    # Far from the shadow there is much of the floor, and no sample of the boundary.
    assert held["facing"] > 0.99
    assert held["boundary"] <= held["shadow"] < 0.5


def test_a_matrix_is_reused_until_a_new_one_is_much_better(objects):
    scene, camera = objects
    light = lx.DirectionalLight((0.4, -1, 0.2))
    first = lx.render(scene, camera, light, lx.SceneOptimized(resolution=200))

    def axis(frame):
        return frame.light_matrix[0, 3] / np.linalg.norm(frame.light_matrix[0, 3, :3])

    # A step to the side: the optical axis stays where it was.
    pose = camera.pose.copy()
    pose[:3, 3] += 0.02 * pose[:3, 0]
    moved = lx.Camera(pose, focal=camera.focal, centre=camera.centre, width=240, height=180)
    kept = lx.render(scene, moved, light, lx.SceneOptimized(resolution=200, previous=first))
    assert np.allclose(axis(kept)[:3], axis(first)[:3], atol=1e-6)
    # A matrix that squeezes what is near is not.
    worse = first.light_matrix[0].copy()
    away = np.linalg.norm(worse[3, :3]) * -worse[3, :3] / np.linalg.norm(worse[3, :3])
    worse[3, :3] = 0.3 * away
    chosen = lx.render(scene, camera, light, lx.SceneOptimized(resolution=200, previous=worse))
    assert np.allclose(chosen.light_matrix, first.light_matrix)


def test_previous_is_checked():
    with pytest.raises(ValueError, match=r"previous must be .* got shape \(3, 3\)"):
        lx.SceneOptimized(previous=np.eye(3))
    with pytest.raises(TypeError, match=r"previous must be a frame or .*, got 'frame'"):
        lx.SceneOptimized(previous="frame")


@pytest.mark.parametrize("method", [*MATRIX_METHODS, lx.Cascades])
@pytest.mark.parametrize("kind", ["point above", "point among", "spot"])
def test_lights_with_a_position(method, kind, objects):
    light = {
        "point above": lx.PointLight((2.0, 9.0, -3.0)),
        "point among": lx.PointLight((0.5, 1.2, 0.3)),
        "spot": lx.SpotLight((3.0, 7.0, 2.0), (-0.4, -1.0, -0.3), outer=0.6),
    }[kind]
    truth = lx.reference(*objects, light)
    wrong = lx.compare(lx.render(*objects, light, method(resolution=512)), truth)
    # A share of what a map of nothing would get wrong; a plane's texels are few off the plane.
    dark = np.count_nonzero((truth.visibility == 0.0) & truth.facing)
    assert wrong.misclassified_count < (0.4 if method is lx.PlaneOptimal else 0.1) * dark


@pytest.mark.parametrize("fit", ["lispsm", "trapezoidal", "scene_optimized"])
@pytest.mark.parametrize("warp", [lx.NonOrthogonalWarp, lx.RectilinearWarp])
def test_warps_compose_with_light_matrices(fit, warp, objects):
    directions = [(0.4, -1, 0.2), (-0.4, -1, 0.2), (0.1, -1, 0.5), (0.7, -0.6, -0.2)]
    composed = warp(fit=fit, resolution=100)
    alone = dataclasses.replace(lx.method_from(fit), resolution=100)
    wrong = dict.fromkeys(("uniform", "fit", "composed"), 0)
    for direction in directions:
        light = lx.DirectionalLight(direction)
        truth = lx.reference(*objects, light)
        frame = lx.render(*objects, light, composed)
        assert len(frame.warp_map) == 1
        assert not np.allclose(frame.light_matrix[0, 3], (0, 0, 0, 1))
        wrong["composed"] += lx.compare(frame, truth).misclassified_count
        for name, method in (("uniform", lx.Uniform(resolution=100)), ("fit", alone)):
            found = lx.render_shadows(*objects, light, method)
            wrong[name] += lx.compare(found, truth).misclassified_count
    # A warp adds to what the fit has done. One that does it again has about twice the wrong pixels
    # of the fit.
    assert wrong["composed"] < wrong["uniform"]
    assert wrong["composed"] < 1.25 * wrong["fit"]


@pytest.mark.parametrize(
    "splits", ["receivers", "quantiles", "practical", "logarithmic", "uniform"]
)
@pytest.mark.parametrize("layers", [1, 3, 8])
def test_cascades_are_split_by_depth(splits, layers, objects):
    light = lx.DirectionalLight((0.4, -1, 0.2))
    frame = lx.render(*objects, light, lx.Cascades(layers=layers, splits=splits, resolution=128))
    assert frame.stats["layers"] + frame.stats["skipped_layers"] == layers
    assert len(frame.shadow_map) == frame.stats["layers"]
    # Texels grow from layer to layer where the splits are made for it.
    widths = 1.0 / np.linalg.norm(frame.light_matrix[:, 0, :3], axis=-1)
    if splits == "receivers" and layers > 1:
        assert widths[-1] > 2 * widths[0]


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({"layers": 0}, "layers must be .* from 1 to 8, got 0"),
        ({"layers": 9}, "layers must be .* from 1 to 8, got 9"),
        ({"weight": 1.5}, "weight must be a number from 0 to 1, got 1.5"),
        ({"splits": "even"}, "splits must be one of 'receivers'"),
    ],
)
def test_bad_cascades_are_named(parameters, words):
    with pytest.raises(ValueError, match=words):
        lx.Cascades(**parameters)


@pytest.mark.parametrize("direction", [(0.3, -1, 0.2), (-0.5, -0.7, 0.6), (0.2, -0.5, -0.8)])
def test_a_frustum_that_begins_at_the_eye_leaves_texels_for_what_is_seen(direction):
    """Without a near plane of the user's, the frustum's apex is among the columns."""
    scene = small("colonnade")
    low, high = scene.bounds
    middle = 0.5 * (low + high)
    eye = (0.6 * low[0] + 0.4 * middle[0], 0.6 * middle[1], 1.02 * middle[2])
    target = (high[0], 0.3 * middle[1], middle[2] + 0.5)
    camera = lx.Camera.look_at(eye, target, yfov=1.0, width=320, height=180)
    light = lx.DirectionalLight(direction)
    truth = lx.reference(scene, camera, light)
    focused, lispsm, trapezoidal = (
        lx.compare(lx.render(scene, camera, light, method), truth).misclassified_count
        for method in (
            lx.Focused(fit="frustum", resolution=512),
            lx.LightSpacePerspective(fit="frustum", resolution=512),
            lx.Trapezoidal(fit="frustum", resolution=512),
        )
    )
    assert truth.covered.mean() > 0.5
    assert max(lispsm, trapezoidal) < 3 * focused + 50
