"""Lights far away: the sun as a lamp. The answers are computed here, by rays in numpy."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import lixel as lx

TO_SUN = np.array([0.4, 0.8, 0.45]) / np.linalg.norm([0.4, 0.8, 0.45])
FLOOR = 20.0
PLATE, HEIGHT = 2.0, 4.0
DISTANCES = [3e2, 1e3, 1e5, 1e8, 1.496e11, 1e15]
COMPOSED = [
    "cube+notw",
    "cube+rtw",
    "dual_paraboloid+notw",
    "improved_paraboloid+notw",
    "spot+rtw",
    "lispsm+notw",
    "trapezoidal+notw",
    "log_psm",
    "log_psm+notw",
    "scene_optimized+notw",
    "min_sm+rtw",
]
VARIANTS = [
    lx.Cube(cut="face"),
    lx.Cube(turned=True, snap=True),
    lx.DualParaboloid(cut="receivers"),
    lx.ImprovedParaboloid(cut="cone"),
    lx.ImprovedParaboloid(cut="frustum"),
    lx.Focused(fit="frustum"),
    lx.PlaneOptimal(fit="frustum"),
    lx.DesiredView(snap=True, lookup="depth"),
    lx.DesiredView(rasterization="linear"),
    lx.RectilinearWarp(analysis="forward"),
    lx.Exact(warp="notw"),
]


def plate_over_floor() -> lx.Scene:
    corners = np.array([(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)], float)
    floor, plate = FLOOR * corners, PLATE * corners + (0, HEIGHT, 0)
    return lx.Scene(np.concatenate([floor, plate]), [[0, 2, 1], [0, 3, 2], [4, 6, 5], [4, 7, 6]])


def camera(**options) -> lx.Camera:
    return lx.Camera.look_at((12, 14, 16), (0, 0, 0), yfov=0.9, width=240, height=135, **options)


def floor_in_shadow(eye: lx.Camera, light: lx.Light) -> tuple[np.ndarray, np.ndarray]:
    """(H, W) bool, whether a pixel's point of the floor is in the plate's shadow, and whether it is
    farther than a hundredth of a unit from the shadow's edge and sees the floor. The plate's shadow
    is where the ray to the light crosses the plate's plane within the plate."""
    rows, columns = np.mgrid[: eye.height, : eye.width] + 0.5
    right, up, back = eye.pose[:3, :3].T
    rays = (
        (columns - eye.centre[0])[..., None] / eye.focal[0] * right
        - (rows - eye.centre[1])[..., None] / eye.focal[1] * up
        - back
    )
    steps = -eye.eye[1] / rays[..., 1]
    floor = eye.eye + rays * steps[..., None]
    at_plate = eye.eye + rays * ((HEIGHT - eye.eye[1]) / rays[..., 1])[..., None]
    sees_plate = (np.abs(at_plate[..., [0, 2]]) < PLATE + 0.05).all(axis=-1)
    sees_floor = (steps > 0) & (np.abs(floor[..., [0, 2]]) < FLOOR).all(axis=-1) & ~sees_plate
    if isinstance(light, lx.DirectionalLight):
        crossing = floor + TO_SUN * (HEIGHT / TO_SUN[1])
    else:
        position = np.asarray(light.position, float)
        crossing = floor + (position - floor) * (HEIGHT / position[1])
    beyond = np.abs(crossing[..., [0, 2]]).max(axis=-1) - PLATE
    return beyond < 0, sees_floor & (np.abs(beyond) > 0.01)


def wrong(light: lx.Light, method: str | lx.Method) -> int:
    scene, eye = plate_over_floor(), camera()
    visibility = lx.render_shadows(scene, eye, light, method)
    dark, is_clear = floor_in_shadow(eye, light)
    assert 100 < np.count_nonzero(dark & is_clear) < 1000
    return int(np.count_nonzero(((visibility == 0) != dark) & is_clear))


def takes_points() -> list[str]:
    return [
        name
        for name in [*lx.METHODS, *COMPOSED]
        if lx.method_from(name).takes(lx.PointLight((0, 1, 0)))
    ]


def name_of(value) -> str:
    if isinstance(value, lx.Method):
        chosen = {"cut", "fit", "snap", "rasterization", "analysis", "warp"}
        given = [str(v) for k, v in value.parameters().items() if k in chosen]
        return "-".join([value.name, *given])
    return str(value)


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("method", [*takes_points(), *VARIANTS], ids=name_of)
def test_a_lamp_far_away_casts_the_shadow_of_the_sun(method, distance):
    assert wrong(lx.PointLight(TO_SUN * distance), method) <= 2


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize("method", ["spot", "spot+notw", "exact", "uniform", "focused", "cube"])
def test_spots_and_hemispheres_far_away(method, distance):
    position = TO_SUN * distance
    assert wrong(lx.SpotLight(position, -TO_SUN, 0.5), method) <= 2
    if method not in ("spot", "spot+notw"):
        assert wrong(lx.HemisphereLight(position, -TO_SUN), method) <= 2


