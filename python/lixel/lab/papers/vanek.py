"""Table 1 of J. Vanek, J. Navrátil, A. Herout, P. Zemčík, "High-quality shadows with improved
paraboloid mapping", ISVC 2011."""

from __future__ import annotations

from collections.abc import Iterator

from ...light import PointLight, SpotLight
from .figures import VANEK, Figure, rows_of, source
from .tables import Row, SubstituteScene, Table, both

PAPER = "vanek-2011"

COLONNADE = {"detail": 24}
OUTSIDE = (3.0, 4.4, 5.0)

SCENES = {
    "Sibenik": SubstituteScene(
        "colonnade", COLONNADE, PointLight(OUTSIDE), SpotLight(OUTSIDE, (-0.25, -0.35, -1.0), 0.9)
    ),
    "Sibenik, lamp in the view": SubstituteScene(
        "colonnade", COLONNADE, PointLight((0.4, 3.4, -9.3)),
        SpotLight((0.4, 3.4, -9.3), (0.0, -1.0, 0.0), 1.2),
    ),
    "Car": SubstituteScene(
        "objects_on_floor", {"count": 140, "subdivisions": 3}, PointLight((-14, 16, 10)),
        SpotLight((-14, 16, 10), (14, -16, -10), 0.6),
    ),
    "Trees": SubstituteScene(
        "grass", {"blades": 30000}, PointLight((-60, 70, -25)),
        SpotLight((-60, 70, -25), (60, -70, 25), 0.6),
    ),
}  # fmt: skip

METHODS = {"DPSM": "dual_paraboloid", "IPSM": "improved_paraboloid"}


def rows() -> Iterator[Row]:
    """Each of the paper's, with both sizes of map."""
    printed = rows_of(VANEK, "Table 1")

    def figures(name: str, resolution: int) -> dict[str, Figure]:
        columns = {scene: scene.partition(",")[0] for scene in SCENES}
        return {s: printed[name][f"{of}, {resolution}²"] for s, of in columns.items()}

    for resolution in (512, 2048):
        at = {"resolution": resolution}
        plain = figures("Uniform SM", resolution)
        yield Row(f"Uniform SM {resolution}²", f"uniform@{PAPER}", plain, at, by_spot=True)
        for name, method in METHODS.items():
            own = figures(name, resolution)
            yield from both(f"{name} {resolution}²", method, PAPER, own, **at)


TABLES = (
    Table(
        "vanek-1",
        "Paraboloids, in frames per second",
        source(VANEK, "Table 1"),
        (1600, 1200),
        512,
        SCENES,
        tuple(rows()),
        base="DPSM 512²",
        unit="fps",
        ranking=("DPSM 512²", "IPSM 512²"),
        remark="One uniform map does not hold all sides of a light: its rows are of a spot light "
        "in the place of the lamp, so that their pixels are others. The paper does not say where "
        "its lamps are.",
    ),
)
