"""What the CPU engine leaves out: triangles, blocks and cells that rays or points cannot meet."""

from __future__ import annotations

from .mutant import Mutant

WARPED = ("pytest", "tests/test_shadow_maps.py", "-k", "texel_holds and Warp")
TURNED = ("pytest", "tests/test_given_samples.py", "-k", "turned_map or move_nothing")
TABLES = (
    "pytest", "tests/test_given_samples.py", "-k",
    "another_size or not_reach or beyond_a_table or narrowest_step",
)  # fmt: skip
BY_A_HAIR = ("cargo", "--lib", "whose_rays_an_edge_nearly", "edge_ends_a_hair", "a_surface_a_hair")
CELLS_OF_LIGHT = ("cargo", "--lib", "a_cell_lists")
KEPT_PLACES = ("cargo", "--lib", "tests::counts")
CELLS_OF_MAP = ("cargo", "--lib", "cpu::importance_map")
IMPORTANCE = ("cargo", "--lib", "importance_is", "importance_does_not", "maps_and_warps")
POINTS = ("pytest", "tests/test_points.py")
BIAS = ("cargo", "--lib", "bias")
ALPHA = ("cargo", "--lib", "masks")

RAYS = "src/cpu/tile_rays.rs"
RAY_BINS = "src/cpu/ray_bins.rs"
BINS = "src/cpu/bins.rs"
GRID = "src/cpu/light_grid.rs"
IMPORTANCE_MAP = "src/cpu/importance_map.rs"
CELLS = "src/cpu/cells.rs"
AT_POINTS = "src/cpu/points.rs"
SAMPLES = "src/warp/samples.rs"
BIAS_OF = "src/bias.rs"
MASKS = "src/masks.rs"

