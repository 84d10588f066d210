"""How much of each object, or triangle, lights do not reach."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, SupportsIndex, TypeAlias, get_args

import numpy as np
import numpy.typing as npt

from .arguments import instance, real
from .light import Light, one_or_several
from .points import FLOAT64_ROUNDING, shadows_at
from .scene import Scene

By: TypeAlias = Literal["object", "material", "triangle"]

FEWEST_SAMPLES = 64
"""Of each object at first; where they do not do, twice as many are taken, and so on."""

MAX_POINTS = 1 << 22
"""Answers that are in memory at once, about."""

_ROOT = 1.2207440846057596
"""Of x^4 = x + 1: multiples of its powers fill a cube evenly (Roberts, "The unreasonable
effectiveness of quasirandom sequences", 2018)."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ShadowFractions:
    """Shares of areas; one row for each object, material or triangle.

    Attributes
    ----------
    names : tuple of str
        Of the objects or the materials; empty for triangles.
    area : (n,) float64
        Square world units, one side counted.
    fraction : (n,) or (L, n) float64
        The share of the area that the light reaches from neither side, in [0, 1]; for ``L`` lights
        a row for each. NaN where there is no area.
    error : (n,) or (L, n) float64
        Its standard error: that of as many points thrown at random. Points that are spread evenly,
        as these are, mostly come closer.
    samples : (n,) int64
        Points that were looked at.
    """

    names: tuple[str, ...]
    area: npt.NDArray[np.float64]
    fraction: npt.NDArray[np.float64]
    error: npt.NDArray[np.float64]
    samples: npt.NDArray[np.int64]


def shadow_fractions(
    scene: Scene,
    light: Light | Sequence[Light],
    by: By = "object",
    *,
    error: float = 0.01,
    threads: SupportsIndex | None = None,
    progress: bool = True,
) -> ShadowFractions:
    """Which share of each object's area is in shadow.

    Points are spread evenly over the area, and each is answered by `shadows_at`, without normals: a
    surface counts as lit where the light reaches it from either side, so that meshes need no
    orientation. What faces away on a closed object is in shadow, and so is a triangle that the
    light lies in the plane of. Where the standard error is above `error`, twice as many points are
    taken.

    Parameters
    ----------
    scene : Scene
    light : Light, or list or tuple of them
    by : str
        ``"object"`` (`Scene.objects`), ``"material"`` (`Scene.materials`) or ``"triangle"``.
    error : float
        The largest standard error of a share, from 0.0005 to 0.5. The number of points grows with
        the square of one over it.
    threads, progress
        As for `shadows_at`.

    Returns
    -------
    ShadowFractions

    Raises
    ------
    TypeError, ValueError
        The message names the argument, the rule and the value.
    """
    instance("scene", scene, Scene)
    if by not in get_args(By):
        raise ValueError(f"by must be 'object', 'material' or 'triangle', got {by!r}")
    error = real("error", error)
    if not 0.0005 <= error <= 0.5:
        raise ValueError(f"error must be from 0.0005 to 0.5, got {error}")
    lights, is_list = one_or_several(light)
    areas = _Areas(scene, by)
    count = len(areas.of_groups)
    dark = np.zeros((len(lights), count))
    samples = np.zeros(count, np.int64)
    spread = np.full((len(lights), count), np.inf)
    while (open_ := (areas.of_groups > 0.0) & (spread > error).any(axis=0)).any():
        wanted = np.where(open_, np.maximum(samples, FEWEST_SAMPLES), 0)
        for groups, numbers in _in_pieces(wanted, samples, MAX_POINTS // max(len(lights), 1)):
            points, normals = areas.points(groups, numbers)
            found = shadows_at(scene, points, lights, threads=threads, progress=progress)
            for i, one in enumerate(lights):
                is_dark = (found[i] == 0.0) | _is_along(one, points, normals)
                dark[i] += np.bincount(groups, is_dark, count)
        samples += wanted
        # As if one more had been lit, and one more dark: none of few does not mean none.
        share = (dark + 1.0) / (samples + 2.0)
        spread = np.sqrt(share * (1.0 - share) / np.maximum(samples, 1))
    with np.errstate(invalid="ignore"):
        fraction = dark / samples
    spread = np.where(samples > 0, spread, 0.0)
    return ShadowFractions(
        names=areas.names,
        area=areas.of_groups,
        fraction=fraction if is_list else fraction[0],
        error=spread if is_list else spread[0],
        samples=samples,
    )


def _in_pieces(
    wanted: npt.NDArray[np.int64], done: npt.NDArray[np.int64], most: int
) -> list[tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]]]:
    """The group and the number of each sample that is wanted, in pieces."""
    groups = np.repeat(np.arange(len(wanted)), wanted)
    starts = np.cumsum(wanted) - wanted
    numbers = np.arange(len(groups)) - starts[groups] + done[groups]
    cuts = range(most, len(groups), most)
    return list(zip(np.split(groups, cuts), np.split(numbers, cuts), strict=True))


def _is_along(
    light: Light, points: npt.NDArray[np.float64], normals: npt.NDArray[np.float64]
) -> npt.NDArray[np.bool_]:
    """Whether the light lies in the planes of points, within rounding."""
    to_light = light.vectors_from(points)
    height = np.abs(np.einsum("nc,nc->n", normals, to_light))
    size = np.linalg.norm(to_light, axis=1) + np.abs(points).max(axis=1, initial=0.0)
    return np.asarray(height <= FLOAT64_ROUNDING * size)


class _Areas:
    """The triangles of a scene, group by group."""

    def __init__(self, scene: Scene, by: By) -> None:
        corners = scene.vertices[scene.faces]
        self.names: tuple[str, ...] = ()
        group_of: npt.NDArray[np.int64] = np.arange(len(corners))
        count = len(corners)
        if by != "triangle":
            names, ids = {
                "object": (scene.objects, scene.object_id),
                "material": (scene.materials, scene.material_id),
            }[by]
            self.names, group_of, count = names, ids.astype(np.int64), len(names)
        order = np.argsort(group_of, kind="stable")
        self._corners = corners[order]
        across = np.cross(
            self._corners[:, 1] - self._corners[:, 0], self._corners[:, 2] - self._corners[:, 0]
        )
        lengths = np.linalg.norm(across, axis=1)
        self._normals = across / np.where(lengths > 0.0, lengths, 1.0)[:, None]
        areas = 0.5 * lengths
        self.of_groups = np.bincount(group_of[order], areas, count).astype(np.float64)
        self._ends = np.cumsum(areas)
        self._starts = np.cumsum(self.of_groups) - self.of_groups
        self._first = np.searchsorted(group_of[order], np.arange(count))
        self._last = np.searchsorted(group_of[order], np.arange(count), side="right") - 1

    def points(
        self, groups: npt.NDArray[np.int64], numbers: npt.NDArray[np.int64]
    ) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Samples of groups by their numbers: points and the normals of their triangles."""
        along, u, v = ((0.5 + (numbers + 1) * _ROOT**-k) % 1.0 for k in (1, 2, 3))
        place = self._starts[groups] + along * self.of_groups[groups]
        triangle = np.searchsorted(self._ends, place, side="right")
        # Sums round: a place may fall into the group beside its own.
        triangle = np.clip(triangle, self._first[groups], self._last[groups])
        root = np.sqrt(u)
        weights = np.stack([1.0 - root, root * (1.0 - v), root * v], axis=1)
        points = np.einsum("nk,nkc->nc", weights, self._corners[triangle])
        return points, self._normals[triangle]
