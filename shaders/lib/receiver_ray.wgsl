// A receiver's own light ray, and its test against a triangle: what is the same however the triangles are
// searched for, so that all searches give the same answer.
//
// The corners are taken relative to the receiver before they are turned into the ray's axes: what is near
// the receiver is then known as well as float32 allows, wherever in the scene both are.
#import lib/axes
#import lib/receivers
#import lib/shadow_ray
#import lib/triangles
#import mask

struct ReceiverRay {
    own_triangle: u32,
    point: vec3<f32>,           // the receiver, in world axes relative to the eye
    distance: f32,              // of the light; 1 where it is at infinity
    margin: f32,                // how far rounding may have moved the receiver, in world units
    // Axes of the test; the third one is the ray's direction.
    x: vec3<f32>,
    y: vec3<f32>,
    z: vec3<f32>,
    light_ray: LightRay,
}

fn margin_of_receiver(receiver: Receiver, point: vec3<f32>) -> f32 {
    let cosine = abs(dot(receiver.normal, receiver.ray)) / length(receiver.ray);
    return receiver_margin(length(point), cosine, extent_of_triangle(receiver.triangle));
}

fn ray_of_receiver(receiver: Receiver, is_local: bool) -> ReceiverRay {
    let point = receiver.point;
    let to_light = -receiver.from_light;
    let distance = length(to_light);
    let z = to_light / distance;
    let axes = axes_across(z);
    let margin = margin_of_receiver(receiver, point);
    let reach = select(3.0e38, distance, is_local);
    return ReceiverRay(receiver.triangle, point, distance, margin, axes.x, axes.y, z, LightRay(vec2<f32>(0.0), reach));
}

// Corners relative to the receiver; not of its own triangle.
fn meets_corners(ray: ReceiverRay, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, normal: vec3<f32>) -> Meeting {
    let ta = vec3<f32>(dot(ray.x, a), dot(ray.y, a), dot(ray.z, a));
    let tb = vec3<f32>(dot(ray.x, b), dot(ray.y, b), dot(ray.z, b));
    let tc = vec3<f32>(dot(ray.x, c), dot(ray.y, c), dot(ray.z, c));
    let turned_normal = vec3<f32>(dot(ray.x, normal), dot(ray.y, normal), dot(ray.z, normal));
    let room = ROUNDING * max(max(absolute_sum(a), absolute_sum(b)), absolute_sum(c)) + ray.margin;
    let edges = meet_edges(ray.light_ray.shear, ta, tb, tc, room);
    return meeting(ray.light_ray, edges, ta, tb, tc, turned_normal, room);
}

// `eye_high` and `eye_low` are the eye relative to the scene's origin.
fn meets(ray: ReceiverRay, triangle: u32, vertices: vec3<u32>, eye_high: vec3<f32>, eye_low: vec3<f32>) -> Meeting {
    let side = light_side(triangle);
    // Where the light is in the plane there is no shadow.
    if triangle == ray.own_triangle || side == 0 {
        return Meeting(false, false);
    }
    let a = offset_from_vertex(vertices.x, eye_high, eye_low) - ray.point;
    let b = offset_from_vertex(vertices.y, eye_high, eye_low) - ray.point;
    let c = offset_from_vertex(vertices.z, eye_high, eye_low) - ray.point;
    let normal = normal_of_triangle(triangle);
    if is_masked(triangle) {
        let met = meets_solid(ray, side, a, b, c, normal);
        let solidity = solidity_on_ray(ray, triangle, a, b, c);
        return Meeting(met.is_possible && solidity.may_be, met.is_certain && solidity.is_sure);
    }
    return meets_solid(ray, side, a, b, c, normal);
}

// What the ray meets of a masked triangle. The shares of its corners are as wrong as the edges that they are from.
fn solidity_on_ray(ray: ReceiverRay, triangle: u32, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Solidity {
    let pa = vec2<f32>(dot(ray.x, a), dot(ray.y, a));
    let pb = vec2<f32>(dot(ray.x, b), dot(ray.y, b));
    let pc = vec2<f32>(dot(ray.x, c), dot(ray.y, c));
    let ea = edge_function(pb, pc - pb);
    let eb = edge_function(pc, pa - pc);
    let ec = edge_function(pa, pb - pa);
    let room = ROUNDING * max(max(absolute_sum(a), absolute_sum(b)), absolute_sum(c)) + ray.margin;
    let total = abs(pa) + abs(pb) + abs(pc);
    let slack = ea.y + eb.y + ec.y + 3.0 * room * (total.x + total.y + room);
    let area = abs(ea.x + eb.x + ec.x);
    return solidity_of(triangle, vec3<f32>(ea.x, eb.x, ec.x), 2.0 * slack / area);
}

// The ray against a triangle without its holes.
fn meets_solid(ray: ReceiverRay, side: i32, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, normal: vec3<f32>) -> Meeting {
    if side == FOUND_IN_FLOAT32 {
        return meets_corners(ray, a, b, c, normal);
    }
    // The light is on a known side, so that the hit is before it where the receiver is on the other one.
    var endless = ray;
    endless.light_ray.reach = 3.0e38;
    let met = meets_corners(endless, a, b, c, normal);
    var nearest = select(a, b, absolute_sum(b) < absolute_sum(a));
    nearest = select(nearest, c, absolute_sum(c) < absolute_sum(nearest));
    let height = dot(normal, nearest) * f32(side);
    let off = 5.0 * (ray.margin + ROUNDING * absolute_sum(nearest));
    return Meeting(met.is_possible && height > -off, met.is_certain && height > off);
}
