// Shadow edges seen from the light (Rosen, "Rectilinear texture warping", 5.3): 1 in a texel whose depth
// differs from that of one of its eight neighbours by more than a bias, little elsewhere.
#import projection
#import stored

struct ShadowEdge {
    constant_bias: f32,                 // depth
    beam_bias: f32,                     // depth per growth of a texel's beam
    floor: f32,                         // Rosen's alpha
}

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(1) var<uniform> shadow_edge_uniform: ShadowEdge;
@group(0) @binding(2) var<storage, read_write> shadow_edges: array<f32>;

fn depth_at(projection: Projection, x: i32, y: i32) -> f32 {
    let inside = clamp(vec2<i32>(x, y), vec2<i32>(0), vec2<i32>(projection.size) - 1);
    let stored = load_stored(u32(inside.y) * projection.size.x + u32(inside.x)).depth;
    return select(z_from_stored(projection, stored), stored, stored > 1e38);
}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let projection = projection_uniform;
    let place = vec2<i32>(invocation.xy);
    if invocation.x >= projection.size.x {
        return;
    }
    let middle = depth_at(projection, place.x, place.y);
    var jump = 0.0;
    for (var y = -1; y <= 1; y += 1) {
        for (var x = -1; x <= 1; x += 1) {
            jump = max(jump, abs(depth_at(projection, place.x + x, place.y + y) - middle));
        }
    }
    let centred = vec2<f32>(place) + 0.5 - projection.centre;
    let point = projected_from_ray(projection, ray_from_texel(projection, centred), middle);
    let edge = shadow_edge_uniform;
    let is_edge = jump > edge.constant_bias + edge.beam_bias * beam_growth(projection, point);
    shadow_edges[invocation.y * projection.size.x + invocation.x] = select(edge.floor, 1.0, is_edge);
}
