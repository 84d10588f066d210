"""Text for people: tables, and progress on long work."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
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


@contextmanager
def waiting(text: str, patience: float | None = None) -> Iterator[None]:
    """Says on stderr what is waited for: on a terminal after a second, and for how long already, in
    a line that goes away; elsewhere once, after ten seconds, or after `patience`."""
    is_done = threading.Event()
    is_terminal = sys.stderr.isatty()
    seconds = patience if patience is not None else 1.0 if is_terminal else 10.0

    def tell() -> None:
        start = time.monotonic()
        if is_done.wait(seconds):
            return
        if not is_terminal:
            status(f"{text} ...")
            return
        while not is_done.wait(0.2):
            words = f"{text} ... {time.monotonic() - start:.0f} s"
            print(f"\r{words}", end="", file=sys.stderr, flush=True)
        print("\r\033[K", end="", file=sys.stderr, flush=True)

    teller = threading.Thread(target=tell, daemon=True)
    teller.start()
    try:
        yield
    finally:
        is_done.set()
        teller.join()


def status(text: str) -> None:
    """A line on stderr about what goes on now."""
    print(text, file=sys.stderr, flush=True)
