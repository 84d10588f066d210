"""What holes cost, and brute force that says whether they are right."""

import numpy as np
import pytest

import lixel as lx
from lixel import cli
from lixel.lab import leaves, masks
from lixel.lab.brute_force import Triangles, cast
from lixel.lab.result_tables import read


def strips(count=24):
    """Bent strips of four triangles, each a loose piece, and a closed box, all one object; and a
    floor."""
    random = np.random.default_rng(3)
    floor, solid = lx.scenes.plane_and_box(), lx.scenes.created("box")
    x = np.array([0.0, 1.0, 2.0])
    strip = np.array([[a, 0.2 * (a - 1.0) ** 2, z] for a in x for z in (0.0, 0.6)])
    faces = np.array([[0, 1, 2], [1, 3, 2], [2, 3, 4], [3, 5, 4]])
    parts = [(floor.vertices, floor.faces), solid]
    for _ in range(count):
        turn = lx.scenes.rotation(*random.uniform(0.0, 6.0, 2))
        parts.append((strip @ turn.T * 0.7 + random.uniform((-2, 0.8, -2), (2, 2.5, 2)), faces))
    offsets = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    scene = lx.Scene(
        np.concatenate([vertices for vertices, _ in parts]),
        np.concatenate([own + at for (_, own), at in zip(parts, offsets, strict=False)]),
        object_id=np.repeat([0, *[1] * (count + 1)], [len(own) for _, own in parts]),
        objects=["floor", "plant"],
    )
    scene.cameras["default"] = floor.cameras["default"].resized(96, 60)
    scene.lights["default"] = floor.lights["default"]
    return scene, len(floor.faces) + len(solid[1])


def test_cards_of_plants_get_the_leaf_and_nothing_else_does():
    scene, opaque = strips()
    found = leaves.leafy(scene)
    assert (found.face_alpha[:opaque] == -1).all()
    assert (found.face_alpha[opaque:] == 0).all()
    for card in found.uv[opaque:].reshape(-1, 12, 2):
        # Once over the whole card, the long side along u.
        np.testing.assert_allclose(card.min(axis=0), 0.0, atol=1e-12)
        np.testing.assert_allclose(card.max(axis=0), 1.0, atol=1e-12)
    # From the first corner to the second one across the strip, and to the third one along it.
    across, along = np.abs(np.diff(found.uv[opaque, [1, 0, 2], 0]))
    assert across < 0.15
    assert along > 0.4


def test_a_scene_without_plants_is_refused():
    with pytest.raises(ValueError, match="must have plants, objects of at least 20 loose pieces"):
        leaves.leafy(lx.scenes.plane_and_box())


@pytest.mark.parametrize("light", [None, lx.PointLight((0.5, 4.0, 0.3))])
def test_brute_force_and_the_reference_agree_on_leaves(light):
    scene, _ = strips()
    triangles = leaves.leafy(scene)
    camera = scene.cameras["default"]
    case = masks.Case("strips", triangles, camera, light or scene.lights["default"])
    truth = lx.reference(case.scene(), camera, case.light)
    pixels = np.argwhere(~truth.tie & ~truth.float32_tie)
    known = cast(triangles, camera, case.light, pixels)
    found = truth.visibility[tuple(pixels.T)]
    np.testing.assert_array_equal(known, found)
    # Solid cards are seen, and cast other shadows.
    solid = cast(triangles._replace(face_alpha=-1 - 0 * triangles.face_alpha), camera, case.light,
                 pixels)  # fmt: skip
    assert np.count_nonzero(~np.equal(solid, found)) > 50


def test_brute_force_knows_the_near_wall_from_the_far_one():
    """Two squares across the view of one pixel, the light from the side of the camera."""
    square = np.array([[-1.0, -1, 0], [1, -1, 0], [1, 1, 0], [-1, 1, 0]])
    vertices = np.concatenate([square, square - np.array([0.0, 0.0, 2.0])])
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]])
    triangles = Triangles(vertices, faces, np.zeros((4, 3, 2)), np.full(4, -1), ())
    camera = lx.Camera.look_at((0.2, 0.1, 3), (0.2, 0.1, 0), yfov=0.2, width=1, height=1)
    front, behind = lx.PointLight((0.3, 0.2, 5.0)), lx.PointLight((0.3, 0.2, -5.0))
    assert cast(triangles, camera, front, [(0, 0)]) == [1.0]
    assert cast(triangles, camera, behind, [(0, 0)]) == [0.0]
    # What lies beyond the lamp does not matter, what lies before it does.
    small = 0.05 * square + np.array([0.4, 0.3, 2.0])
    beyond = triangles._replace(vertices=np.concatenate([square, small]))
    assert cast(beyond, camera, lx.PointLight((0.3, 0.2, 1.0)), [(0, 0)]) == [1.0]
    assert cast(beyond, camera, lx.PointLight((0.6, 0.5, 4.0)), [(0, 0)]) == [0.0]


def test_the_command_measures_the_fence_and_a_scene_with_plants(tmp_path, monkeypatch, capsys):
    scene, opaque = strips()
    monkeypatch.setattr(masks, "view_of", lambda _: (scene, scene.cameras["default"],
                                                     scene.lights["default"]))  # fmt: skip
    monkeypatch.setattr(masks, "METHODS", {"exact": lx.Exact(), "uniform": lx.Uniform()})
    path, picture = tmp_path / "masks.csv", tmp_path / "leaves.png"
    command = ["lab", "masks", "strips.glb", "--size", "96x60", "--repeats", "1", "--rays", "400",
               "--picture", str(picture), "-o", str(path)]  # fmt: skip
    assert cli.main(command) == 0
    table = read(path)
    assert list(table["scene"]) == ["fence"] * 3 + ["strips"] * 3
    assert list(table["method"]) == ["reference", "exact", "uniform"] * 2
    assert list(table["with holes"].unique()) == [2, scene.triangle_count - opaque]
    right = table[table["method"] != "uniform"]
    assert (right["wrong of rays"] == 0).all()
    assert (table["rays"] > 230).all()
    assert (right["misclassified"].dropna() == 0).all()
    assert (table["changed by holes"].dropna() > 40).all()
    timed = table.loc[table["method"] != "reference", ["ms", "ms, solid", "processor ms"]]
    assert (timed > 0.0).all().all()
    assert picture.stat().st_size > 500
    assert "wrong of rays" in capsys.readouterr().out
