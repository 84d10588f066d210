"""What a paper's table is: its rows with the paper's figures, and how to measure it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from ...light import Light
from ...methods import Method, method_from
from .figures import Figures


def method_of(spelling: str, **changes: Any) -> Method:
    """The method of a name such as ``"rtw"`` or ``"rtw@milet-2015"``, with some changes."""
    return replace(method_from(spelling), **changes)


Stages = Mapping[str, tuple[str, ...] | None]
"""Passes of a frame by the name of a column; None: all of them."""


@dataclass(frozen=True)
class SubstituteScene:
    """A generated scene in place of one of a paper, its light if it is not the scene's own, and a
    spot light of the same place for a map that has one direction."""

    generator: str
    arguments: Mapping[str, Any] = field(default_factory=dict)
    light: Light | None = None
    spot: Light | None = None
    # In place of the others where a table is to be had in minutes.
    quick: Mapping[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        return f"{self.generator}({', '.join(f'{k}={v}' for k, v in self.arguments.items())})"


@dataclass(frozen=True)
class Row:
    """A method of a table, and the paper's figures by column."""

    name: str
    # As `method_of` spells it.
    method: str
    figures: Figures = field(default_factory=dict)
    parameters: Mapping[str, Any] = field(default_factory=dict)
    # The passes that the figures are of; None: those of the table.
    passes: tuple[str, ...] | None = None
    # In place of the table's.
    stages: Stages | None = None
    # By the scene's spot light.
    by_spot: bool = False

    @property
    def by(self) -> str:
        """Whose parameters: the paper's, or lixel's."""
        return "published" if "@" in self.method else "lixel"

    @property
    def key(self) -> tuple[str, str]:
        """No other row of the table has it."""
        return self.name, self.by


def both(
    name: str, method: str, paper: str, figures: Figures, /, **parameters: Any
) -> tuple[Row, Row]:
    """A method as a paper has it, and with lixel's own parameters; those given are set in each."""
    return Row(name, f"{method}@{paper}", figures, parameters), Row(
        name, method, figures, parameters
    )


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
    # The row as published that the others are divided by.
    base: str
    # Cameras on a path; more than one gives ranges.
    path: int = 1
    # Passes that the paper's times leave out.
    without: tuple[str, ...] = ()
    # Columns of each scene, with their passes.
    stages: Stages = field(default_factory=dict)
    # Whether these are given as shares of the frame.
    as_shares: bool = False
    unit: str = "ms"
    # Columns of the study, whose medians are added under these names.
    details: Mapping[str, str] = field(default_factory=dict)
    # Whether the paper says how many texels a plain map would need.
    has_mer: bool = False
    # Rows that by the paper misclassify fewer pixels from one to the next.
    ranking: Sequence[str] = ()
    # Rows of the paper that are not here, and why.
    left_out: Mapping[str, str] = field(default_factory=dict)
    # Why ours differ where they do.
    remark: str = ""

    def columns(self, row: Row) -> Iterator[tuple[str, str | None, tuple[str, ...] | None, str]]:
        """Scene, stage, its passes, and what the paper calls the column, for each column."""
        stages = row.stages or self.stages
        for scene in self.scenes:
            if not stages:
                yield scene, None, None, scene
            for stage, passes in stages.items():
                name = stage if len(self.scenes) == 1 else f"{scene}, {stage}"
                yield scene, stage, passes, name
