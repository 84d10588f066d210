"""Percentage closer filtering in warped and in unwarped coordinates (Rosen, section 6.2)."""

from __future__ import annotations

import dataclasses
from functools import cache

import numpy as np
import pytest

import lixel as lx

WARPED = lx.Pcf(radius=3.0, samples=32, space="warped")
SOFT = lx.Pcf(radius=0.4, samples=64, space="unwarped")
DIRECTIONAL = lx.DirectionalLight((0.0, -1.0, -0.3))
POINT = lx.PointLight((0.5, 9.0, 1.0))
OF_A_POINT_LIGHT = ("cube", "dual_paraboloid", "cube+notw", "dual_paraboloid+rtw")


def with_lookup(method: str, lookup: str | lx.Pcf, resolution: int = 256) -> lx.Method:
    # A map of what is in shadow has no room for the lit half of a penumbra.
    more = {"samples": "facing"} if method == "scene_optimized" else {}
    return dataclasses.replace(lx.method_from(method), resolution=resolution, lookup=lookup, **more)


def square(half: float, y: float, shift: float = 0.0) -> np.ndarray:
    """Two triangles, (2, 3, 3), in the plane of a height."""
    a, b, c, d = ([shift + x, y, z] for x, z in
                  ((-half, -half), (half, -half), (half, half), (-half, half)))  # fmt: skip
    return np.array([[a, c, b], [a, d, c]])


def scene_of(*squares: np.ndarray) -> lx.Scene:
    corners = np.concatenate(squares).reshape(-1, 3)
    return lx.Scene(corners, np.arange(len(corners)).reshape(-1, 3))


# Under the plate of `edge`.
CAMERA = lx.Camera.look_at((0.2, 1.5, 4.0), (0.0, 0.0, 0.0), yfov=0.8, width=240, height=135)


@cache
def edge() -> lx.Scene:
    """A floor, half of it under a plate whose edge is above x = 0."""
    return scene_of(square(30.0, 0.0), square(15.0, 2.0, shift=-15.0))


def floor_only(frame: lx.Frame) -> np.ndarray:
    near = (np.abs(frame.position) < 8.0).all(axis=-1)
    return near & (np.abs(frame.position[..., 1]) < 1e-6)


def methods_and_lights() -> list[tuple[str, lx.Light]]:
    return [
        (method, light) for light in (DIRECTIONAL, POINT) for method in lx.methods.MAP_METHODS
    ] + [(method, POINT) for method in OF_A_POINT_LIGHT]


@pytest.mark.parametrize("height", [1.0, 0.05, 0.003])
@pytest.mark.parametrize("lookup", [dataclasses.replace(WARPED, radius=8.0), SOFT])
def test_a_lit_plane_stays_lit_at_grazing_angles(lookup, height):
    scene = scene_of(square(30.0, 0.0))
    directional = lx.DirectionalLight((-1.0, -height, 0.4))
    point_light = lx.PointLight((3.0, 20.0 * height, 1.0))
    for method, light in methods_and_lights():
        shown = lx.render_shadows(
            scene,
            CAMERA,
            directional if light is DIRECTIONAL else point_light,
            with_lookup(method, lookup),
        )
        assert not (shown < 1.0).any(), (method, light)


@pytest.mark.parametrize("light", [DIRECTIONAL, POINT], ids=["directional", "point"])
def test_unwarped_penumbras_have_the_radius_in_world_units_whatever_the_map(light):
    methods = [method for method, made_for in methods_and_lights() if made_for is light]
    for method in methods:
        frame = lx.render(edge(), CAMERA, light, with_lookup(method, SOFT, 1024))
        seen = floor_only(frame)
        # The edge's shadow is where the ray through (0, 2, z) meets the floor.
        x = frame.position[..., 0]
        if light is DIRECTIONAL:
            across = x
        else:
            end = 0.5 - 0.5 * 9.0 / 7.0
            # From the plane of light through the edge.
            across = (x - end) * 9.0 / np.hypot(0.5 - end, 9.0)
        partly = seen & (frame.visibility > 0.0) & (frame.visibility < 1.0)
        texel = 30.0 / 1024 * (3.0 if light is POINT else 1.0)
        slack = 0.06 + texel
        assert partly.sum() > 200, method
        assert np.abs(across[partly]).max() < SOFT.radius + slack, method
        # It is as wide as that, too: nearly all of a pixel's samples fall on one side at its ends.
        assert across[partly].min() < -0.85 * SOFT.radius + slack, method
        assert across[partly].max() > 0.85 * SOFT.radius - slack, method
        # The share of a disc to one side of a line, at the line's distance from its middle.
        t = np.clip(across / SOFT.radius, -1.0, 1.0)
        expected = 0.5 + (t * np.sqrt(1.0 - t * t) + np.arcsin(t)) / np.pi
        error = (frame.visibility - expected)[seen]
        assert abs(error[np.abs(across[seen]) < 1.0].mean()) < 0.01, method
        assert np.abs(error).max() < 0.15, method


