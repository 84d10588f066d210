"""Tables 1 to 3 of T. Milet, J. Navrátil, P. Zemčík, "An improved non-orthogonal texture warping
for better shadow rendering", WSCG 2015, and those of J. Navrátil's doctoral thesis."""

from __future__ import annotations

from ...light import PointLight
from .. import passes
from .tables import Row, SubstituteScene, Table

PAPER = "T. Milet, J. Navrátil, P. Zemčík, WSCG 2015"
THESIS = "J. Navrátil, doctoral thesis"

OBSERVATORY = SubstituteScene("terrain", {"cells": 162})
SCENES = {
    "Conf. room": SubstituteScene("colonnade", {"columns": 10}),
    "Sponza": SubstituteScene("colonnade"),
    "Observatory": OBSERVATORY,
}

TABLE_1_ROWS = (
    Row("SM", "uniform", (1.596,)),
    Row("MIN-SM", "min_sm", (1.7,)),
    Row("RTW", "rtw", (3.296,)),
    Row("NoTW", "notw", (4.708,)),
    Row("NoTW-DV", "desired_view", (2.521,)),
)
TABLE_3_ROWS = (
    Row("gbuffer", "uniform", (2.16, 2.229, 1.84), passes=(passes.VISIBILITY,)),
    Row("SM", "uniform", (0.21, 0.40, 0.16)),
    Row("RTW", "rtw", (3.14, 3.47, 3.02)),
    Row("NoTW", "notw", (3.63, 3.84, 3.23)),
)
TABLE_3_REMARK = (
    "Here compute shaders rasterize the shadow map and look it up, so that SM weighs more against "
    "the warps and the gbuffer than in the paper, where hardware does both."
)

TABLES = (
    Table(
        "milet-1",
        "Methods at 1024 x 1024 with a map of 512²",
        f"{PAPER}, Table 1; {THESIS}, Table 5.3",
        (1024, 1024),
        512,
        {"Observatory": OBSERVATORY},
        TABLE_1_ROWS,
        base="SM",
        remark="Here a fit is one reduction over the receivers that stays on the GPU, and casters "
        "that reach none of them are left out, so that NoTW-DV and MIN-SM cost no more than SM.",
    ),
    Table(
        "milet-2",
        "Shares of the steps",
        f"{PAPER}, Table 2",
        (1024, 1024),
        512,
        {"Sponza": SCENES["Sponza"]},
        (
            # The paper counts the importance map of RTW to its desired view.
            Row("NoTW", "notw", (15.4, 61.0, 19.9, 3.7)),
            Row("RTW", "rtw", (82.5, 0.0, 14.1, 3.2)),
        ),
        base="NoTW",
        stages={
            "desired view": passes.RECEIVERS + passes.FIT,
            "importance map": (*passes.IMPORTANCE, passes.WARP_MAP),
            "shadow map": (passes.SHADOW_MAP,),
            "final pass": (passes.LOOKUP,),
        },
    ),
    Table(
        "milet-3",
        "Scenes",
        f"{PAPER}, Table 3; {THESIS}, Table 5.1",
        (1024, 1024),
        512,
        SCENES,
        TABLE_3_ROWS,
        base="SM",
        without=(passes.VISIBILITY,),
        remark=TABLE_3_REMARK,
    ),
    Table(
        "thesis-2",
        "An omnidirectional light",
        f"{THESIS}, Table 5.2",
        (1024, 1024),
        512,
        {"its scene": SubstituteScene("colonnade", light=PointLight((0.4, 3.4, -9.3)))},
        (
            Row("SV", "ray_traced", (4.8,)),
            Row("CubeSM", "cube", (2.5,)),
            Row("DPSM", "dual_paraboloid", (2.3,)),
            Row("CubeSM w/ warping", "cube+notw", (5.8,)),
            Row("DPSM w/ warping", "dual_paraboloid+notw", (3.4,)),
        ),
        base="CubeSM",
        remark="The thesis does not name scene, size and map of this table. Its SV, shadow "
        "volumes, is exact; so are our rays.",
    ),
)
