"""The tables in prose, made from the files of `docs/results`.

What stands in a page between ``<!-- NAME -->`` and ``<!-- /NAME -->`` is what `BLOCKS[NAME]`
returns. `python docs/tables.py` writes all of them, and draws the README's plot; a test fails where
a table is out of date.
"""

from __future__ import annotations

import re
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib as mpl
import misclassified
import pandas as pd
import paper_tables
import times
from cells import DOCS, RESULTS, markdown

from lixel import _core, auto
from lixel.lab import (
    aligned as aligned_lights,
    calibration,
    equal,
    filters,
    hard_views,
    pages as beside_cascades,
    rankings,
    stress,
)
from lixel.lab.papers import rows as rows_of_papers
from lixel.lab.result_tables import read
from lixel.pictures import plots

PAGES = (DOCS.parent / "README.md", RESULTS / "README.md", *sorted((DOCS / "pages").glob("*.md")))


# --- Methods: README.md ---


def citation(name: str) -> str:
    """The papers of a method in short, such as "Rosen 2012"."""
    (whole,) = (each["citation"] for each in _core.methods() if each["name"] == name)
    authors_and_year = r"((?:[\w-]+, (?:[A-Z]\.[ -]?)+,? ?(?:and )?)+)(\d{4})?"
    found = []
    for authors, year in re.findall(authors_and_year, whole):
        surnames = re.findall(r"([\w-]+), [A-Z]\.", authors)
        short = f"{surnames[0]} et al." if len(surnames) > 2 else ", ".join(surnames)
        found.append(f"{short} {year or '(thesis)'}")
    return "; ".join(found)


def demo(light: int) -> str:
    """The demo's table for its first or second light."""
    table = read(RESULTS / "demo" / "cpu.csv")
    rows = [rows for _, rows in table.groupby("light", sort=False)][light].to_dict("records")
    return markdown(
        {
            "method": f"`{row['method']}`",
            "paper": citation(row["method"].split("+")[-1]),
            "ms": f"{row['ms']:,.0f}",
            "misclassified": row["misclassified"],
            "% of covered": f"{row['% of covered']:.2f}",
            "false shadow": row["false shadow"],
        }
        for row in rows
    )


# --- Pages of the site ---


def of_auto(of_set: str) -> list[dict[str, Any]]:
    """How often the bound of `lx.Auto` held, by the error that is asked for."""
    table = read(RESULTS / "auto" / "llvmpipe.parquet")
    rows = calibration.how_often_it_held(table, auto.model())
    return [row for row in rows if row["set"] == of_set]


def bound() -> str:
    return markdown(
        {
            "`max_error`": row["max_error"],
            "pairs of maps": row["pairs"],
            "bound within it": row["accepted"],
            "error within it, too": row["kept"],
            "largest error, as a share of `max_error`": f"{row['worst, times max_error']:.2f}",
        }
        for row in of_auto("held out")
    )


def bound_generated() -> str:
    error, rows = auto.model()["error"], of_auto("generated")
    kept, accepted = (sum(row[name] for row in rows) for name in ("kept", "accepted"))
    return (
        f"The constant *c* is {error['share']:.2f}, which is enough for "
        f"{calibration.QUANTILE:.0%} of the generated pairs of maps.\nOf those whose bound is "
        f"within one of these errors, {kept} of {accepted} keep it."
    )


def stability_summary() -> str:
    table = read(RESULTS / "stability" / "stress.parquet")
    newer = [f"`{name}`" for name in hard_views.FAMILIES if name not in set(table["family"])]
    note = f"\n\nThe table is older than the families {', '.join(newer)}." if newer else ""
    return markdown(stress.summary(table)) + note


def stability_limits() -> str:
    return markdown(
        {"view": ", ".join(x.cases), "method": ", ".join(x.methods), "why": x.why}
        for x in stress.LIMITS
    )


def stability_beyond() -> str:
    table = read(RESULTS / "stability" / "stress.parquet")
    beyond = table[table["beyond"] > 0].drop(columns="limit")
    limits = {(case, name) for x in stress.LIMITS for case in x.cases for name in x.methods}
    views = beyond["family"] + ", " + beyond["case"]
    gone = sum(view not in limits for view in zip(views, beyond["method"], strict=True))
    note = f"\n\n{gone} of these are limits no more: the table is older." if gone else ""
    return markdown(beyond) + note


def aligned(kind: str) -> str:
    """Misclassified pixels of each method by scene, of lights along walls and of turned ones."""
    sums = aligned_lights.summary(read(RESULTS / "stability" / "aligned.parquet"))
    sums = sums[sums["kind"] == kind]
    rows = []
    for method, own in sums.groupby("method", sort=False):
        cells = {
            row["scene"]: f"{row['aligned']:,} / {row['turned']:,}" for _, row in own.iterrows()
        }
        rows.append({"method": f"`{method}`", **cells})
    return markdown(rows)