MUTANTS = (
    Mutant(
        "rays of a tile", "the last row of a block that a box meets is left out", RAYS,
        "first + 1 + met.ilog2() as usize", "first + met.ilog2() as usize", WARPED,
    ),
    Mutant(
        "rays of a tile", "a row of blocks is as wide as its narrowest", RAYS,
        "greatest_of(&self.boxes[k + 1][of_row])", "least_of(&self.boxes[k + 1][of_row])", WARPED,
    ),
    Mutant(
        "rays of a tile", "a block's rays end before the last", RAYS,
        "*high = f32x8::from_slice(simd, rows).reduce_max();",
        "*high = f32x8::from_slice(simd, rows).reduce_min();", WARPED,
    ),
    Mutant(
        "rays of a tile", "a triangle touches what it covers for sure", RAYS,
        "splat(simd, -1.5).simd_le(most)", "splat(simd, 1.5).simd_le(most)", BY_A_HAIR,
    ),
    Mutant(
        "rays of a tile", "what is nearly covered is covered", RAYS,
        "splat(simd, 1.5).simd_lt(fewest)", "splat(simd, -1.5).simd_lt(fewest)", BY_A_HAIR,
    ),
    Mutant(
        "rays of a tile", "a triangle is as far in a block as it goes there", RAYS,
        "let nearest = greatest_in(&boxes, plane).min(splat(simd, shapes.high[lane]));",
        "let nearest = -greatest_in(&boxes, plane.map(|of_axis| -of_axis));", WARPED,
    ),
    Mutant(
        "rays of a tile", "they fall into the tiles of the first of them", RAYS,
        "tile(x1, 0, columns),", "tile(x0, 0, columns),", WARPED,
    ),
    Mutant(
        "rays of a tile", "triangles of several tiles are those of the first", RAY_BINS,
        "near.append(&mut shared);", "shared.clear();", WARPED,
    ),
    Mutant(
        "bins", "only the middles of pixels count", BINS,
        "Cover::Whole => (1.0, 0.0),", "Cover::Whole => (0.5, 0.5),", BY_A_HAIR,
    ),
    Mutant(
        "bins", "float32 knows what leaves the range of depths", BINS,
        "let wide = corners.wide(simd, view) | mask_bits(leaves_range);",
        "let wide = corners.wide(simd, view) | 0 * mask_bits(leaves_range);", BY_A_HAIR,
    ),
    Mutant(
        "bins", "the near plane is known to the bit", BINS,
        "near * (1.0 - 1e-6 * near.signum())", "near * (1.0 + 1e-6 * near.signum())", BY_A_HAIR,
    ),
    Mutant(
        "cells of the light", "a box has no room for rounding", GRID,
        "let rounding = self.view.rounding() * 2.0;", "let rounding = self.view.rounding() * 0.0;",
        CELLS_OF_LIGHT,
    ),
    Mutant(
        "cells of the light", "a triangle is as near as its nearest corner, to the bit", GRID,
        "let nearest = (nearest + nearest.abs() * 1e-6).to_array();",
        "let nearest = (nearest - nearest.abs() * 1e-6).to_array();", CELLS_OF_LIGHT,
    ),
    Mutant(
        "cells of the light", "the last column of a triangle is left out", GRID,
        "let columns = (0xff << u0) & (0xff >> (TILE_CELLS - 1 - u1));",
        "let columns = (0xff << u0) & (0xff >> (TILE_CELLS - u1.max(1)));", CELLS_OF_LIGHT,
    ),
    Mutant(
        "cells of the light", "what float64 sets up is as near as its plane in the middle", GRID,
        "nearest: shapes.high[0] + shapes.rounding[0],",
        "nearest: shapes.first[0],", CELLS_OF_LIGHT,
    ),
    Mutant(
        "cells of the light", "those of a tile that is one cell are lost", GRID,
        "let cell = if tile.is_one { 0 } else { cell };", "",
        ("cargo", "--lib", "large_triangles_over_each_other"),
    ),
    Mutant(
        "importance on the CPU", "counts are rounded down", IMPORTANCE_MAP,
        "Lane::floor(numbers + 0.5f32.next_down())", "Lane::floor(numbers)", CELLS_OF_MAP,
    ),
    Mutant(
        "importance on the CPU", "receivers of another layer are counted", IMPORTANCE_MAP,
        " && placed.layer == *layer)", ")", KEPT_PLACES,
    ),
    Mutant(
        "importance on the CPU", "a cell has the weight of its last neighbour", IMPORTANCE_MAP,
        "zero.slide::<7>(most)", "zero", CELLS_OF_MAP,
    ),
    Mutant(
        "importance on the CPU", "receivers at the map's border have no cell", IMPORTANCE_MAP,
        "splat(simd, ON_THE_MAP)", "splat(simd, ON_THE_MAP - 0.002)", IMPORTANCE,
    ),
    Mutant(
        "importance on the CPU", "the end of the map is in the next row", IMPORTANCE_MAP,
        "(place.clamp(zero, one) * count).floor().min(count - one)",
        "(place.clamp(zero, one) * count).floor()", CELLS_OF_MAP,
    ),
    Mutant(
        "importance on the CPU", "counts along y are of unwarped columns", IMPORTANCE_MAP,
        "Some(warp) => [warp.warped_x(V2::new(u, v)), v],", "Some(_) => [u, v],", IMPORTANCE,
    ),
    Mutant(
        "importance on the CPU", "what other threads filled is lost", CELLS,
        ".filter(|(_, b)| **b != 0)", ".filter(|(_, b)| **b == 0)", IMPORTANCE,
    ),
    Mutant(
        "points", "with a normal stay where rounding put them", AT_POINTS,
        "let moved = (rounding + MOVED) * point.length();",
        "let moved = 0.0 * (rounding + MOVED) * point.length();", POINTS,
    ),
    Mutant(
        "points", "float32 coordinates are those of float64", AT_POINTS,
        "None => self.rounding,", "None => FLOAT64_ROUNDING,", POINTS,
    ),
    Mutant(
        "points", "what stands on their plane is hit for sure", AT_POINTS,
        "trusts_hits: self.points.normals.is_some()", "trusts_hits: true", POINTS,
    ),
    Mutant(
        "points", "are turned to every light", AT_POINTS,
        "normals.is_none_or(|normals| vector_at(normals, place).dot(to_light) > 0.0)",
        "normals.is_none_or(|normals| vector_at(normals, place).dot(to_light) > -1e300)", POINTS,
    ),
    Mutant(
        "points", "beside all grids are dark", AT_POINTS,
        "*lit |= left.iter().fold(0, |all, left| all | left[i]);",
        "*lit |= 0 * left.iter().fold(0, |all, left| all | left[i]);", POINTS,
    ),
    Mutant(
        "points", "beyond the scene are beyond all views", AT_POINTS,
        "bounds: (low.min(of_points.0), high.max(of_points.1)),", "bounds: (low, high),", POINTS,
    ),
    Mutant(
        "points", "grids end where the first job's points do", AT_POINTS,
        "let range = job * JOB_POINTS..points.count().min((job + 1) * JOB_POINTS);",
        "let range = job * JOB_POINTS..points.count().min(JOB_POINTS);", POINTS,
    ),
    Mutant(
        "warps by samples", "what falls off an edge-on surface is not turned", SAMPLES,
        "self.steps_in(cell).transpose() * gradient", "gradient + 0.0 * cell[0] as f64", TURNED,
    ),
    Mutant(
        "warps by samples", "what falls off an edge-on surface turns the other way", SAMPLES,
        "self.steps_in(cell).transpose() * gradient", "self.steps_in(cell) * gradient", TURNED,
    ),
    Mutant(
        "warps by samples", "the far triangle of a cell is the near one", SAMPLES,
        "false => d + (c - d) * (1.0 - part.x) + (b - d) * (1.0 - part.y),",
        "false => a + (b - a) * part.x + (c - a) * part.y,", TABLES,
    ),
    Mutant(
        "warps by samples", "a mirror image has no cells", SAMPLES,
        "match area * self.turn > 0.0 {", "match area > 0.0 {", TURNED,
    ),
    Mutant(
        "warps by samples", "the ring comes before the table", SAMPLES,
        "found.or(in_ring)", "in_ring.or(found)", TABLES,
    ),
    Mutant(
        "warps by samples", "boxes around cells are narrower than they", SAMPLES,
        "let room = DVec2::splat(1e-12);", "let room = DVec2::splat(-1e-3);", TABLES,
    ),
    Mutant(
        "warps by samples", "widen most where they widen least", SAMPLES,
        "lengths.fold(DVec2::INFINITY, DVec2::min)", "lengths.fold(DVec2::ZERO, DVec2::max)",
        TABLES,
    ),
    Mutant(
        "bias on the CPU", "rounding is none where the surface is oblique", BIAS_OF,
        "self.rounding * (one / L::select(is_edge_on, one, cosine))",
        "self.rounding * (one / L::select(is_edge_on, one, one))", BIAS,
    ),
    Mutant(
        "bias on the CPU", "texels before an edge-on surface are those behind it", BIAS_OF,
        "step.x.constant(0.0).at_most(outward.dot(step))",
        "outward.dot(step).at_most(step.x.constant(0.0))", BIAS,
    ),
    Mutant(
        "bias on the CPU", "does not grow with the way to the texel", BIAS_OF,
        "bias.beam * step.length().max(self.rounding.constant(1.0))", "bias.beam", BIAS,
    ),
    Mutant(
        "bias on the CPU", "of edge-on surfaces follows their plane", BIAS_OF,
        "L::select(\n            bias.is_edge_on,\n            kind.depth_from_projected(plane.q),",
        "L::select(\n            bias.is_edge_on,\n            on_plane,", BIAS,
    ),
    Mutant(
        "holes", "rounding moves no point to the next texel", MASKS,
        "[low, high.floor().max(low), high]", "[low, low, high]", ALPHA,
    ),
    Mutant(
        "holes", "float64 is sure of every alpha", MASKS,
        "Sampling::Linear => FULL * ((reach.x + reach.y) * at.z.abs() + reach.z),",
        "Sampling::Linear => 0.0,", ALPHA,
    ),
    Mutant(
        "holes", "a hole at one corner makes none", MASKS,
        ".fold(f64::INFINITY, |least, c| least.min(c.z));",
        ".fold(0.0, |most: f64, c| most.max(c.z));", ALPHA,
    ),
)  # fmt: skip
