// A perspective along the view whose rows a logarithm spreads evenly: Lloyd, Govindaraju, Quammen, Molnar and Manocha,
// "Logarithmic perspective shadow maps", ACM Transactions on Graphics 27(4), 2008. The straight texel of `lib/homography`
// is (x, s): the column, and one over the distance w from the perspective's apex along the view, which is one on the
// axis. With c the rate, how many rows there are for a distance that is e times as large,
//
//   texel = (x, -c log s)
//
// A column is as wide as w is large, and a row as long: w / c. The row grows all the way as s falls, so that a box of
// texels is a box of (x, s), and what is known of straight edges there bounds what is in it. Edges themselves are
// tested on the rays of the texels, so that a triangle needs no tessellation, however large it is.
#import lib/homography

// What float32 may round of an exponential whose argument is no more than ten.
const EXP_ROUNDING: f32 = 4e-6;

fn s_from_row(projection: Projection, row: f32) -> f32 {
    return exp(-row / projection.scale.y);
}

// How s falls per row at a point.
fn fall_of_s(projection: Projection, q: vec3<f32>) -> f32 {
    let texel = straight_texel(projection, q);
    return texel.y / (texel.z * projection.scale.y);
}

// The exponential less one, in which nothing cancels.
fn exp_less_one(x: f32) -> f32 {
    let series = x * (1.0 + x / 2.0 * (1.0 + x / 3.0 * (1.0 + x / 4.0 * (1.0 + x / 5.0 * (1.0 + x / 6.0)))));
    return select(exp(x) - 1.0, series, abs(x) < 0.25);
}

fn centred_texel_from_projected(projection: Projection, q: vec3<f32>) -> vec2<f32> {
    let texel = straight_texel(projection, q);
    let row = -projection.scale.y * log(texel.y / texel.z);
    // What is behind the horizon is far outside of every map.
    return select(vec2<f32>(1e8), vec2<f32>(texel.x / texel.z, row), texel.z > 0.0);
}

fn homogeneous_texel(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    let w = straight_texel(projection, q).z;
    return vec3<f32>(centred_texel_from_projected(projection, q) * w, w);
}

fn ray_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    return straight_ray(projection, vec2<f32>(centred.x, s_from_row(projection, centred.y)));
}

// A box of texels as one of (x, s): its middle and its reach, rounding included.
fn straight_box(projection: Projection, middle: vec2<f32>, reach: vec2<f32>) -> vec4<f32> {
    let low = s_from_row(projection, middle.y + reach.y) * (1.0 - EXP_ROUNDING);
    let high = s_from_row(projection, middle.y - reach.y) * (1.0 + EXP_ROUNDING);
    return vec4<f32>(middle.x, 0.5 * (low + high), reach.x, 0.5 * (high - low));
}

fn depths_on_plane_in_box(projection: Projection, plane: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> vec2<f32> {
    let straight = straight_box(projection, middle, reach);
    return straight_depths_in_box(projection, plane, straight.xy, straight.zw);
}

fn height_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return straight_height_slope(projection, normal, q) * vec2<f32>(1.0, -fall_of_s(projection, q));
}

fn depth_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return straight_depth_slope(projection, normal, q) * vec2<f32>(1.0, -fall_of_s(projection, q));
}

fn depth_of_neighbour(projection: Projection, normal: vec3<f32>, q: vec3<f32>, step: vec2<f32>, most: f32) -> f32 {
    let s = fall_of_s(projection, q) * projection.scale.y;
    let straight = vec2<f32>(step.x, s * exp_less_one(-step.y / projection.scale.y));
    return straight_depth_of_neighbour(projection, normal, q, straight);
}

// The width of a texel's beam at a point.
fn beam_growth(projection: Projection, q: vec3<f32>) -> f32 {
    let slopes = place_slopes(projection, place_from_projected(projection, q));
    return width_at(projection, q.z) * max(length(slopes[0]), length(slopes[1]) * fall_of_s(projection, q));
}

// How wide a texel is at a point, against others of the same map: both sides grow as w does.
fn texel_width(projection: Projection, q: vec3<f32>) -> f32 {
    let place = place_from_projected(projection, q);
    return width_at(projection, q.z) * abs(dot(projection.texel_from_place[2].xyz, vec3<f32>(place, 1.0)));
}

fn texels_of_triangle(projection: Projection, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Extent {
    let straight = straight_extent(projection, a, b, c);
    let rows = -projection.scale.y * log(max(vec2<f32>(straight.high.y, straight.low.y), vec2<f32>(1e-38)));
    // A triangle behind the horizon is nowhere.
    let is_seen = straight.low.x <= straight.high.x;
    return Extent(
        vec2<f32>(straight.low.x, select(3.0e38, rows.x, is_seen)),
        vec2<f32>(straight.high.x, select(-3.0e38, rows.y, is_seen)),
    );
}

// An edge is a curve here: no line bounds it.
fn line_of_edge(projection: Projection, edge: vec3<f32>, reach: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(0.0);
}

fn greatest_of_edge(projection: Projection, edge: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> f32 {
    let straight = straight_box(projection, middle, reach);
    return straight_greatest_of_edge(projection, edge, straight.xy, straight.zw);
}

// Positive in the half of space that corners can be taken from to the map: before the horizon.
fn side_from_projected(projection: Projection, q: vec3<f32>) -> f32 {
    return straight_texel(projection, q).z - projection.least_w;
}

// Sides that triangles are cut at where a corner has no place: the end of the projection.
const CUTS: u32 = 1u;
