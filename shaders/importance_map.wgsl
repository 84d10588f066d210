// Importance of the cells of a grid over the light's map, from the receivers that face the light.
//
//   count     how many receivers fall in each cell (Milet et al., "Non-orthogonal texture warping",
//             section 3): layout [function][cell], along x or, after the warp along x, along y
//   maximum   the greatest importance of a receiver in each cell (Rosen, "Rectilinear texture
//             warping", sections 5 and 6.3), a product of functions
//
// Integer atomics: the same bytes at every run.
#import projection
#import lib/receivers
#import warp

struct Importance {
    functions: u32,                     // of `count`: rows, or columns along y
    cells: u32,
    along_y: u32,
    uses_distance: u32,
    uses_normal: u32,
    normal_bonus: f32,                  // Rosen's beta
}

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(1) var<uniform> importance_uniform: Importance;
@group(0) @binding(2) var<storage, read_write> importance_map: array<atomic<u32>>;

override rows_per_invocation: u32 = 1u;

fn cell_at(place: f32, cells: u32) -> u32 {
    return min(u32(clamp(place, 0.0, 1.0) * f32(cells)), cells - 1u);
}

@compute @workgroup_size(64)
fn count(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let importance = importance_uniform;
    let warp = load_warp();
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = invocation.y * rows_per_invocation + i;
        if invocation.x < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, invocation.x, row);
            if receiver.faces_light {
                let texel = centred_texel_from_projected(projection, receiver.q) + projection.centre;
                let uv = texel / vec2<f32>(projection.size);
                var place = uv.yx;
                if importance.along_y != 0u {
                    place = vec2<f32>(warped_from_linear(warp, uv).uv.x, uv.y);
                }
                let function_index = cell_at(place.x, importance.functions);
                let cell = cell_at(place.y, importance.cells);
                atomicAdd(&importance_map[function_index * importance.cells + cell], 1u);
            }
        }
    }
}

@compute @workgroup_size(64)
fn maximum(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let importance = importance_uniform;
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = invocation.y * rows_per_invocation + i;
        if invocation.x < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, invocation.x, row);
            if receiver.faces_light {
                let texel = centred_texel_from_projected(projection, receiver.q) + projection.centre;
                let uv = texel / vec2<f32>(projection.size);
                // Desired view (5.1): every receiver has a part. The others are factors.
                var value = 1.0;
                if importance.uses_distance != 0u {
                    // Distance to eye (5.2): a sphere's image is proportional to 1 / depth.
                    value /= receiver.depth;
                }
                if importance.uses_normal != 0u {
                    // Surface normal (5.4), turned towards the camera.
                    let cosine = abs(dot(receiver.normal, normalize(receiver.ray)));
                    value *= 1.0 + importance.normal_bonus * cosine;
                }
                let cell = cell_at(uv.y, importance.cells) * importance.cells
                    + cell_at(uv.x, importance.cells);
                // Positive floats are ordered as their bits are.
                atomicMax(&importance_map[cell], bitcast<u32>(value));
            }
        }
    }
}
