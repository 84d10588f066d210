// Parallel rays: a directional light. Texel = (q.x, q.y), depth = q.z.
#import lib/parallel_rays

// The edges and the rays of a parallel projection live in the plane q.z = 1.
fn homogeneous_from_projected(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(q.xy, 1.0);
}

fn projected_from_ray(projection: Projection, ray: vec3<f32>, depth: f32) -> vec3<f32> {
    return vec3<f32>(ray.xy, depth);
}

fn ray_from_projected(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(q.xy, 1.0);
}

// Depth is linear in the texel: the coefficients of the plane with a normal (a covector of projection
// space) through a point. On a steep plane that is more precise than the plane's height.
fn depth_plane(projection: Projection, normal: vec3<f32>, q: vec3<f32>, height: f32) -> vec3<f32> {
    let slope = -normal.xy / normal.z;
    return vec3<f32>(slope, q.z - dot(slope, q.xy));
}

fn depth_on_plane(projection: Projection, plane: vec3<f32>, ray: vec3<f32>) -> f32 {
    return fma(plane.x, ray.x, fma(plane.y, ray.y, plane.z));
}

fn centred_texel_from_projected(projection: Projection, q: vec3<f32>) -> vec2<f32> {
    return q.xy;
}

fn ray_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    return vec3<f32>(centred, 1.0);
}

// Least and greatest depth of a plane in a box of centred texels, rounding included.
fn depths_on_plane_in_box(projection: Projection, plane: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> vec2<f32> {
    let depth = dot(plane.xy, middle) + plane.z;
    let rounding = FUNCTION_ROUNDING * (dot(abs(plane.xy), abs(middle)) + abs(plane.z));
    return depth + (dot(abs(plane.xy), reach) + rounding) * vec2<f32>(-1.0, 1.0);
}

// Height over the plane through a point, per texel along each axis.
fn height_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return normal.xy;
}

// Depth per texel of the plane through a point.
fn depth_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return -normal.xy / normal.z;
}

// Depth of the plane through a point where a ray `step` texels away meets it.
fn depth_of_neighbour(projection: Projection, normal: vec3<f32>, q: vec3<f32>, step: vec2<f32>, most: f32) -> f32 {
    return q.z + dot(-normal.xy / normal.z, step);
}

// How much wider a texel's beam is at a point than at the depth that widths are given for.
fn beam_growth(projection: Projection, q: vec3<f32>) -> f32 {
    return 1.0;
}

// How wide a texel is at a point, against others of the same map: the root of its area across the axis.
fn texel_width(projection: Projection, q: vec3<f32>) -> f32 {
    return 1.0;
}

fn texels_of_triangle(projection: Projection, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Extent {
    return Extent(min(min(a.xy, b.xy), c.xy), max(max(a.xy, b.xy), c.xy));
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

// Centred texel times w, and w: what depths are divided by before they are interpolated along lines of
// the map.
fn homogeneous_texel(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(q.xy, 1.0);
}

// Positive in the half of space that corners can be taken from to the map.
fn side_from_projected(projection: Projection, q: vec3<f32>) -> f32 {
    return 1.0;
}

// Sides that triangles are cut at where a corner has no place or is far off: the end of the projection,
// and those of a band around the map.
const CUTS: u32 = 5u;
