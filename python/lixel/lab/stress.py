"""Count the pixels that each method misclassifies in hard views, and hold them to a bound.

Each view is rendered with each method and compared with the reference. The bounds are stated, and
the same for all:

* `exact` and `ray_traced` misclassify no pixel; ties of the reference are never counted.
* `shadow_volumes` may misclassify pixels nearer than one to an edge of a shadow or to an outline:
  the hardware that draws the volumes snaps their corners to a fraction of a pixel.
* A view that is a plain one moved, scaled or with other planes of depth, or under a lamp so far
  away that it is as good as a directional light, has no more misclassified pixels than the plain
  one, and three standard deviations of such a count: the texels fall elsewhere. The same holds for
  a sun along walls against that sun turned by a degree, for a lamp in the plane of a wall against
  one a degree before it, and for a low sun against one of 1 degree.
* In any other view, and with a method that does not take the plain one's light, a map may
  misclassify pixels where its texels are too wide: nearer than three of them and one pixel to an
  edge of a shadow, or to an outline, behind which one may hide.

What is beyond its bound is a fault, or one of the known `LIMITS`.
"""

from __future__ import annotations

import argparse
import functools
import math
import warnings
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from ..arguments import needs
from ..compare import Comparison, compare
from ..frame import Frame, render
from ..methods import Method, method_from
from ..reference import Reference, reference
from .hard_views import FAMILIES, WITHOUT_MAP, Case, cases, made, methods_for
from .options import MORE, add_methods, add_output, keep
from .report import progress, table
from .views import View

EXACT = ("exact", "ray_traced")
"""Methods that promise to misclassify no pixel."""

FINER = 4
"""Pixels along each side of a pixel, in the image that has the edges of what is thin."""

REACH = 3
"""Texels within which a lookup finds its answer: the receiver's own, a neighbour, the bias."""


