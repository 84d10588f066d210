"""The papers' own figures: every number of every table, and of the captions that have some.

They are in ``figures.csv`` beside this file, a line for each, with paper, table, section, row and
column. The section stands for the page, which differs between prints of a paper.
"""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple, TypeAlias

ROSEN = "Rosen 2012"
MILET = "Milet et al. 2015"
THESIS = "Navrátil, thesis"
VANEK = "Vanek et al. 2011"
CHONG = "Chong, Gortler 2007"

Figure: TypeAlias = float | tuple[float, float]
"""A number of a paper, or a range."""

Figures: TypeAlias = Mapping[str, Figure]
"""Those of a row by column."""


def middle(figure: Figure) -> float:
    """The number, or the middle of the range."""
    return sum(figure) / 2 if isinstance(figure, tuple) else figure


class Place(NamedTuple):
    """Where a figure stands."""

    paper: str
    place: str
    section: str
    row: str
    column: str


class Printed(NamedTuple):
    """A figure and its unit."""

    figure: Figure
    unit: str


@cache
def printed() -> Mapping[Place, Printed]:
    """All figures."""
    text = (Path(__file__).parent / "figures.csv").read_text(encoding="utf-8")
    found = {}
    for line in csv.DictReader(text.splitlines()):
        place = Place(*(line[name] for name in Place._fields))
        low, high = float(line["from"]), line["to"]
        found[place] = Printed((low, float(high)) if high else low, line["unit"])
    return found


def rows_of(paper: str, place: str) -> Mapping[str, Figures]:
    """The rows of a table by name, each with its figures by column."""
    rows: dict[str, dict[str, Figure]] = defaultdict(dict)
    for at, (figure, _) in printed().items():
        if (at.paper, at.place) == (paper, place):
            rows[at.row][at.column] = figure
    if not rows:
        raise KeyError(f"{paper}, {place}")
    return rows


def columns_of(paper: str, place: str) -> Mapping[str, Figures]:
    """The columns of a table by name, each with its figures by row."""
    columns: dict[str, dict[str, Figure]] = defaultdict(dict)
    for row, figures in rows_of(paper, place).items():
        for column, figure in figures.items():
            columns[column][row] = figure
    return columns


def source(paper: str, place: str) -> str:
    """Where a table stands, for people."""
    sections = {at.section for at in printed() if (at.paper, at.place) == (paper, place)}
    return f"{paper}, {place}, in section {', '.join(sorted(sections))}"
