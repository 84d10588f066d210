"""Measure the tables of the papers again, beside the papers' own figures.

The papers' scenes are not to be had; each has a generated substitute of the same size and kind,
which is named. A row says whether the method is as published or has lixel's own parameters. Ratios
come first, because the machines differ: each time over that of the table's plainest method as
published, or the share of a stage in its frame. What the tables leave out is added: how many pixels
are misclassified. A line names each pair of rows whose order is not the paper's.

A row whose method this version does not have is left out, and named.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from ...arguments import did_you_mean, needs
from ..options import SCENE_HELP, VIEWS_HELP, add_output, natural
from ..report import status
from . import chong_gortler, drawings, milet, path, rosen, vanek
from .figures import CHONG, ROSEN
from .measuring import beside, measure_table, print_table, quick_version
from .tables import Table


class Experiment(NamedTuple):
    """A title, and what is measured: ``measure(quick, folder)``."""

    title: str
    measure: Callable[[bool, Path | None], list[dict[str, Any]]]


TABLES: Mapping[str, Table] = {
    each.name: each for each in (*rosen.TABLES, *milet.TABLES, *vanek.TABLES)
}

EXPERIMENTS: Mapping[str, Experiment] = {
    "rosen-figure-9": Experiment(
        f"Times along a path, {ROSEN}, Figure 9, in section 6.4", path.along_a_path
    ),
    "chong-1": Experiment(
        f"Misclassified pixels, {CHONG}, Table 1; the paper's percentages in brackets",
        chong_gortler.misclassified,
    ),
    "chong-2": Experiment(
        f"Running time, {CHONG}, Table 2; the paper's in brackets", chong_gortler.running_times
    ),
    "chong-3": Experiment(f"Where a frame's time goes, {CHONG}, Table 3", chong_gortler.stages),
}
"""What is not laid out as a `Table`."""

NAMES = (*TABLES, *EXPERIMENTS)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The options of `lixel lab papers`."""
    parser.add_argument(
        "tables", nargs="*", metavar="TABLE", help=f"default: all of {', '.join(NAMES)}"
    )
    parser.add_argument(
        "--quick",
        action="store_true",
        help="images and maps of a quarter of the size, smaller scenes, fewer frames and lights",
    )
    parser.add_argument(
        "--lights", type=natural, metavar="N", help="of chong-1; default: 500, quick 10"
    )
    parser.add_argument(
        "--scene", metavar="FILE",
        help=f"of chong-1, in place of objects on a floor: {SCENE_HELP}",
    )  # fmt: skip
    parser.add_argument("--views", type=Path, metavar="FILE.json", help=f"of --scene: {VIEWS_HELP}")
    parser.add_argument(
        "--figures", action="store_true",
        help="draw the papers' figures in place of their tables, into the folder of -o or out: "
        + ", ".join(drawings.FIGURES),
    )  # fmt: skip
    add_output(
        parser,
        "write all that was measured into this folder, and go on there after a stop",
        type=Path,
        metavar="FOLDER",
    )


def run(options: argparse.Namespace) -> None:
    """Measure tables and print them, or draw figures."""
    given = {name: getattr(options, name) for name in ("lights", "scene", "views")}
    given = {name: value for name, value in given.items() if value is not None}
    if given and options.tables != ["chong-1"]:
        raise ValueError(f"--{', --'.join(given)} must come with the table chong-1 alone")
    if options.views is not None and options.scene is None:
        raise ValueError("--views must come with --scene")
    if options.figures:
        drawings.draw(options.tables, options.output or Path("out"), quick=options.quick)
    elif given:
        chong_gortler.print_rows(
            chong_gortler.misclassified(options.quick, options.output, **given)
        )
    else:
        measure(options.tables, quick=options.quick, folder=options.output)


def measure(
    names: Sequence[str] = (), *, quick: bool = False, folder: Path | None = None, repeats: int = 5
) -> dict[str, list[dict[str, Any]]]:
    """Measure tables of `NAMES`, all without `names`, and print each beside the paper's figures.

    `quick` takes images and maps of a quarter of the size on each side, smaller scenes, two cameras
    on a path and one frame each, in place of `repeats`. Into the folder goes each table with all
    that was measured, and its journal. The rows are returned by the name of the table; an unknown
    name is a `ValueError`.
    """
    needs("pandas", "study")
    for name in names:
        if name not in NAMES:
            raise ValueError(
                f"table must be one of {', '.join(NAMES)}, got {name!r}{did_you_mean(name, NAMES)}"
            )
    found = {}
    for name in names or NAMES:
        if name in EXPERIMENTS:
            experiment = EXPERIMENTS[name]
            status(f"{name}: {experiment.title}")
            found[name] = experiment.measure(quick, folder)
            print(f"\n{experiment.title}")
            chong_gortler.print_rows(found[name])
            continue
        chosen = quick_version(TABLES[name]) if quick else TABLES[name]
        measured = measure_table(chosen, 1 if quick else repeats, folder)
        found[name] = list(beside(chosen, measured))
        print_table(chosen, found[name], measured)
    return found
