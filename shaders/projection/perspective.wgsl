// Rays from one point through a plane: the camera. Texel = q.xy / q.z, depth = q.z.
#import lib/projection

fn homogeneous_from_projected(q: vec3<f32>) -> vec3<f32> {
    return q;
}

fn centred_texel_from_projected(q: vec3<f32>) -> vec2<f32> {
    return q.xy / q.z;
}

// One over depth is linear in the texel: the coefficients of the plane with a normal (a covector of
// projection space) through a point.
fn depth_plane(normal: vec3<f32>, q: vec3<f32>) -> vec3<f32> {
    return normal / dot(normal, q);
}

fn depth_on_plane(plane: vec3<f32>, centred_texel: vec2<f32>) -> f32 {
    return 1.0 / fma(plane.x, centred_texel.x, fma(plane.y, centred_texel.y, plane.z));
}

// What is nearer than the near plane is not seen.
fn clamp_to_nearest(z: f32, z_min: f32) -> f32 {
    return z;
}

fn is_in_front(q: vec3<f32>, z_min: f32) -> bool {
    return q.z >= z_min;
}
