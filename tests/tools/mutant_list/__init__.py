"""The mutants: formulas that errors hide in, what each becomes, and the tests that must fail."""

from __future__ import annotations

from . import engines, fits, lab, lookups, maps, pages, rays, samples, truth
from .mutant import Mutant

MUTANTS: tuple[Mutant, ...] = (
    *engines.MUTANTS,
    *maps.MUTANTS,
    *pages.MUTANTS,
    *rays.MUTANTS,
    *samples.MUTANTS,
    *lookups.MUTANTS,
    *fits.MUTANTS,
    *truth.MUTANTS,
    *lab.MUTANTS,
)