def errors_by_angle() -> str:
    """The largest aliasing error of each method by far over near and by the angle of the light."""
    table = read(RESULTS / "angles" / "cpu.csv")
    heads = {"far_over_near": "far / near", "degrees": "degrees"}
    return markdown(
        {
            heads.get(str(key), f"`{key}`"): value if key in heads else f"{value:,.1f}"
            for key, value in row.items()
        }
        for row in table.to_dict("records")
    )


def mutants() -> str:
    table = read(RESULTS / "stability" / "mutants.csv")
    return (
        f"Of {len(table)} such mutants the tests fail on {table['killed'].sum()}, by "
        f"{table['subject'].nunique()} subjects in `docs/results/stability/mutants.csv`."
    )


def culling() -> str:
    return markdown(read(RESULTS / "stability" / "culling.csv"))


def flicker() -> str:
    return markdown(read(RESULTS / "stability" / "flicker.csv").drop(columns="frames"))


def pages(name: str) -> str:
    """`virtual` beside cascades with as many texels, by scene."""
    table = read(RESULTS / "accuracy" / f"{name}.parquet")
    sums = beside_cascades.summary(table)
    rows = []
    for scene, own in sums.groupby("scene", sort=False):
        of = own.set_index("method")
        paged = of.loc["virtual"]
        row: dict[str, object] = {"scene": scene, "views": int(paged["views"])}
        row |= {"pages": int(paged["pages"]), "texels, millions": paged["texels"] / 1e6}
        row |= {f"`{method}`" if " " not in method else method: int(found["misclassified"])
                for method, found in of.iterrows()}  # fmt: skip
        row |= {"ratio to `cascades`": of.loc["cascades", "ratio"]}
        row |= {"ms, `virtual`": paged["milliseconds"]}
        row |= {"ms, `cascades`": of.loc["cascades", "milliseconds"]}
        rows.append(row)
    made = table.attrs
    return f"{markdown(rows)}\n\nBy `{made['command']}`, on {made['device']}."


# --- All files ---

WHAT = {
    "accuracy/exact-1080p": "`exact` and `ray_traced` at 1920 x 1080: every camera and light of "
    "`scenes.json`, and 50 random lights from each camera",
    "accuracy/480x270": "methods that sample nothing from the light, and Embree's float32 rays: "
    "every camera and light of `scenes.json`, and six random lights from each camera",
    "accuracy/directional": "`desired_view`, `rtw` and `notw` in every directional light of the "
    "scenes and in 20 random ones from each camera",
    "accuracy/directional-llvmpipe": "the same suns by the GPU engine",
    "accuracy/directional-edges": "`desired_view`, `rtw` and `notw` in directional lights by which "
    "the camera sees an edge of a shadow",
    "accuracy/directional-1080p": "`desired_view`, `rtw` and `notw` at 1920 x 1080, maps of 1024²",
    "accuracy/point": "methods for point lights by lookup; half of the random lights are in view",
    "accuracy/point-llvmpipe": "the same point lights by the GPU engine",
    "accuracy/point-1080p": "methods for point lights at 1920 x 1080, maps of 1024²",
    "accuracy/spot-1080p": "methods for spot lights at 1920 x 1080, maps of 1024²",
    "accuracy/pages": "`virtual` and cascades with as many texels; suns by which the camera sees "
    "an edge of a shadow",
    "accuracy/pages-fine": "the same with pages of 64² and texels of at most half a pixel",
    "angles/cpu": "the largest aliasing error by the angle between light and view",
    "auto/llvmpipe": "what `lx.Auto` is calibrated on, and scenes that it was not made from",
    "departures/cpu": "what each departure of a default from its paper gains",
    "filters/cpu": "filtered maps against the lit share of 32 samples in each pixel",
    "demo/cpu": "every method on the built-in colonnade, 1920 x 1080, maps of 1024²",
    "newcomer/steps": "the way from a clone to a picture of one's own, without what was downloaded "
    "before; beside it what each step printed",
    **paper_tables.WHAT,
    "papers/rankings": "the papers' methods as published, by scenes and random lights",
    "growth/cpu": "time and memory by triangles, pixels, threads, and where much lies together",
    "masks/sponza": "what the holes of a fence and of leaves cost, and that no pixel is wrong",
    "peers/colonnade-lamp": "`exact`, `desired_view` and ray casters, a point light",
    "peers/colonnade-sun": "`exact`, `desired_view` and other renderers, the camera moved",
    "peers/sponza-lamp": "`exact`, `desired_view` and ray casters, a point light",
    "peers/sponza-sun": "`exact`, `desired_view` and other renderers, the camera moved",
    "sponza-cpu": "time and error of every method on Crytek Sponza (the README's figure)",
    "sponza-llvmpipe": "the same by the GPU engine on a software driver, maps of 1024²",
    "sponza-point-cpu": "the same of every method that takes a lamp, maps of 1024²",
    "sponza-point-llvmpipe": "the same by the GPU engine on a software driver",
    "sponza-spot-cpu": "the same by a spot light, `spot` and what it is compared with",
    "sponza-spot-llvmpipe": "the same by the GPU engine on a software driver",
    "stability/aligned": "misclassified pixels under lights that run along walls, and turned ones",
    "stability/culling": "what each method leaves out, and that no pixel changes by it",
    "stability/flicker": "pixels that flicker while the camera or the light moves",
    "stability/mutants": "one formula broken at a time, and the first test that fails",
    "stability/stress": "misclassified pixels of every method in hard views",
    "studies/equal": "time and error of every method in the first view of each scene",
    "studies/cluster": "a study on Dask workers with a core each, killed and gone on with",
}


