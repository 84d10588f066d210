"""Shadow edges that run straight where those of the map's texels are stairs."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import lixel as lx

MAX_RUN = 16
SIDES = ((-1, 0), (1, 0), (0, -1), (0, 1))
CAMERA = lx.Camera.look_at(
    (0.1, 1.0, 0.0), (0.1, 0, 0), (0, 0, -1), ymag=4.0, width=120, height=120, zfar=1.5
)


@cache
def polygon() -> lx.Scene:
    """A floor, and above the camera a triangle, a sliver and a square that shade it."""
    floor = [(-8, 0, -8), (-8, 0, 8), (8, 0, 8), (8, 0, -8)]
    casters = [
        ((-3.3, 2.4), (2.9, 3.1), (-1.0, -3.2)),
        ((1.2, -3.5), (3.6, -1.1), (3.5, -0.9)),
        ((0.9, 0.2), (2.1, 0.6), (1.4, 1.9)),
        ((-3.6, -3.4), (-3.1, -3.4), (-3.1, -2.2)),
        ((-3.6, -3.4), (-3.1, -2.2), (-3.6, -2.2)),
    ]
    corners = [*floor, *((x, 3.0, z) for caster in casters for x, z in caster)]
    faces = [(0, 1, 2), (0, 2, 3)]
    faces += [(4 + 3 * i, 5 + 3 * i, 6 + 3 * i) for i in range(len(casters))]
    return lx.Scene(corners, faces)


def is_lit_by_silhouette(lit: np.ndarray, place: np.ndarray) -> bool:
    """Of a place of a map of lit texels: which side of the edge's pieces, each from the middle of
    one step of the stairs to the middle of the next."""
    column, row = (int(part) for part in np.floor(place))
    within = place - (column, row)
    own = lit[row, column]

    def other(x: int, y: int) -> bool:
        return bool(lit[y, x] != own)

    for dx, dy in SIDES:
        if not other(column + dx, row + dy):
            continue
        ax, ay = abs(dy), abs(dx)
        ends = []
        for way in (-1, 1):
            for run in range(MAX_RUN + 1):
                x, y = column + way * (run + 1) * ax, row + way * (run + 1) * ay
                here, beside = other(x, y), other(x + dx, y + dy)
                if run == MAX_RUN or here or not beside:
                    inside = 0.0
                    if run < MAX_RUN and here == beside:
                        inside = 0.5 if here else -0.5
                    ends.append((run, inside))
                    break
        length = ends[0][0] + ends[1][0] + 1
        along = ends[0][0] + within @ (ax, ay)
        depth = np.interp(along, [0, length / 2, length], [ends[0][1], 0.0, ends[1][1]])
        across = within @ (abs(dx), abs(dy))
        if (across if dx + dy < 0 else 1.0 - across) < depth:
            return not own
    return bool(own)


@pytest.mark.parametrize("resolution", [40, 97])
def test_answers_are_those_of_pieces_between_the_middles_of_steps(resolution, engine):
    light = lx.DirectionalLight((0.0, -1.0, 0.0))
    method = lx.Uniform(resolution=resolution, lookup="revectorized", rotation=0.0)
    frame = lx.render(polygon(), CAMERA, light, method)
    lit = frame.shadow_map[0] > 0.5
    points = frame.position.reshape(-1, 3)
    h = np.c_[points, np.ones(len(points))] @ frame.light_matrix[0].T
    places = h[:, :2] / h[:, 3:]
    expected = np.array([is_lit_by_silhouette(lit, place) for place in places])
    differs = frame.visibility.reshape(-1) != expected
    # At a border of a texel or of a piece rounding decides.
    assert differs.mean() < 1e-3
    depth = lx.render_shadows(polygon(), CAMERA, light, method, lookup="depth").reshape(-1)
    assert (depth != expected).sum() > 50


@pytest.mark.parametrize("turn", [0.05, 0.3, 0.7, 1.2])
def test_a_straight_edge_is_straight(turn):
    """Wrong pixels of the stairs lie up to half a texel off the edge, those of its pieces less."""
    x, z = np.cos(turn), np.sin(turn)
    along, across = np.array([x, 0, z]), np.array([-z, 0, x])
    up = np.array([0, 3, 0])
    floor = [(-8, 0, -8), (-8, 0, 8), (8, 0, 8), (8, 0, -8)]
    plate = [
        -9 * along + up,
        9 * along + up,
        9 * along + 9 * across + up,
        -9 * along + 9 * across + up,
    ]
    scene = lx.Scene([*floor, *plate], [(0, 1, 2), (0, 2, 3), (4, 5, 6), (4, 6, 7)])
    light = lx.DirectionalLight((0.0, -1.0, 0.0))
    truth = lx.reference(scene, CAMERA, light)
    wrong = {
        lookup: lx.compare(
            lx.render_shadows(
                scene, CAMERA, light, "uniform", resolution=64, rotation=0.0, lookup=lookup
            ),
            truth,
        ).misclassified_count
        for lookup in ("depth", "revectorized")
    }
    assert wrong["depth"] > 100
    # Along diagonals there are no stairs to straighten.
    assert wrong["revectorized"] < (0.65 if turn == 0.7 else 0.45) * wrong["depth"], wrong


@pytest.mark.parametrize(
    ("method", "light"),
    [
        ("desired_view", None),
        ("rtw", None),
        ("notw", None),
        ("cascades", None),
        ("lispsm", None),
        ("cube", lx.PointLight((3.0, 9.0, 2.0))),
        ("dual_paraboloid", lx.PointLight((3.0, 9.0, 2.0))),
        ("cube+notw", lx.PointLight((3.0, 9.0, 2.0))),
    ],
)
def test_it_is_wrong_in_fewer_pixels_than_depths(method, light, engine):
    scene = lx.scenes.colonnade(columns=8, detail=16)
    camera, light = scene.cameras["default"].resized(320, 180), light or scene.lights["default"]
    truth = lx.reference(scene, camera, light)
    wrong = {
        lookup: lx.compare(
            lx.render_shadows(scene, camera, light, method, resolution=256, lookup=lookup), truth
        ).misclassified_count
        for lookup in ("depth", "revectorized")
    }
    assert wrong["revectorized"] < 0.9 * wrong["depth"], wrong
