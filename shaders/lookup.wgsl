// The shadow test of every pixel: its receiver against what the texels around it hold.
//
//   depth     The receiver's texel holds the depth of the nearest caster on the ray through the texel's
//             centre. With `receiver_plane` the receiver's own plane is evaluated on that ray too, so
//             that a lit plane meets itself at any incidence and only rounding is left to a bias.
//   triangle  The receiver's own light ray against the triangles that the texels around it hold: no
//             false shadow, and no bias; a caster that no texel there saw is missed. Related: Lecocq
//             et al., "Sub-pixel shadow maps", 2014.
//   auto      In shadow if a triangle of the 3 x 3 texels is hit, or if nearly all depth tests there
//             say so: the second finds casters smaller than a texel, which the first misses.
#import projection
#import warp
#import lib/receivers
#import lib/edges
#import stored

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(6) var<storage, read_write> visibility: array<f32>;

override rows_per_invocation: u32 = 1u;
// Texels on each side of the receiver's own: 0, 1 or 2 for 1, 3 x 3 or 5 x 5.
override reach: i32 = 0;
override uses_triangles: bool = false;
override uses_depths: bool = true;
// Whether this is the first layer, which answers for the pixels that no layer holds.
override is_first: bool = true;

// How many of nine depth tests must agree in `auto`. Measured on six scenes, maps of 1024 and 2048
// texels: seven leave fewer wrong pixels in total than eight, and those fewer than nine.
const AGREEING: i32 = 7;

const NO_SURFACE: u32 = 0x7fc00000u;   // a quiet NaN

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let warp = load_warp();
    let column = invocation.x;
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = invocation.y * rows_per_invocation + i;
        if column < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, column, row);
            var lit = select(bitcast<f32>(NO_SURFACE), 0.0, receiver.is_seen);
            if receiver.faces_light {
                lit = select(1.0, 0.0, is_in_shadow(receivers, projection, warp, receiver));
            }
            if is_first || receiver.faces_light {
                visibility[row * receivers.width + column] = lit;
            }
        }
    }
}

fn is_in_shadow(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    receiver: Receiver,
) -> bool {
    let centred = centred_texel_from_projected(projection, receiver.q);
    let depth = depth_from_projected(receiver.q);
    let size = vec2<f32>(projection.size);
    // Off the map there is no caster. Rounding may move a receiver at the border.
    if any(abs(centred + projection.centre - 0.5 * size) > 0.5 * size + 0.5) {
        return false;
    }
    let warped = warped_from_linear(warp, (centred + projection.centre) / size);
    let middle = vec2<i32>(clamp(floor(warped.uv * size), vec2<f32>(0.0), size - 1.0));
    let normal = projected_from_normal(projection, receiver.normal);
    let slope = depth_slope(projection, normal, receiver.q);
    // Rounding moves a depth, and moves it again by the slope where it moves the texel.
    let world_slope = 1.0 / abs(dot(receiver.normal, normalize(receiver.from_light)));
    let rounding = receivers.rounding * world_slope;
    let bias = receivers.constant_bias + receivers.beam_bias * beam_growth(projection, receiver.q)
        + receivers.slope_bias * (abs(slope.x) + abs(slope.y)) + rounding;

    // Of the texels around: how many there are, how many hold something before the receiver's plane,
    // and, a bit each, which hold another triangle that may be met before it.
    var tests = 0;
    var nearer = 0;
    var candidates = 0u;
    var bit = 1u;
    // A triangle is tested once where it follows itself along the row or begins the row before.
    var previous = NO_TRIANGLE;
    var above = NO_TRIANGLE;
    var first_of_row = NO_TRIANGLE;
    for (var y = -reach; y <= reach; y += 1) {
        above = first_of_row;
        for (var x = -reach; x <= reach; x += 1) {
            let texel = middle + vec2<i32>(x, y);
            if all(texel >= vec2<i32>(0)) && all(texel < vec2<i32>(projection.size)) {
                let linear = linear_from_texel(warp, texel, projection.size);
                let step = linear * size - projection.centre - centred;
                let plane = depth_of_neighbour(projection, normal, receiver.q, step * receivers.receiver_plane);
                let stored = load_stored(u32(texel.y) * projection.size.x + u32(texel.x));
                tests += 1;
                nearer += i32(depth_from_z(projection, plane - bias) > stored.depth);
                let id = stored.triangle;
                if id != NO_TRIANGLE && id != receiver.triangle && id != previous && id != above {
                    candidates |= bit;
                }
                previous = id;
                first_of_row = select(first_of_row, id, x == -reach);
            }
            bit <<= 1u;
        }
    }
    if !uses_triangles {
        return nearer == tests;
    }
    if uses_depths && 9 * nearer >= AGREEING * tests {
        return true;
    }
    var hit = false;
    while candidates != 0u && !hit {
        let place = i32(firstTrailingBit(candidates));
        candidates &= candidates - 1u;
        let side = 2 * reach + 1;
        let texel = middle + vec2<i32>(place % side, place / side) - reach;
        let id = load_stored(u32(texel.y) * projection.size.x + u32(texel.x)).triangle;
        hit = hits(projection, id, ray_from_projected(receiver.q), depth - rounding);
    }
    return hit;
}

fn depth_from_z(projection: Projection, z: f32) -> f32 {
    return (z - projection.depth_offset) * projection.depth_scale;
}

// Whether a ray meets a triangle before a depth.
fn hits(projection: Projection, id: u32, ray: vec3<f32>, before: f32) -> bool {
    let corners = load_projected(projection, id);
    let triangle = triangle_from_projected(projection, id, corners[0], corners[1], corners[2]);
    let e = vec3<f32>(
        evaluate_edge(triangle.edge0, ray),
        evaluate_edge(triangle.edge1, ray),
        evaluate_edge(triangle.edge2, ray),
    );
    let depth = clamp(depth_on_plane(triangle.plane, ray), triangle.depths.x, triangle.depths.y);
    return min(min(e.x, e.y), e.z) >= 0.0 && max(max(e.x, e.y), e.z) > 0.0 && depth < before;
}
