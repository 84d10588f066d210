"""Text for people: tables, and progress on long work."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, TypeVar

Item = TypeVar("Item")


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Rows as text; columns are their keys in order of appearance, numbers stand on the right."""
    if not rows:
        return ""
    columns = list(dict.fromkeys(key for row in rows for key in row))
    cells = [columns, *([_cell(row.get(column)) for column in columns] for row in rows)]
    widths = [max(len(line[i]) for line in cells) for i in range(len(columns))]
    right = [any(isinstance(row.get(column), (int, float)) for row in rows) for column in columns]
    lines = [
        "  ".join(
            cell.rjust(width) if is_right else cell.ljust(width)
            for cell, width, is_right in zip(line, widths, right, strict=True)
        ).rstrip()
        for line in cells
    ]
    lines.insert(1, "  ".join("-" * width for width in widths))
    return "\n".join(lines)


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, float):
        return f"{value:,.2f}"
    if isinstance(value, int):
        return f"{value:,}"
    return str(value)


def progress(
    items: Iterable[Item],
    label: str,
    total: int | None = None,
    done: int = 0,
    *,
    is_shown: bool = True,
) -> Iterator[Item]:
    """The items, with a bar on stderr if it is shown. Of `total` items (None: as many as there are)
    `done` were done before.
    """
    from tqdm import tqdm

    if total is None:
        items = list(items)
        total = len(items)
    yield from tqdm(items, desc=label, total=total, initial=done, leave=False, disable=not is_shown)


def status(text: str) -> None:
    """A line on stderr about what goes on now."""
    print(text, file=sys.stderr, flush=True)