def kept() -> list[Path]:
    """Every file of results."""
    return sorted(path for path in RESULTS.rglob("*.*") if path.suffix in (".csv", ".parquet"))


def files() -> str:
    """Every file, when it was measured, and the command."""
    rows = []
    for path in kept():
        made = read(path).attrs
        name = path.relative_to(RESULTS).as_posix()
        rows.append(
            {"file": f"`{name}`", "what": WHAT[name.rpartition(".")[0]], "date": made["date"],
             "command": f"`{textwrap.shorten(made['command'], 160, placeholder=' ...')}`"}
        )  # fmt: skip
    return markdown(rows)


def devices() -> str:
    drivers = {read(path).attrs["driver"] for path in kept()}
    own = "; ".join(sorted(driver for driver in drivers if "lanes" in driver))
    adapters = ", ".join(sorted(driver for driver in drivers if "lanes" not in driver))
    return (
        f"They are of {adapters}, a Vulkan driver that runs on the CPU, on two cores, or of\n"
        f"the CPU engine ({own})."
    )


# --- The papers' rankings: docs/pages/papers.md ---


def ranked(part: str) -> str:
    """A table, or what the text says with numbers, from the views of `lixel lab rankings`."""
    table = read(RESULTS / "papers" / "rankings.parquet")
    match part:
        case "views":
            suns, lamps = rankings.by_view(table, "sun"), rankings.by_view(table, "lamp")
            scenes = table["scene"].nunique()
            return (
                f"{len(suns)} views by random directional lights and {len(lamps)} by lamps outside "
                f"of the view, of {scenes}\nscenes, 320 x 180 pixels, maps of 256²."
            )
        case "smoothing":
            return markdown(rankings.by_smoothing(table))
        case _:
            return markdown(rankings.by_scene(table))


# --- Filters: docs/pages/filters.md ---


def filtered(column: str) -> str:
    """By filter and radius: means over the views of a folder, or of leaks those of the two roofs;
    in hundredths."""
    table = read(RESULTS / "filters" / "cpu.parquet")
    is_leaking = table["scene"] == filters.LEAKING
    views = table[is_leaking if column == "leak" else ~is_leaking]
    means = 100.0 * views.pivot_table(index="filter", columns="radius", values=column, sort=False)
    names = dict.fromkeys(table["filter"])
    shown = means.map(lambda share: "" if pd.isna(share) else f"{share:.2f}").loc[list(names)]
    shown.columns = [f"{radius:g}" if radius else "none" for radius in means]
    return markdown([{"filter": f"`{name}`", **row} for name, row in shown.T.to_dict().items()])


def filtered_views() -> str:
    table = read(RESULTS / "filters" / "cpu.parquet")
    views = table[table["scene"] != filters.LEAKING]
    return (
        f"{len(views.groupby(['scene', 'light']))} views of {views['scene'].nunique()} scenes, "
        "480 x 270 pixels, maps of 512²."
    )


def equal_table() -> str:
    table = equal.summary(read(RESULTS / "studies" / "equal.csv"))
    return markdown(table.assign(method="`" + table["method"] + "`"))


def equal_in_words() -> str:
    cases = read(RESULTS / "studies" / "equal.csv")
    rows = equal.summary(cases).set_index("method")
    texels, time = rows["times desired_view's"], rows["time"]
    scenes, count = rows["scenes in equal time"], cases["scene"].nunique()
    text = (
        f"So `exact` takes {time['exact']:.2f} of the time and misclassifies nothing. With maps of "
        f"as many texels `notw` has {texels['notw']:.2f} of the misclassified pixels in "
        f"{time['notw']:.1f} times the time; `virtual`, held to a finest level of 1024² where it "
        f"would take more, has {texels['virtual']:.2f} of them in {time['virtual']:.1f} times the "
        f"time. In the time of `desired_view` `notw` has a map in {scenes['notw']} of {count} "
        f"scenes, `virtual` in {scenes['virtual']}."
    )
    return textwrap.fill(text, 124)


