"""How time and work grow with triangles and with pixels.

One scene, objects on a floor, in finer and finer triangles, and in larger and larger images: where
time doubles with what doubles, the exponent between two rows is 1. `exact` comes with the warp
that balances its lists, and without.

    python -m lixel.growth -o growth.csv
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..arguments import needs
from ..methods import DesiredView, Exact, Method, RayTraced
from .report import say
from .report import table as as_text
from .result_tables import check_table_path, provenance, save
from .study import study

if TYPE_CHECKING:
    import pandas

METHODS: Mapping[str, Method] = {
    "desired_view": DesiredView(resolution=1024),
    "ray_traced": RayTraced(),
    "exact": Exact(warp="notw"),
    "exact without a warp": Exact(warp="none"),
}

SUBDIVISIONS = (1, 2, 3, 4, 5, 6)
"""Four times as many triangles at each step, 18 thousand to 18 million."""

SIZES = ((640, 400), (1280, 800), (2560, 1600), (3840, 2160))
"""0.26 to 8.3 million pixels."""

SUBDIVISION, SIZE = 4, (1280, 800)
"""What stays while the other grows."""

COUNTERS = {
    "items": "stats.caster tests.work_items",
    "tests": "stats.caster tests.tests",
    "longest list": "stats.receiver lists.longest_list",
    "longest walk": "stats.shadow rays.longest_walk",
}


def growth(repeats: int = 3, journal: Path | None = None) -> pandas.DataFrame:
    """Times and counters of both series.

    Parameters
    ----------
    repeats : int
        Timed frames of each case.
    journal : Path, optional
        As for `study`.

    Returns
    -------
    pandas.DataFrame
        A row for each step of a series (``grows``: triangles or pixels) and method: ``triangles``,
        ``pixels``; ``gpu_ms``, the median; ``exponent`` of the time since the step before;
        wrong pixels; counters.
    """
    pandas = needs("pandas", "study")
    series = {
        "triangles": [(step, SIZE) for step in SUBDIVISIONS],
        "pixels": [(SUBDIVISION, size) for size in SIZES],
    }
    rows: list[dict[str, Any]] = []
    for grows, steps in series.items():
        before: dict[str, dict[str, Any]] = {}
        for step, size in steps:
            found = study(
                {"objects_on_floor": ("objects_on_floor", {"subdivisions": step})},
                methods=list(METHODS.values()),
                size=size,
                repeats=repeats,
                journal=journal,
            )
            for name, (_, case) in zip(METHODS, found.iterrows(), strict=True):
                row = {
                    "grows": grows,
                    "method": name,
                    "triangles": case["triangles"],
                    "pixels": case["width"] * case["height"],
                    "gpu_ms": case["gpu_ms"],
                    "exponent": math.nan,
                    "misclassified": case["misclassified_count"],
                    **{key: case.get(column, math.nan) for key, column in COUNTERS.items()},
                }
                if name in before:
                    row["exponent"] = math.log(row["gpu_ms"] / before[name]["gpu_ms"]) / math.log(
                        row[grows] / before[name][grows]
                    )
                before[name] = row
                rows.append(row)
    return pandas.DataFrame(rows)


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure and print both series."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--repeats", type=int, default=3, metavar="N")
    parser.add_argument("-o", "--output", type=Path, metavar="FILE", help="write a table")
    parser.add_argument("--journal", type=Path, metavar="FILE", help="go on there after a stop")
    options = parser.parse_args(arguments)
    if options.output is not None:
        check_table_path("output", options.output)
    found = growth(options.repeats, options.journal)
    print(as_text(found.to_dict("records")))
    if options.output is not None:
        save(found.assign(**provenance("python -m lixel.growth")), options.output)
        say(f"wrote {options.output}")


if __name__ == "__main__":
    main()
