"""Triangles of files by assimp, which shares nothing with lixel's readers.

`python tests/other_reader.py FOLDER` compares all files below a folder: who has many of them can
see at once which are read otherwise.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

import assimp_py
import numpy as np

import lixel as lx

# Others have axes and units of their own, which assimp takes otherwise.
ENDINGS = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")

ROUNDING = 2e-6
"""In parts of a scene's size: assimp keeps float32."""


def triangles(path: Path) -> np.ndarray:
    """(n, 3, 3): the corners of each triangle, where its nodes put it."""
    scene = assimp_py.import_file(str(path), assimp_py.Process_Triangulate)
    found = [np.zeros((0, 3, 3))]
    pending = [(scene.root_node, np.eye(4))]
    while pending:
        node, world = pending.pop()
        world = world @ np.array(node.transformation, np.float64).reshape(4, 4)
        pending += [(child, world) for child in node.children]
        for number in node.mesh_indices or ():
            mesh = scene.meshes[number]
            faces = np.asarray(() if mesh.indices is None else mesh.indices)
            if len(faces) == 3 * mesh.num_faces:  # else points or lines
                positions = np.asarray(mesh.vertices, np.float64).reshape(-1, 3)
                moved = positions @ world[:3, :3].T + world[:3, 3]
                found.append(moved[faces.reshape(-1, 3)])
    return np.concatenate(found)


def difference(found: np.ndarray, expected: np.ndarray) -> float:
    """How far the triangles of two files are apart, in parts of their size; infinite where they are
    not as many.

    Neither the order of the triangles counts nor at which corner each begins. Numbers that are
    sorted stay as near to one another as they were, so that rounding changes little; eight random
    numbers of each triangle tell it from all others.
    """
    if found.shape != expected.shape:
        return np.inf
    if not len(found):
        return 0.0
    size = np.ptp(expected.reshape(-1, 3), axis=0).max()
    random = np.random.default_rng(1)
    worst = 0.0
    for _ in range(8):
        direction, weights = random.normal(size=3), random.normal(size=3)
        # Distances of corners along a line, from the nearest to the farthest.
        here, there = (np.sort(np.sort(s @ direction) @ weights) for s in (found, expected))
        worst = max(worst, float(np.abs(here - there).max()))
    return worst / (size or 1.0)


def outcome(path: Path) -> str:
    """What the two readers say of a file."""
    try:
        with warnings.catch_warnings(record=True):
            warnings.simplefilter("always")
            scene = lx.load(path)
    except ValueError as error:
        return f"refused: {error}"
    found = scene.vertices[scene.faces]
    named = "".join(f"; without {word}" for word in scene.unsupported)
    try:
        expected = triangles(path)
    except (RuntimeError, ValueError) as error:
        return f"{len(found):,} triangles, and assimp fails: {' '.join(str(error).split())}{named}"
    apart = difference(found, expected)
    if apart <= ROUNDING:
        return f"{len(found):,} triangles, the same{named}"
    return f"OTHER: {len(found):,} triangles, {len(expected):,} by assimp, {apart:.1g} apart{named}"


if __name__ == "__main__":
    for file in sorted(Path(sys.argv[1]).rglob("*")):
        if file.suffix.lower() in ENDINGS and file.is_file():
            print(f"{file}: {outcome(file)}", flush=True)
