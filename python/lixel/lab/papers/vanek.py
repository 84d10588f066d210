"""Table 1 of J. Vaněk, J. Navrátil, A. Herout, P. Zemčík, "High-quality shadows with improved
paraboloid mapping", ISVC 2011."""

from __future__ import annotations

from ...light import PointLight
from .tables import Row, SubstituteScene, Table

PAPER = "J. Vaněk, J. Navrátil, A. Herout, P. Zemčík, ISVC 2011"

TABLES = (
    Table(
        "vanek-1",
        "Paraboloids, in frames per second",
        f"{PAPER}, Table 1",
        (1600, 1200),
        512,
        {
            "Sibenik": SubstituteScene("colonnade", {"detail": 24}, PointLight((0.4, 3.4, -9.3))),
            "Car": SubstituteScene(
                "objects_on_floor", {"count": 140, "subdivisions": 3}, PointLight((-14, 16, 10))
            ),
            "Trees": SubstituteScene("grass", {"blades": 30000}, PointLight((-60, 70, -25))),
        },
        (
            Row("DPSM 512²", "dual_paraboloid", (102.0, 97.0, 135.0)),
            Row("DPSM 2048²", "dual_paraboloid", (78.0, 84.0, 123.0), {"resolution": 2048}),
            Row("IPSM 512²", "improved_paraboloid", (95.0, 107.0, 148.0), {"cut": "frustum"}),
            Row(
                "IPSM 2048²",
                "improved_paraboloid",
                (76.0, 95.0, 134.0),
                {"cut": "frustum", "resolution": 2048},
            ),
        ),
        base="DPSM 512²",
        unit="fps",
        remark="The paper's uniform map is left out: one map does not hold all sides of a light.",
    ),
)
