"""Polygons as triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from .contents import Faces, Positions

_ROUNDING = 1e-12
"""A corner between two edges of one line turns by no more than this, in parts of the polygon."""

_FLAT = 1e-6
"""A polygon is flat if its corners are this near to a plane, in parts of its size."""


def triangulated(
    positions: Positions, corners: npt.NDArray[np.int64], sizes: npt.NDArray[np.int64]
) -> tuple[Faces, npt.NDArray[np.int64]]:
    """Triangles that cover polygons, and the polygon of each.

    A polygon is cut from its first corner where that covers it, as most programs do it, and by ear
    clipping where it has notches. Polygons of fewer than three corners are none.

    Parameters
    ----------
    positions : (n, 3) float64
    corners : (c,) int64
        Rows of `positions`, one polygon after another.
    sizes : (p,) int64
        How many corners each polygon has.
    """
    counts = np.maximum(sizes - 2, 0)
    first_corner, first_triangle = np.cumsum(sizes) - sizes, np.cumsum(counts) - counts
    faces = np.full((int(counts.sum()), 3), -1, dtype=np.int64)
    for size in np.unique(sizes[sizes > 2]):
        polygons = np.flatnonzero(sizes == size)
        rows = corners[first_corner[polygons, None] + np.arange(size)]
        fans = np.stack([np.repeat(rows[:, :1], size - 2, 1), rows[:, 1:-1], rows[:, 2:]], axis=2)
        if size > 3:
            _cut_notched(positions, rows, fans)
        faces[first_triangle[polygons, None] + np.arange(size - 2)] = fans
    owners = np.repeat(np.arange(len(sizes)), counts)
    filled = faces[:, 0] >= 0
    return faces[filled], owners[filled]


def _cut_notched(positions: Positions, rows: Faces, fans: Faces) -> None:
    """Cut polygons of one size again where their fan does not cover them."""
    notched = np.flatnonzero(~_covered_by_fans(positions, fans))
    if rows.shape[1] == 4:
        # The other diagonal, where that one covers it.
        other = rows[notched][:, [[1, 2, 3], [1, 3, 0]]]
        better = _covered_by_fans(positions, other)
        fans[notched[better]] = other[better]
        return
    for i in notched:
        ears = _ears(positions[rows[i]])
        fans[i] = -1
        fans[i, : len(ears)] = rows[i][ears]


def _covered_by_fans(positions: Positions, fans: Faces) -> npt.NDArray[np.bool_]:
    """Whether all triangles of a polygon's fan are turned as the polygon is."""
    first, second, third = (positions[fans[..., i]] for i in range(3))
    areas = np.cross(second - first, third - first)
    normal = areas.sum(axis=1)
    turned = np.einsum("ptx,px->pt", areas, normal)
    square = np.einsum("px,px->p", normal, normal)
    return np.asarray((turned >= -_ROUNDING * square[:, None]).all(axis=1))


def _ears(points: Positions) -> npt.NDArray[np.int64]:
    """A polygon's triangles by ear clipping, in the plane that it faces."""
    import mapbox_earcut

    following = np.roll(points, -1, axis=0)
    normal = np.cross(points - points[0], following - points[0]).sum(axis=0)
    kept = [axis for axis in range(3) if axis != np.argmax(np.abs(normal))]
    flat = np.ascontiguousarray(points[:, kept])
    found = mapbox_earcut.triangulate_float64(flat, np.array([len(flat)], dtype=np.uint32))
    ears = np.asarray(found, dtype=np.int64).reshape(-1, 3)
    # Corners on a line of the plane have no ear; in space that line may be bent, and then it has.
    heights = (points - points[0]) @ normal
    is_flat = np.ptp(heights) <= _FLAT * np.linalg.norm(normal) * np.ptp(points, axis=0).max()
    if len(ears) < len(points) - 2 and not is_flat:
        steps = np.arange(1, len(points) - 1)
        return np.stack([0 * steps, steps, steps + 1], axis=1)
    return ears
