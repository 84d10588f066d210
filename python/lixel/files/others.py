"""Formats that trimesh reads."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from .contents import Contents, Part

ENDINGS = (".off", ".3mf", ".dae")


def read(path: Path) -> Contents:
    """The meshes of a file, where its nodes stand."""
    import trimesh

    # Nothing is merged or repaired, so that vertices keep their bits.
    scene = trimesh.load_scene(path, process=False, skip_materials=True)
    contents = Contents()
    for node in scene.graph.nodes_geometry:
        world_from_node, name = scene.graph[node]
        mesh = scene.geometry[name]
        if not isinstance(mesh, trimesh.Trimesh):
            continue
        positions = np.asarray(mesh.vertices, dtype=np.float64)
        if not np.array_equal(world_from_node, np.eye(4)):
            positions = positions @ world_from_node[:3, :3].T + world_from_node[:3, 3]
        contents.parts.append(Part(positions, np.asarray(mesh.faces, np.int64), str(node)))
    return contents
