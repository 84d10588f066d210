"""Points anywhere in space, and which of them lights reach."""

from __future__ import annotations

from collections.abc import Sequence
from typing import SupportsIndex

import numpy as np
import numpy.typing as npt

from . import _core
from .arguments import REAL, array_of, count, instance, reals
from .light import Light, one_or_several
from .scene import Scene

FLOAT64_ROUNDING = 2.0**-48
"""What float64 rounds of a coordinate on its way, as a share of it: 32 times one step's error."""

STEPS_OF_ROUNDING = 4
"""What any other type may have rounded of a coordinate, in the steps between two of its numbers."""

MAX_COORDINATE = 1e30
"""Squares of lengths must stay finite."""

SECONDS_BEFORE_BAR = 2.0
"""Work that takes longer shows how far it is."""


def shadows_at(
    scene: Scene,
    points: npt.ArrayLike,
    light: Light | Sequence[Light],
    normals: npt.ArrayLike | None = None,
    *,
    threads: SupportsIndex | None = None,
    progress: bool = True,
) -> npt.NDArray[np.float32]:
    """Which points the light, or each of several lights, reaches; exact, on all cores of the CPU.

    A point is in shadow where a triangle stands between it and the light, or where it is outside of
    the light's cone. It may be anywhere; of a point on a surface rounding does not say on which
    side of it it is. With a normal the side is known: a point that faces away from the light is in
    shadow, and the surface of one that faces it does not stand in its way. Without normals no
    triangle shadows a point that lies in its plane within rounding, so that a point on a wall is
    lit where the light reaches the wall from either side. A triangle in whose plane the light lies
    shadows nothing.

    Rounding is that of the array's type: of float64 points 4e-15 of the distance to the origin, of
    float32 points 5e-7. Points that are known less well need normals and a step along them.

    What can be is found once for all lights: a year of the sun is one call.

    Parameters
    ----------
    scene : Scene
    points : (n, 3) float
        In world space.
    light : Light, or list or tuple of them
    normals : (n, 3) float, optional
        Away from the surfaces that points lie on, in world space, of any length but zero.
    threads : int, optional
        From 1 to 1024. None: as many as the environment variable ``LIXEL_THREADS`` says, else
        ``RAYON_NUM_THREADS``, else as there are cores.
    progress : bool
        Show a bar on stderr where it takes longer than two seconds.

    Returns
    -------
    (n,) float32
        1 lit, 0 in shadow. For ``L`` lights (L, n), in their order.

    Raises
    ------
    TypeError, ValueError
        Arguments of another type or shape, points and normals that are not finite, a normal of
        zero length; the message names the argument, the rule and the row.

    Examples
    --------
    >>> import lixel as lx
    >>> scene = lx.scenes.plane_and_box()
    >>> lx.shadows_at(scene, [(0, -1, 0), (5, 1, 0)], lx.DirectionalLight((0, -1, 0)))
    array([0., 1.], dtype=float32)
    """
    instance("scene", scene, Scene)
    lights, is_list = one_or_several(light)
    positions, rounding = _points(points)
    turned = None if normals is None else _normals(normals, len(positions))
    from tqdm import tqdm

    with tqdm(
        desc="points",
        total=len(lights) * len(positions),
        unit_scale=True,
        leave=False,
        delay=SECONDS_BEFORE_BAR,
        disable=not progress,
    ) as bar:
        visibility = _core.shadows_at(
            scene._core,
            (positions, rounding),
            turned,
            [one._core for one in lights],
            None if threads is None else count("threads", threads),
            bar.update,
        )
    return visibility if is_list else visibility[0]


def _points(value: npt.ArrayLike) -> tuple[npt.NDArray[np.float64], float]:
    """Positions, and what rounding does to a coordinate, as a share of it."""
    dtype = array_of(REAL, "points", value, ("n", 3)).dtype
    positions = reals("points", value, "n", 3)
    bad = np.logical_not((np.abs(positions) < MAX_COORDINATE).all(axis=1))
    _refuse_rows("points", f"finite and below {MAX_COORDINATE:g} in size", positions, bad)
    step = np.finfo(dtype).eps if dtype.kind == "f" else 0.0
    return positions, max(FLOAT64_ROUNDING, STEPS_OF_ROUNDING * float(step))


def _normals(value: npt.ArrayLike, point_count: int) -> npt.NDArray[np.float64]:
    normals = reals("normals", value, "n", 3)
    if len(normals) != point_count:
        raise ValueError(f"normals must be as many as points, {point_count}, got {len(normals)}")
    largest = np.abs(normals).max(axis=1, initial=0.0)
    bad = np.logical_not((largest > 0.0) & (largest < np.inf))
    _refuse_rows("normals", "finite and not of zero length", normals, bad)
    # Scaled, so that neither tiny nor huge vectors under- or overflow.
    return np.asarray(normals / largest[:, None])


def _refuse_rows(
    name: str, rule: str, values: npt.NDArray[np.float64], bad: npt.NDArray[np.bool_]
) -> None:
    if bad.any():
        row = int(bad.argmax())
        raise ValueError(f"{name} must be {rule}: row {row} is {values[row].tolist()}")
