"""The scene: what it accepts, what it refuses and how it says so."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest
import trimesh

import lixel as lx

VERTICES = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
FACES = np.array([[0, 1, 2], [0, 2, 3]])


@pytest.mark.parametrize(
    "vertices",
    [
        VERTICES.astype(np.float32),
        VERTICES.astype(np.int16),
        VERTICES.astype(">f8"),
        np.asfortranarray(VERTICES),
        np.repeat(VERTICES, 2, axis=0)[::2],
        VERTICES.tolist(),
    ],
    ids=["float32", "int16", "byte-swapped", "Fortran order", "strided", "list"],
)
@pytest.mark.parametrize("faces", [FACES.astype(np.uint8), FACES.astype(">i8"), FACES.tolist()])
def test_any_layout_gives_the_same_scene(vertices, faces):
    scene = lx.Scene(vertices, faces)
    assert np.array_equal(scene.vertices, VERTICES)
    assert np.array_equal(scene.faces, FACES)
    assert scene.vertices.dtype == np.float64
    assert scene.faces.dtype == np.uint32


def test_read_only_arrays_are_accepted_and_copied():
    vertices = VERTICES.copy()
    vertices.flags.writeable = False
    scene = lx.Scene(vertices, FACES)
    scene.vertices[:] = 7.0
    assert np.array_equal(scene.vertices, VERTICES)


def test_float64_keeps_its_precision():
    far = VERTICES + 1e9 + 1e-6
    assert np.array_equal(lx.Scene(far, FACES).vertices, far)


@pytest.mark.parametrize(
    ("vertices", "faces", "error", "words"),
    [
        (VERTICES.astype(complex), FACES, TypeError, "vertices .* real numbers, got dtype complex"),
        (VERTICES.astype(str), FACES, TypeError, "vertices .* real numbers, got dtype <U"),
        (VERTICES.astype(object), FACES, TypeError, "vertices .* real numbers, got dtype object"),
        (VERTICES > 0, FACES, TypeError, "vertices .* real numbers, got dtype bool"),
        (VERTICES[:, :2], FACES, ValueError, r"vertices must have shape \(n, 3\), got \(4, 2\)"),
        (VERTICES.ravel(), FACES, ValueError, r"vertices must have shape \(n, 3\), got \(12,\)"),
        ([[0, 0, 0], [1, 0]], FACES, ValueError, r"vertices must have shape \(n, 3\)"),
        (VERTICES, FACES.astype(float), TypeError, "faces .* integers, got dtype float64"),
        (VERTICES, FACES > 0, TypeError, "faces .* integers, got dtype bool"),
        (VERTICES, FACES[:, :2], ValueError, r"faces must have shape \(m, 3\), got \(2, 2\)"),
        (VERTICES, [], ValueError, r"faces must have shape \(m, 3\), got \(0,\)"),
        (VERTICES, FACES[:0], ValueError, "faces must have at least one triangle"),
        (VERTICES, [[0, 1, 2], [0, -1, 2]], ValueError, r"faces .* row 1 is \[0, -1, 2\]"),
        (VERTICES, [[0, 1, 2], [0, 4, 2]], ValueError, r"faces .* row 1 is \[0, 4, 2\] .* 4 vert"),
        (VERTICES, np.array([[0, 1, 2**64 - 1]], np.uint64), ValueError, "faces .* row 0 is"),
        (VERTICES, [[0, 1, 2**32]], ValueError, r"faces .* row 0 is \[0, 1, 4294967296\]"),
        (
            np.where(FACES[[0, 0, 1, 1]] == 2, np.nan, VERTICES),
            FACES,
            ValueError,
            "vertices .* row",
        ),
        (np.where(VERTICES == 1, np.inf, VERTICES), FACES, ValueError, "vertices .* finite: row 1"),
    ],
)
def test_bad_input_is_named(vertices, faces, error, words):
    with pytest.raises(error, match=words):
        lx.Scene(vertices, faces)


def test_triangles_of_zero_area_are_counted():
    scene = lx.Scene(VERTICES, [[0, 1, 2], [0, 1, 1]])
    assert (scene.triangle_count, scene.degenerate_count) == (2, 1)
    assert "1 of zero area" in repr(scene)


def test_update_moves_the_vertices_and_nothing_else():
    scene = lx.Scene(VERTICES, FACES)
    scene.update_vertices(VERTICES + np.array([0, 0, 5]))
    assert np.array_equal(scene.bounds, [[0, 0, 5], [1, 1, 6]])
    for bad, error in ((VERTICES[:3], ValueError), (VERTICES.astype(complex), TypeError)):
        with pytest.raises(error, match="vertices"):
            scene.update_vertices(bad)
    assert np.array_equal(scene.bounds, [[0, 0, 5], [1, 1, 6]])


@pytest.mark.parametrize("twin_of", [lambda s: pickle.loads(pickle.dumps(s)), copy.copy])
def test_copies_are_whole_and_apart(twin_of):
    scene = lx.scenes.plane_and_box()
    twin = twin_of(scene)
    assert np.array_equal(twin.vertices, scene.vertices)
    assert np.array_equal(twin.faces, scene.faces)
    assert twin.cameras == scene.cameras
    assert twin.lights == scene.lights
    twin.update_vertices(twin.vertices + 1.0)
    twin.cameras.clear()
    assert not np.array_equal(twin.vertices, scene.vertices)
    assert scene.cameras


def test_from_trimesh_applies_transforms_in_float64():
    box = trimesh.creation.box()
    turned = trimesh.transformations.rotation_matrix(0.3, (1, 2, 3), (4, 5, 6))
    moved = trimesh.transformations.translation_matrix((1e8 + 0.1, 0, 0))
    whole = trimesh.Scene()
    whole.add_geometry(box, transform=turned)
    whole.add_geometry(box, transform=moved)
    whole.add_geometry(trimesh.PointCloud(np.ones((3, 3))))
    scene = lx.Scene.from_trimesh(whole)
    assert scene.triangle_count == 24
    expected = [trimesh.transform_points(box.vertices, m) for m in (turned, moved)]
    assert np.allclose(scene.vertices, np.concatenate(expected), rtol=1e-15, atol=1e-14)
    triangles = np.concatenate([vertices[box.faces] for vertices in expected])
    assert np.allclose(scene.vertices[scene.faces], triangles, rtol=1e-15, atol=1e-14)
    assert lx.Scene.from_trimesh(box).triangle_count == 12


def test_from_trimesh_refuses_what_has_no_triangles():
    with pytest.raises(TypeError, match="mesh must be a trimesh"):
        lx.Scene.from_trimesh([1, 2])
    with pytest.raises(ValueError, match="mesh must hold at least one triangle"):
        lx.Scene.from_trimesh(trimesh.Scene(trimesh.PointCloud(np.ones((3, 3)))))
