// Rays from one point through a plane: the camera, a spot light, a face of a cube around a light.
// Texel = q.xy / q.z, depth = q.z.
#import lib/projection

fn homogeneous_from_projected(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return q;
}

fn centred_texel_from_projected(projection: Projection, q: vec3<f32>) -> vec2<f32> {
    return q.xy / q.z;
}

fn projected_from_ray(projection: Projection, ray: vec3<f32>, depth: f32) -> vec3<f32> {
    return ray * depth;
}

fn depth_from_projected(q: vec3<f32>) -> f32 {
    return q.z;
}

fn ray_from_projected(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(q.xy / q.z, 1.0);
}

fn ray_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    return vec3<f32>(centred, 1.0);
}

// The same but of any length.
fn direction_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    return ray_from_texel(projection, centred);
}

// One over depth is linear in the texel: the coefficients of the plane with a normal (a covector of
// projection space) through a point, at a height: the normal's product with any point of the plane.
fn depth_plane(projection: Projection, normal: vec3<f32>, q: vec3<f32>, height: f32) -> vec3<f32> {
    return normal / height;
}

fn depth_on_plane(projection: Projection, plane: vec3<f32>, ray: vec3<f32>) -> f32 {
    return 1.0 / fma(plane.x, ray.x, fma(plane.y, ray.y, plane.z));
}

// Least and greatest depth of a plane in a box of centred texels, rounding included.
fn depths_on_plane_in_box(projection: Projection, plane: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> vec2<f32> {
    let inverse = dot(plane.xy, middle) + plane.z;
    let rounding = FUNCTION_ROUNDING * (dot(abs(plane.xy), abs(middle)) + abs(plane.z));
    let range = inverse + (dot(abs(plane.xy), reach) + rounding) * vec2<f32>(1.0, -1.0);
    return select(vec2<f32>(FAR), 1.0 / range, range > vec2<f32>(0.0));
}

// Height over the plane through a point, per texel along each axis.
fn height_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return normal.xy;
}

// Depth per texel of the plane through a point.
fn depth_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return -normal.xy * q.z * q.z / dot(normal, q);
}

// Depth of the plane through a point where a ray `step` texels away meets it; no more than `most` times
// as near or as far.
fn depth_of_neighbour(projection: Projection, normal: vec3<f32>, q: vec3<f32>, step: vec2<f32>, most: f32) -> f32 {
    let growth = 1.0 + q.z * dot(normal.xy, step) / dot(normal, q);
    return q.z / clamp(growth, 1.0 / most, most);
}

// How much wider a texel's beam is at a point than at the depth that widths are given for.
fn beam_growth(projection: Projection, q: vec3<f32>) -> f32 {
    return q.z;
}

// How wide a texel is at a point, against others of the same map: the root of its area across the axis.
fn texel_width(projection: Projection, q: vec3<f32>) -> f32 {
    return q.z;
}

fn grown_by_corner(projection: Projection, extent: Extent, a: vec3<f32>) -> Extent {
    let texel = a.xy / a.z;
    let is_seen = a.z >= projection.z_min;
    return Extent(
        select(extent.low, min(extent.low, texel), is_seen),
        select(extent.high, max(extent.high, texel), is_seen),
    );
}

// What is divided by it stays within float32.
const NEAREST_CROSSING: f32 = 1e-25;

// Where the edge from a to b meets the near plane, if the plane lies between them.
fn grown_by_crossing(projection: Projection, extent: Extent, a: vec3<f32>, b: vec3<f32>) -> Extent {
    let crosses = (a.z >= projection.z_min) != (b.z >= projection.z_min);
    let t = (projection.z_min - a.z) / select(1.0, b.z - a.z, crosses);
    let z = max(projection.z_min, NEAREST_CROSSING);
    let texel = mix(a.xy, b.xy, t) / z;
    // The nearer the plane, the more of the image a rounding of the crossing is.
    let rounding = ROUNDING * (abs(a.xy) + abs(b.xy)) / z;
    return Extent(
        select(extent.low, min(extent.low, texel - rounding), crosses),
        select(extent.high, max(extent.high, texel + rounding), crosses),
    );
}

// Of the part in front of the near plane.
fn texels_of_triangle(projection: Projection, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Extent {
    var extent = Extent(vec2<f32>(3.0e38), vec2<f32>(-3.0e38));
    extent = grown_by_corner(projection, extent, a);
    extent = grown_by_corner(projection, extent, b);
    extent = grown_by_corner(projection, extent, c);
    extent = grown_by_crossing(projection, extent, a, b);
    extent = grown_by_crossing(projection, extent, b, c);
    return grown_by_crossing(projection, extent, c, a);
}

// Least and greatest depth of a triangle, or a little beyond.
fn depths_of_triangle(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec2<f32> {
    return vec2<f32>(min(min(a.z, b.z), c.z), max(max(a.z, b.z), c.z));
}

// The line on which an edge's function is zero among centred texels: its coefficients of x and y, its
// constant, and what float32 may round of the function within `reach` of the axis.
fn line_of_edge(projection: Projection, edge: vec3<f32>, reach: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(edge, FUNCTION_ROUNDING * (dot(abs(edge.xy), reach) + abs(edge.z)));
}

// A bound of an edge's function in a box of centred texels.
fn greatest_of_edge(projection: Projection, edge: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> f32 {
    return dot(edge.xy, middle) + edge.z + dot(abs(edge.xy), reach) + SHORT_ROUNDING * abs(edge.z);
}

// What is nearer than the near plane is not seen.
fn clamp_to_nearest(z: f32, z_floor: f32) -> f32 {
    return z;
}

// Sides that triangles are cut at where a corner has no place or is far off: the end of the projection,
// and those of a band around the map.
const CUTS: u32 = 5u;

// Centred texel times w, and w: what depths are divided by before they are interpolated along lines of
// the map.
fn homogeneous_texel(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return q;
}

// Positive in the half of space that corners can be taken from to the map: behind the near plane. A corner
// nearer than 2^-16 of the farthest depth would be placed by its rounding.
fn side_from_projected(projection: Projection, q: vec3<f32>) -> f32 {
    return q.z - max(projection.z_min, projection.z_max / 65536.0);
}
