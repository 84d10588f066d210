"""Measure every method at equal texels and in equal time: misclassified pixels over the scenes of a
folder.

Each scene is seen by its first camera in its first sun. Every method that takes suns is studied
there with maps of four sizes. Texels are equal at 1024² (cascades have as many in each of their
maps, `virtual` in its finest level). The time that is equal is that of `desired_view` with 1024² in
the same scene: between two sizes of a map, misclassified pixels are taken to go by a power of the
time, and a method that has none so fast is left out of the scene. The table is written scene by
scene, and the same command goes on where the last one stopped.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ..arguments import needs
from ..light import DirectionalLight
from ..load import load
from ..methods import DesiredView
from .options import add_output, add_size, natural
from .report import table as as_text
from .result_tables import append, read, resume
from .study import study
from .views import listed_in

if TYPE_CHECKING:
    import pandas

RESOLUTIONS = (256, 512, 1024, 2048)
EQUAL = 1024
COLUMNS = ["scene", "method", "resolution", "wall_ms", "misclassified_count", "covered_count"]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab equal`."""
    parser.add_argument("folder", type=Path, help="with a scenes.json and the files that it lists")
    add_size(parser, "1920x1080", (1920, 1080))
    parser.add_argument(
        "--repeats", type=natural, default=3, metavar="N", help="timed frames of each case; 3"
    )
    add_output(parser, "table of every case, .csv or .parquet", required=True)


def run(options: argparse.Namespace) -> None:
    """Measure the scenes that the table does not have yet, append them, and print the summary."""
    done = {row["scene"] for row in resume(options.output, options.line)}
    for file, listed in listed_in(options.folder):
        name = Path(file).stem
        suns = [sun for sun in listed.lights.values() if isinstance(sun, DirectionalLight)]
        if name in done or not suns:
            continue
        found = study(
            {name: load(options.folder / file)},
            cameras=next(iter(listed.cameras.values())),
            lights=suns[0],
            parameters={"resolution": RESOLUTIONS},
            size=options.size,
            repeats=options.repeats,
        )
        rows = found[found["error"].isna()][COLUMNS].to_dict("records")
        append(options.output, options.line, [{str(k): v for k, v in row.items()} for row in rows])
    if options.output.exists():
        print(as_text(summary(read(options.output)).to_dict("records")))


def summary(table: pandas.DataFrame) -> pandas.DataFrame:
    """A row for each method: of all scenes the misclassified pixels at equal texels, how many times
    those of `desired_view` these are, and the median of its time over that of `desired_view`; then
    in how many scenes it is there in equal time, and its misclassified pixels over those of
    `desired_view` in these."""
    # What has no map is the same at every size.
    own = table.fillna({"resolution": EQUAL})
    at_equal = own[own["resolution"] == EQUAL].set_index(["method", "scene"])
    first = at_equal.loc[DesiredView.name]
    rows: list[dict[str, Any]] = []
    for method, of_method in own.groupby("method", sort=False):
        at = at_equal.loc[method]
        wrong = int(at["misclassified_count"].sum())
        in_time = {
            scene: misclassified_in(of_scene, float(first["wall_ms"][scene]))
            for scene, of_scene in of_method.groupby("scene", sort=False)
        }
        there = [scene for scene, count in in_time.items() if count is not None]
        few = first["misclassified_count"]
        rows.append(
            {
                "method": method,
                "misclassified": wrong,
                "times desired_view's": _ratio(wrong, few[at.index].sum()),
                "time": round(float((at["wall_ms"] / first["wall_ms"][at.index]).median()), 2),
                "scenes in equal time": len(there),
                "in equal time": _ratio(sum(in_time[s] or 0 for s in there), few[there].sum()),
            }
        )
    return needs("pandas", "study").DataFrame(rows)


def misclassified_in(cases: pandas.DataFrame, time: float) -> float | None:
    """What maps of several sizes misclassify in a time; `None` where all take longer."""
    by_size = cases.sort_values("resolution")
    # Where a larger map took less, nobody would take the smaller one.
    times = np.minimum.accumulate(by_size["wall_ms"].to_numpy(np.float64)[::-1])[::-1]
    counts = by_size["misclassified_count"].to_numpy(np.float64)
    # Within what the same frame takes from one time to the next.
    if time < 0.95 * times[0]:
        return None
    return float(np.expm1(np.interp(np.log(time), np.log(times), np.log1p(counts))))


def _ratio(count: float, of: float) -> float | None:
    return round(float(count / of), 3) if of else None
