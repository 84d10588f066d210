// Rays that are parallel or nearly so, whose texels a homography moves: the light matrices of perspective, light
// space perspective, plane optimal and scene optimized shadow maps, and every map of a light that is far away: the
// texels are the straight ones of `lib/homography`.
#import lib/homography

fn centred_texel_from_projected(projection: Projection, q: vec3<f32>) -> vec2<f32> {
    let texel = homogeneous_texel(projection, q);
    // What is behind the horizon is far outside of every map.
    return select(vec2<f32>(1e8), texel.xy / texel.z, texel.z > 0.0);
}

fn homogeneous_texel(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return straight_texel(projection, q);
}

fn ray_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    return straight_ray(projection, centred);
}

fn depths_on_plane_in_box(projection: Projection, plane: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> vec2<f32> {
    return straight_depths_in_box(projection, plane, middle, reach);
}

fn height_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return straight_height_slope(projection, normal, q);
}

fn depth_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return straight_depth_slope(projection, normal, q);
}

fn depth_of_neighbour(projection: Projection, normal: vec3<f32>, q: vec3<f32>, step: vec2<f32>, most: f32) -> f32 {
    return straight_depth_of_neighbour(projection, normal, q, step);
}

// The width of a texel's beam at a point.
fn beam_growth(projection: Projection, q: vec3<f32>) -> f32 {
    let slopes = place_slopes(projection, place_from_projected(projection, q));
    return width_at(projection, q.z) * max(length(slopes[0]), length(slopes[1]));
}

// How wide a texel is at a point, against others of the same map: the root of its area across the axis, which grows as
// the third power of w.
fn texel_width(projection: Projection, q: vec3<f32>) -> f32 {
    let place = place_from_projected(projection, q);
    let w = abs(dot(projection.texel_from_place[2].xyz, vec3<f32>(place, 1.0)));
    return width_at(projection, q.z) * w * sqrt(w);
}

fn texels_of_triangle(projection: Projection, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Extent {
    return straight_extent(projection, a, b, c);
}

fn line_of_edge(projection: Projection, edge: vec3<f32>, reach: vec2<f32>) -> vec4<f32> {
    return straight_line_of_edge(projection, edge, reach);
}

fn greatest_of_edge(projection: Projection, edge: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> f32 {
    return straight_greatest_of_edge(projection, edge, middle, reach);
}

// Positive in the half of space that corners can be taken from to the map: before the horizon.
fn side_from_projected(projection: Projection, q: vec3<f32>) -> f32 {
    return homogeneous_texel(projection, q).z - projection.least_w;
}

// Sides that triangles are cut at where a corner has no place or is far off: the end of the projection,
// and those of a band around the map.
const CUTS: u32 = 5u;
