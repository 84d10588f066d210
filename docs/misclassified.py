"""The tables of misclassified pixels, from `results/accuracy`."""

from __future__ import annotations

from collections.abc import Sequence

import pandas as pd
from cells import RESULTS, markdown

from lixel.lab import accuracy, departures
from lixel.lab.result_tables import read

# --- README.md ---


def gain_of_exact_rasterization() -> str:
    table = read(RESULTS / "departures" / "cpu.parquet")
    rows = departures.summary(table).query("departure == 'rasterization'").set_index("method")
    names = ("notw", "min_sm+notw", "cube+notw")
    return (
        f"As published but for this, {_times(names, rows['median ratio'])} times\n"
        f"as many pixels, the median of {rows['views'].max()} views."
    )


def gain_of_the_lookup() -> str:
    table = by_lookup(read(RESULTS / "accuracy" / "directional.parquet"))
    wrong = table.pivot_table(
        index="method", columns="lookup", values="misclassified", aggfunc="sum"
    )
    views = table.groupby(["scene", "camera", "light"]).ngroups
    shares = _times(("desired_view", "rtw", "notw"), wrong["auto"] / wrong["depth"])
    return (
        f"In {views} views of {table['scene'].nunique()} scenes, maps of 512²,\n"
        f"{shares} times as many pixels as with depths alone."
    )


def _times(names: Sequence[str], shares: pd.Series[float]) -> str:
    first, *others = (f"`{name}` {shares[name]:.2f}" for name in names)
    words = [first.replace("` ", "` misclassifies "), *others]
    return f"{', '.join(words[:-1])} and {words[-1]}"


def lights_around() -> str:
    table = by_lookup(read(RESULTS / "accuracy" / "point.parquet")).query("lookup == 'auto'")
    sums = table.groupby("method")[["misclassified", "covered"]].sum()
    percent = 100 * sums["misclassified"] / sums["covered"]
    views = table.groupby(["scene", "camera", "light"]).ngroups
    return (
        f"Around a point light, in {views} views, `cube` misclassifies {percent['cube']:.2f} %\n"
        f"of the pixels and `cube+notw` {percent['cube+notw']:.2f} %."
    )


def ties() -> str:
    table = read(RESULTS / "accuracy" / "exact-1080p.parquet")
    all_views = accuracy.summary(table).query("scene == 'all'").iloc[0]
    left_out = all_views["ties"] + all_views["float32_ties"]
    return (
        f"In the {all_views['views']} views above these are {left_out:,} pixels, "
        f"{all_views['ties']:,} of them in float64 and\n"
        f"{all_views['float32_ties']:,} where float32 sees another surface first."
    )


def exact_views() -> str:
    table = read(RESULTS / "accuracy" / "exact-1080p.parquet")
    sums = accuracy.summary(table).query("scene == 'all'").set_index("method")
    views, covered = sums.loc["exact", ["views", "covered"]]
    wrong = sums.loc[["exact", "ray_traced"], "misclassified"].sum()
    return (
        f"In [{views} views of {table['scene'].nunique()} scenes](docs/results/README.md), "
        f"{covered:,} pixels, they misclassify {wrong} that are no ties."
    )


# --- docs/results/README.md ---


def without_samples() -> str:
    """Wrong pixels of the methods that sample nothing from the light, and of Embree."""
    sums = accuracy.summary(read(RESULTS / "accuracy" / "480x270.parquet"))
    rows = []
    for scene, of_scene in sums.groupby("scene", sort=False):
        first = of_scene.iloc[0]
        counts = {
            f"`{name}`": f"{row['misclassified']:,} ({row['most']:,})"
            if row["misclassified"]
            else "0"
            for name, row in of_scene.set_index("method").iterrows()
        }
        rows.append(
            {"scene": scene, "views": first["views"], "covered pixels": first["covered"],
             "ties": first["ties"] + first["float32_ties"], **counts}
        )  # fmt: skip
    return markdown(rows)


def by_lookup(table: pd.DataFrame) -> pd.DataFrame:
    """The method without its lookup and its resolution, and the lookup, as columns."""
    parts = table["method"].str.partition(":")
    lookup = parts[2].str.extract(r"lookup=(\w+)")[0].fillna("auto")
    others = parts[2].str.replace(r"(lookup|resolution)=\w+,?", "", regex=True).str.strip(",")
    name = parts[0] + (", " + others).where(others != "", "")
    return table.assign(method=name, lookup=lookup)