@pytest.mark.parametrize("distance", [1e3, 1e5, 1e7])
@pytest.mark.parametrize("method", ["exact", "ray_traced", "spot", "desired_view"])
def test_the_rim_of_a_far_cone_is_where_it_is(method, distance):
    """Narrow, and half of space: both end in the middle of the floor."""
    scene, eye = plate_over_floor(), camera()
    position = TO_SUN * distance
    towards = np.array([1.0, 0.0, 2.0]) - position
    lights: list[lx.Light] = [lx.SpotLight(position, towards, np.arctan(10 / distance))]
    if method != "spot":
        # A plane along the light's ray through (1, 0, 2).
        side = np.cross(towards, (0.0, 1.0, 0.0))
        lights.append(lx.HemisphereLight(position, side))
    for light in lights:
        frame = lx.render(scene, eye, light, method)
        from_middle = frame.position - (1.0, 0.0, 2.0)
        if isinstance(light, lx.SpotLight):
            axis = towards / np.linalg.norm(towards)
            aside = from_middle - (from_middle @ axis)[..., None] * axis
            inside = 10.0 - np.linalg.norm(aside, axis=-1)
        else:
            inside = from_middle @ (side / np.linalg.norm(side))
        dark, is_clear = floor_in_shadow(eye, light)
        # The cone widens over the scene by its share of the distance.
        is_clear &= np.abs(inside) > 0.05 + 200.0 / distance
        assert np.count_nonzero(is_clear & (inside > 0)) > 1000
        assert np.count_nonzero(is_clear & (inside < 0)) > 1000
        expected = (inside > 0) & ~dark
        assert np.count_nonzero(((frame.visibility == 1) != expected) & is_clear) <= 2


@pytest.mark.parametrize("method", ["desired_view", "lispsm", "notw", "cascades", "uniform"])
def test_a_farther_lamp_is_more_of_a_sun(method):
    """The map of a lamp becomes that of the direction, and so do its measures."""
    scene = lx.scenes.colonnade()
    eye = scene.cameras["default"].resized(160, 90)
    chosen = dataclasses.replace(lx.method_from(method), resolution=512)
    sun = lx.render(scene, eye, lx.DirectionalLight(-TO_SUN), chosen)
    lamp = lx.render(scene, eye, lx.PointLight(TO_SUN * 1e12), chosen)
    assert lamp.light_matrix.shape == sun.light_matrix.shape
    points = np.random.default_rng(1).uniform(*scene.bounds, (200, 3))
    homogeneous = np.column_stack([points, np.ones(len(points))])
    for of_lamp, of_sun in zip(lamp.light_matrix, sun.light_matrix, strict=True):
        there, expected = (homogeneous @ matrix.T for matrix in (of_lamp, of_sun))
        is_before = expected[:, 3] > 0.01
        texels = [p[is_before, :2] / p[is_before, 3:] for p in (there, expected)]
        assert np.abs(texels[0] - texels[1]).max() < 0.1
    assert np.allclose(lamp.max_effective_resolution, sun.max_effective_resolution, rtol=1e-3)
    ratio = lamp.aliasing_error / sun.aliasing_error
    assert abs(np.nanmedian(ratio) - 1) < 1e-3


@pytest.mark.parametrize("distance", [2e2, 1e4])
@pytest.mark.parametrize("method", ["cube", "focused", "psm", "scene_optimized"])
def test_points_of_one_ray_share_a_texel(method, distance):
    """Whatever the fit: the light matrix is of the lamp's own rays."""
    scene, eye = plate_over_floor(), camera()
    light = lx.PointLight(TO_SUN * distance)
    frame = lx.render(scene, eye, light, method)
    (matrix,) = frame.light_matrix
    feet = np.random.default_rng(2).uniform((-5, 0, -5), (5, 0, 5), (50, 3))
    along = np.linspace(0.0, 12.0 / distance, 5)[:, None, None]
    points = feet + along * (np.asarray(light.position) - feet)
    there = np.concatenate([points, np.ones((5, 50, 1))], axis=-1) @ matrix.T
    texels = there[..., :2] / there[..., 3:]
    assert np.abs(texels - texels[0]).max() < 1e-6
    assert (np.diff(there[..., 2], axis=0) < 0).all()


def test_texels_of_a_far_lamp_hold_still():
    scene, light = plate_over_floor(), lx.PointLight(TO_SUN * 500)
    places = []
    for i in range(8):
        eye = lx.Camera.look_at(
            (12 + 0.37 * i, 14, 16 - 0.2 * i), (0, 0, 0), yfov=0.9, width=96, height=54
        )
        (matrix,) = lx.render(scene, eye, light, lx.Cube(snap=True)).light_matrix
        points = np.array([(0, 0, 0, 1), (3, 0, 1, 1), (-2, 4, 2, 1)], float) @ matrix.T
        places.append(points[:, :2] / points[:, 3:])
    shifts = [p - places[0] for p in places if np.ptp((p - places[0])[:, 0]) < 1e-6]
    assert len(shifts) > 3
    for shift in shifts:
        assert np.abs(shift - np.round(shift)).max() < 1e-6
