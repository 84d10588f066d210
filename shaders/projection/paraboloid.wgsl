// Rays from one point to all sides but straight back, as a paraboloid around the light reflects them:
// Brabec, Annen and Seidel, "Shadow mapping for hemispherical and omnidirectional light sources", 2002;
// Navrátil's thesis, section 3.3.2. With d the direction of a point,
//
//   texel = scale * d.xy / (1 + d.z)           depth = distance
//
// It is the stereographic projection. A direction with d.z = 0 lies on the unit circle of its plane,
// and beyond it d.z < 0: nothing ends at the rim. The great circle that an edge lies on becomes a circle
// of radius 1 / |n.z| around n.xy / n.z, n the normal of its plane. Edges are tested on the directions
// of the texels, so that a triangle needs no tessellation, however large it is.
#import lib/projection

fn homogeneous_from_projected(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return q;
}

// A place in the plane. Behind the light 1 + d.z cancels; there another form of it does not.
fn plane_from_projected(q: vec3<f32>) -> vec2<f32> {
    let size = length(q);
    let squared = dot(q.xy, q.xy);
    let inverse = select((size - q.z) / squared, 1.0 / (size + q.z), q.z >= 0.0);
    // Straight back is nowhere: far outside of every map.
    return select(clamp(q.xy * inverse, vec2<f32>(-1e8), vec2<f32>(1e8)), vec2<f32>(1e8), squared == 0.0 && q.z < 0.0);
}

fn centred_texel_from_projected(projection: Projection, q: vec3<f32>) -> vec2<f32> {
    return plane_from_projected(q) * projection.scale;
}

fn projected_from_ray(projection: Projection, ray: vec3<f32>, depth: f32) -> vec3<f32> {
    return ray * depth;
}

fn depth_from_projected(q: vec3<f32>) -> f32 {
    return length(q);
}

fn ray_from_projected(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return normalize(q);
}

fn ray_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    let place = centred / projection.scale;
    return direction_from_texel(projection, centred) / (1.0 + dot(place, place));
}

// The same but of any length.
fn direction_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    let place = centred / projection.scale;
    return vec3<f32>(2.0 * place, 1.0 - dot(place, place));
}

// One over the distance along a ray to a plane is linear in the ray.
fn depth_plane(projection: Projection, normal: vec3<f32>, q: vec3<f32>, height: f32) -> vec3<f32> {
    return normal / height;
}

fn depth_on_plane(projection: Projection, plane: vec3<f32>, ray: vec3<f32>) -> f32 {
    return 1.0 / dot(plane, ray);
}

// Least and greatest depth of a plane in a box of centred texels, rounding included: on the unnormalized ray
// it is the ray's length, 1 + place^2, over the plane's function.
fn depths_on_plane_in_box(projection: Projection, plane: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> vec2<f32> {
    let range = vec2<f32>(
        greatest_of_edge(projection, plane, middle, reach),
        -greatest_of_edge(projection, -plane, middle, reach),
    );
    let nearest = max(abs(middle) - reach, vec2<f32>(0.0)) / projection.scale;
    let farthest = (abs(middle) + reach) / projection.scale;
    let lengths = vec2<f32>(1.0 + dot(nearest, nearest), 1.0 + dot(farthest, farthest));
    let rounding = vec2<f32>(1.0 - FUNCTION_ROUNDING, 1.0 + FUNCTION_ROUNDING);
    return select(vec2<f32>(FAR), lengths * rounding / range, range > vec2<f32>(0.0));
}

// Height over the plane through a point, per texel along each axis.
fn height_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    let place = plane_from_projected(q);
    let growth = 2.0 / (1.0 + dot(place, place));
    let ray = normalize(q);
    // The derivative of the ray by the place: `growth` across the ray, by the derivatives of the
    // unnormalized ray (2 place, 1 - place^2).
    let along_x = growth * (vec3<f32>(1.0, 0.0, -place.x) - ray * place.x);
    let along_y = growth * (vec3<f32>(0.0, 1.0, -place.y) - ray * place.y);
    let changes = vec2<f32>(dot(normal, along_x), dot(normal, along_y));
    return changes / projection.scale;
}

// Depth per texel of the plane through a point.
fn depth_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return -length(q) * height_slope(projection, normal, q) / dot(normal, normalize(q));
}

// Depth of the plane through a point where a ray `step` texels away meets it; no more than `most` times
// as near or as far.
fn depth_of_neighbour(projection: Projection, normal: vec3<f32>, q: vec3<f32>, step: vec2<f32>, most: f32) -> f32 {
    let ray = ray_from_texel(projection, plane_from_projected(q) * projection.scale + step);
    let growth = dot(normal, ray) * length(q) / dot(normal, q);
    return length(q) / clamp(growth, 1.0 / most, most);
}

// How much wider a texel's beam is at a point than at the depth that widths are given for.
fn beam_growth(projection: Projection, q: vec3<f32>) -> f32 {
    return length(q);
}

// How wide a texel is at a point, against others of the same map: the stereographic projection scales alike in all
// directions.
fn texel_width(projection: Projection, q: vec3<f32>) -> f32 {
    return length(q) + q.z;
}

