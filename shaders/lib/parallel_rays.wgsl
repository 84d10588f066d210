// What parallel rays have alike with those that nearly are, wherever their texels lie: depth = q.z.
#import lib/projection

fn depth_from_projected(q: vec3<f32>) -> f32 {
    return q.z;
}

// The ray of a texel, but of any length.
fn direction_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    return ray_from_texel(projection, centred);
}

// Least and greatest depth of a triangle, or a little beyond.
fn depths_of_triangle(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(min(min(a.z, b.z), c.z), max(max(a.z, b.z), c.z));
}

// Casters nearer than the nearest depth are drawn at it, as pancaking does.
fn clamp_to_nearest(z: f32, z_floor: f32) -> f32 {
    return max(z, z_floor);
}
