"""Names of objects, and the shares of their areas that lie in shadow."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
import trimesh

import lixel as lx


def roof_over_floor() -> lx.Scene:
    """A floor of 10 x 10, and 2 above it a roof of 4 x 4 that a wall of 4 x 1 hangs from."""
    square = np.array([(-1, 0, -1), (-1, 0, 1), (1, 0, 1), (1, 0, -1)], float)
    wall = np.array([(-2, 1, 0), (2, 1, 0), (2, 2, 0), (-2, 2, 0)], float)
    vertices = np.concatenate([5 * square, 2 * square + (0, 2, 0), wall])
    faces = [(i, i + j, i + j + 1) for i in (0, 4, 8) for j in (1, 2)]
    names = ["floor", "roof", "wall"]
    return lx.Scene(vertices, faces, object_id=np.repeat([0, 1, 2], 2), objects=names)


def test_names_are_given_or_made():
    vertices, faces = np.eye(3), [(0, 1, 2), (2, 1, 0)]
    plain = lx.Scene(vertices, faces)
    assert plain.objects == ("object 0",)
    assert plain.object_id.tolist() == [0, 0]
    assert lx.Scene(vertices, faces, object_id=[1, 0]).objects == ("object 0", "object 1")
    scene = roof_over_floor()
    for same in (copy.deepcopy(scene), pickle.loads(pickle.dumps(scene))):
        assert same.objects == ("floor", "roof", "wall")
        assert same.object_id.tolist() == [0, 0, 1, 1, 2, 2]
    copied = copy.copy(scene)
    copied.object_id[0] = 2
    assert scene.object_id[0] == 0
    for arguments, error, words in [
        ({"object_id": [0]}, ValueError, "object_id must be one for each of 2 faces, got 1"),
        ({"object_id": [0, 2], "objects": ["a", "b"]}, ValueError, "from 0 to 1: row 1 is 2"),
        ({"object_id": [0, -1]}, ValueError, "row 1 is -1"),
        ({"object_id": [0.5, 1]}, TypeError, "object_id must be an array of integers"),
        ({"objects": ["a", "b"]}, ValueError, "objects without object_id must be one name"),
    ]:
        with pytest.raises(error, match=words):
            lx.Scene(vertices, faces, **arguments)


def test_names_come_from_nodes_and_groups(tmp_path):
    scene = trimesh.Scene()
    for name, x in (("left", -2.0), ("right", 2.0)):
        box = trimesh.creation.box()
        scene.add_geometry(box, node_name=name, transform=np.diag([1, 1, 1, 1.0]))
        scene.graph[name] = trimesh.transformations.translation_matrix((x, 0, 0))
    path = tmp_path / "boxes.glb"
    scene.export(path)
    for found in (lx.Scene.from_trimesh(scene), lx.load(path)):
        assert set(found.objects) == {"left", "right"}
        middles = found.vertices[found.faces].mean(axis=1)[:, 0]
        for number, name in enumerate(found.objects):
            side = -1 if name == "left" else 1
            assert (side * middles[found.object_id == number] > 0).all()
    camera = lx.Camera.look_at((0, 1, 9), (0, 0, 0), yfov=0.8, width=60, height=40)
    found = lx.load(path)
    for seen in (
        lx.render(found, camera, lx.DirectionalLight((0, -1, -1))),
        lx.reference(found, camera, lx.DirectionalLight((0, -1, -1))),
    ):
        assert set(np.unique(seen.object_id)) == {-1, 0, 1}
        assert ((seen.object_id >= 0) == seen.covered).all()
        left = found.objects.index("left")
        assert np.nonzero(seen.object_id == left)[1].max() < 30
        assert (seen.object_id == left).any()


SUN = lx.DirectionalLight((0, -1, 0))


def test_shares_are_those_of_the_areas():
    scene = roof_over_floor()
    shares = lx.shadow_fractions(scene, SUN)
    assert shares.names == ("floor", "roof", "wall")
    np.testing.assert_allclose(shares.area, [100, 16, 4])
    # The sun is in the plane of the wall.
    np.testing.assert_allclose(shares.fraction, [0.16, 0.0, 1.0], atol=0.01)
    assert (shares.error <= 0.01).all()
    # A lamp 2 above the roof: its shadow is twice as wide.
    lamp = lx.PointLight((0, 4, 0))
    both = lx.shadow_fractions(scene, [SUN, lamp], error=0.005)
    assert both.fraction.shape == (2, 3)
    np.testing.assert_allclose(both.fraction[0], [0.16, 0.0, 1.0], atol=0.005)
    np.testing.assert_allclose(both.fraction[1], [0.64, 0.0, 1.0], atol=0.005)


def test_shares_of_triangles_are_theirs_alone():
    scene = roof_over_floor()
    shares = lx.shadow_fractions(scene, lx.DirectionalLight((1, -2, 0)), by="triangle")
    assert shares.fraction.shape == (6,)
    # The shadow of the roof lies 1 to the side, that of the wall in it.
    floor = scene.vertices[scene.faces[:2]]
    grid = np.stack(np.meshgrid(np.linspace(-5, 5, 801), np.linspace(-5, 5, 801)), -1)
    in_shadow = (np.abs(grid[..., 0] - 1) < 2) & (np.abs(grid[..., 1]) < 2)
    for corners, fraction in zip(floor, shares.fraction[:2], strict=True):
        a, b, c = corners[:, [0, 2]]
        weights = np.linalg.solve(np.stack([b - a, c - a], 1), (grid - a).reshape(-1, 2).T)
        inside = ((weights >= 0).all(0) & (weights.sum(0) <= 1)).reshape(801, 801)
        assert fraction == pytest.approx(in_shadow[inside].mean(), abs=0.015)
    np.testing.assert_array_equal(shares.fraction[2:4], 0.0)


def test_a_closed_object_shades_what_faces_away():
    ball = trimesh.creation.icosphere(subdivisions=3)
    shares = lx.shadow_fractions(lx.Scene.from_trimesh(ball), SUN)
    assert shares.fraction[0] == pytest.approx(0.5, abs=0.02)


def test_stated_errors_hold_what_is_missed():
    """Random towers: shares of few points against those of many."""
    scene = lx.scenes.city(blocks=5)
    rough = lx.shadow_fractions(scene, SUN_ASIDE, by="triangle", error=0.05)
    fine = lx.shadow_fractions(scene, SUN_ASIDE, by="triangle", error=0.008)
    missed = np.abs(rough.fraction - fine.fraction)
    known = rough.area > 0
    assert (missed <= 3 * rough.error)[known].mean() > 0.99
    assert np.sqrt(np.mean(missed[known] ** 2)) < 0.05


SUN_ASIDE = lx.DirectionalLight((0.6, -0.7, 0.3))


def test_what_is_no_share_is_refused():
    scene = roof_over_floor()
    with pytest.raises(ValueError, match="by must be 'object', 'material' or 'triangle'"):
        lx.shadow_fractions(scene, SUN, by="mesh")
    with pytest.raises(ValueError, match=r"error must be from 0\.0005 to 0\.5, got 0"):
        lx.shadow_fractions(scene, SUN, error=0)
    with pytest.raises(TypeError, match="light must be"):
        lx.shadow_fractions(scene, "sun")
