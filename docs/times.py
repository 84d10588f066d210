"""The tables of times: of the methods, and beside other renderers."""

from __future__ import annotations

import math

import pandas as pd
from cells import RESULTS, markdown

from lixel.lab.growth import with_rates
from lixel.lab.result_tables import read


def processor(name: str) -> str:
    """Who made a file of results."""
    made = read(RESULTS / f"{name}.csv").attrs
    _, lanes, threads = made["driver"].split(", ")
    return f"by the CPU engine on an {made['device']}, {lanes}, {threads}, {made['date']}"


def front() -> str:
    """The methods of the plot that none is quicker than with as few wrong pixels."""
    table = read(RESULTS / "sponza-cpu.csv").sort_values(["wall_ms", "misclassified_count"])
    least = table["misclassified_count"].astype(float).cummin()
    best = table[table["misclassified_count"].lt(least.shift(fill_value=math.inf))]
    names = ", ".join(f"`{name}`" for name in best["method"].unique())
    return f"On the front there: {names}."


def cost_of_warps() -> str:
    table = read(RESULTS / "sponza-cpu.csv").set_index(["method", "resolution"])
    ms = table["pass_ms.shadow map"]
    ratios = {name: ms[name] / ms["desired_view"] for name in ("notw", "rtw")}
    words = [f"`{n}` takes {r.min():.1f} to {r.max():.1f} times" for n, r in ratios.items()]
    return (
        f"In the plot above the shadow map pass of {' and that of '.join(words)}\n"
        "as long as that of `desired_view`."
    )


def other_renderers(light: str) -> str:
    """Times and misclassified pixels beside other renderers, by the light, "sun" or "lamp"."""
    tables = {
        scene: read(RESULTS / "peers" / f"{scene}-{light}.csv").set_index("renderer")
        for scene in ("colonnade", "sponza")
    }
    columns = {
        "ms": "ms, median",
        "processor ms": "processor ms, median",
        "ms with building": "ms with building, median",
        "misclassified": "misclassified",
    }
    rows = []
    for name in tables["colonnade"].index:
        row = {"renderer": name, "version": tables["colonnade"].loc[name, "version"]}
        for scene, table in tables.items():
            for short, column in columns.items():
                value = table.loc[name, column]
                row[f"{scene}: {short}"] = "" if pd.isna(value) else f"{value:,.0f}"
        rows.append(row)
    return markdown(rows)


def six_rows() -> str:
    """The methods of the README's picture, Mitsuba's rays and Embree's, in one view."""
    maps = read(RESULTS / "sponza-cpu.csv").query("resolution == 1024").set_index("method")
    peers = read(RESULTS / "peers" / "sponza-sun.csv").set_index("renderer")
    covered = maps["covered_count"].iloc[0]
    found = {
        f"`{name}`, a map of 1024²": (
            maps.loc[name, "wall_ms"],
            maps.loc[name, "misclassified_count"],
        )
        for name in ("uniform", "rtw", "notw")
    }
    others = {
        "`exact`": "lixel exact",
        "Mitsuba 3, rays": "Mitsuba 3 llvm_ad_rgb",
        "Embree by embreex, rays": "embreex",
    }
    for words, name in others.items():
        found[words] = peers.loc[name, "ms, median"], peers.loc[name, "misclassified"]
    table = markdown(
        {
            "by": words,
            "ms": f"{ms:,.0f}",
            "misclassified": f"{wrong:,.0f}",
            "% of covered": f"{100 * wrong / covered:.4f}",
        }
        for words, (ms, wrong) in found.items()
    )
    return f"{table}\n\nMeasured {processor('peers/sponza-sun')}."


def beside_rays() -> str:
    """`exact` and the fastest ray caster."""
    rows = {}
    for scene in ("colonnade", "sponza"):
        table = read(RESULTS / "peers" / f"{scene}-sun.csv").set_index("renderer")
        rows[scene] = [table.loc[name] for name in ("lixel exact", "Mitsuba 3 llvm_ad_rgb")]

    def both(column: str, of: int) -> str:
        first, second = (f"{rows[scene][of][column]:.0f}" for scene in ("colonnade", "sponza"))
        return f"{first} and {second}"

    frame, built = "ms, median", "ms with building, median"
    return (
        f"At 1920 x 1080, on two cores, `exact` takes {both(frame, 0)} ms for the colonnade and "
        f"for Crytek Sponza, and\n{both(built, 0)} ms where the triangles moved; the rays of "
        f"Mitsuba 3 take {both(frame, 1)} ms, and\n{both(built, 1)} ms, and err in "
        f"{both('misclassified', 1)} pixels."
    )