def directional(file: str) -> str:
    """Wrong pixels of `desired_view`, `rtw` and `notw` by scene, and of all scenes by lookup."""
    table = by_lookup(read(RESULTS / "accuracy" / f"{file}.parquet"))
    views = table.pivot_table(
        index=["lookup", "scene", "camera", "light"], columns="method", values="misclassified"
    )
    rows = []
    for lookup in table["lookup"].unique():
        of_lookup = views.loc[lookup]
        scenes = {"all": of_lookup}
        if lookup == "auto":
            names = table["scene"].unique()
            scenes = {**{name: of_lookup.loc[[name]] for name in names}, **scenes}
        for scene, own in scenes.items():
            wrong = own.sum()
            better, even = own["notw"] < own["rtw"], own["notw"] == own["rtw"]
            rows.append(
                {
                    "scene": scene,
                    "lookup": lookup,
                    "views": len(own),
                    **{f"`{n}`": int(wrong[n]) for n in ("desired_view", "rtw", "notw")},
                    "rtw / desired_view": f"{wrong['rtw'] / wrong['desired_view']:.2f}",
                    "notw / rtw": f"{wrong['notw'] / wrong['rtw']:.2f}",
                    "notw better, even, worse": f"{better.sum()}, {even.sum()}, "
                    f"{len(own) - better.sum() - even.sum()}",
                }
            )
    return markdown(rows)


def positional(file: str) -> str:
    """Wrong pixels in % of the covered ones: all by lookup, and with `auto` by scene."""
    table = by_lookup(read(RESULTS / "accuracy" / f"{file}.parquet"))
    scenes = table["scene"].unique()
    wrong, covered = (
        table.pivot_table(
            index="method", columns=["lookup", "scene"], values=value, aggfunc="sum", sort=False
        )
        for value in ("misclassified", "covered")
    )
    rows = []
    for method in table["method"].unique():
        name, comma, parameters = method.partition(",")
        row = {"method": f"`{name}`{comma}{parameters}"}
        for lookup in ("auto", "depth", "triangle"):
            is_there = lookup in wrong and wrong.loc[method, lookup].notna().any()
            row[f"all: {lookup}"] = ""
            if is_there:
                share = wrong.loc[method, lookup].sum() / covered.loc[method, lookup].sum()
                row[f"all: {lookup}"] = f"{100 * share:.3f}"
        for scene in scenes:
            share = wrong.loc[method, ("auto", scene)] / covered.loc[method, ("auto", scene)]
            row[scene] = f"{100 * share:.3f}"
        rows.append(row)
    return markdown(rows)


def cuts(file: str) -> str:
    """Wrong pixels of the cuts of `improved_paraboloid` over those of `dual_paraboloid`.

    Random lights with an odd number, and the living room's own, are outside of the view.
    """
    table = by_lookup(read(RESULTS / "accuracy" / f"{file}.parquet"))
    number = table["light"].str.extract(r"random (\d+)")[0].astype(float)
    is_outside = (number % 2 == 1) | (number.isna() & (table["scene"] == "living_room"))
    place = is_outside.map({True: "outside the view", False: "in the view"})
    wrong = table.assign(place=place).pivot_table(
        index="method", columns=["place", "lookup"], values="misclassified", aggfunc="sum"
    )
    rows = []
    for method in table["method"].unique():
        if method.startswith("improved_paraboloid") and "+" not in method:
            cut = method.partition("cut=")[2] or "receivers"
            row = {"cut": f'`cut="{cut}"`'}
            for where in ("outside the view", "in the view"):
                for lookup in ("auto", "depth", "triangle"):
                    share = wrong.loc[method, (where, lookup)]
                    share /= wrong.loc["dual_paraboloid", (where, lookup)]
                    row[f"{where}: {lookup}"] = f"{share:.2f}"
            rows.append(row)
    return markdown(sorted(rows, key=lambda row: row["cut"], reverse=True))


def false_shadows() -> str:
    counts = {}
    for path in sorted((RESULTS / "accuracy").glob("*.parquet")):
        table = by_lookup(read(path))
        of_triangles = table[table["lookup"] == "triangle"]
        if len(of_triangles):
            counts[path.stem] = int(of_triangles["false_shadow"].sum())
    return (
        'With `lookup="triangle"` the pixels that are falsely in shadow were '
        + ", ".join(f"{count:,} in `{name}`" for name, count in counts.items())
        + "."
    )


def engines() -> str:
    """Both engines beside each other, with the default lookup: all scenes together, and the scene
    in which the GPU engine's ratio is farthest from one."""
    rows = []
    for kind in ("directional", "point"):
        own, other = (
            by_lookup(read(RESULTS / "accuracy" / f"{name}.parquet")).query("lookup == 'auto'")
            for name in (kind, f"{kind}-llvmpipe")
        )
        sums = [
            each.groupby(["method", "scene"], sort=False)["misclassified"].sum()
            for each in (own, other)
        ]
        for method in other["method"].unique():
            cpu, gpu = (of[method] for of in sums)
            ratios = cpu / gpu
            scene = ratios.where(ratios > 1.0, 1.0 / ratios).idxmax()
            rows.append(
                {
                    "lights": kind,
                    "method": f"`{method.partition(',')[0]}`{''.join(method.partition(',')[1:])}",
                    "CPU engine": int(cpu.sum()),
                    "GPU engine": int(gpu.sum()),
                    "ratio": f"{cpu.sum() / gpu.sum():.3f}",
                    "farthest from 1": f"{ratios[scene]:.3f}, {scene}",
                }
            )
    return markdown(rows)
