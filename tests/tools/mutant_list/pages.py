"""Maps in pages: which level a pixel looks into, which pages are drawn, and which are kept."""

from __future__ import annotations

from .mutant import Mutant

LEVELS = ("pytest", "tests/test_virtual.py", "-k", "as_wide_as_it_is or bias_moves")
PAGES = ("cargo", "--lib", "pages::t", "fits::pages", "kept_pages")
KEEPING = ("pytest", "tests/test_virtual.py", "-k", "keeps_pages or keeps_no_page")
ON_GPU = ("pytest", "tests/test_virtual.py", "-k", "same_pages")

FOOTPRINT = "src/paging/footprint.rs"
PAGING = "src/paging/mod.rs"
SHADER = "shaders/paging/pages.wgsl"
DRAWN = "src/cpu/pages/draw.rs"
KEPT = "src/cpu/pages/kept.rs"
TABLE = "src/cpu/pages/table.rs"
TREE = "src/cpu/pages/tree.rs"
SQUARES = "src/fits/pages.rs"

MUTANTS = (
    Mutant(
        "pages", "a level is chosen by the width of a texel", PAGING,
        "(width * width / 4_f64.powf(bias)) as f32",
        "(width / 4_f64.powf(bias)) as f32", LEVELS,
    ),
    Mutant(
        "pages", "a bias of one is half a level", PAGING,
        "4_f64.powf(bias)", "2_f64.powf(bias)", LEVELS,
    ),
    Mutant(
        "pages", "the farther a pixel sees, the smaller it is", FOOTPRINT,
        "(ray / ray.length()).dot(along)", "ray.dot(along)", LEVELS,
    ),
    Mutant(
        "pages", "the eye is where the map's origin is", FOOTPRINT,
        "row.truncate().extend(row.w + row.truncate().dot(eye))", "row + 0.0 * eye.extend(0.0)",
        LEVELS,
    ),
    Mutant(
        "pages", "a map is as long as it is, and not as wide", SQUARES,
        "let side = half.truncate().max_element();", "let side = half.truncate().min_element();",
        PAGES,
    ),
    Mutant(
        "pages", "twice as many as may be are stored", PAGING,
        "if count <= most {", "if count <= 2.0 * most {", PAGES,
    ),
    Mutant(
        "pages", "the first of eight receivers asks for all", "src/cpu/lookup/mod.rs",
        "requests.ask(mask_bits(asking), ", "requests.ask(mask_bits(asking) & 1, ", PAGES,
    ),
    Mutant(
        "pages", "those of a scene that moved are kept", KEPT,
        "self.generation == scene.generation() && ", "", KEEPING,
    ),
    Mutant(
        "pages", "a kept page has its first tile everywhere", DRAWN,
        "(slot * of_page + tile % of_page) * TILE_PIXELS", "slot * of_page * TILE_PIXELS",
        KEEPING,
    ),
    Mutant(
        "pages", "tiles of a page are as many as in one of 128 texels", TABLE,
        "(y >> tile << (self.grid.shift - tile))", "(y >> tile << 1)", PAGES,
    ),
    Mutant(
        "pages", "the last tile of a box is left out", TREE,
        "(first[0] + along).min(x1 + 1)", "(first[0] + along).min(x1)", PAGES,
    ),
    Mutant(
        "pages", "a pixel looks into every level", SHADER,
        "level_of_pixel[pixel] == pages_uniform.number", "level_of_pixel[pixel] != 0u", ON_GPU,
    ),
    Mutant(
        "pages", "the levels of all maps have their pages in common", SHADER,
        "ask(pages.first_bit + page.y * pages.columns + page.x)",
        "ask(page.y * pages.columns + page.x)", ON_GPU,
    ),
    Mutant(
        "pages", "rows of a page are half as long", SHADER,
        "+ within.y) << size_shift)", "+ within.y) << (size_shift - 1u))", ON_GPU,
    ),
    Mutant(
        "pages", "a coarse tile holds no page", SHADER,
        "+ tile.y * pages.coarse_columns + tile.x] != 0u", "+ tile.y * pages.coarse_columns] != 0u",
        ON_GPU,
    ),
)  # fmt: skip