@pytest.mark.parametrize("method", ["uniform", "desired_view", "focused", "rtw"])
def test_warped_penumbras_have_the_radius_in_texels(method):
    # Not along the texels' columns, where the edge would be moved by up to half of one.
    directional = lx.DirectionalLight((0.35, -1.0, -0.6))
    frame = lx.render(edge(), CAMERA, directional, with_lookup(method, WARPED))
    seen = floor_only(frame)
    points = frame.position[seen]
    at_edge = points * (0.0, 1.0, 1.0) + (0.7, 0.0, 0.0)

    def texels(places: np.ndarray) -> np.ndarray:
        h = np.c_[places, np.ones(len(places))] @ frame.light_matrix[0].T
        linear = h[:, :2] / h[:, 3:] / 256
        warp = frame.warp_map
        return 256 * (lx.warp_points(warp[0], linear) if len(warp) else linear)

    # In texels from the edge's shadow, across it.
    here, there = texels(points), texels(at_edge)
    along = texels(at_edge + np.array([0.0, 0.0, 1e-3])) - there
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    offset = here - there
    across = np.abs(offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0])
    across *= np.sign(points[:, 0] - 0.7)
    visible = frame.visibility[seen]
    partly = (visible > 0.0) & (visible < 1.0)
    assert partly.sum() > 100
    # A sample is answered at the middle of its texel: up to half of a diagonal more.
    assert np.abs(across[partly]).max() < WARPED.radius + 0.75
    assert across[partly].min() < -0.75 * WARPED.radius
    assert across[partly].max() > 0.75 * WARPED.radius
    # The true edge lies in the middle.
    near = np.abs(across) < 6.0
    assert abs((visible - (across > 0.0))[near].mean()) < 0.02


@pytest.mark.parametrize("scene", ["colonnade", "city", "objects_on_floor"])
def test_a_disc_ends_at_a_tear(scene):
    """Beyond it are texels of elsewhere: with them notw was off by 0.9 to 1.15 of what rtw is."""
    made = lx.scenes.GENERATORS[scene]()
    seen = made, made.cameras["default"].resized(640, 360), made.lights["default"]
    truth = lx.reference(*seen).visibility
    rtw, notw = (
        np.nansum(np.abs(lx.render_shadows(*seen, with_lookup(method, WARPED, 512)) - truth))
        for method in ("rtw", "notw")
    )
    assert notw <= 0.85 * rtw


@pytest.mark.parametrize("resolution", [16, 20, 24, 32, 40, 48])
def test_a_patch_without_a_texel_has_an_answer(resolution, engine):
    """Sixteen functions in so few texels leave some of them none, the first ones among these."""
    scene = lx.scenes.objects_on_floor(count=25, subdivisions=2)
    seen = scene, scene.cameras["default"].resized(160, 90), lx.DirectionalLight((0.5, -1.0, 0.35))
    truth = lx.reference(*seen).visibility
    method = with_lookup("notw", lx.Pcf(radius=1.5, samples=16), resolution)
    share = lx.render_shadows(*seen, method)
    assert np.nanmean(np.abs(share - truth)) < 0.12


@pytest.mark.parametrize("space", ["warped", "unwarped"])
@pytest.mark.parametrize("samples", [1, 2, 5, 16])
def test_shares_are_those_of_so_many_samples(samples, space):
    lookup = lx.Pcf(0.3 if space == "unwarped" else 2.0, samples, space)
    shown = lx.render_shadows(edge(), CAMERA, DIRECTIONAL, with_lookup("rtw", lookup))
    shares = np.unique(shown[~np.isnan(shown)])
    assert ((shares >= 0.0) & (shares <= 1.0)).all()
    # But for points off the map, which are left out of the mean.
    whole = np.unique((np.arange(samples + 1) / samples).astype(np.float32))
    assert np.isin(shown[40:90, 90:150], whole).all()
    assert len(shares) >= min(samples, 4) + 1


