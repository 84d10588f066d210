"""What is drawn into a map: texels of a tile, warps and their inverses, parts that are hidden."""

from __future__ import annotations

from .mutant import Mutant

WARPS = (
    "pytest", "tests/test_warps.py", "tests/test_shadow_maps.py", "-k",
    "test_warps or ((texel_holds or cell_with_most or never_shadows_itself) and Warp)",
)  # fmt: skip
TEXELS = ("pytest", "tests/test_shadow_maps.py", "-k", "texel_holds")
PIXELS = ("pytest", "tests/test_visibility_buffer.py", "-k", "shared_edge or soups")
TILES_OF_IMAGE = ("pytest", "tests/test_image_tiles.py", "-k", "change_nothing and cube")
HIDDEN = ("pytest", "tests/test_hidden_parts.py")
READ_BACK = ("cargo", "--lib", "packed_image")
LOOKED_AT = ("pytest", "tests/test_receiver_tiles.py", "-k", "no_receiver_looks_at")

GRID = "shaders/warp/grid.wgsl"
TABLES = "shaders/warp_map.wgsl"
BANDS = "shaders/rasterize_bands.wgsl"
TILES = "shaders/lib/tiles.wgsl"
PARTS = "shaders/lib/parts.wgsl"
COVERAGE = "shaders/lib/coverage.wgsl"
IMAGE_TILES = "shaders/image_tiles.wgsl"
MARKED = "src/cpu/lookup/looked_at.rs"
RECEIVER_TILES = "src/cpu/receiver_tiles.rs"
PACKED = "shaders/packed_image.wgsl"
IMAGE_READ = "src/gpu/passes/packed_image.rs"

