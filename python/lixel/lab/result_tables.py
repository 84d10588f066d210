"""Tables of results as files: what made them, once a file, and going on where a run stopped.

A `.csv` file begins with lines ``# key: value`` that name the device, its driver, the day and the
command; a `.parquet` file has the same in its metadata.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, timezone
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .. import _core
from ..arguments import needs

if TYPE_CHECKING:
    import pandas

PROVENANCE = ("device", "driver", "date", "command")

ENDINGS = (".csv", ".parquet")


def provenance(command: str) -> dict[str, str]:
    """What made a table: the device, its driver, the day, and the command."""
    adapter = _core.device()
    return {
        "device": adapter["name"],
        "driver": adapter["driver"],
        "date": datetime.now(timezone.utc).date().isoformat(),
        "command": command,
    }


def save(table: pandas.DataFrame, path: str | Path) -> None:
    """Write a table as .csv or .parquet.

    Parameters
    ----------
    table : pandas.DataFrame
        What made it is in ``attrs``, or in columns ``device``, ``driver``, ``date`` and
        ``command``. Such a column with one value for all rows becomes a line of the header.
    path : path
        Its folder is made where there is none. A file that is there is replaced whole.

    Raises
    ------
    ValueError
        Another ending.
    ImportError
        pyarrow is missing; the extra ``study`` has it.
    """
    target = Path(path)
    if target.suffix.lower() not in ENDINGS:
        raise ValueError(f"path must end in {' or '.join(ENDINGS)}, got {str(target)!r}")
    shared = {
        name: str(table[name].iloc[0])
        for name in PROVENANCE
        if name in table and table[name].nunique(dropna=False) == 1
    }
    found = {**table.attrs, **shared}
    header = {name: found[name] for name in PROVENANCE if name in found}
    rows = table.drop(columns=list(shared))
    rows.attrs = header
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(f"{target.name}.part")
    if target.suffix.lower() == ".csv":
        lines = "".join(f"# {name}: {value}\n" for name, value in header.items())
        # Counts stay whole where a row has none.
        text = rows.convert_dtypes().to_csv(index=False, lineterminator="\n")
        part.write_text(lines + text, encoding="utf-8")
    else:
        needs("pyarrow", "study")
        rows.to_parquet(part, index=False, compression="zstd", compression_level=19)
    part.replace(target)


def read(path: str | Path) -> pandas.DataFrame:
    """Read a table that `save` wrote; what made it is in ``attrs``."""
    pandas = needs("pandas", "study")
    target = Path(path)
    if target.suffix.lower() == ".parquet":
        return pandas.read_parquet(target)
    lines = target.read_text(encoding="utf-8").splitlines()
    count = next((i for i, line in enumerate(lines) if not line.startswith("# ")), len(lines))
    table = pandas.read_csv(target, skiprows=count)
    table.attrs = dict(line[2:].split(": ", 1) for line in lines[:count])
    return table


def write(path: str | Path, command: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write a whole table: rows, and in the header what made them."""
    # An empty text is no value, in Parquet too.
    table = needs("pandas", "study").DataFrame(rows).replace("", None)
    # Rows may name their own device.
    table.attrs = {k: v for k, v in provenance(command).items() if k not in table}
    save(table, path)


def resume(path: Path, command: str) -> list[dict[str, Any]]:
    """The rows that a command goes on with; none where there is no table yet.

    Raises
    ------
    ValueError
        The table is another command's, whose rows are of other views, or another device's.
    """
    if not path.exists():
        return []
    table = read(path)
    for name, ours in (("command", command), ("device", provenance(command)["device"])):
        theirs = table.attrs.get(name)
        if theirs != ours:
            raise ValueError(f"{path.name} must be the table of {ours!r}, got one of {theirs!r}")
    return [{str(name): value for name, value in row.items()} for row in table.to_dict("records")]


def append(path: Path, command: str, rows: Sequence[Mapping[str, Any]]) -> None:
    """Add rows to a table, all of them or none; its header is from when it was begun."""
    pandas = needs("pandas", "study")
    table = pandas.DataFrame(rows)
    if path.exists():
        before = read(path)
        table = pandas.concat([before, table], ignore_index=True)
        table.attrs = before.attrs
    else:
        table.attrs = provenance(command)
    save(table, path)
