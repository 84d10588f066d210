// The shadow of every pixel by a ray towards the light through a bounding volume hierarchy.
//
// The nodes are in depth-first order and each knows where to go on when its box is missed, so a ray
// needs no stack (Smits, "Efficiency issues for ray tracing", Journal of Graphics Tools 3(2), 1998):
// any hit ends it, and the order of the search plays no part. The boxes are grown by all roundings of
// the walk, as in src/bvh.rs; lib/shadow_ray decides about triangles.
#import lib/receivers
#import lib/triangles
#import lib/shadow_ray

struct ShadowRays {
    // The eye relative to the scene's origin, double-single.
    eye_high: vec3<f32>,
    node_count: u32,
    eye_low: vec3<f32>,
    box_scale: f32,             // of the boxes' space per world unit
    eye_in_boxes: vec3<f32>,
    box_margin: f32,
}

struct Counters {
    // Longest walk: boxes and triangles of one ray.
    longest_walk: atomic<u32>,
    rays: atomic<u32>,
}

@group(0) @binding(0) var<uniform> shadow_rays_uniform: ShadowRays;
// Two elements a node, corners as the bits of floats: (least corner, node to go on with), (greatest
// corner, leaf). A leaf is the index of its first triangle times 16 plus their number; 0 is no leaf.
@group(0) @binding(4) var nodes: texture_2d<u32>;
// (vertex, vertex, vertex, triangle), in the order of the leaves.
@group(0) @binding(5) var leaf_triangles: texture_2d<u32>;
@group(0) @binding(6) var<storage, read_write> visibility: array<f32>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;

// Some drivers end a loop in silence after 65,535 iterations.
override most_steps: u32 = 65000u;

const NO_SURFACE: u32 = 0x7fc00000u;   // a quiet NaN

@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let column = invocation.x;
    let row = invocation.y;
    if column >= receivers.width || row >= receivers.height {
        return;
    }
    let receiver = load_receiver(receivers, column, row);
    var lit = select(bitcast<f32>(NO_SURFACE), 0.0, receiver.is_seen);
    if receiver.faces_light {
        lit = select(1.0, 0.0, is_in_shadow(shadow_rays_uniform, receiver, receivers.is_local > 0.0));
    }
    visibility[row * receivers.width + column] = lit;
}

fn is_in_shadow(rays: ShadowRays, receiver: Receiver, is_local: bool) -> bool {
    let point = receiver.ray * receiver.depth;
    let to_light = -receiver.from_light;
    let distance = length(to_light);
    let z = to_light / distance;
    // Duff et al., "Building an orthonormal basis, revisited", JCGT 2017.
    let side = select(-1.0, 1.0, z.z >= 0.0);
    let k = -1.0 / (side + z.z);
    let m = z.x * z.y * k;
    let x = vec3<f32>(1.0 + side * z.x * z.x * k, side * m, -side * z.x);
    let y = vec3<f32>(m, side + z.y * z.y * k, -z.y);
    let cosine = abs(dot(receiver.normal, receiver.ray)) / length(receiver.ray);
    let margin = receiver_margin(length(point), cosine, extent_of_triangle(receiver.triangle));
    let reach = select(3.0e38, distance, is_local);
    let light_ray = LightRay(vec2<f32>(0.0), reach, margin);

    // A component that is zero would give 0 * infinity on the side of a box.
    let inverse = 1.0 / select(z, vec3<f32>(1e-20), abs(z) < vec3<f32>(1e-20));
    let start = point * rays.box_scale + rays.eye_in_boxes;
    let from_least = start + rays.box_margin;
    let from_greatest = start - rays.box_margin;
    let end = select(8.0 + 4.0 * absolute_sum(start), distance * rays.box_scale + rays.box_margin, is_local);

    var node = 0u;
    var steps = 0u;
    var is_hit = false;
    while node < rays.node_count && !is_hit && steps < most_steps {
        // To the next leaf that is met.
        var leaf = 0u;
        while leaf == 0u && node < rays.node_count && steps < most_steps {
            let least = textureLoad(nodes, place_from_index(2u * node), 0);
            let greatest = textureLoad(nodes, place_from_index(2u * node + 1u), 0);
            let a = (bitcast<vec3<f32>>(least.xyz) - from_least) * inverse;
            let b = (bitcast<vec3<f32>>(greatest.xyz) - from_greatest) * inverse;
            let low = min(a, b);
            let high = max(a, b);
            let enter = max(max(low.x, low.y), max(low.z, 0.0));
            let leave = min(min(high.x, high.y), min(high.z, end));
            let is_entered = enter <= leave;
            node = select(least.w, node + 1u, is_entered);
            leaf = select(0u, greatest.w, is_entered);
            steps += 1u;
        }
        var next = leaf >> 4u;
        let last = next + (leaf & 0xfu);
        while next < last && !is_hit {
            let item = textureLoad(leaf_triangles, place_from_index(next), 0);
            let a = offset_from_vertex(item.x, rays.eye_high, rays.eye_low) - point;
            let b = offset_from_vertex(item.y, rays.eye_high, rays.eye_low) - point;
            let c = offset_from_vertex(item.z, rays.eye_high, rays.eye_low) - point;
            let normal = normal_of_triangle(item.w);
            is_hit = item.w != receiver.triangle && is_met(
                light_ray,
                vec3<f32>(dot(x, a), dot(y, a), dot(z, a)),
                vec3<f32>(dot(x, b), dot(y, b), dot(z, b)),
                vec3<f32>(dot(x, c), dot(y, c), dot(z, c)),
                vec3<f32>(dot(x, normal), dot(y, normal), dot(z, normal)),
            );
            next += 1u;
            steps += 1u;
        }
    }
    atomicMax(&counters.longest_walk, steps);
    atomicAdd(&counters.rays, 1u);
    return is_hit;
}
