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
    device: str = ""
    """The engine of all tests that name none, if it is not the mutant's own."""

    @property
    def engine(self) -> str:
        of_cpu = self.tests[0] == "pytest" and not self.file.startswith("shaders/")
        return self.device or ("cpu" if of_cpu else "gpu")
