"""What a mutant is."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutant:
    """A text of a file that stands there once, and what it becomes."""

    subject: str
    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]
    """Options of `cargo test`, or of pytest, that choose the tests which must fail."""
    device: str = "gpu"
    """The engine of all tests that name none."""
