"""What a receiver is compared with: depths and their bias, triangles, moments, tears."""

from __future__ import annotations

from .mutant import Mutant

BIAS = (
    "pytest", "tests/test_shadow_maps.py", "-k",
    "(never_shadows or acne or slope or spares or no_gap) and (Uniform or DesiredView)",
)  # fmt: skip
LOOKUPS = (
    "pytest", "tests/test_lookups.py", "tests/test_methods.py", "-k",
    "noon or one_row or (auto_is or misclassified and None) and desired_view",
)  # fmt: skip
LOOKUPS_OF_WARPS = ("pytest", "tests/test_lookups.py", "tests/test_methods.py", "-k", "rtw")
TORN = ("pytest", "tests/test_lookups.py", "tests/test_pcf.py", "-k", "tear or seam")
TORN_PLANE = ("pytest", "tests/test_shadow_maps.py", "-k", "never_shadows and NonOrthogonal")
ACROSS = ("cargo", "--lib", "warp::twins")
SEEN_TILES = ("pytest", "tests/test_receiver_tiles.py", "-k", "torn")
MOMENTS = ("pytest", "tests/test_filtered_maps.py", "-k", "float64 or mips_answer")
MIPS = ("cargo", "--lib", "filtered_texels")
MOMENTS_IN_RUST = ("cargo", "--lib", "moments")
BIASES_IN_RUST = ("cargo", "--lib", "bias")
KNOWN = ("cargo", "--lib", "lookup::depths")
OWN = ("cargo", "--lib", "own_blocks")
STAIRS = ("pytest", "tests/test_revectorized.py", "-k", "middles_of_steps")

LOOKUP = "shaders/lookup.wgsl"
LOOKUP_BIAS = "shaders/lib/bias.wgsl"
SEEN = "shaders/receiver_tiles.wgsl"
GRID = "shaders/warp/grid.wgsl"
BIASES = "src/map_settings.rs"
CPU_BIAS = "src/bias.rs"
CPU_MOMENTS = "src/moments.rs"
CPU_TEXELS = "src/cpu/filtered_texels.rs"
CPU_STAIRS = "src/cpu/lookup/revectorized.rs"
CPU_AROUND = "src/neighbourhood.rs"
CPU_DEPTHS = "src/cpu/lookup/depths.rs"
CPU_OWN = "src/cpu/lookup/own_blocks.rs"

MUTANTS = (
    Mutant(
        "bias on the CPU", "is added to the plane, not taken off", CPU_BIAS,
        "depth - (bias.least", "depth + (bias.least", BIASES_IN_RUST,
    ),
    Mutant(
        "bias on the CPU", "the plane is followed across the map", CPU_BIAS,
        "plane, bias, step, TEXEL_REACH)", "plane, bias, step, DISC_REACH)", BIASES_IN_RUST,
    ),
    Mutant(
        "bias on the CPU", "of a disc does not grow with the step", CPU_BIAS,
        "bias.slope.dot(texels)", "(bias.slope.x + bias.slope.y)", BIASES_IN_RUST,
    ),
    Mutant(
        "filtered maps", "a receiver before the mean is as one behind it", CPU_MOMENTS,
        "L::select(depth.at_most(mean), one, bound)", "bound", MOMENTS_IN_RUST,
    ),
    Mutant(
        "filtered maps", "a Gaussian is as wide as its radius", CPU_MOMENTS,
        "(-2.0 * (offset as f64 / radius).powi(2)).exp()",
        "(-0.5 * (offset as f64 / radius).powi(2)).exp()", MOMENTS,
    ),
    Mutant(
        "filtered maps", "a blur at a map's side is dimmer", CPU_TEXELS,
        "weights[0] + sides.sum::<f32>()", "1.0 + 0.0 * sides.sum::<f32>()", MOMENTS,
    ),
    Mutant(
        "filtered maps", "a coarser map is the first of two texels", CPU_TEXELS,
        "(2 * x + 1).min(self.width - 1),", "(2 * x).min(self.width - 1),", MIPS,
    ),
    Mutant(
        "revectorized edges", "end at the corners of texels, on the CPU", CPU_STAIRS,
        "(goes_on & here & beside).select(half, end.inside)",
        "(goes_on & here & beside).select(half + half, end.inside)", STAIRS,
    ),
    Mutant(
        "revectorized edges", "are followed to one side", CPU_STAIRS,
        "let [before, after] = [-one, one]", "let [before, after] = [one, one]", STAIRS,
    ),
    Mutant(
        "auto lookup", "weighs the texels on the other side, on the CPU", CPU_AROUND,
        "(if aside > 0.0 { 1 } else { -1 })", "(if aside > 0.0 { -1 } else { 1 })", LOOKUPS,
    ),
    Mutant(
        "auto lookup", "takes one texel's word for a thin caster, on the CPU", CPU_AROUND,
        "ninths >= 4", "ninths * 0 == 0", LOOKUPS,
    ),
    Mutant(
        "auto lookup", "asks few texels where triangles are large, on the CPU", CPU_AROUND,
        "false => AGREEING,", "false => AGREEING_OF_SMALL,", LOOKUPS,
    ),
    Mutant(
        "auto lookup", "asks as many texels where triangles are small, on the CPU", CPU_AROUND,
        "true => AGREEING_OF_SMALL,", "true => AGREEING,", LOOKUPS,
    ),
    Mutant(
        "auto lookup", "no triangle is in two texels, on the CPU", CPU_DEPTHS,
        "u32::from(id == previous || id == above)", "u32::from(id == previous && id == NONE)",
        LOOKUPS,
    ),
    Mutant(
        "auto lookup", "no triangle is higher than a texel, on the CPU", CPU_DEPTHS,
        "u32::from(id == previous || id == above)", "u32::from(id == previous)", KNOWN,
    ),
    Mutant(
        "blocks of one triangle", "do not look at the last row", CPU_OWN,
        "(y0..=y1).all(", "(y0..y1).all(", OWN,
    ),
    Mutant(
        "blocks of one triangle", "look at the texels of a corner alone", CPU_OWN,
        "has_only(id, first, last)", "has_only(id, first, first)", LOOKUPS,
    ),
    Mutant(
        "blocks of one triangle", "look where they are before the warp", CPU_OWN,
        "place = warped.zip(size, |warped, size| warped * size);",
        "place = place + warped * splat(simd, 0.0);", LOOKUPS_OF_WARPS,
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
        "step * receivers.receiver_plane, reach", "vec2<f32>(0.0), reach", BIAS,
    ),
    Mutant(
        "bias", "automatic is none", BIASES,
        "Bias::Auto => DepthBias {\n                beam: texel_width,",
        "Bias::Auto => DepthBias {\n                beam: 0.0 * texel_width,", BIAS,
    ),
    Mutant(
        "bias", "a constant one is none by default", BIASES,
        "self.constant.map_or(texel_width, |_| 0.0)",
        "self.constant.map_or(0.0 * texel_width, |_| 0.0)", BIAS,
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
        "tears", "what lies beside a texel is its neighbour", LOOKUP,
        "let is_beside = all(texel >= own_patch.low) && all(texel <= own_patch.high);",
        "let is_beside = all(texel >= vec2<i32>(0)) && all(texel < vec2<i32>(projection.size));",
        TORN_PLANE,
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
        ACROSS,
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
)  # fmt: skip
