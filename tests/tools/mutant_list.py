"""The mutants: formulas that errors hide in, what each becomes, and the tests that must fail."""

from __future__ import annotations

from dataclasses import dataclass

# Options of `cargo test`, or of pytest.
REFERENCE = ("cargo", "--lib", "reference")
TURNS = ("cargo", "--lib", "rotation")
PARABOLOID = ("cargo", "--lib", "fits::improved_paraboloid")
CASCADES = ("cargo", "--lib", "fits::cascades")
SAMPLES = ("cargo", "--lib", "fits::scene_optimized")
BIAS = (
    "pytest", "tests/test_shadow_maps.py", "-k",
    "(never_shadows or acne or slope or spares or no_gap) and (Uniform or DesiredView)",
)  # fmt: skip
WARPS = (
    "pytest", "tests/test_warps.py", "tests/test_shadow_maps.py", "-k",
    "test_warps or ((texel_holds or cell_with_most or never_shadows_itself) and Warp)",
)  # fmt: skip
TEXELS = ("pytest", "tests/test_shadow_maps.py", "-k", "texel_holds")
PIXELS = ("pytest", "tests/test_visibility_buffer.py")
TRIANGLES = ("pytest", "tests/test_lookups.py")
LOOKUPS = (
    "pytest",
    "tests/test_lookups.py",
    "tests/test_methods.py",
    "-k",
    "auto or misclassified or noon or one_row",
)
HIDDEN = ("pytest", "tests/test_hidden_parts.py")
TORN = ("pytest", "tests/test_lookups.py", "tests/test_pcf.py", "-k", "tear or seam")
SEEN_TILES = ("pytest", "tests/test_receiver_tiles.py", "-k", "torn")
RULES = ("pytest", "tests/test_parameters.py", "-k", "same_words")
SEARCHES = ("pytest", "tests/test_exact.py", "-k", "decide_alike or falls_away")
TWINS = ("cargo", "--lib", "passes::twins")
HOLES = ("pytest", "tests/test_masks.py")
MOMENTS = ("pytest", "tests/test_filtered_maps.py", "-k", "float64 or mips_answer")
STAIRS = ("pytest", "tests/test_revectorized.py", "-k", "middles_of_steps")
GIVEN_LAYERS = ("pytest", "tests/test_given_layers.py")
CPU_ENGINE = ("cargo", "--lib", "cpu::")
CHOICE = (
    "pytest", "tests/test_devices.py", "-k",
    "by_environment or hardware_comes or names_nothing",
)  # fmt: skip
VOLUMES = ("pytest", "tests/test_shadow_volumes.py", "-k", "cpu and not hardly")
STRAIGHT = ("pytest", "tests/test_rasterization.py", "-k", "cpu and stay_lines and cube")


@dataclass(frozen=True)
class Mutant:
    """A text of a file that stands there once, and what it becomes."""

    subject: str
    name: str
    file: str
    old: str
    new: str
    tests: tuple[str, ...]


LOOKUP = "shaders/lookup.wgsl"
LOOKUP_BIAS = "shaders/lib/bias.wgsl"
SEEN = "shaders/receiver_tiles.wgsl"
GRID = "shaders/warp/grid.wgsl"
TABLES = "shaders/warp_map.wgsl"
BANDS = "shaders/rasterize_bands.wgsl"
TILES = "shaders/lib/tiles.wgsl"
PARTS = "shaders/lib/parts.wgsl"
COVERAGE = "shaders/lib/coverage.wgsl"
IMAGE_TILES = "shaders/image_tiles.wgsl"
RAY = "shaders/lib/shadow_ray.wgsl"
CASTERS = "shaders/caster_tests.wgsl"
TRUTH = "src/reference.rs"
BIASES = "src/map_settings.rs"
SCHEMA = "src/methods/schema.rs"
ROTATION = "src/fits/rotation.rs"
ZOOM = "src/fits/improved_paraboloid.rs"
SPLITS = "src/fits/cascades.rs"
CHOSEN = "src/fits/scene_optimized.rs"
GIVEN = "src/fits/given.rs"
ENGINE = "src/engine.rs"
EDGES = "shaders/lib/edges.wgsl"
CPU_VIEW = "src/cpu/view.rs"
CPU_SHAPES = "src/cpu/shapes.rs"
CPU_BINS = "src/cpu/bins.rs"
CPU_RASTER = "src/cpu/rasterize.rs"
CPU_GRID = "src/cpu/light_grid.rs"
CPU_TESTS = "src/cpu/caster_tests.rs"
CPU_RECEIVERS = "src/cpu/receivers.rs"
CPU_VOLUMES = "src/cpu/shadow_volumes.rs"
CPU_FACES = "src/cpu/volume_faces.rs"
CPU_LINEAR = "src/cpu/linear_map.rs"

