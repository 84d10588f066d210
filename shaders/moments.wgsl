// Filtered maps: moments of the depths in texels, row by row, those of a texel one after the other; twin of
// src/cpu/filtered_texels.rs.
//
//   fill      moments of a texel's depth
//   blur      weighted means of the texels along a row or a column, within the texel's patch
//   halve     of each two by two texels the mean, into the next level behind them
#import projection
#import warp
#import stored
#import lib/moments

struct MomentLevel {
    size: vec2<u32>,                    // of the level that is read
    first: u32,                         // its first number
    next: u32,                          // that of the level that is written
}

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(1) var<uniform> moment_level: MomentLevel;
@group(0) @binding(2) var<storage, read> before: array<f32>;
@group(0) @binding(3) var<storage, read_write> after: array<f32>;
// Of texels so many from the middle.
@group(0) @binding(4) var<storage, read> weights: array<f32>;

override is_along_y: bool = false;
override reach: i32 = 0;

@compute @workgroup_size(64)
fn fill(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let projection = projection_uniform;
    if invocation.x >= projection.size.x {
        return;
    }
    let texel = invocation.y * projection.size.x + invocation.x;
    let depth = clamp(2.0 * load_stored(texel).depth - 1.0, -1.0, 1.0);
    let moments = moments_of_depth(depth);
    let count = moments_of_texel();
    for (var i = 0u; i < count; i += 1u) {
        after[texel * count + i] = moments[i];
    }
}

// The texels that lie side by side with one.
fn patch_of_texel(warp: Warp, texel: vec2<i32>, size: vec2<u32>) -> Patch {
    let column = function_of_column(warp, texel.x, size);
    return patch_of_functions(warp, vec2<u32>(band_of_row(warp, column, texel.y, size), column), size);
}

@compute @workgroup_size(64)
fn blur(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let size = projection_uniform.size;
    if invocation.x >= size.x {
        return;
    }
    let texel = vec2<i32>(invocation.xy);
    let own_patch = patch_of_texel(load_warp(), texel, size);
    let axis = select(vec2<i32>(1, 0), vec2<i32>(0, 1), is_along_y);
    let place = dot(texel, axis);
    let low = max(dot(own_patch.low, axis), place - reach);
    let high = min(dot(own_patch.high, axis), place + reach);
    let count = moments_of_texel();
    var sum = vec4<f32>(0.0);
    var sum_of_weights = 0.0;
    for (var i = low; i <= high; i += 1) {
        let weight = weights[abs(i - place)];
        let there = vec2<u32>(texel + axis * (i - place));
        let first = (there.y * size.x + there.x) * count;
        sum_of_weights += weight;
        for (var k = 0u; k < count; k += 1u) {
            sum[k] += weight * before[first + k];
        }
    }
    let first = (invocation.y * size.x + invocation.x) * count;
    for (var k = 0u; k < count; k += 1u) {
        after[first + k] = sum[k] / sum_of_weights;
    }
}

@compute @workgroup_size(64)
fn halve(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let level = moment_level;
    let width = (level.size.x + 1u) / 2u;
    if invocation.x >= width {
        return;
    }
    let count = moments_of_texel();
    // At an odd end a texel stands for two.
    let near = 2u * invocation.xy;
    let far = min(near + 1u, level.size - 1u);
    let rows = level.first + vec2<u32>(near.y, far.y) * level.size.x * count;
    for (var k = 0u; k < count; k += 1u) {
        let above = after[rows.x + near.x * count + k] + after[rows.x + far.x * count + k];
        let below = after[rows.y + near.x * count + k] + after[rows.y + far.x * count + k];
        after[level.next + (invocation.y * width + invocation.x) * count + k] = 0.25 * (above + below);
    }
}
