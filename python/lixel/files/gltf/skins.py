"""Skins at rest: vertices go where their joints are, and the mesh's own node counts for nothing."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..contents import Positions
from .accessors import accessor
from .document import Document
from .nodes import Matrix, parent_from_node
from .primitives import Primitive


def skinned(document: Document, skin: int, primitive: Primitive, world: JointsInWorld) -> Positions:
    """The vertices of a primitive in world space, posed by a skin."""
    joints, weights = _influences(primitive)
    matrices = _joint_matrices(document, skin, world)
    if joints.size and joints.max() >= len(matrices):
        raise ValueError(f"it has joint {joints.max()}, and its skin has {len(matrices)}")
    posed = np.zeros_like(primitive.positions)
    ends = np.concatenate([primitive.positions, np.ones((len(posed), 1))], axis=1)
    for joint, weight in zip(joints.T, weights.T, strict=True):
        posed += weight[:, None] * np.einsum("nij,nj->ni", matrices[joint][:, :3], ends)
    return posed


class JointsInWorld:
    """World from node of the nodes that are joints, in the scene or not."""

    def __init__(self, document: Document, world_from_file: Matrix) -> None:
        self._document = document
        self._world_from_file = world_from_file
        self._parents = {
            child: index
            for index, node in enumerate(document.items("nodes"))
            for child in node.get("children", [])
        }
        self._known: dict[int, Matrix] = {}

    def of(self, index: int) -> Matrix:
        """World from this node."""
        path: list[int] = []
        at: int | None = index
        while at is not None and at not in self._known:
            if len(path) > len(self._document.items("nodes")):
                raise ValueError(f"joint {index} is its own ancestor")
            path.append(at)
            at = self._parents.get(at)
        world = self._world_from_file if at is None else self._known[at]
        for node in reversed(path):
            world = world @ parent_from_node(self._document.item("nodes", node))
            self._known[node] = world
        return world


def _joint_matrices(document: Document, skin: int, world: JointsInWorld) -> npt.NDArray[np.float64]:
    entry = document.item("skins", skin)
    joints = entry["joints"]
    matrices = np.array([world.of(joint) for joint in joints])
    if "inverseBindMatrices" in entry:
        inverse = accessor(document, entry["inverseBindMatrices"])
        if len(inverse) < len(joints) or inverse.shape[1] != 16:
            raise ValueError(f"its skin has {len(joints)} joints and {len(inverse)} bind matrices")
        columns = inverse[: len(joints)].astype(np.float64).reshape(-1, 4, 4)
        matrices = matrices @ columns.transpose(0, 2, 1)
    return matrices


def _influences(primitive: Primitive) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.float64]]:
    """Joints and weights of each vertex, (n, 4 k) both; weights that sum to one."""
    joints, weights = [], []
    for i in range(len(primitive.entry["attributes"])):
        joint, weight = primitive.attribute(f"JOINTS_{i}"), primitive.attribute(f"WEIGHTS_{i}")
        if joint is None or weight is None:
            break
        joints.append(joint.astype(np.int64))
        weights.append(weight.astype(np.float64))
    if not joints:
        raise ValueError("it has a skin, and no JOINTS_0 and WEIGHTS_0")
    rows = {len(a) for a in (*joints, *weights)}
    if rows != {len(primitive.positions)}:
        raise ValueError("its joints, weights and positions must be as many as its vertices")
    joint, weight = np.concatenate(joints, axis=1), np.concatenate(weights, axis=1)
    if not (np.isfinite(weight) & (weight >= 0)).all():
        raise ValueError("its weights must be finite and not negative")
    total = weight.sum(axis=1, keepdims=True)
    # A vertex that no joint moves goes with its first, as in the viewers.
    weight[total[:, 0] == 0, 0] = 1.0
    weight /= np.where(total > 0, total, 1.0)
    # What has no weight may name any joint.
    return np.where(weight > 0, joint, 0), weight
