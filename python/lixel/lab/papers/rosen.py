"""Tables 1 to 3 of P. Rosen, "Rectilinear texture warping for fast adaptive shadow mapping", I3D
2012."""

from __future__ import annotations

from collections.abc import Sequence

from ...light import PointLight
from .. import passes
from .tables import Figure, Row, SubstituteScene, Table

PAPER = "P. Rosen, I3D 2012"

PLAYGROUND = SubstituteScene("objects_on_floor", {"count": 160})
SCENES = {
    "Playground": PLAYGROUND,
    "Sandbox": SubstituteScene("city", {"blocks": 26}),
    "Town": SubstituteScene("city", {"blocks": 112}),
}
FORWARD = {"analysis": "forward"}
HYBRID = {"analysis": "hybrid"}

LINEAR = {"lookup": "depth", "rasterization": "linear"}
SPLIT = ((None, "not split"), (0.05, "5 %"), (0.025, "2.5 %"), (0.01, "1 %"))
DRAWN = {
    "shadow map, ms": f"pass_ms.{passes.SHADOW_MAP}",
    "triangles drawn": f"stats.{passes.SHADOW_MAP}.rasterized",
}


def straight_and_exact(
    method: str, figures: Sequence[tuple[Figure | None, ...]] = ((None,),) * 4
) -> tuple[Row, ...]:
    """Straight edges, split or not, with the paper's figures of each, and exact ones."""
    straight = (
        Row(f"{method}, {words}", method, given, {**LINEAR, "tessellation": share})
        for (share, words), given in zip(SPLIT, figures, strict=True)
    )
    none = (None,) * len(figures[0])
    return (*straight, Row(f"{method}, exact", method, none, {"lookup": "depth"}))


TABLES = (
    Table(
        "rosen-1",
        "Range of frame times on a path",
        f"{PAPER}, Table 1",
        (1920, 1080),
        2048,
        SCENES,
        (
            Row("Conventional", "uniform", ((2.7, 3.6), (1.9, 2.1), (2.7, 3.2))),
            Row("Forward Analysis", "rtw", ((5.3, 7.0), (4.2, 5.3), (3.7, 4.8)), FORWARD),
            Row("Backward Analysis", "rtw", ((4.2, 5.9), (4.0, 5.4), (3.7, 4.8))),
            Row("Hybrid Analysis", "rtw", ((5.8, 7.3), (5.0, 5.7), (4.5, 5.4)), HYBRID),
        ),
        base="Conventional",
        path=4,
    ),
    Table(
        "rosen-2",
        "Stages of the pipeline",
        f"{PAPER}, Table 2",
        (1920, 1080),
        2048,
        {"Playground": PLAYGROUND},
        (
            Row("Conventional", "uniform", (0.0, 0.0, 1.3, 1.8)),
            Row("Forward Analysis", "rtw", (1.3, 0.1, 2.2, 1.9), FORWARD),
            Row("Backward Analysis", "rtw", (1.4, 0.3, 2.2, 0.9)),
            Row("Hybrid Analysis", "rtw", (2.7, 0.4, 2.0, 1.1), HYBRID),
        ),
        base="Conventional",
        stages={
            "(a) importance map": passes.RECEIVERS + passes.FIT + passes.IMPORTANCE,
            "(b) warping map": (passes.WARP_MAP,),
            "(c) shadow map": (passes.SHADOW_MAP,),
            "(d) output": (passes.VISIBILITY, passes.LOOKUP),
        },
        remark="Forward and hybrid analysis render the light's depth image first, which the paper "
        "counts to (a), and we, as it is the same pass, to (c).",
    ),
    Table(
        "rosen-3",
        "Straight edges between warped corners",
        f"{PAPER}, Table 3",
        (1920, 1080),
        2048,
        SCENES,
        straight_and_exact(
            "rtw",
            (
                ((4.3, 5.4), (3.8, 4.8), (3.8, 5.0)),
                ((5.5, 6.9), (5.2, 5.9), (8.4, 9.5)),
                ((5.8, 7.0), (5.9, 7.0), (10.9, 11.9)),
                ((6.0, 7.2), (8.0, 9.5), (16.5, 17.4)),
            ),
        ),
        base="rtw, not split",
        details=DRAWN,
        remark="Triangles are split until no edge in the map is longer than the share of its side. "
        "The exact rows, which the paper has not, take each texel's own ray.",
    ),
    Table(
        "rosen-3-warps",
        "Straight edges between warped corners, and exact ones",
        "as Rosen's Table 3",
        (1920, 1080),
        1024,
        {"colonnade": SubstituteScene("colonnade")},
        straight_and_exact("rtw") + straight_and_exact("notw"),
        base="rtw, not split",
        details=DRAWN,
    ),
    Table(
        "rosen-3-paraboloids",
        "Straight edges between corners on paraboloids, and exact ones",
        "as Rosen's Table 3",
        (1920, 1080),
        1024,
        {
            "colonnade": SubstituteScene("colonnade", light=PointLight((0.4, 3.4, -9.3))),
            "plane and box": SubstituteScene("plane_and_box", light=PointLight((0.3, 4.0, 0.2))),
        },
        straight_and_exact("dual_paraboloid", ((None, None),) * 4),
        base="dual_paraboloid, not split",
        details=DRAWN,
    ),
    Table(
        "rosen-figure-1",
        "RTW at 512² beside a conventional map of 2048²",
        f"{PAPER}, Figure 1",
        (1920, 1080),
        2048,
        {"Playground": PLAYGROUND},
        (
            Row("Conventional 2048²", "uniform", (3.1,)),
            Row("RTW 512²", "rtw", (4.8,), {"resolution": 512}),
            Row("RTW 2048²", "rtw", (4.8,)),
        ),
        base="Conventional 2048²",
        remark="The paper's figure shows pictures; its times are those of Table 2, at 2048².",
    ),
)
