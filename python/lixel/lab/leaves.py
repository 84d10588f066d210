"""Holes for the leaves of a scene that has none: cards whose images were lost with its textures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from ..masks import AlphaMask
from ..scene import Scene
from .brute_force import Triangles

MIN_PIECES = 20
"""An object of fewer loose pieces is no plant."""

OPEN = 0.05
"""From this share of its edges at one triangle alone on, a piece is a card, not a body."""


def leaf(size: int = 64) -> AlphaMask:
    """A pinnate leaf along u: leaflets on both sides of a rib. Its rims are soft, so that they lie
    between the middles of texels."""
    places = (np.arange(size) + 0.5) / size
    along, aside = np.meshgrid(places, 2.0 * np.abs(places - 0.5))
    outline = np.sqrt(np.maximum(1.0 - (2.0 * along - 1.0) ** 2, 0.0))
    # Leaflets point to the tip.
    leaflets = 0.5 + 0.5 * np.cos(2.0 * np.pi * 7.0 * (along - 0.12 * aside))
    reach = np.maximum(outline * (0.35 + 0.65 * leaflets), 0.12)
    alpha = 0.5 + 4.0 * (reach - aside)
    return AlphaMask(np.clip(255.0 * alpha, 0.0, 255.0).astype(np.uint8), wrap="clamp")


def leafy(scene: Scene) -> Triangles:
    """The arrays of a scene, the cards of whose plants have the image of a leaf.

    A plant is an object of many loose pieces; a card is a piece that is open. The image lies in the
    plane of each card along its longest extent, once over all of it.

    Raises
    ------
    ValueError
        There is no plant.
    """
    uv = np.zeros((scene.triangle_count, 3, 2))
    face_alpha = np.full(scene.triangle_count, -1, np.int64)
    for number in range(len(scene.objects)):
        own = np.flatnonzero(scene.object_id == number)
        pieces, is_card = _pieces(scene.vertices[scene.faces[own]])
        if len(is_card) < MIN_PIECES:
            continue
        for piece in np.flatnonzero(is_card):
            card = own[pieces == piece]
            uv[card] = _in_own_plane(scene.vertices[scene.faces[card]])
            face_alpha[card] = 0
    if (face_alpha < 0).all():
        raise ValueError(
            f"scene must have plants, objects of at least {MIN_PIECES} loose pieces, got none"
        )
    return Triangles(scene.vertices, scene.faces.astype(np.int64), uv, face_alpha, (leaf(),))


def _pieces(
    corners: npt.NDArray[np.float64],
) -> tuple[npt.NDArray[np.int64], npt.NDArray[np.bool_]]:
    """Of each triangle (n, 3, 3) the number of its piece, joined where corners are at the same
    place, and of each piece whether it is open."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    _, joined = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    faces = joined.reshape(-1, 3)
    edges = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
    size = faces.max(initial=-1) + 1
    graph = coo_matrix((np.ones(len(edges), bool), tuple(edges.T)), (size, size))
    count, label = connected_components(graph, directed=False)
    pieces = label[faces[:, 0]].astype(np.int64)
    _, edge, uses = np.unique(edges, axis=0, return_inverse=True, return_counts=True)
    is_rim = (uses == 1)[edge.ravel()]
    of_edges = np.repeat(pieces, 3)
    rims = np.bincount(of_edges, is_rim, count) / np.maximum(np.bincount(of_edges, None, count), 1)
    return pieces, rims > OPEN


def _in_own_plane(corners: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """(n, 3, 2): places from 0 to 1 of corners (n, 3, 3) in their plane of least squares, along its
    two axes."""
    points = corners.reshape(-1, 3)
    centred = points - points.mean(axis=0)
    _, _, axes = np.linalg.svd(centred, full_matrices=False)
    places = centred @ axes[:2].T
    low, high = places.min(axis=0), places.max(axis=0)
    shares = (places - low) / np.maximum(high - low, 1e-300)
    return np.asarray(shares.reshape(-1, 3, 2))
