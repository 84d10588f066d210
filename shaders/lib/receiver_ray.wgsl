// A receiver's own light ray, and its test against a triangle: what is the same however the triangles are
// searched for, so that all searches give the same answer.
//
// The corners are taken relative to the receiver before they are turned into the ray's axes: what is near
// the receiver is then known as well as float32 allows, wherever in the scene both are.
#import lib/axes
#import lib/receivers
#import lib/shadow_ray
#import lib/triangles

struct ReceiverRay {
    own_triangle: u32,
    point: vec3<f32>,           // the receiver, in world axes relative to the eye
    distance: f32,              // of the light; 1 where it is at infinity
    normal: vec3<f32>,          // of the receiver's plane, unit, to the side of the light
    // How far rounding may have moved the receiver across its plane. An oblique view moves it farther, but
    // along the plane.
    plane_margin: f32,
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
    let point = receiver.ray * receiver.depth;
    let to_light = -receiver.from_light;
    let distance = length(to_light);
    let z = to_light / distance;
    let axes = axes_across(z);
    let margin = margin_of_receiver(receiver, point);
    let reach = select(3.0e38, distance, is_local);
    let normal = receiver.normal * sign(dot(receiver.normal, to_light));
    return ReceiverRay(
        receiver.triangle,
        point,
        distance,
        normal,
        ROUNDING * length(point),
        axes.x,
        axes.y,
        z,
        LightRay(vec2<f32>(0.0), reach, margin),
    );
}

// Corners relative to the receiver; not of its own triangle.
fn meets_corners(ray: ReceiverRay, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>, normal: vec3<f32>) -> bool {
    let above = max(max(dot(ray.normal, a), dot(ray.normal, b)), dot(ray.normal, c));
    return is_met(
        ray.light_ray,
        vec3<f32>(dot(ray.x, a), dot(ray.y, a), dot(ray.z, a)),
        vec3<f32>(dot(ray.x, b), dot(ray.y, b), dot(ray.z, b)),
        vec3<f32>(dot(ray.x, c), dot(ray.y, c), dot(ray.z, c)),
        vec3<f32>(dot(ray.x, normal), dot(ray.y, normal), dot(ray.z, normal)),
        above <= ray.plane_margin,
    );
}

// `eye_high` and `eye_low` are the eye relative to the scene's origin.
fn meets(ray: ReceiverRay, triangle: u32, vertices: vec3<u32>, eye_high: vec3<f32>, eye_low: vec3<f32>) -> bool {
    let a = offset_from_vertex(vertices.x, eye_high, eye_low) - ray.point;
    let b = offset_from_vertex(vertices.y, eye_high, eye_low) - ray.point;
    let c = offset_from_vertex(vertices.z, eye_high, eye_low) - ray.point;
    return triangle != ray.own_triangle && meets_corners(ray, a, b, c, normal_of_triangle(triangle));
}
