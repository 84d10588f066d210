"""Tables that are kept: what made them, and going on where a run stopped."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from .. import _core


def provenance(command: str) -> dict[str, str]:
    """What every row of a kept table says: the device, its driver, the day, and the command."""
    adapter = _core.device()
    return {
        "device": adapter["name"],
        "driver": adapter["driver"],
        "date": datetime.now(timezone.utc).date().isoformat(),
        "command": command,
    }


def read(path: Path, command: str) -> list[dict[str, str]]:
    """The rows that a command goes on with; none where there is no table yet.

    Raises
    ------
    ValueError
        The table is another command's, whose rows are of other views.
    """
    if not path.exists():
        return []
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    for row in rows:
        if row["command"] != command:
            raise ValueError(
                f"{path.name} must be the table of {command!r}, got one of {row['command']!r}"
            )
    return rows


def write(path: Path, command: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """A whole table: rows, and in each what made it."""
    path.unlink(missing_ok=True)
    said = provenance(command)
    append(path, [*rows[0], *said], [{**row, **said} for row in rows])


def append(path: Path, columns: Sequence[str], rows: Sequence[Mapping[str, Any]]) -> None:
    """Adds rows to a table, which begins with its columns."""
    path.parent.mkdir(parents=True, exist_ok=True)
    is_new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, columns)
        if is_new:
            file.write(",".join(columns) + "\n")
        writer.writerows(rows)