@pytest.mark.parametrize("space", ["warped", "unwarped"])
def test_no_radius_is_the_depth_lookup(view, space):
    for method in ("uniform", "rtw", "notw", "cascades"):
        depth = lx.render_shadows(*view, with_lookup(method, "depth"))
        filtered = lx.render_shadows(*view, with_lookup(method, lx.Pcf(0, 16, space)))
        assert depth.tobytes() == filtered.tobytes()


@pytest.mark.parametrize("lookup", [WARPED, SOFT], ids=["warped", "unwarped"])
def test_same_bytes_at_every_run(view, lookup):
    for method in ("rtw", "notw", "cascades"):
        runs = {lx.render_shadows(*view, with_lookup(method, lookup)).tobytes() for _ in range(3)}
        assert len(runs) == 1


def test_a_shadow_has_no_light_line_where_layers_meet():
    """Points off a face or a cascade are left out rather than lit."""
    roof = scene_of(square(30.0, 0.0), square(60.0, 4.0))
    for method, light in (
        ("cascades", DIRECTIONAL),
        ("cube", lx.PointLight((0.4, 9.0, 0.3))),
        ("uniform", lx.PointLight((0.4, 9.0, 0.3))),
        ("desired_view", DIRECTIONAL),
    ):
        for lookup in (WARPED, SOFT):
            frame = lx.render(roof, CAMERA, light, with_lookup(method, lookup))
            assert (frame.visibility[floor_only(frame)] == 0.0).all(), method


def test_what_lies_deeper_than_every_receiver_shadows_none(engine):
    """A board that leans to a slat below its low edge. The disc reaches the slat, where the board's
    plane would go on below; the camera sees it from behind, so that no receiver is as deep."""

    def quad(x0: float, y0: float, x1: float, y1: float) -> np.ndarray:
        a, b, c, d = (x0, y0, -1.0), (x1, y1, -1.0), (x1, y1, 1.0), (x0, y0, 1.0)
        return np.array([[a, c, b], [a, d, c]])

    # The shelf makes the map wide enough.
    board, slat, shelf = quad(-1, 1, 1, 0), quad(1.5, -0.24, 1.6, -0.04), quad(2.5, 0.2, 2.7, 0.2)
    scene = scene_of(board, slat, shelf)
    camera = lx.Camera.look_at((4.0, 2.0, 0.0), (0.8, 0.0, 0.0), yfov=0.7, width=96, height=64)
    light = lx.SpotLight((0.0, 6.0, 0.0), (0.0, -1.0, 0.0), outer=0.6)
    lookup = lx.Pcf(radius=1.4, samples=64, space="unwarped")
    frame = lx.render(scene, camera, light, with_lookup("spot", lookup))
    assert {0, 1, 2, 4} <= set(frame.triangle_id.ravel())
    # Of these no disc reaches the shelf.
    of_board = (frame.triangle_id == 0) | (frame.triangle_id == 1)
    of_board &= frame.position[..., 0] < 0.9
    assert (frame.visibility[of_board] == 1.0).all()


@pytest.mark.parametrize("importance", ["distance*boundary"])
def test_boundaries_are_those_of_hard_shadows(view, importance):
    """The first pass that finds them is not filtered: the same warp with and without."""
    warps = [
        lx.render(
            *view,
            lx.RectilinearWarp(
                importance=importance, resolution=128, analysis_resolution=64, lookup=lookup
            ),
        ).warp_map.tobytes()
        for lookup in ("depth", lx.Pcf(8.0, 64))
    ]
    assert warps[0] == warps[1]


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"radius": -1.0}, ValueError, "radius must be a finite number, at least 0, got -1.0"),
        ({"radius": float("nan")}, ValueError, "radius must be a finite number, .*, got nan"),
        ({"radius": float("inf")}, ValueError, "radius must be a finite number, .*, got inf"),
        ({"radius": "2"}, TypeError, "radius must be a finite number, at least 0, got '2'"),
        ({"samples": 0}, ValueError, "samples must be .* of points from 1 to 1024, got 0"),
        ({"samples": 1025}, ValueError, "samples must be .* of points from 1 to 1024, got 1025"),
        ({"samples": 4.0}, TypeError, "samples must be a whole number .*, got 4.0"),
        ({"space": "world"}, ValueError, "space must be one of 'warped', 'unwarped', got 'world'"),
    ],
)
def test_bad_filters_are_named(arguments, error, words):
    with pytest.raises(error, match=words):
        lx.Pcf(**arguments)


