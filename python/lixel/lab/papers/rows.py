"""Which command measures each row of each table of the papers, and why some rows have none."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from .figures import CHONG, MILET, ROSEN, THESIS, VANEK, printed

TABLES: Mapping[tuple[str, str], str] = {
    **{(ROSEN, f"Table {n}"): f"rosen-{n}" for n in (1, 2, 3)},
    **{(ROSEN, f"Figure {n}"): f"rosen-figure-{n}" for n in (1, 3, 6, 7, 8)},
    **{(MILET, f"Table {n}"): f"milet-{n}" for n in (1, 2, 3)},
    # The thesis prints two tables of the paper again.
    (THESIS, "Table 5.1"): "milet-3",
    (THESIS, "Table 5.2"): "thesis-2",
    (THESIS, "Table 5.3"): "milet-1",
    (VANEK, "Table 1"): "vanek-1",
    **{(CHONG, f"Table {n}"): f"chong-{n}" for n in (1, 2, 3)},
}
"""What `lixel lab papers` calls each table, and each figure whose caption has numbers."""

TRIANGLES = "those of the substitutes stand above the table"

WITHOUT: Mapping[tuple[str, str, str], str] = {
    (ROSEN, "Table 2", "Total"): "it is the sum of the others; `rosen-1` has whole frames",
    (MILET, "Table 3", "triangles"): TRIANGLES,
    (THESIS, "Table 5.1", "triangles"): TRIANGLES,
    (CHONG, "Table 3", "Convex Hull"): "it is part of the optimization, and has no time of its own",
}
"""Rows that no command measures by themselves, and why."""


def commands() -> Iterator[dict[str, str]]:
    """For each table its rows, the command that measures them, and what is not measured."""
    for paper, place in dict.fromkeys((at.paper, at.place) for at in printed()):
        rows = dict.fromkeys(at.row for at in printed() if (at.paper, at.place) == (paper, place))
        without = {
            row: WITHOUT[paper, place, row] for row in rows if (paper, place, row) in WITHOUT
        }
        yield {
            "table": f"{paper}, {place}",
            "rows": "; ".join(row for row in rows if row not in without),
            "command": f"`lixel lab papers {TABLES[paper, place]}`",
            "not measured": "; ".join(f"{row}: {reason}" for row, reason in without.items()),
        }
