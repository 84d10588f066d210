"""Tables and figures of P. Rosen, "Rectilinear texture warping for fast adaptive shadow mapping",
I3D 2012."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...light import PointLight
from ...methods import Pcf
from .. import passes
from .figures import ROSEN, Figures, columns_of, rows_of, source
from .tables import Row, SubstituteScene, Table, both

PAPER = "rosen-2012"

PLAYGROUND = SubstituteScene("objects_on_floor", {"count": 160}, quick={"subdivisions": 3})
SANDBOX = SubstituteScene("city", {"blocks": 26})
TOWN = SubstituteScene("city", {"blocks": 112}, quick={"blocks": 40})
SCENES = {"Playground": PLAYGROUND, "Sandbox": SANDBOX, "Town": TOWN}

ANALYSES: Mapping[str, Mapping[str, Any]] = {
    "Forward Analysis": {"analysis": "forward"},
    "Backward Analysis": {"analysis": "backward"},
    # Without the edge function there is no use of the depth image: section 4.1 and 5.3.
    "Hybrid Analysis": {"analysis": "hybrid", "importance": "desired_view*distance*shadow_edge"},
}
NORMAL = "desired_view*distance*normal"

FILTERS = {
    "warped": Pcf(radius=2.0, weights="gaussian", jitter=True),
    "unwarped": Pcf(radius=0.1, space="unwarped", weights="gaussian", jitter=True),
}
"""Section 6.2: jittered tests with Gaussian weights, in the map or in the world."""

GOOD_SPLIT = 0.025
"""Of the largest edge: "a good balance", section 6.1. Table 1 does not say which it has."""

WHOLE: Mapping[str, Any] = {"tessellation": None}
"""The captions of most figures, and the first rows of Table 1: tessellation disabled."""

SPLIT = ((None, "Disabled"), (0.05, "5 %"), (0.025, "2.5 %"), (0.01, "1 %"))
DRAWN = {
    "shadow map, ms": f"pass_ms.{passes.SHADOW_MAP}",
    "triangles drawn": f"stats.{passes.SHADOW_MAP}.rasterized",
}
STAGES = {
    "(a) importance map": (passes.FACING, *passes.FIT, *passes.IMPORTANCE),
    "(b) warping map": (passes.WARP_MAP,),
    "(c) shadow map": passes.DRAWING,
    "(d) output": (passes.VISIBILITY, passes.LOOKUP),
}


def analyses(figures: Mapping[str, Figures]) -> tuple[Row, ...]:
    """A conventional map, and each analysis: as published without and with tessellation, and
    lixel's, whose exact rasterization splits nothing."""
    rows = [*both("Conventional", "uniform", PAPER, figures["Conventional"])]
    for name, parameters in ANALYSES.items():
        published, own = both(name, "rtw", PAPER, figures[name], **WHOLE, **parameters)
        split = f"{name}, tessellated"
        more = {**parameters, "tessellation": GOOD_SPLIT}
        # Where a table has stages, the tessellated frame differs in one of them.
        own_figures = {**figures[name], **figures[split]}
        rows += [published, Row(split, published.method, own_figures, more), own]
    return tuple(rows)


def straight_and_exact(
    method: str, figures: Mapping[str, Figures] | None = None
) -> tuple[Row, ...]:
    """Straight edges, split or not, with the paper's figures of each, and exact ones."""
    given = figures or {}
    straight = (
        Row(words, f"{method}@published", given.get(words, {}), {"tessellation": share})
        for share, words in SPLIT
    )
    exact = Row("exact", f"{method}@published", {}, {"rasterization": "exact"})
    return (*straight, exact, Row("lixel's best", method))


