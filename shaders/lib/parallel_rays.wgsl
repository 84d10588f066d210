// What parallel rays have alike, wherever their texels lie: depth = q.z, and edges, planes and rays are those of the
// plane of q.xy.
#import lib/projection

// The edges and the rays of a parallel projection live in the plane q.z = 1.
fn homogeneous_from_projected(q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(q.xy, 1.0);
}

fn projected_from_ray(ray: vec3<f32>, depth: f32) -> vec3<f32> {
    return vec3<f32>(ray.xy, depth);
}

fn depth_from_projected(q: vec3<f32>) -> f32 {
    return q.z;
}

fn ray_from_projected(q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(q.xy, 1.0);
}

// The ray of a texel, but of any length.
fn direction_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    return ray_from_texel(projection, centred);
}

// Depth is linear in the texel: the coefficients of the plane with a normal (a covector of projection
// space) through a point. On a steep plane that is more precise than the plane's height.
fn depth_plane(normal: vec3<f32>, q: vec3<f32>, height: f32) -> vec3<f32> {
    let slope = -normal.xy / normal.z;
    return vec3<f32>(slope, q.z - dot(slope, q.xy));
}

fn depth_on_plane(plane: vec3<f32>, ray: vec3<f32>) -> f32 {
    return fma(plane.x, ray.x, fma(plane.y, ray.y, plane.z));
}

// Least and greatest depth of a triangle, or a little beyond.
fn depths_of_triangle(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(min(min(a.z, b.z), c.z), max(max(a.z, b.z), c.z));
}

// Casters nearer than the nearest depth are drawn at it, as pancaking does.
fn clamp_to_nearest(z: f32, z_min: f32) -> f32 {
    return max(z, z_min);
}

// Sides that triangles are cut at where a corner has no place or is far off: the end of the projection,
// and those of a band around the map.
const CUTS: u32 = 5u;