MUTANTS = (
    Mutant(
        "CPU engine", "corners are where they are, to the bit", CPU_SHAPES,
        "let turned = (longest + lengths[i]) * (2.0 * rounding);",
        "let turned = (longest + lengths[i]) * (0.0 * rounding);", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "rounding turns no plane", CPU_SHAPES,
        "let off = moved + turned + far_off + size",
        "let off = moved + far_off + size", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "a block that a triangle touches aside of its corner is left out", CPU_SHAPES,
        "greatest_of_all.min(e + side * (a.max(0.0) + b.max(0.0)))",
        "greatest_of_all.min(e)", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "a block that a triangle nearly covers is covered", CPU_SHAPES,
        "covered: mask_bits(splat(simd, 1.5)",
        "covered: mask_bits(splat(simd, -1.5)", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "what is before the near plane is seen", CPU_VIEW,
        "is_inside && far < nearness && nearness < near;",
        "is_inside && far < nearness;", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "a corner behind the eye is beyond a side of the view", CPU_VIEW,
        "x > width * w",
        "x > width", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "a tile is touched where its nearest corner is", CPU_VIEW,
        "side * (edge.x.max(0.0) + edge.y.max(0.0))",
        "side * (edge.x.min(0.0) + edge.y.min(0.0))", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "a triangle around the eye is in one tile", CPU_BINS,
        "_ => [0, tiling.columns - 1, 0, tiling.rows - 1],",
        "_ => [0, 0, 0, 0],", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "the nearest pixel of a block hides all of it", CPU_RASTER,
        "least.reduce_min()",
        "least.reduce_max()", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "the last of triangles in one place is seen", CPU_RASTER,
        "new == old && id < known",
        "new == old && id > known", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "a box ends before its triangle does", CPU_GRID,
        "(least(x) - rounding, greatest(x) + rounding)",
        "(least(x) + rounding, greatest(x) - rounding)", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "a group is as near as its farthest triangle", CPU_GRID,
        "nearest: greatest_of(&self.nearest),",
        "nearest: least_of(&self.nearest),", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "what may be hit is missed", CPU_TESTS,
        "(-rounding).simd_le(before)",
        "rounding.simd_le(before)", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "what is about inside of an edge is hit for sure", CPU_TESTS,
        "let hit = f32x16::splat(simd, 1.0).simd_lt(e)",
        "let hit = f32x16::splat(simd, -0.5).simd_lt(e)", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "receivers beside the first grid are dark", CPU_TESTS,
        "left[i] &= !within[i];",
        "left[i] = 0;", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "rounding decides the side of a light in a plane", CPU_RECEIVERS,
        "const SURE_OF_SIDE: f64 = 1e-10;",
        "const SURE_OF_SIDE: f64 = 0.0;", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "the side that the camera does not see is lit", CPU_RECEIVERS,
        "let mut faces_light = is_above ^ is_behind;",
        "let mut faces_light = is_above;", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "a cone lights what is outside of it", CPU_RECEIVERS,
        "outside.simd_le(within)",
        "within.simd_le(outside)", CPU_ENGINE,
    ),
    Mutant(
        "CPU engine", "two faces of the cube are exchanged", CPU_RECEIVERS,
        "let is_y = !is_x & z.simd_le(y);",
        "let is_y = !is_x & y.simd_le(z);", CPU_ENGINE,
    ),
    Mutant(
        "choice of engine", "the environment counts for more than the caller", ENGINE,
        "if let Some(name) = device.or(named_by_environment().as_deref()) {",
        "if let Some(name) = named_by_environment().as_deref().or(device) {",
        CHOICE,
    ),
    Mutant(
        "choice of engine", "an empty word in the environment names a device", ENGINE,
        ".filter(|name| !name.is_empty())",
        "", CHOICE,
    ),
    Mutant(
        "choice of engine", "a software driver comes before the CPU engine", ENGINE,
        "Ok(false) | Err(_) => Ok(Self::Cpu),",
        'Ok(false) | Err(_) => Ok(Self::Gpu(gpu::gpu("")?)),', CHOICE,
    ),
    Mutant(
        "CPU engine", "an eye is in no shadow volume", CPU_VOLUMES,
        "count: at_eye,",
        "count: 0 * at_eye,", VOLUMES,
    ),
    Mutant(
        "CPU engine", "lines of sight enter sides that they leave", CPU_FACES,
        "entered: volumes * eye_side,",
        "entered: volumes,", VOLUMES,
    ),
    Mutant(
        "CPU engine", "depths between straight edges are those of no perspective", CPU_LINEAR,
        "weighted(|corner| 1.0 / corner.w),",
        "weighted(|_| 1.0),", STRAIGHT,
    ),
    Mutant(
        "twins", "an edge is computed from the triangle's own end", EDGES,
        "let swap = is_before(b, a);",
        "let swap = false;", TWINS,
    ),
    Mutant(
        "twins", "weights of the texels above are those of the texels beside", LOOKUP,
        "weights.x), weights.y);",
        "weights.x), weights.x);", TWINS,
    ),
    Mutant(
        "twins", "a carry is lost", "shaders/lib/pairs.wgsl",
        "select(0u, 1u, low < a.x)",
        "0u", TWINS,
    ),
    Mutant(
        "two walks", "the second one takes any triangle", "shaders/target/depth_then_triangle.wgsl",
        "index + 1u]) == key {",
        "index + 1u]) != 0u {", ("pytest", "tests/test_without.py"),
    ),
    Mutant(
        "twins", "an inverse ends in the next cell", TABLES,
        "warp_table[forward + middle + 1u] < centre;",
        "warp_table[forward + middle + 1u] <= centre;", TWINS,
    ),
    Mutant(
        "exact", "grid space decides what it does not know", CASTERS,
        "if met.is_certain && !is_own &&",
        "if met.is_possible && !is_own &&", SEARCHES,
    ),
    Mutant(
        "exact", "grid space has no room for its rounding", CASTERS,
        "let room = ROUNDING * (caster.farthest + absolute_sum(q)) + margin;",
        "let room = 0.0;", SEARCHES,
    ),
    Mutant(
        "exact", "what may be is never tested again", CASTERS,
        "unsure |= 1u << i;",
        "unsure |= 0u;", SEARCHES,
    ),
    Mutant(
        "exact", "what may be inside of a triangle's edges is inside", RAY,
        "edges.is_inside && is_between,",
        "edges.may_be_inside && is_between,", SEARCHES,
    ),
    Mutant(
        "tears", "what lies beside a texel is its neighbour", LOOKUP,
        "let is_beside = all(texel >= own_patch.low) && all(texel <= own_patch.high);",
        "let is_beside = all(texel >= vec2<i32>(0)) && all(texel < vec2<i32>(projection.size));",
        TORN,
    ),
    Mutant(
        "tears", "end the lookup", LOOKUP,
        "while !is_rectilinear && reach > 0 && torn != 0u {",
        "while !is_rectilinear && reach > 2 && torn != 0u {", TORN,
    ),
    Mutant(
        "tears", "a receiver's own texel may be of another patch", LOOKUP,
        "clamp(vec2<i32>(floor(start.place)), own_patch.low, own_patch.high);",
        "vec2<i32>(floor(start.place));", TORN,
    ),
    Mutant(
        "tears", "the nearest texel across is not found along the rows", GRID,
        "select(edge.x, value_of_function(warp, 0u, beside.x, linear.x), is_along_y)",
        "select(edge.x, value_of_function(warp, 0u, warped.functions.x, linear.x), is_along_y)",
        TORN,
    ),
    Mutant(
        "tears", "a disc goes on beyond them", LOOKUP,
        "whole = select(clamp(whole, own_patch.low, own_patch.high), whole, is_unwarped);", "",
        TORN,
    ),
    Mutant(
        "tears", "tiles across are not drawn", SEEN,
        "mark(tiles, tiles_around(tiles, vec2<f32>(across) + 0.5, reach, size));", "", SEEN_TILES,
    ),
    Mutant(
        "bias", "is added to the plane, not taken off", LOOKUP_BIAS,
        "return depth - (bias.least",
        "return depth + (bias.least", BIAS,
    ),
    Mutant(
        "bias", "knows the slope along one axis", LOOKUP_BIAS,
        "receivers.slope_bias * (slope.x + slope.y)",
        "receivers.slope_bias * slope.x", BIAS,
    ),
    Mutant(
        "bias", "of rounding is left out", LOOKUP_BIAS,
        "let rounding = receivers.rounding * world_slope;", "let rounding = 0.0;", BIAS,
    ),
    Mutant(
        "bias", "does not grow with the texel's beam", LOOKUP_BIAS,
        "receivers.beam_bias * beam_growth(projection, receiver.q)", "receivers.beam_bias * 0.0",
        BIAS,
    ),
    Mutant(
        "bias", "does not grow with the way to the texel", LOOKUP_BIAS,
        "bias.beam * max(1.0, length(step))", "bias.beam", LOOKUPS,
    ),
    Mutant(
        "bias", "the receiver's plane is flat", LOOKUP_BIAS,
        "step * receivers.receiver_plane, TEXEL_REACH", "vec2<f32>(0.0), TEXEL_REACH", BIAS,
    ),
    Mutant(
        "bias", "automatic is none", BIASES,
        "Bias::Auto => DepthBias {\n                beam: texel_width,",
        "Bias::Auto => DepthBias {\n                beam: 0.0 * texel_width,", BIAS,
    ),
    Mutant(
        "rules", "a count may be zero", SCHEMA,
        "(1..=i64::from(max)).contains(&count)",
        "(0..=i64::from(max)).contains(&count)", RULES,
    ),
    Mutant(
        "rules", "what is above zero may be zero", SCHEMA,
        "Least::AboveZero => number > 0.0,",
        "Least::AboveZero => number >= 0.0,", RULES,
    ),
    Mutant(
        "bias", "a constant one is none by default", BIASES,
        "self.constant.map_or(texel_width, |_| 0.0)",
        "self.constant.map_or(0.0 * texel_width, |_| 0.0)", BIAS,
    ),
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
        TRIANGLES,
    ),
    Mutant(
        "filtered maps", "the third moment is not around the mean", "shaders/lib/moments.wgsl",
        "(m.y * 3.0 - square * 2.0)", "(m.y * 3.0)", MOMENTS,
    ),
    Mutant(
        "filtered maps", "a blur weighs all texels alike", "shaders/moments.wgsl",
        "weights[abs(i - place)]", "weights[0]", MOMENTS,
    ),
    Mutant(
        "filtered maps", "the finest level answers for every pixel",
        "shaders/lookup_moments.wgsl",
        "max(log2(max(widest, 1.0)), 0.0)", "0.0", MOMENTS,
    ),
    Mutant(
        "revectorized edges", "end at the corners of texels", LOOKUP,
        "select(-0.5, 0.5, is_other_here)", "select(-1.0, 1.0, is_other_here)", STAIRS,
    ),
    Mutant(
        "auto lookup", "weighs the texels on the other side", LOOKUP,
        "let beside = select(-1, 1, aside.x > 0.0)", "let beside = select(1, -1, aside.x > 0.0)",
        LOOKUPS,
    ),
    Mutant(
        "auto lookup", "takes the receiver's own texel for four", LOOKUP,
        "let weights = min(abs(aside), vec2<f32>(0.5));", "let weights = vec2<f32>(0.0);", LOOKUPS,
    ),
    Mutant(
        "auto lookup", "asks as many texels where triangles are small", LOOKUP,
        "select(AGREEING, AGREEING_OF_SMALL, are_small)", "AGREEING", LOOKUPS,
    ),
    Mutant(
        "auto lookup", "takes one texel's word for a thin caster", LOOKUP,
        "ninths >= 4u", "ninths >= 0u", LOOKUPS,
    ),
    Mutant(
        "auto lookup", "asks few texels where triangles are large", LOOKUP,
        "select(AGREEING, AGREEING_OF_SMALL, are_small)", "AGREEING_OF_SMALL", LOOKUPS,
    ),
    Mutant(
        "image tiles", "end at their nearest receiver", IMAGE_TILES,
        "max(rates * depths.x, rates * depths.y)", "rates * depths.x",
        ("pytest", "tests/test_image_tiles.py"),
    ),
    Mutant(
        "image tiles", "are narrower than they are", IMAGE_TILES,
        "min(first + IMAGE_TILE, vec2<u32>(receivers.width, receivers.height))",
        "first + vec2<u32>(1u)", ("pytest", "tests/test_image_tiles.py"),
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
        "turns", "the scene's edges have no say", ROTATION,
        "0.5 * area.ln() + EDGES_WORTH * alignment", "0.5 * area.ln()",
        ("pytest", "tests/test_fits.py"),
    ),
    Mutant(
        "turns", "a cube lies along the edges", ROTATION,
        "edges.alignment(x, y) + edges.alignment(y, z) + edges.alignment(z, x)",
        "-edges.alignment(x, y) - edges.alignment(y, z) - edges.alignment(z, x)",
        ("pytest", "tests/test_fits.py", "-k", "turned_cube"),
    ),
    Mutant(
        "turns", "maps lie along the edges", ROTATION,
        "0.5 * area.ln() + EDGES_WORTH * alignment", "0.5 * area.ln() - EDGES_WORTH * alignment",
        TURNS,
    ),
    Mutant(
        "turns", "a paraboloid's axes are the same everywhere", ROTATION,
        "axis - 2.0 * axis.dot(normal) * normal", "axis - 0.0 * axis.dot(normal) * normal", TURNS,
    ),
    Mutant(
        "improved paraboloid", "the zoom factor is the sine of the field of view", ZOOM,
        "(0.5 * self.field_of_view).tan()", "self.field_of_view.sin()", PARABOLOID,
    ),
    Mutant(
        "improved paraboloid", "the axis is pulled to a corner", ZOOM,
        "let sum: DVec3 = border_points.into_iter().sum();",
        "let sum = border_points.into_iter().sum::<DVec3>() + border_points[7];", PARABOLOID,
    ),
    Mutant(
        "cascades", "uniform splits are logarithmic", SPLITS,
        "Splits::Uniform => 0.0,", "Splits::Uniform => 1.0,", CASCADES,
    ),
    Mutant(
        "cascades", "logarithmic splits are uniform", SPLITS,
        "Splits::Logarithmic | Splits::Receivers | Splits::Quantiles => 1.0,",
        "Splits::Logarithmic | Splits::Receivers | Splits::Quantiles => 0.0,", CASCADES,
    ),
    Mutant(
        "cascades", "quantiles are those of cubes", SPLITS,
        "(share * depths.len() as f64) as usize",
        "(share.powi(3) * depths.len() as f64) as usize", CASCADES,
    ),
    Mutant(
        "cascades", "practical splits have no weight", SPLITS,
        "Splits::Practical => weight,", "Splits::Practical => 0.5,", CASCADES,
    ),
    Mutant(
        "scene optimized", "samples at a boundary are all that face the light", CHOSEN,
        "SampleChoice::Boundary => at_boundary(),", "SampleChoice::Boundary => true,", SAMPLES,
    ),
    Mutant(
        "scene optimized", "samples at a boundary are all in shadow", CHOSEN,
        "SampleChoice::Boundary => at_boundary(),",
        "SampleChoice::Boundary => visibility[i] == 0.0 || at_boundary(),", SAMPLES,
    ),
    Mutant(
        "given layers", "any light will do", GIVEN,
        "<= BESIDE_LIGHT,", "<= 2.0,", GIVEN_LAYERS,
    ),
    Mutant(
        "given layers", "a layer is for half of its map", GIVEN,
        "vec![x, w - x, y, w - y]", "vec![x, w - x * 2.0, y, w - y]", GIVEN_LAYERS,
    ),
    Mutant(
        "given layers", "depths may fall", GIVEN,
        "is_seen && last < first", "is_seen && last > first", GIVEN_LAYERS,
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
        "ties", "points are known exactly", TRUTH,
        "self.granted * length + self.margin", "self.margin", REFERENCE,
    ),
    Mutant(
        "ties", "the receiver is known exactly", TRUTH,
        "margin: corner_margin + (corner_margin / cosine.abs()).min(extent),", "margin: 0.0,",
        REFERENCE,
    ),
    Mutant(
        "ties", "a surface edge-on to the eye may not turn", TRUTH,
        "let is_edge_on = to_light_side != 0 && to_eye_side == 0;",
        "let is_edge_on = false;", REFERENCE,
    ),
    Mutant(
        "ties", "a surface edge-on to the light may shadow", TRUTH,
        "if side == 0.0 || side * height > margin {", "if side * height > margin {", REFERENCE,
    ),
    Mutant(
        "ties", "the side of the light says nothing", TRUTH,
        "self.parts_ends = side * height < -margin;", "self.parts_ends = false;", REFERENCE,
    ),
    Mutant(
        "ties", "neighbours do not keep apart", TRUTH,
        ".all(|&c| normal.dot(c - self.point) <= self.margin)",
        ".all(|&c| normal.dot(c - self.point) <= -1.0)", REFERENCE,
    ),
    Mutant(
        "ties", "an edge inside a mesh hides nothing", TRUTH,
        "end = end.min(covered_until(&candidates, ray.range));", "", REFERENCE,
    ),
    Mutant(
        "holes", "a texel is taken for its neighbour", "src/masks.rs",
        "let columns = [x, x + 1].map", "let columns = [x + 1, x].map", HOLES,
    ),
    Mutant(
        "holes", "what the light grid knows of holes is sure", "src/cpu/holes.rs",
        "Solidity::Open(_) => hit &= !(1 << i),", "Solidity::Open(_) => {}", HOLES,
    ),
    Mutant(
        "holes", "shaders mirror where they should repeat", "shaders/mask/alpha.wgsl",
        "const WRAP_MIRROR: u32 = 1u;", "const WRAP_MIRROR: u32 = 0u;", HOLES,
    ),
    Mutant(
        "holes", "float32 is sure of every alpha", "shaders/mask/alpha.wgsl",
        "let slack = FULL_ALPHA * (reach.x + reach.y) + ALPHA_ROUNDING;", "let slack = 0.0;", HOLES,
    ),
    Mutant(
        "ties", "equal distances go to the higher index", TRUTH,
        "a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))", "a.0.total_cmp(&b.0).then(b.1.cmp(&a.1))",
        REFERENCE,
    ),
)  # fmt: skip
