// The rays of the receivers towards the light, and their tests against triangles: what is the same however
// the triangles are searched for. Boxes are in their own space, relative to the scene's centre and scaled
// to [-1, 1], so that every rounding of a search is one constant.
#import lib/receivers
#import lib/triangles
#import lib/shadow_ray

struct LightRays {
    // The eye relative to the scene's origin, double-single.
    eye_high: vec3<f32>,
    box_scale: f32,             // of the boxes' space per world unit
    eye_low: vec3<f32>,
    box_margin: f32,
    eye_in_boxes: vec3<f32>,
    node_count: u32,            // of the hierarchy, where compute walks one
}

struct Counters {
    // Boxes and triangles of one ray, at most.
    longest_walk: atomic<u32>,
    rays: atomic<u32>,
}

@group(0) @binding(0) var<uniform> light_rays_uniform: LightRays;
// (vertex, vertex, vertex, triangle), in the order of the search.
@group(0) @binding(5) var searched_triangles: texture_2d<u32>;
@group(0) @binding(6) var<storage, read_write> visibility: array<f32>;
@group(0) @binding(7) var<storage, read_write> counters: Counters;

// Some drivers end a loop in silence after 65,535 iterations.
override most_steps: u32 = 65000u;

const NO_SURFACE: u32 = 0x7fc00000u;   // a quiet NaN

struct ReceiverRay {
    own_triangle: u32,
    point: vec3<f32>,           // the receiver, in world axes relative to the eye
    // Axes of the test; the third one is the ray's direction.
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
    light_ray: LightRay,
    // In the boxes' space: where the ray starts, its direction without zeros, and its length. A light at
    // infinity is beyond every box.
    start: vec3<f32>,
    direction: vec3<f32>,
    end: f32,
}

fn ray_of_receiver(rays: LightRays, receiver: Receiver, is_local: bool) -> ReceiverRay {
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
    let start = point * rays.box_scale + rays.eye_in_boxes;
    return ReceiverRay(
        receiver.triangle,
        point,
        x,
        y,
        z,
        LightRay(vec2<f32>(0.0), reach, margin),
        start,
        // A component that is zero would give 0 * infinity on the side of a box.
        select(z, vec3<f32>(1e-20), abs(z) < vec3<f32>(1e-20)),
        select(8.0 + 4.0 * absolute_sum(start), distance * rays.box_scale + rays.box_margin, is_local),
    );
}

// The ray against one of `searched_triangles`.
fn meets(rays: LightRays, ray: ReceiverRay, index: u32) -> bool {
    let item = textureLoad(searched_triangles, place_from_index(index), 0);
    let a = offset_from_vertex(item.x, rays.eye_high, rays.eye_low) - ray.point;
    let b = offset_from_vertex(item.y, rays.eye_high, rays.eye_low) - ray.point;
    let c = offset_from_vertex(item.z, rays.eye_high, rays.eye_low) - ray.point;
    let normal = normal_of_triangle(item.w);
    return item.w != ray.own_triangle && is_met(
        ray.light_ray,
        vec3<f32>(dot(ray.x, a), dot(ray.y, a), dot(ray.z, a)),
        vec3<f32>(dot(ray.x, b), dot(ray.y, b), dot(ray.z, b)),
        vec3<f32>(dot(ray.x, c), dot(ray.y, c), dot(ray.z, c)),
        vec3<f32>(dot(ray.x, normal), dot(ray.y, normal), dot(ray.z, normal)),
    );
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
    var lit = select(bitcast<f32>(NO_SURFACE), 0.0, receiver.is_seen);
    if receiver.faces_light {
        lit = select(1.0, 0.0, is_in_shadow(light_rays_uniform, receiver, receivers.is_local > 0.0));
    }
    visibility[row * receivers.width + column] = lit;
}
