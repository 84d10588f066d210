"""Triangles of files as assimp reads them, an independent library."""

from __future__ import annotations

import json
import os
import warnings
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from gltf_files import CASES
from other_reader import ROUNDING, difference, triangles
from test_files import TRIANGLES

import lixel as lx


def without_comments(content: bytes) -> bytes:
    return b"\n".join(line.partition(b"#")[0] for line in content.split(b"\n"))


def changed(change):
    """A glTF file that says plainly what a word of the standard means."""

    def mended(content: bytes) -> bytes:
        tree = json.loads(content)
        change(tree)
        return json.dumps(tree).encode()

    return mended


MENDED = {
    # What assimp does not know of a file, said so that it does.
    "hidden_node.gltf": changed(lambda tree: tree["nodes"][1].pop("mesh")),
    # Its target moves all vertices alike.
    "morph_mesh_weight_1.gltf": changed(
        lambda tree: tree["nodes"][1].update(translation=[0, 2, 0])
    ),
    "obj_latin1_name.obj": lambda content: content.decode("latin-1").encode(),
    "obj_trailing_comment_f.obj": without_comments,
    "obj_utf8_bom.obj": lambda content: content.decode("utf-8-sig").encode(),
    "primitive_without_position.gltf": changed(lambda tree: tree["meshes"][1]["primitives"].pop()),
    # The only joint shrinks by a hundred, and the node stands where its mesh does.
    "skin_outside_armature.gltf": changed(
        lambda tree: [tree["nodes"][2].pop("skin"), tree["nodes"][2].update(scale=[0.01] * 3)]
    ),
    "stl_bin_trailing.stl": lambda content: content[: 84 + 50 * 2],
    "uri_space in name.gltf": changed(
        lambda tree: tree["buffers"][0].update(uri="my scene data.bin")
    ),
}


CUT_OTHERWISE = ("obj_concave_L.obj", "obj_quad_vtvn_hexagon_vn.obj")
"""Polygons that can be cut into triangles in several ways."""


def outline(soup: np.ndarray) -> set[frozenset[tuple[float, ...]]]:
    """The edges that bound the triangles together: those of an odd number of them."""
    edges = Counter(
        frozenset((tuple(corners[i]), tuple(corners[i - 1])))
        for corners in soup.tolist()
        for i in range(3)
    )
    return {edge for edge, count in edges.items() if count % 2}


def size(soup: np.ndarray) -> float:
    sides = soup[:, 1:] - soup[:, :1]
    return np.linalg.norm(np.cross(sides[:, 0], sides[:, 1]), axis=1).sum() / 2


def soup(path: Path) -> np.ndarray:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        scene = lx.load(path)
    return scene.vertices[scene.faces]


@pytest.mark.parametrize("name", TRIANGLES)
def test_cases_have_the_triangles_of_another_reader(name, tmp_path):
    path = CASES / name
    if MENDED.get(name):
        (tmp_path / "my scene data.bin").write_bytes((CASES / "my scene data.bin").read_bytes())
        (tmp_path / name).write_bytes(MENDED[name](path.read_bytes()))
        path = tmp_path / name
    found, expected = soup(CASES / name), triangles(path)
    assert len(expected) == TRIANGLES[name][0]
    if name in CUT_OTHERWISE:
        assert outline(found) == outline(expected)
        assert size(found) == pytest.approx(size(expected), rel=1e-6)
    else:
        assert difference(found, expected) <= ROUNDING


def test_a_difference_is_found():
    soups = np.random.default_rng(0).normal(size=(100, 3, 3))
    shuffled = soups[::-1][:, [2, 0, 1]]
    assert difference(shuffled, soups) < 1e-12
    moved = shuffled.copy()
    moved[7, 1, 2] += 1e-4
    assert 1e-7 < difference(moved, soups) < 1e-4
    # The other diagonal of a square, and the triangle of its mirror.
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], float)
    assert difference(square[[[0, 1, 2], [0, 2, 3]]], square[[[1, 2, 3], [1, 3, 0]]]) > 0.01
    assert difference(soups[1:], soups) == np.inf


@pytest.mark.skipif("LIXEL_SCENES" not in os.environ, reason="LIXEL_SCENES names no folder")
def test_scenes_have_the_triangles_of_another_reader():
    paths = sorted(Path(os.environ["LIXEL_SCENES"]).rglob("*.glb"))
    # Python holds the larger ones to assimp in half a minute: other_reader.py.
    paths = [path for path in paths if path.stat().st_size < 4_000_000]
    assert paths
    for path in paths:
        found, expected = soup(path), triangles(path)
        apart = difference(found, expected)
        assert apart <= ROUNDING, f"{path.name}: {len(found)} and {len(expected)}, {apart} apart"
