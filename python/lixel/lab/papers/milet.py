"""Tables of T. Milet, J. Navrátil, P. Zemčík, "An improved non-orthogonal texture warping for
better shadow rendering", WSCG 2015, and those of J. Navrátil's doctoral thesis."""

from __future__ import annotations

from ...light import PointLight
from .. import passes
from .figures import MILET, THESIS, rows_of, source
from .tables import Row, SubstituteScene, Table, both

PAPER, OF_THESIS = "milet-2015", "navratil"

OBSERVATORY = SubstituteScene("terrain", {"cells": 162})
SCENES = {
    "Conf. room": SubstituteScene("colonnade", {"columns": 10}),
    "Sponza": SubstituteScene("colonnade"),
    "Observatory": OBSERVATORY,
}
LAMP = SubstituteScene("colonnade", light=PointLight((0.4, 3.4, -9.3)))

SIZE, RESOLUTION = (1024, 1024), 512

# The rows by their methods; shadow volumes have no parameter.
METHODS = {"SM": "uniform", "MIN-SM": "min_sm", "RTW": "rtw", "NoTW": "notw",
           "NoTW-DV": "desired_view"}  # fmt: skip
LAMP_METHODS = {
    "CubeSM": "cube",
    "DPSM": "dual_paraboloid",
    "CubeSM w/ warping": "cube+notw",
    "DPSM w/ warping": "dual_paraboloid+notw",
}

DESIRED_VIEW = (passes.FACING, *passes.FIT)
IMPORTANCE = (*passes.IMPORTANCE, passes.WARP_MAP)
DRAWING = {"shadow map": passes.DRAWING, "final pass": (passes.LOOKUP,)}

TABLE_1, TABLE_2, TABLE_3 = (rows_of(MILET, f"Table {number}") for number in (1, 2, 3))
THESIS_2 = rows_of(THESIS, "Table 5.2")


def by_hand(method: str) -> dict[str, float]:
    """The smoothing of a warp as published: the thesis sets it for each scene (section 5.3.1)."""
    return {"smoothing": 16.0} if method.endswith(f"notw@{OF_THESIS}") else {}


TABLES = (
    Table(
        "milet-1",
        "Methods at 1024 x 1024 with a map of 512²",
        f"{source(MILET, 'Table 1')}; {source(THESIS, 'Table 5.3')}",
        SIZE,
        RESOLUTION,
        {"Observatory": OBSERVATORY},
        (
            Row("SV", f"shadow_volumes@{PAPER}", TABLE_1["SV"]),
            *(row for name, of in METHODS.items() for row in both(name, of, PAPER, TABLE_1[name])),
        ),
        base="SM",
        ranking=("SM", "NoTW-DV", "MIN-SM", "RTW", "NoTW"),
        remark="Here a fit is one reduction over the receivers, and casters that reach none of "
        "them are left out, so that NoTW-DV and MIN-SM cost no more than SM.",
    ),
    Table(
        "milet-2",
        "Shares of the steps",
        source(MILET, "Table 2"),
        SIZE,
        RESOLUTION,
        SCENES,
        tuple(
            Row(name, of + by, TABLE_2[name], stages={**analysis, **DRAWING})
            for name, of, analysis in (
                ("NoTW", "notw", {"desired view": DESIRED_VIEW, "importance map": IMPORTANCE}),
                (
                    "RTW",
                    "rtw",
                    # One figure in the paper.
                    {"desired view and importance map": (*DESIRED_VIEW, *IMPORTANCE)},
                ),
            )
            for by in (f"@{PAPER}", "")
        ),
        base="NoTW",
        as_shares=True,
        unit="%",
    ),
    Table(
        "milet-3",
        "Scenes",
        f"{source(MILET, 'Table 3')}; {source(THESIS, 'Table 5.1')}",
        SIZE,
        RESOLUTION,
        SCENES,
        (
            Row("gbuffer", f"uniform@{PAPER}", TABLE_3["gbuffer"], passes=(passes.VISIBILITY,)),
            Row("SV", f"shadow_volumes@{PAPER}", TABLE_3["SV"]),
            *(
                row
                for name in ("SM", "RTW", "NoTW")
                for row in both(name, METHODS[name], PAPER, TABLE_3[name])
            ),
        ),
        base="SM",
        without=(passes.VISIBILITY,),
        ranking=("SM", "RTW", "NoTW"),
    ),
    Table(
        "thesis-2",
        "An omnidirectional light",
        source(THESIS, "Table 5.2"),
        SIZE,
        RESOLUTION,
        {"its scene": LAMP},
        (
            # Volumes have no map to render.
            Row("SV", f"shadow_volumes@{OF_THESIS}", THESIS_2["SV"], stages={"Frame time": None}),
            *(
                Row(name, method, THESIS_2[name], by_hand(method))
                for name, of in LAMP_METHODS.items()
                for method in (f"{of}@{OF_THESIS}", of)
            ),
        ),
        base="CubeSM",
        stages={
            "Frame time": None,
            "SM rendering": (*DESIRED_VIEW, *IMPORTANCE, *passes.DRAWING),
            "Shadow computation": (passes.LOOKUP,),
        },
        ranking=("CubeSM", "CubeSM w/ warping", "DPSM w/ warping"),
        remark="The thesis does not name scene, size and map of this table. As there, the "
        "importance map and the warp count to the rendering of the shadow map.",
    ),
)
