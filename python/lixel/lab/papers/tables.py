"""What a paper's table is: its rows with the paper's figures, and how to measure it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

from ...light import Light

Figure: TypeAlias = float | tuple[float, float]
"""A number of a paper, or a range."""


@dataclass(frozen=True)
class SubstituteScene:
    """A generated scene in place of one of a paper."""

    generator: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    light: Light | None = None

    def __str__(self) -> str:
        return f"{self.generator}({', '.join(f'{k}={v}' for k, v in self.arguments.items())})"


@dataclass(frozen=True)
class Row:
    """A method of a table and its figures, one for each column: a number, a range, or None where
    the paper has none."""

    name: str
    method: str
    figures: tuple[Figure | None, ...]
    parameters: Mapping[str, Any] = field(default_factory=dict)
    # The passes that the figures are of; None: those of the table.
    passes: tuple[str, ...] | None = None


@dataclass(frozen=True)
class Table:
    """A table of a paper, and how to measure it."""

    name: str
    title: str
    source: str
    size: tuple[int, int]
    resolution: int
    scenes: Mapping[str, SubstituteScene]
    rows: tuple[Row, ...]
    # The row that the others are divided by.
    base: str
    # Cameras on a path; more than one gives ranges.
    path: int = 1
    # Passes that the paper's times leave out.
    without: tuple[str, ...] = ()
    # Columns that are stages of a frame rather than scenes, with their passes; figures are then
    # shares of the frame.
    stages: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    unit: str = "ms"
    # Columns of the study, whose medians are added under these names.
    details: Mapping[str, str] = field(default_factory=dict)
    # Why ours differ where they do.
    remark: str = ""
