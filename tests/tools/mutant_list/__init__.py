"""The mutants: formulas that errors hide in, what each becomes, and the tests that must fail."""

from __future__ import annotations

from . import engines, fits, lookups, maps, pages, truth
from .mutant import Mutant

MUTANTS: tuple[Mutant, ...] = (
    *engines.MUTANTS,
    *maps.MUTANTS,
    *pages.MUTANTS,
    *lookups.MUTANTS,
    *fits.MUTANTS,
    *truth.MUTANTS,
)