def _captions() -> dict[str, tuple[Row, ...]]:
    """The rows of the figures whose captions give times and maximum effective resolutions."""
    figures = {
        name: {row: {**own, _SCENE_OF[name]: own["time"]} for row, own in rows.items()}
        for name, rows in ((n, rows_of(ROSEN, f"Figure {n}")) for n in _SCENE_OF)
    }
    plain, distance, edges = figures["3"]
    near, normal = figures["6"]
    whole, split = figures["7"]
    one, sharp, soft = figures["8"]
    split_as = {"tessellation": GOOD_SPLIT}
    small: dict[str, Any] = {"resolution": 512, **WHOLE}
    middle: dict[str, Any] = {"resolution": 1024, **WHOLE}
    sharpened = {**middle, "lookup": FILTERS["warped"]}
    softened = {**middle, "lookup": FILTERS["unwarped"]}
    return {
        "1": (
            *both("Conventional 2048²", "uniform", PAPER, figures["1"]["Conventional 2048²"]),
            *both("RTW 512²", "rtw", PAPER, figures["1"]["RTW 512²"], **small),
            *both("RTW 2048²", "rtw", PAPER, figures["1"]["RTW 2048²"], **WHOLE),
        ),
        "3": (
            *both(plain, "uniform", PAPER, figures["3"][plain]),
            *both(distance, "rtw", PAPER, figures["3"][distance], **small),
            *both(edges, "rtw", PAPER, figures["3"][edges], **small, **ANALYSES["Hybrid Analysis"]),
        ),
        "6": (
            *both(near, "rtw", PAPER, figures["6"][near], **WHOLE),
            *both(normal, "rtw", PAPER, figures["6"][normal], **WHOLE, importance=NORMAL),
        ),
        "7": (
            Row(whole, "rtw@published", figures["7"][whole], WHOLE),
            Row(split, "rtw@published", figures["7"][split], split_as),
            Row("exact", "rtw@published", {}, {"rasterization": "exact"}),
        ),
        "8": (
            Row(one, "rtw@published", figures["8"][one], middle),
            Row(sharp, "rtw@published", figures["8"][sharp], sharpened),
            Row(soft, "rtw@published", figures["8"][soft], softened),
        ),
    }


_SCENE_OF = {"1": "Playground", "3": "Sandbox", "6": "Playground", "7": "Playground",
             "8": "Playground"}  # fmt: skip
_TITLES = {
    "1": "RTW at 512² beside a conventional map of 2048²",
    "3": "A small map by its importance functions",
    "6": "The surface normal function",
    "7": "Tessellation",
    "8": "Percentage closer filtering",
}
_REMARKS = {
    "1": "By the paper RTW at 512² is about as good as the conventional map; see `lixel lab "
    "rankings` for when it is.",
    "8": "A filtered pixel counts as lit or in shadow by its larger half.",
}

TABLES = (
    Table(
        "rosen-1",
        "Range of frame times on a path",
        source(ROSEN, "Table 1"),
        (1920, 1080),
        2048,
        SCENES,
        analyses(rows_of(ROSEN, "Table 1")),
        base="Conventional",
        path=4,
        ranking=("Conventional", "Backward Analysis"),
    ),
    Table(
        "rosen-2",
        "Stages of the pipeline",
        source(ROSEN, "Table 2"),
        (1920, 1080),
        2048,
        {"Playground": PLAYGROUND},
        analyses(columns_of(ROSEN, "Table 2")),
        base="Conventional",
        stages=STAGES,
        as_shares=True,
        remark="Forward and hybrid analysis render the light's depth image first, which the paper "
        "counts to (a), and we, as it is the same pass, to (c).",
    ),
    Table(
        "rosen-3",
        "Straight edges between warped corners",
        source(ROSEN, "Table 3"),
        (1920, 1080),
        2048,
        SCENES,
        straight_and_exact("rtw", columns_of(ROSEN, "Table 3")),
        base="Disabled",
        details=DRAWN,
        remark="Triangles are split until no edge in the map is longer than the share of its side. "
        "The exact rows, which the paper has not, take each texel's own ray.",
    ),
    Table(
        "rosen-3-warps",
        "The same of a map of a non-orthogonal warp",
        "as Rosen's Table 3",
        (1920, 1080),
        1024,
        {"colonnade": SubstituteScene("colonnade")},
        straight_and_exact("notw"),
        base="Disabled",
        details=DRAWN,
    ),
    Table(
        "rosen-3-paraboloids",
        "The same of paraboloids",
        "as Rosen's Table 3",
        (1920, 1080),
        1024,
        {
            "colonnade": SubstituteScene("colonnade", light=PointLight((0.4, 3.4, -9.3))),
            "plane and box": SubstituteScene("plane_and_box", light=PointLight((0.3, 4.0, 0.2))),
        },
        straight_and_exact("dual_paraboloid"),
        base="Disabled",
        details=DRAWN,
    ),
    *(
        Table(
            f"rosen-figure-{number}",
            _TITLES[number],
            source(ROSEN, f"Figure {number}"),
            (1920, 1080),
            2048,
            {_SCENE_OF[number]: SCENES[_SCENE_OF[number]]},
            rows,
            base=rows[0].name,
            has_mer=True,
            remark=_REMARKS.get(number, ""),
        )
        for number, rows in _captions().items()
    ),
)
