// Blends an importance map with that of the frame before (Rosen, "Rectilinear texture warping", 5.5), so
// that a warp follows the view slowly:
//
//   maximum   the mean of both, the new one's cell taking what was at its place
//   count     the same for counts along x, which the change of a cell's area spreads or gathers
//   fade      counts along y: what is left of the new ones
//   splat     and the old ones, added where the functions along x put them
//
// What was not on the old map had no importance.
#import warp

struct Blend {
    // Rows of the matrix from a place in the new map to one in the old, in cells, homogeneous.
    old_from_new: array<vec4<f32>, 3>,
    determinant: f32,
    share: f32,                         // of the old map
    unit: f32,                          // what a weight of one counts
    cells: u32,                         // of the new map along each side
    old_columns: u32,
    old_rows: u32,
}

@group(0) @binding(0) var<uniform> blend_uniform: Blend;
@group(0) @binding(1) var<storage, read> old_importance: array<f32>;
@group(0) @binding(2) var<storage, read_write> importance_map: array<u32>;
@group(0) @binding(3) var<storage, read_write> counts: array<atomic<u32>>;

fn old_cell(blend: Blend, column: i32, row: i32) -> f32 {
    let size = vec2<i32>(i32(blend.old_columns), i32(blend.old_rows));
    let inside = clamp(vec2<i32>(column, row), vec2<i32>(0), size - 1);
    return old_importance[u32(inside.y * size.x + inside.x)];
}

// The old map's value at the middle of a cell of the new one, and how many old cells a new one covers.
fn old_value_and_area(blend: Blend, cell: vec2<u32>) -> vec2<f32> {
    let place = vec3<f32>(vec2<f32>(cell) + 0.5, 1.0);
    let w = dot(blend.old_from_new[2].xyz, place);
    let there = vec2<f32>(dot(blend.old_from_new[0].xyz, place), dot(blend.old_from_new[1].xyz, place)) / w;
    let size = vec2<f32>(f32(blend.old_columns), f32(blend.old_rows));
    if !(w > 0.0 && all(there >= vec2<f32>(0.0)) && all(there < size)) {
        return vec2<f32>(0.0);
    }
    // Linear between the middles of cells.
    let corner = floor(there - 0.5);
    let t = there - 0.5 - corner;
    let column = i32(corner.x);
    let row = i32(corner.y);
    let above = mix(old_cell(blend, column, row), old_cell(blend, column + 1, row), t.x);
    let below = mix(old_cell(blend, column, row + 1), old_cell(blend, column + 1, row + 1), t.x);
    return vec2<f32>(mix(above, below, t.y), abs(blend.determinant / (w * w * w)));
}

@compute @workgroup_size(64)
fn maximum(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let blend = blend_uniform;
    if invocation.x >= blend.cells {
        return;
    }
    let i = invocation.y * blend.cells + invocation.x;
    let old = old_value_and_area(blend, invocation.xy).x;
    importance_map[i] = bitcast<u32>(mix(bitcast<f32>(importance_map[i]), old, blend.share));
}

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let blend = blend_uniform;
    if invocation.x >= blend.cells {
        return;
    }
    let i = invocation.y * blend.cells + invocation.x;
    let old = old_value_and_area(blend, invocation.xy);
    let counted = mix(f32(importance_map[i]), old.x * old.y * blend.unit, blend.share);
    importance_map[i] = u32(round(counted));
}

@compute @workgroup_size(64)
fn fade(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let blend = blend_uniform;
    if invocation.x >= blend.cells {
        return;
    }
    let i = invocation.y * blend.cells + invocation.x;
    importance_map[i] = u32(round((1.0 - blend.share) * f32(importance_map[i])));
}

@compute @workgroup_size(64)
fn splat(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let blend = blend_uniform;
    if invocation.x >= blend.cells {
        return;
    }
    let old = old_value_and_area(blend, invocation.xy);
    let counted = u32(round(blend.share * old.x * old.y * blend.unit));
    let uv = (vec2<f32>(invocation.xy) + 0.5) / f32(blend.cells);
    let x = warped_from_linear(load_warp(), uv).uv.x;
    let column = min(u32(clamp(x, 0.0, 1.0) * f32(blend.cells)), blend.cells - 1u);
    atomicAdd(&counts[column * blend.cells + invocation.y], counted);
}
