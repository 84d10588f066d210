"""The papers' tables, measured again: docs/pages/paper_tables.md."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import pandas as pd
from cells import RESULTS, markdown

from lixel.lab import papers
from lixel.lab.papers import chong_gortler, measuring, path
from lixel.lab.papers.tables import Table
from lixel.lab.result_tables import read

FOLDER = RESULTS / "papers"


def paper_table(name: str) -> str:
    """A table beside the paper's figures, what it was measured with, and what is to be said of it;
    before it was measured, its command."""
    file = next(FOLDER.glob(f"{name}.*"), None)
    if file is None:
        return f"Not measured by this version: `lixel lab papers {name}`."
    measured = read(file)
    made = measured.attrs
    parts = list(_parts(name, measured))
    driver = made["driver"].partition(", ")[2]
    parts.append(f"By `{made['command']}`, on an {made['device']}, {driver}, {made['date']}.")
    return "\n\n".join(parts)


def _parts(name: str, measured: pd.DataFrame) -> Iterator[str]:
    """Tables and paragraphs."""
    rows: list[dict[str, Any]] = [dict(row) for row in measured.to_dict("records")]
    match name:
        case "chong-1":
            wrong = measured.pivot_table(index="method", columns="light", values="misclassified")
            names = list(dict.fromkeys(measured["method"]))
            counts = wrong.loc[names].to_numpy()
            yield f"{counts.shape[1]} lights."
            yield markdown(chong_gortler.layout(names, counts))
            yield "All that were measured, with the best fits unless another is named:"
            yield markdown(chong_gortler.summary(names, counts))
        case "rosen-figure-9":
            yield markdown(path.summary(rows))
        case "chong-2" | "chong-3":
            yield markdown(measured)
        case _:
            chosen = papers.TABLES[name]
            found = list(measuring.beside(chosen, measured))
            sizes, *scenes = measuring.heading(chosen, measured)
            yield f"{sizes}; {'; '.join(scenes)}."
            has_stages = any("stage" in row for row in found)
            yield markdown(_by_stage(chosen, found) if has_stages else _filled(found))
            lines = [*_order(found), *measuring.remarks(chosen, found, measured)]
            if lines:
                yield "\n".join(f"* {line[0].upper()}{line[1:].rstrip('.')}." for line in lines)


def _by_stage(chosen: Table, rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """A row with a column for each stage: our share or ratio, and in brackets the paper's."""
    ours, paper = ("ours, %", "paper, %") if chosen.as_shares else ("ours, ratio", "paper, ratio")
    found: dict[tuple[str, ...], dict[str, Any]] = {}
    for row in rows:
        head = {name: row[name] for name in ("scene", "row", "by", "ours")}
        cells = found.setdefault(tuple(head.values()), head)
        own, theirs = (
            "-" if value is None else f"{value:.{0 if chosen.as_shares else 2}f}"
            for value in (row[ours], row[paper])
        )
        unit = " %" if chosen.as_shares else ""
        cells[row["stage"]] = f"{own}{unit} ({theirs})"
        if row.get("misclassified") is not None:
            cells["misclassified"] = row["misclassified"]
    return _filled(list(found.values()))


def _filled(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows with the same columns, in the order in which they come up."""
    columns = dict.fromkeys(name for row in rows for name in row)
    return [{name: _cell(row.get(name)) for name in columns} for row in rows]


def _cell(value: Any) -> Any:
    return "" if value is None else value


def _order(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """How many pairs of rows stand in the order of the paper's times."""
    by: dict[str, list[bool]] = {}
    for first, _, paper, ours in measuring.apart(rows):
        by.setdefault(first["by"], []).append((paper > 1.0) == (ours > 1.0))
    for whose, same in by.items():
        yield (
            f"Times, {whose}: {sum(same)} of the {len(same)} pairs of rows that are 5 % or more "
            "apart, there and here, stand in the paper's order"
        )


BLOCKS = {f"paper table {name}": lambda name=name: paper_table(name) for name in papers.NAMES}

WHAT = {
    f"papers/{name}": f"{papers.TABLES[name].title} ({papers.TABLES[name].source})"
    if name in papers.TABLES
    else papers.EXPERIMENTS[name].title
    for name in papers.NAMES
}
"""Of each file."""
