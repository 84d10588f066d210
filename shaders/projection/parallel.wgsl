// Parallel rays: a directional light. Texel = (q.x, q.y), depth = q.z.
#import lib/projection

// The edges and the rays of a parallel projection live in the plane q.z = 1.
fn homogeneous_from_projected(q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(q.xy, 1.0);
}

fn centred_texel_from_projected(q: vec3<f32>) -> vec2<f32> {
    return q.xy;
}

// Depth is linear in the texel: the coefficients of the plane with a normal (a covector of projection
// space) through a point.
fn depth_plane(normal: vec3<f32>, q: vec3<f32>) -> vec3<f32> {
    let slope = -normal.xy / normal.z;
    return vec3<f32>(slope, q.z - dot(slope, q.xy));
}

fn depth_on_plane(plane: vec3<f32>, centred_texel: vec2<f32>) -> f32 {
    return fma(plane.x, centred_texel.x, fma(plane.y, centred_texel.y, plane.z));
}

// Casters nearer than the nearest depth are drawn at it, as pancaking does.
fn clamp_to_nearest(z: f32, z_min: f32) -> f32 {
    return max(z, z_min);
}

// Everything is in front of a parallel projection.
fn is_in_front(q: vec3<f32>, z_min: f32) -> bool {
    return true;
}