GROWS = {
    "triangles": "triangles",
    "pixels": "pixels",
    "threads": "threads",
    "floor": "floor, times as wide",
    "heap": "triangles in the heap",
}


def growth(series: str) -> str:
    """A series of `lixel lab growth`: milliseconds of each method; in the first one memory, too, on
    threads how much faster, and misclassified pixels where the floor is wide."""
    table = with_rates(read(RESULTS / "growth" / "cpu.csv")).query("series == @series")
    step = series if series in ("triangles", "pixels", "threads") else "step"
    rows = []
    for grown, own in table.groupby(step, sort=False):
        own = own.set_index("method")
        row = {GROWS[series]: int(grown)}
        for name in own.index:
            row[f"`{name}`, ms"] = f"{own.loc[name, 'ms']:,.0f}"
        if series == "triangles":
            row["MB of the scene"] = f"{own.loc['exact', 'MB of scene']:,.0f}"
            for name in ("exact", "ray_traced"):
                row[f"`{name}`, MB"] = f"{own.loc[name, 'MB']:,.0f}"
        if series == "threads":
            for name in own.index:
                faster = own.loc[name, "speed-up"]
                row[f"`{name}`, times as fast"] = "" if pd.isna(faster) else f"{faster:.2f}"
        if series == "floor":
            for name in ("desired_view", "rtw"):
                row[f"`{name}`, misclassified"] = int(own.loc[name, "misclassified"])
        rows.append(row)
    return markdown(rows)


def growth_of_exact() -> str:
    """What the methods without an error have wrong in all steps, and their memory."""
    table = read(RESULTS / "growth" / "cpu.csv")
    own = table[table["method"].isin(["exact", "ray_traced"])]
    ties = 100.0 * (own["ties"] / own["covered"].clip(lower=1)).max()
    largest = own[own["triangles"] == own["triangles"].max()].groupby("method").max()
    bytes_of = (1e6 * largest["MB"] / largest["triangles"]).map("{:,.0f}".format)
    return (
        f"`exact` and `ray_traced` misclassify {own['misclassified'].sum():,} pixels in all of "
        f"these images; at most {ties:.2f} % of\nthose that see a surface are ties. Of the largest "
        f"scene, {own['triangles'].max():,} triangles, the process of\n`exact` has at most "
        f"{bytes_of['exact']} bytes for each triangle, and that of `ray_traced` "
        f"{bytes_of['ray_traced']}."
    )


def newcomer() -> str:
    """How long it takes from a clone to a picture."""
    steps = read(RESULTS / "newcomer" / "steps.csv")
    return (
        "From a clone to a picture of a file of one's own these take "
        f"{steps['seconds'].sum():,.0f} s on two cores ({steps.attrs['device']}),\n"
        "with all that is downloaded: "
        "`python tests/tools/newcomer.py`."
    )


def holes() -> str:
    """A fence and plants: what their holes cost, and pixels that are wrong."""
    table = read(RESULTS / "masks" / "sponza.csv")
    rows = []
    for row in table.to_dict("records"):
        is_reference = row["method"] == "reference"
        ms = {
            words: "" if is_reference else f"{row[column]:,.0f}"
            for words, column in (
                ("ms", "ms"),
                ("ms, solid", "ms, solid"),
                ("processor ms", "processor ms"),
                ("processor ms, solid", "processor ms, solid"),
            )
        }
        rows.append(
            {
                "scene": row["scene"],
                "method": f"`{row['method']}`",
                **ms,
                "misclassified": "" if is_reference else f"{row['misclassified']:,.0f}",
                "wrong of rays": f"{row['wrong of rays']:,} of {row['rays']:,}",
            }
        )
    return markdown(rows)


def cluster() -> str:
    return markdown(read(RESULTS / "studies" / "cluster.csv"))
