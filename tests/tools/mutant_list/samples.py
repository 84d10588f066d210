"""Samples of a pixel, which the CPU engine tests together, and grids of crowds."""

from __future__ import annotations

from .mutant import Mutant

CROWDS = ("cargo", "--lib", "cpu::crowds")
SEVERAL_CELLS = ("pytest", "tests/test_crowds.py", "-k", "several_cells")
EVERY_CELL = ("pytest", "tests/test_coverage.py", "-k", "every_cell")
SQUARES = ("cargo", "--lib", "footprints_hold")
SAMPLES = ("cargo", "--lib", "cpu::samples")

OF_CROWDS = "src/cpu/crowds.rs"
FINER = "src/cpu/finer_grids.rs"
GRIDS = "src/cpu/light_grids.rs"
TESTS = "src/cpu/samples/footprint_tests.rs"
FOOTPRINTS = "src/cpu/samples/footprints.rs"
DRAW = "src/cpu/samples/draw.rs"

MUTANTS = (
    Mutant(
        "crowds", "a gap between rows parts none", OF_CROWDS,
        "(_, Some(at)) => Some(in_rows(at)),", "(_, Some(_)) => None,", CROWDS,
    ),
    Mutant(
        "crowds", "a finer grid ends before its last cells", FINER,
        "high: [unit(columns.end), unit(rows.end), 0.0]",
        "high: [unit(columns.end - 1), unit(rows.end - 1), 0.0]", SEVERAL_CELLS,
    ),
    Mutant(
        "crowds", "triangles of the last row of cells are left out", FINER,
        "for row in cells.rows.clone() {", "for row in cells.rows.start..cells.rows.end - 1 {",
        SEVERAL_CELLS,
    ),
    Mutant(
        "crowds", "vertices are those of the first chunk", FINER,
        "vertices[chunk * WORDS * 64 + place]", "vertices[0 * chunk * WORDS * 64 + place]",
        SEVERAL_CELLS,
    ),
    Mutant(
        "crowds", "of a block only the receivers in the last cell are asked about", GRIDS,
        "*all |= more;", "*all = *more;", SEVERAL_CELLS,
    ),
    Mutant(
        "samples of a pixel", "the next cell along the columns is not looked into", TESTS,
        "(number(u1, v0), within & many_u),", "(number(u1, v0), 0 * (within & many_u)),",
        EVERY_CELL,
    ),
    Mutant(
        "samples of a pixel", "the cell at the far corner is not looked into", TESTS,
        "(number(u1, v1), within & many_u & many_v),",
        "(number(u1, v1), 0 * (within & many_u & many_v)),", EVERY_CELL,
    ),
    Mutant(
        "samples of a pixel", "the cell between two is not looked into", TESTS,
        "splat(simd, 2.0 * MAX_REACH)", "splat(simd, 4.0 * MAX_REACH)", EVERY_CELL,
    ),
    Mutant(
        "samples of a pixel", "a footprint is as far as its middle", TESTS,
        "|i| middle[i][2] - reach(i, 2)", "|i| middle[i][2]", EVERY_CELL,
    ),
    Mutant(
        "samples of a pixel", "those in a crowd are lit", TESTS,
        "*maybe |= within;", "*maybe |= 0 * within;", SEVERAL_CELLS,
    ),
    Mutant(
        "samples of a pixel", "a footprint is that of the step at its middle", FOOTPRINTS,
        "splat64(simd, 0.5 * GROWTH) / (one - bend * splat64(simd, 0.5))",
        "splat64(simd, 0.5 * GROWTH)", SQUARES,
    ),
    Mutant(
        "samples of a pixel", "the light's rays are parallel", FOOTPRINTS,
        "linear_part(simd, rows[j], step) * inverse - middle[j] * along",
        "linear_part(simd, rows[j], step) * inverse", SQUARES,
    ),
    Mutant(
        "samples of a pixel", "the middle says whether all are in the light's cone", FOOTPRINTS,
        "(is_flat & reach.simd_lt(within))", "(is_flat & splat64(simd, 0.0).simd_lt(within))",
        SQUARES,
    ),
    Mutant(
        "samples of a pixel", "of two triangles in one place the last is seen", DRAW,
        "new == old && id < known", "new == old && id > known", SAMPLES,
    ),
)  # fmt: skip