MUTANTS = (
    Mutant(
        "warp inverse", "takes a texel's corner for its centre", TABLES,
        "let centre = (f32(texel) + 0.5) / f32(axis.texels);",
        "let centre = f32(texel) / f32(axis.texels);", WARPS,
    ),
    Mutant(
        "warp inverse", "stops a cell early", TABLES,
        "var last = axis.cells - 1u;",
        "var last = max(axis.cells, 2u) - 2u;", WARPS,
    ),
    Mutant(
        "warp inverse", "takes the row from the warped map", GRID,
        "linear_from_column(warp, function_at(y, warp.functions.x), texel.x, size)",
        "linear_from_column(warp, function_at((f32(texel.y) + 0.5) / f32(size.y), "
        "warp.functions.x), texel.x, size)", WARPS,
    ),
    Mutant(
        "warp inverse", "takes the column beside", GRID,
        "return function_at((f32(column) + 0.5) / f32(size.x), warp.functions.y);",
        "return function_at((f32(column) + 1.5) / f32(size.x), warp.functions.y);", WARPS,
    ),
    Mutant(
        "warp inverse", "the bound of texels is that of the first", GRID,
        "y.y = max(y.y, linear_from_row(warp, i, last.y, size));",
        "y.y = max(y.y, linear_from_row(warp, i, first.y, size));", WARPS,
    ),
    Mutant(
        "warp inverse", "neighbours begin a texel late", GRID,
        "clamp(middle + i - reach, vec2<i32>(0)", "clamp(middle + i - reach + 1, vec2<i32>(0)",
        WARPS,
    ),
    Mutant(
        "texels of a tile", "the last column is left out", TILES,
        "x >= column && x < width);", "x >= column && x + 1u < width);", TEXELS,
    ),
    Mutant(
        "texels of a tile", "columns beyond the last are drawn", TILES,
        "x >= column && x < width);", "x >= column);", TEXELS,
    ),
    Mutant(
        "texels of a tile", "rows of another band are drawn", TILES,
        "bound.first.y + i32(y), projection.size) == band;",
        "bound.first.y + i32(y), projection.size) <= 0xffffu;", TEXELS,
    ),
    Mutant(
        "texels of a tile", "the first column's rows are those of all", BANDS,
        "span_of(unwarped.along_y, from_x, to_x)", "span_of(unwarped.along_y, from_x, from_x)",
        TEXELS,
    ),
    Mutant(
        "texels of a tile", "the lower rows are a row too high", TILES,
        "select(0u, 4u, is_second)", "select(0u, 3u, is_second)", TEXELS,
    ),
    Mutant(
        "texels of a tile", "the second four columns stand where the first do", TILES,
        "let four = select(places.first, places.second, i >= 4u);", "let four = places.first;",
        TEXELS,
    ),
    Mutant(
        "texels of a tile", "the last that is drawn hides the others", TILES,
        "let rest = half & (half - 1u);", "let rest = 0u;", TEXELS,
    ),
    Mutant(
        "texels of a tile", "an edge that two triangles share is of neither", COVERAGE,
        "return min(min(e.x, e.y), e.z) >= 0.0 &&", "return min(min(e.x, e.y), e.z) > 0.0 &&",
        PIXELS,
    ),
    Mutant(
        "image tiles", "end at their nearest receiver", IMAGE_TILES,
        "max(rates * depths.x, rates * depths.y)", "rates * depths.x",
        TILES_OF_IMAGE,
    ),
    Mutant(
        "image tiles", "are narrower than they are", IMAGE_TILES,
        "min(first + IMAGE_TILE, vec2<u32>(receivers.width, receivers.height))",
        "first + vec2<u32>(1u)", TILES_OF_IMAGE,
    ),
    Mutant(
        "packed image", "all pixels of a word are its first", PACKED,
        "min(4u * word + i, arrayLength", "min(4u * word, arrayLength", READ_BACK,
    ),
    Mutant(
        "packed image", "what is lit in part is lit", IMAGE_READ,
        "if is_filtered {", "if false {", READ_BACK,
    ),
    Mutant(
        "hidden parts", "what covers some of a tile hides all of it", PARTS,
        "is_in_range && covers_all(projection, triangle, box)",
        "is_in_range && may_cover(projection, triangle, box)", HIDDEN,
    ),
    Mutant(
        "hidden parts", "what is behind the nearest point of a tile is hidden", PARTS,
        "let key = ~bitcast<u32>(stored_depth(projection, depths.y));",
        "let key = ~bitcast<u32>(stored_depth(projection, depths.x));", HIDDEN,
    ),
    Mutant(
        "hidden parts", "a whole triangle ends where its first tile does", PARTS,
        "select(part.tile, min(part.tile + 1u, tiles - 1u), part.is_whole)", "part.tile", HIDDEN,
    ),
    Mutant(
        "hidden parts", "what is nearer than the near plane hides", PARTS,
        "depths.x >= projection.z_min && depths.y <= projection.z_max", "true", HIDDEN,
    ),
    Mutant(
        "tiles that receivers look at", "the texels to the right are left out", MARKED,
        "((high[k] + reach) as usize)", "(high[k] as usize)", LOOKED_AT,
    ),
    Mutant(
        "tiles that receivers look at", "the last column of blocks is left out", RECEIVER_TILES,
        "(last - start).min(BLOCKS - 1)", "(last - start).min(BLOCKS - 2)", LOOKED_AT,
    ),
    Mutant(
        "tiles that receivers look at", "the last receivers forget those before", RECEIVER_TILES,
        "known.fetch_or(blocks, Ordering::Relaxed);", "known.store(blocks, Ordering::Relaxed);",
        LOOKED_AT,
    ),
    Mutant(
        "tiles that receivers look at", "blocks of another row of curved maps",
        "src/cpu/tile_rays.rs",
        "let (bx, by) = (i % BLOCKS, i / BLOCKS / BLOCK);",
        "let (bx, by) = (i % BLOCKS, i / BLOCKS % BLOCKS);", LOOKED_AT,
    ),
    Mutant(
        "tiles that receivers look at", "a disc goes beyond", "src/cpu/verbs.rs",
        "|| settings.lookup.looks_far()", "|| settings.lookup.reach > 2", LOOKED_AT,
    ),
)  # fmt: skip
