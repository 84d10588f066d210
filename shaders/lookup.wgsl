// The shadow test of every pixel: its receiver against the depth in its texel.
//
// A receiver's texel holds the depth of the nearest caster on the ray through the texel's centre.
// With `receiver_plane` the receiver's own plane is evaluated on that ray too, so that a lit plane
// meets itself at any incidence and only rounding is left to a bias.
#import projection
#import lib/receivers

@group(0) @binding(3) var<uniform> projection_uniform: Projection;
// Depths with inverted bits, as the rasterizer stores them.
@group(0) @binding(4) var<storage, read> shadow_map: array<u32>;
@group(0) @binding(5) var<storage, read_write> visibility: array<f32>;

const NO_SURFACE: u32 = 0x7fc00000u;   // a quiet NaN

override rows_per_invocation: u32 = 1u;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let column = invocation.x;
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = invocation.y * rows_per_invocation + i;
        if column < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, column, row);
            var lit = select(bitcast<f32>(NO_SURFACE), 0.0, receiver.is_seen);
            if receiver.is_seen && receiver.faces_light {
                lit = compare_depth(receivers, projection, receiver);
            }
            visibility[row * receivers.width + column] = lit;
        }
    }
}

fn compare_depth(receivers: Receivers, projection: Projection, receiver: Receiver) -> f32 {
    let centred = centred_texel_from_projected(receiver.q);
    let texel = clamp(floor(centred + projection.centre), vec2<f32>(0.0), vec2<f32>(projection.size) - 1.0);
    let index = u32(texel.y) * projection.size.x + u32(texel.x);
    let step = texel + 0.5 - projection.centre - centred;
    let normal = projected_from_normal(projection, receiver.normal);
    let slope = -normal.xy / normal.z;
    let plane = dot(slope, step) * receivers.receiver_plane;
    let steepness = abs(slope.x) + abs(slope.y);
    // Rounding moves a depth, and moves it again by the slope where it moves the texel.
    let world_slope = length(receiver.normal) / abs(dot(receiver.normal, receivers.light_direction));
    let bias = receivers.constant_bias + receivers.slope_bias * steepness + receivers.rounding * world_slope;
    let z = receiver.q.z + plane - bias;
    let key = shadow_map[index];
    let depth = (z - projection.depth_offset) * projection.depth_scale;
    return select(0.0, 1.0, depth <= bitcast<f32>(~key) || key == 0u);
}