// Takes in the outermost place, along one axis, of the circle of an edge, if the edge reaches it: the
// direction (2 t, 1 - t^2) lies on the edge's great circle, so it is on the edge from a to b if it is
// on b's side of a and on a's side of b.
fn grown_by_place(extent: Extent, place: vec2<f32>, n: vec3<f32>, a: vec3<f32>, b: vec3<f32>) -> Extent {
    let direction = vec3<f32>(2.0 * place, 1.0 - dot(place, place));
    let is_reached = dot(cross(a, direction), n) >= 0.0 && dot(cross(direction, b), n) >= 0.0;
    return Extent(
        select(extent.low, min(extent.low, place), is_reached),
        select(extent.high, max(extent.high, place), is_reached),
    );
}

fn grown_by_edge(extent: Extent, a: vec3<f32>, b: vec3<f32>) -> Extent {
    let n = cross(a, b);
    let size = length(n);
    // A circle of a huge radius is a line; its ends are its extremes.
    let flat = select(n.z, select(-SHORT_ROUNDING, SHORT_ROUNDING, n.z >= 0.0) * size, abs(n.z) < SHORT_ROUNDING * size);
    let middle = n.xy / flat;
    let radius = size / abs(flat);
    // Of the two places on each axis the nearer to zero cancels: their product is known instead.
    let far = middle + select(vec2<f32>(-radius), vec2<f32>(radius), middle >= vec2<f32>(0.0));
    let near = -(1.0 + middle.yx * middle.yx) / far;
    var grown = grown_by_place(extent, vec2<f32>(far.x, middle.y), n, a, b);
    grown = grown_by_place(grown, vec2<f32>(near.x, middle.y), n, a, b);
    grown = grown_by_place(grown, vec2<f32>(middle.x, far.y), n, a, b);
    return grown_by_place(grown, vec2<f32>(middle.x, near.y), n, a, b);
}

fn texels_of_triangle(projection: Projection, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Extent {
    let ends = array<vec2<f32>, 3>(
        plane_from_projected(a),
        plane_from_projected(b),
        plane_from_projected(c),
    );
    // Unit lengths, so that the products of products below stay within float32.
    let na = a / max(length(a), 1e-30);
    let nb = b / max(length(b), 1e-30);
    let nc = c / max(length(c), 1e-30);
    var extent = Extent(min(min(ends[0], ends[1]), ends[2]), max(max(ends[0], ends[1]), ends[2]));
    extent = grown_by_edge(extent, na, nb);
    extent = grown_by_edge(extent, nb, nc);
    extent = grown_by_edge(extent, nc, na);
    // A triangle straight behind the light, or nearly, is all around the map. So is what has a corner in
    // the light. The sides of the direction (0, 0, -1) at the three edges:
    let sides = -vec3<f32>(cross(na, nb).z, cross(nb, nc).z, cross(nc, na).z);
    let is_behind = (min(min(sides.x, sides.y), sides.z) >= -SHORT_ROUNDING || max(max(sides.x, sides.y), sides.z) <= SHORT_ROUNDING)
        && min(min(a.z, b.z), c.z) <= 0.0;
    let is_at_light = min(min(dot(a, a), dot(b, b)), dot(c, c)) == 0.0;
    let is_all = is_behind || is_at_light;
    return Extent(
        select(extent.low, vec2<f32>(-1e8), is_all) * projection.scale,
        select(extent.high, vec2<f32>(1e8), is_all) * projection.scale,
    );
}

// Least and greatest depth of a triangle, or a little beyond: no point of it is farther from its
// nearest corner than the longest side by the square root of three.
fn depths_of_triangle(a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> vec2<f32> {
    let sizes = vec3<f32>(length(a), length(b), length(c));
    let longest = max(max(distance(a, b), distance(b, c)), distance(c, a));
    return vec2<f32>(
        max(min(min(sizes.x, sizes.y), sizes.z) - 0.578 * longest, 0.0),
        max(max(sizes.x, sizes.y), sizes.z),
    );
}

// An edge is a circle here: no line bounds it.
fn line_of_edge(projection: Projection, edge: vec3<f32>, reach: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(0.0);
}

// A bound of an edge's function in a box of centred texels. On the unnormalized ray (2 t, 1 - t^2) it
// is a sum of parabolas of t.x and of t.y.
fn greatest_of_edge(projection: Projection, edge: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> f32 {
    let low = (middle - reach) / projection.scale;
    let high = (middle + reach) / projection.scale;
    let top = select(low, clamp(edge.xy / edge.z, low, high), edge.z > 0.0);
    let parabola_low = low * (2.0 * edge.xy - edge.z * low);
    let parabola_high = high * (2.0 * edge.xy - edge.z * high);
    let parabola_top = top * (2.0 * edge.xy - edge.z * top);
    let greatest = max(max(parabola_low, parabola_high), parabola_top);
    let farthest = max(abs(low), abs(high));
    let slack = 2.0 * FUNCTION_ROUNDING * (dot(abs(edge.xy), farthest) + abs(edge.z) * (1.0 + dot(farthest, farthest)));
    return greatest.x + greatest.y + edge.z + slack;
}

fn clamp_to_nearest(z: f32, z_floor: f32) -> f32 {
    return z;
}

// Sides that triangles are cut at where a corner has no place: the rim.
const CUTS: u32 = 1u;

// Centred texel times w, and w: published paraboloids interpolate distances, as if nothing was projected.
fn homogeneous_texel(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(centred_texel_from_projected(projection, q), 1.0);
}

// Positive in the half of space that corners can be taken from to the map: before the rim.
fn side_from_projected(projection: Projection, q: vec3<f32>) -> f32 {
    return q.z;
}