BLOCKS: dict[str, Callable[[], str]] = {
    **paper_tables.BLOCKS,
    "papers, rows": lambda: markdown(rows_of_papers.commands()),
    "six rows": times.six_rows,
    "demo, directional light": lambda: demo(0),
    "demo, point light": lambda: demo(1),
    "demo processor": lambda: f"They were measured {times.processor('demo/cpu')}.",
    "plot processor": lambda: f"It was measured {times.processor('sponza-cpu')}.\n{times.front()}",
    "gain of exact rasterization": misclassified.gain_of_exact_rasterization,
    "gain of the lookup": misclassified.gain_of_the_lookup,
    "lights around": misclassified.lights_around,
    "share of ties": misclassified.ties,
    "exact in all views": misclassified.exact_views,
    "cost of warps": times.cost_of_warps,
    "files": files,
    "devices": devices,
    "without samples": misclassified.without_samples,
    "directional": lambda: misclassified.directional("directional"),
    "directional-edges": lambda: misclassified.directional("directional-edges"),
    "directional-1080p": lambda: misclassified.directional("directional-1080p"),
    "point": lambda: misclassified.positional("point"),
    "point-1080p": lambda: misclassified.positional("point-1080p"),
    "spot-1080p": lambda: misclassified.positional("spot-1080p"),
    "engines": misclassified.engines,
    "cuts": lambda: misclassified.cuts("point"),
    "cuts-1080p": lambda: misclassified.cuts("point-1080p"),
    "false shadows": misclassified.false_shadows,
    "exact beside rays": times.beside_rays,
    "other renderers, sun": lambda: times.other_renderers("sun"),
    "other renderers, lamp": lambda: times.other_renderers("lamp"),
    "other renderers, processor": lambda: (
        f"They were measured {times.processor('peers/sponza-sun')}."
    ),
    **{f"growth, {name}": lambda name=name: times.growth(name) for name in times.GROWS},
    "equal": equal_table,
    "equal, in words": equal_in_words,
    "growth, exact": times.growth_of_exact,
    "newcomer": times.newcomer,
    "growth, processor": lambda: f"They were measured {times.processor('growth/cpu')}.",
    "holes, cost": times.holes,
    "holes, processor": lambda: f"They were measured {times.processor('masks/sponza')}.",
    "cluster": times.cluster,
    "bound of auto": bound,
    "bound of auto, generated scenes": bound_generated,
    "rankings, views": lambda: ranked("views"),
    "rankings, smoothing": lambda: ranked("smoothing"),
    "rankings, scenes": lambda: ranked("scenes"),
    "filters, views": filtered_views,
    "filters, error": lambda: filtered("mean_absolute_error"),
    "filters, similarity": lambda: filtered("ssim"),
    "filters, leaks": lambda: filtered("leak"),
    "stability": stability_summary,
    "known limits": stability_limits,
    "beyond the bound": stability_beyond,
    "errors by angle": errors_by_angle,
    "aligned suns": lambda: aligned("sun"),
    "aligned point lights": lambda: aligned("point"),
    "virtual beside cascades": lambda: pages("pages"),
    "virtual beside cascades, finer": lambda: pages("pages-fine"),
    "culling": culling,
    "mutants": mutants,
    "flicker": flicker,
}


def filled(text: str) -> str:
    """A page with each of its blocks as it should be."""
    return re.sub(
        r"^( *)<!-- (?P<name>[\w, -]+) -->\n.*?<!-- /(?P=name) -->",
        lambda found: textwrap.indent(
            f"<!-- {found[2]} -->\n{BLOCKS[found[2]]()}\n<!-- /{found[2]} -->", found[1]
        ),
        text,
        flags=re.S | re.M,
    )


def draw() -> None:
    """The README's plot of time against error, with the other renderers where they were measured in
    the same view."""
    table, peers = (read(RESULTS / f"{name}.csv") for name in ("sponza-cpu", "peers/sponza-sun"))
    size = ["width", "height"]
    is_same_view = table[size].drop_duplicates().equals(peers[size].drop_duplicates())
    beside: dict[str, Any] = {"peers": peers, "time": "wall_ms"} if is_same_view else {}
    (ax,) = plots.time_against_error_by_view(table, **beside)
    figure: Any = ax.figure
    plots.save(figure, DOCS / "time_against_error.png", table.attrs["command"], dpi=150)


def main() -> None:
    mpl.use("agg")  # no window
    draw()
    for page in PAGES:
        page.write_text(filled(page.read_text(encoding="utf-8")), encoding="utf-8")


if __name__ == "__main__":
    main()