# --- The command ---


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab stress`."""
    add_methods(parser)
    parser.add_argument(
        "--family", action="append", metavar="NAME",
        help=f"what is hard: one of {', '.join(FAMILIES)}; {MORE}; default: all",
    )  # fmt: skip
    parser.add_argument(
        "--quick", action="store_true", help="only the hardest views of each family"
    )
    add_output(parser, "table of every view, .csv or .parquet")


def run(options: argparse.Namespace) -> None:
    """Measure and save; print the sums of each method, and what is beyond its bound."""
    rows = measure(options.method, options.family, options.quick)
    print(table(summary(needs("pandas", "study").DataFrame(rows))))
    print(table([row for row in rows if row["beyond"] > 0]))
    keep(options, rows)


def measure(
    methods: Iterable[str] | None = None,
    families: Iterable[str] | None = None,
    quick: bool = False,
) -> list[dict[str, Any]]:
    """What `evaluate` gives: a row for each case and method.

    Without `methods` and `families` all of `lixel.METHODS` and of `FAMILIES`; an unknown name is a
    `ValueError`. `quick` takes the hardest cases of each family alone.
    """
    names = None if methods is None else list(methods)
    chosen = [case for case in cases(families) if case.quick or not quick]
    return [
        evaluate(case, method)
        for case in progress(chosen, "cases")
        for method in methods_for(case, names)
    ]


def summary(measured: Any) -> list[dict[str, Any]]:
    """For each method: cases, misclassified pixels by family, and how many cases are beyond their
    bound, and known to be."""
    rows = []
    for method, own in measured.groupby("method", sort=False):
        row: dict[str, Any] = {"method": method, "cases": len(own)}
        for family, cases_of in own.groupby("family", sort=False):
            row[family] = int(cases_of["misclassified"].sum())
        beyond = own[own["beyond"] > 0]
        row["beyond"] = len(beyond)
        row["known"] = int(beyond["limit"].notna().sum())
        rows.append(row)
    return rows


# --- One view ---


def explained(frame: Frame, truth: Reference, finer: Reference) -> npt.NDArray[np.bool_]:
    """(H, W) bool: where a map may be wrong because its texels have a width.

    Those are pixels nearer than `REACH` texels and one pixel to an edge: of a shadow, of an
    outline, or of what faces the light, beyond which no shadow is seen. Without a map they are
    those nearer than one pixel. What is thinner than a pixel has its edges in `finer`, which has
    `FINER` times as many pixels along each side.
    """
    from scipy.ndimage import distance_transform_edt

    height, width = truth.visibility.shape
    parts = _edges(finer).reshape(height, FINER, width, FINER)
    is_edge = _edges(truth) | (truth.covered & parts.any(axis=(1, 3)))
    distance = distance_transform_edt(~is_edge) if is_edge.any() else np.inf
    texels = np.nan_to_num(frame.aliasing_error.astype(np.float64), nan=np.inf, posinf=np.inf)
    if frame.method.name in WITHOUT_MAP:
        texels = np.zeros_like(texels)
    return np.asarray(truth.covered & (distance <= 1.0 + REACH * texels))


def _edges(truth: Reference) -> npt.NDArray[np.bool_]:
    """(H, W) bool: the pixels to either side of an edge."""
    is_edge = np.zeros(truth.visibility.shape, bool)
    lit, depth, facing = truth.visibility, truth.depth, truth.facing
    for here, there in ((np.s_[:-1], np.s_[1:]), (np.s_[:, :-1], np.s_[:, 1:])):
        # Comparisons with NaN are false: what is seen on one side only is an outline.
        is_same = (lit[here] == lit[there]) & (facing[here] == facing[there])
        is_same &= np.abs(depth[here] - depth[there]) < 0.1 * np.minimum(depth[here], depth[there])
        is_edge[here] |= ~is_same
        is_edge[there] |= ~is_same
    return is_edge & truth.covered


@functools.lru_cache(maxsize=4)
def _truth(make: Callable[[], View], times: int = 1) -> Reference:
    scene, camera, light = made(make)
    return reference(scene, camera.resized(times * camera.width, times * camera.height), light)


@functools.lru_cache(maxsize=64)
def _misclassified_in(plain: Callable[[], View], method: Method) -> int:
    frame = render(*made(plain), method)
    return _compared(frame, _truth(plain)).misclassified_count


def _compared(frame: Frame, truth: Reference) -> Comparison:
    # The table has a column of ties: there is no need of a warning for each row.
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)
        return compare(frame, truth, other_surfaces="count")


def evaluate(case: Case, method: str | Method) -> dict[str, Any]:
    """One method in one case: family, case, method; `misclassified` pixels; their `bound`; how many
    are `beyond` it: more than the bound, or where the texels do not explain them; `covered` pixels,
    `ties` and `float32_ties` among them; `limit`: the words of `LIMITS`, or None.
    """
    chosen = method_from(method)
    truth = _truth(case.truth or case.make)
    frame = render(*made(case.make), chosen)
    found = _compared(frame, truth)
    count = found.misclassified_count
    if chosen.name in EXACT:
        bound, beyond = 0, count
    elif case.of is not None and chosen.takes(made(case.of)[2]) and chosen.name not in WITHOUT_MAP:
        before = _misclassified_in(case.of, chosen)
        # Of few pixels it is luck how many: where four are expected, two of a hundred have none.
        bound = before + math.ceil(3.0 * math.sqrt(max(before, 4)))
        beyond = max(count - bound, 0)
    else:
        inside = explained(frame, truth, _truth(case.truth or case.make, FINER))
        bound, beyond = int(inside.sum()), int((found.misclassified & ~inside).sum())
    return {
        "family": case.family,
        "case": case.name,
        "method": chosen.name,
        "misclassified": count,
        "bound": bound,
        "beyond": beyond,
        "covered": int(truth.covered.sum()),
        "ties": found.tie_count,
        "float32_ties": found.float32_tie_count,
        "limit": limit(case, chosen.name),
    }


@dataclass(frozen=True)
class Limit:
    """What is known to be beyond its bound, and why."""

    cases: tuple[str, ...]
    methods: tuple[str, ...]
    why: str
    engines: tuple[str, ...] = ("cpu", "gpu")
    """Where it is met."""


LIMITS: tuple[Limit, ...] = (
    Limit(
        (
            "edge-on, sun at 45 degrees, 1 above the floor",
            "low sun, 2 degrees high, at 110 degrees",
        ),
        ("virtual",),
        "A level is chosen by the area of a pixel's footprint. A floor that the sun sees nearly "
        "edge-on has footprints that are long and thin, and a texel of that area reaches over 13 "
        "pixels; with level_bias=-2 one and four pixels are left.",
    ),
    Limit(
        ("huge floor, 10^6 objects wide, directional light",),
        ("plane_optimal",),
        "The shaders' float32 loses the shadow of an object on a floor a million times as wide; "
        "one pixel of it is farther from its edges than the texels reach.",
        ("gpu",),
    ),
)
"""What a suite may meet without failing."""


def limit(case: Case, method: str) -> str | None:
    """Why the method is beyond its bound in the case, if that is known."""
    found = (x.why for x in LIMITS if str(case) in x.cases and method in x.methods)
    return next(found, None)
