// Importance of the cells of a grid over the light's map, from the receivers that face the light.
//
//   count     how much the receivers in each cell weigh, one each without factors (Milet et al.,
//             "Non-orthogonal texture warping", section 3): in rows of cells along x or, after the warp
//             along x, in columns of cells along y
//   maximum   the greatest importance of a receiver in each cell (Rosen, "Rectilinear texture
//             warping", sections 5 and 6.3)
//
// The importance of a receiver is a product of factors. Integer atomics: the same bytes at every run.
#import projection
#import lib/importance
#import lib/receivers
#import lib/image_tiles
#import warp

struct Importance {
    cells: u32,                         // along each side
    along_y: u32,                       // counts in columns
    map_weights: vec2<u32>,             // columns, rows
    normal_bonus: f32,                  // Rosen's beta
    shadow_edges: u32,                  // columns and rows
    blocks: u32,                        // columns of boundary weights
    unit: f32,                          // what a weight of one counts
}

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(1) var<uniform> importance_uniform: Importance;
@group(0) @binding(2) var<storage, read_write> importance_map: array<atomic<u32>>;
@group(0) @binding(3) var<storage, read> pixel_weights: array<f32>;
@group(0) @binding(7) var<storage, read> boundary_weights: array<f32>;

// Whether it is a count, or else a maximum.
override counts: bool = false;
override uses_boundary: bool = false;
override uses_pixel_weights: bool = false;

const BOUNDARY_BLOCK: u32 = 4u;         // as in boundary.wgsl

// A light matrix may leave receivers off the map, which need no texels; rounding leaves none.
const OFF_THE_MAP: f32 = 0.501;

// Desired view (5.1): every receiver has a part. The others are factors.
fn importance_of(
    projection: Projection,
    importance: Importance,
    receiver: Receiver,
    pixel: vec2<u32>,
    width: u32,
    uv: vec2<f32>,
) -> f32 {
    let texel = texel_width(projection, receiver.q);
    let cosine = abs(dot(receiver.normal, normalize(receiver.ray)));
    var value = importance_of_surface(image_width_at(receiver.depth), texel, cosine, importance.normal_bonus);
    if uses_shadow_edge {
        let size = importance.shadow_edges;
        value *= shadow_edges[cell_at(uv.y, size) * size + cell_at(uv.x, size)];
    }
    if uses_boundary {
        value *= boundary_weights[(pixel.y / BOUNDARY_BLOCK) * importance.blocks + pixel.x / BOUNDARY_BLOCK];
    }
    if uses_pixel_weights {
        value *= pixel_weights[pixel.y * width + pixel.x];
    }
    return value * weight_of_place(uv, importance.map_weights);
}

@compute @workgroup_size(IMAGE_TILE.x)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let importance = importance_uniform;
    let warp = load_warp();
    let first = first_pixel(group, local);
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = first.y + i;
        if first.x < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, first.x, row);
            if receiver.faces_light {
                let texel = centred_texel_from_projected(projection, receiver.q) + projection.centre;
                let uv = texel / vec2<f32>(projection.size);
                if any(abs(uv - 0.5) > vec2<f32>(OFF_THE_MAP)) {
                    continue;
                }
                var place = uv.yx;
                if importance.along_y != 0u {
                    place = vec2<f32>(warped_from_linear(warp, uv).uv.x, uv.y);
                }
                let line = cell_at(place.x, importance.cells);
                let cell = line * importance.cells + cell_at(place.y, importance.cells);
                let pixel = vec2<u32>(first.x, row);
                let weight = importance_of(projection, importance, receiver, pixel, receivers.width, uv);
                if counts {
                    atomicAdd(&importance_map[cell], u32(round(weight * importance.unit)));
                } else {
                    // Positive floats are ordered as their bits are.
                    atomicMax(&importance_map[cell], bitcast<u32>(weight));
                }
            }
        }
    }
}
