"""Where results lie, and tables in Markdown's form."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pandas as pd

DOCS = Path(__file__).parent
RESULTS = DOCS / "results"


def markdown(rows: pd.DataFrame | Iterable[dict[str, object]]) -> str:
    """A table in Markdown's form; numbers without a fraction are whole."""

    def cell(value: object) -> str:
        if isinstance(value, float):
            whole = "" if pd.isna(value) else f"{value:,.0f}"
            return whole if pd.isna(value) or value == int(value) else f"{value:,.2f}"
        if isinstance(value, bool):
            return "yes" if value else "no"
        return f"{value:,}" if isinstance(value, int) else str(value)

    table = rows if isinstance(rows, pd.DataFrame) else pd.DataFrame(list(rows))
    head = f"| {' | '.join(map(str, table.columns))} |\n|{'---|' * len(table.columns)}"
    lines = [f"| {' | '.join(map(cell, row))} |" for row in table.itertuples(index=False)]
    return "\n".join([head, *lines])
