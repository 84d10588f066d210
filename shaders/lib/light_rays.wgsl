// The rays of the receivers towards the light through a hierarchy of boxes: what is the same whoever walks
// it. Boxes are in their own space, relative to the scene's centre and scaled to [-1, 1], so that every
// rounding of a search is one constant.
#import lib/receiver_ray
#import lib/unsure

struct LightRays {
    // The eye relative to the scene's origin, double-single.
    eye_high: vec3<f32>,
    box_scale: f32,             // of the boxes' space per world unit
    eye_low: vec3<f32>,
    box_margin: f32,
    eye_in_boxes: vec3<f32>,
    node_count: u32,            // of the hierarchy, where compute walks one
}

struct RayCounters {
    // Boxes and triangles of one ray, at most.
    longest_walk: atomic<u32>,
    rays: atomic<u32>,
}

@group(0) @binding(0) var<uniform> light_rays_uniform: LightRays;
// (vertex, vertex, vertex, triangle), in the order of the search.
@group(0) @binding(5) var searched_triangles: texture_2d<u32>;
@group(0) @binding(6) var<storage, read_write> visibility: array<u32>;
@group(0) @binding(7) var<storage, read_write> counters: RayCounters;

// Some drivers end a loop in silence after 65,535 iterations.
override most_steps: u32 = 65000u;

// A ray in the boxes' space: where it starts, its direction without zeros, and its length. A light at
// infinity is beyond every box.
struct SearchRay {
    start: vec3<f32>,
    direction: vec3<f32>,
    end: f32,
}

fn search_ray(rays: LightRays, ray: ReceiverRay) -> SearchRay {
    let start = ray.point * rays.box_scale + rays.eye_in_boxes;
    let is_local = ray.light_ray.reach < 3.0e38;
    return SearchRay(
        start,
        // A component that is zero would give 0 * infinity on the side of a box.
        select(ray.z, vec3<f32>(1e-20), abs(ray.z) < vec3<f32>(1e-20)),
        select(8.0 + 4.0 * absolute_sum(start), ray.distance * rays.box_scale + rays.box_margin, is_local),
    );
}

// Whether the ray of a pixel's receiver meets one of `searched_triangles` for sure; what float32 does not know is
// left open.
fn meets_searched(rays: LightRays, ray: ReceiverRay, pixel: u32, index: u32) -> bool {
    let item = textureLoad(searched_triangles, place_from_index(index), 0);
    let met = meets(ray, item.w, item.xyz, rays.eye_high, rays.eye_low);
    leave_open_if(met.is_possible && !met.is_certain, pixel, ray.own_triangle, item.w);
    return met.is_certain;
}

// `is_in_shadow` is the search of the shader that imports this.
@compute @workgroup_size(8, 8)
fn main(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let column = invocation.x;
    let row = invocation.y;
    if column >= receivers.width || row >= receivers.height {
        return;
    }
    let receiver = load_receiver(receivers, column, row);
    var lit = select(NO_SURFACE, IN_SHADOW, receiver.is_seen);
    let pixel = row * receivers.width + column;
    if receiver.faces_light {
        leave_open_if(receiver.is_at_rim, pixel, receiver.triangle, NO_CASTER);
        let ray = ray_of_receiver(receiver, receivers.is_local > 0.0);
        lit = select(LIT, IN_SHADOW, is_in_shadow(light_rays_uniform, ray, pixel));
    }
    visibility[pixel] = lit;
}