def test_filters_are_parameters_like_others():
    method = lx.RectilinearWarp(lookup=lx.Pcf(0.5, 8, "unwarped"))
    assert method == lx.RectilinearWarp(lookup=lx.Pcf(0.5, 8, "unwarped"))
    assert method.parameters()["lookup"] == lx.Pcf(0.5, 8, "unwarped")
    with pytest.raises(
        ValueError, match=r"lookup must be one of 'auto', .* or a lixel\.Pcf, Variance"
    ):
        lx.Uniform(lookup="pcf")  # type: ignore[arg-type]


# --- Rosen's weights and jitter (6.2) ---


def point_of_disc(i: int, samples: int) -> np.ndarray:
    """Vogel's spiral with two arms."""
    odd = samples % 2
    pair = (i + odd) // 2
    radius = np.sqrt((2 * pair + 1 - odd) / samples)
    arm = 1 - 2 * ((i + odd) % 2)
    angle = pair * 1.9416111
    return arm * radius * np.array([np.cos(angle), np.sin(angle)])


@pytest.mark.parametrize("weights", ["even", "gaussian"])
@pytest.mark.parametrize("jitter", [False, True])
def test_a_penumbra_is_the_weighted_share_beyond_the_edge(weights, jitter, engine):
    """Points and weights computed anew: those of the disc that see past a straight edge, in the
    mean over the rotations of the disc."""
    count = 128
    lookup = lx.Pcf(0.5, count, "unwarped", weights=weights, jitter=jitter)
    method = lx.Uniform(resolution=2048, lookup=lookup)
    frame = lx.render(edge(), CAMERA, lx.DirectionalLight((0.0, -1.0, 0.0)), method)
    seen = floor_only(frame)
    points = np.array([point_of_disc(i, count) for i in range(count)])
    w = np.ones(count)
    if weights == "gaussian":
        w = np.exp(-0.5 * (points**2).sum(axis=1) / 0.5**2)
    # In radii from the edge.
    places = np.linspace(-0.95, 0.95, 20)
    turns = np.linspace(0.0, 2 * np.pi, 90, endpoint=False)
    across = points @ np.stack([np.cos(turns), np.sin(turns)])
    lit = places[:, None, None] + across[None] > 0.0
    expected = (w[None, :, None] * lit).sum(axis=1).mean(axis=1) / w.sum()
    x = frame.position[..., 0][seen] / 0.5
    middle = np.abs(x) < 0.9
    error = frame.visibility[seen][middle] - np.interp(x[middle], places, expected)
    bins = np.digitize(x[middle], np.linspace(-0.9, 0.9, 10))
    # A Gaussian is up to 0.07 from even weights.
    assert max(abs(error[bins == b].mean()) for b in range(1, 10)) < 0.025
    assert np.abs(error).max() < 0.15


def test_jitter_is_the_same_in_every_frame_and_differs_by_pixel():
    steady, jittered = (
        lx.Uniform(resolution=2048, lookup=lx.Pcf(0.5, 8, "unwarped", jitter=jitter))
        for jitter in (False, True)
    )
    light = lx.DirectionalLight((0.0, -1.0, 0.0))
    first, second = (lx.render_shadows(edge(), CAMERA, light, jittered) for _ in range(2))
    assert first.tobytes() == second.tobytes()
    plain = lx.render_shadows(edge(), CAMERA, light, steady)

    def roughness(image: np.ndarray) -> float:
        """Along the edge: differences of pixels one above the other."""
        return float(np.nanmean(np.abs(np.diff(image[60:, :], axis=0))))

    assert roughness(first) > 2 * roughness(plain)


def test_both_engines_turn_the_disc_alike():
    lookup = lx.Pcf(0.4, 16, "unwarped", weights="gaussian", jitter=True)
    method = lx.Uniform(resolution=1024, lookup=lookup)
    gpu, cpu = (
        lx.render_shadows(edge(), CAMERA, DIRECTIONAL, method, device=device)
        for device in ("gpu", "cpu")
    )
    differ = ~np.isclose(gpu, cpu, atol=1e-5, equal_nan=True)
    assert differ.mean() < 0.002
