// Parallel rays whose texels a homography moves: the light matrices of perspective, light space
// perspective, plane optimal and scene optimized shadow maps. With H the homography,
//
//   homogeneous texel = H (q.x, q.y, 1)        depth = q.z
//
// The horizon is the line whose last coordinate, w, is zero; nothing behind it is in the map.
#import lib/parallel_rays

fn times(rows: array<vec4<f32>, 3>, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v));
}

fn centred_texel_from_projected(projection: Projection, q: vec3<f32>) -> vec2<f32> {
    let texel = times(projection.texel_from_place, vec3<f32>(q.xy, 1.0));
    // What is behind the horizon is far outside of every map.
    return select(vec2<f32>(1e8), texel.xy / texel.z, texel.z > 0.0);
}

// A texel behind the horizon has the negative of a ray, which no triangle covers.
fn ray_from_texel(projection: Projection, centred: vec2<f32>) -> vec3<f32> {
    let ray = times(projection.place_from_texel, vec3<f32>(centred, 1.0));
    return ray / abs(ray.z);
}

// Least and greatest depth of a plane in a box of centred texels, rounding included. Along any line before the
// horizon depth grows or falls all the way, so the extremes are at corners.
fn depths_on_plane_in_box(projection: Projection, plane: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> vec2<f32> {
    let x = middle.x + reach.x * vec4<f32>(-1.0, 1.0, -1.0, 1.0);
    let y = middle.y + reach.y * vec4<f32>(-1.0, -1.0, 1.0, 1.0);
    let rows = projection.place_from_texel;
    let line = plane.x * rows[0] + plane.y * rows[1] + plane.z * rows[2];
    let sizes = abs(plane.x * rows[0]) + abs(plane.y * rows[1]) + abs(plane.z * rows[2]);
    let w = rows[2].x * x + rows[2].y * y + rows[2].z;
    let rounding = 2.0 * FUNCTION_ROUNDING * (sizes.x * abs(x) + sizes.y * abs(y) + sizes.z);
    let low = (line.x * x + line.y * y + line.z - rounding) / w;
    let high = (line.x * x + line.y * y + line.z + rounding) / w;
    let is_before_horizon = all(w > vec4<f32>(0.0));
    return vec2<f32>(
        select(-FAR, min(min(low.x, low.y), min(low.z, low.w)), is_before_horizon),
        select(FAR, max(max(high.x, high.y), max(high.z, high.w)), is_before_horizon),
    );
}

// How the place of a ray moves as its texel does by a step: the quotient's difference, in which
// nothing cancels.
fn place_step(projection: Projection, q: vec3<f32>, step: vec2<f32>) -> vec2<f32> {
    let w = dot(projection.texel_from_place[2].xyz, vec3<f32>(q.xy, 1.0));
    let x = dot(projection.place_from_texel[0].xy, step);
    let y = dot(projection.place_from_texel[1].xy, step);
    let z = dot(projection.place_from_texel[2].xy, step);
    // A neighbour near the horizon is taken for a nearer one.
    return w * (vec2<f32>(x, y) - q.xy * z) / max(1.0 + w * z, 0.1);
}

// How the place of a ray moves per texel along an axis: the columns of the derivative.
fn place_slopes(projection: Projection, q: vec3<f32>) -> mat2x2<f32> {
    let w = dot(projection.texel_from_place[2].xyz, vec3<f32>(q.xy, 1.0));
    let x = projection.place_from_texel[0];
    let y = projection.place_from_texel[1];
    let z = projection.place_from_texel[2];
    return mat2x2<f32>(
        w * (vec2<f32>(x.x, y.x) - q.xy * z.x),
        w * (vec2<f32>(x.y, y.y) - q.xy * z.y),
    );
}

// Depth per texel of the plane through a point.
fn depth_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return -normal.xy / normal.z * place_slopes(projection, q);
}

// Depth of the plane through a point where a ray `step` texels away meets it.
fn depth_of_neighbour(projection: Projection, normal: vec3<f32>, q: vec3<f32>, step: vec2<f32>, most: f32) -> f32 {
    return q.z + dot(-normal.xy / normal.z, place_step(projection, q, step));
}

// The width of a texel's beam at a point.
fn beam_growth(projection: Projection, q: vec3<f32>) -> f32 {
    let slopes = place_slopes(projection, q);
    return max(length(slopes[0]), length(slopes[1]));
}

fn grown_by_corner(projection: Projection, extent: Extent, texel: vec3<f32>) -> Extent {
    let is_seen = texel.z >= projection.least_w;
    let place = texel.xy / texel.z;
    return Extent(
        select(extent.low, min(extent.low, place), is_seen),
        select(extent.high, max(extent.high, place), is_seen),
    );
}

// Where the edge from a to b comes nearer to the horizon than anything in the map, if it does.
fn grown_by_crossing(projection: Projection, extent: Extent, a: vec3<f32>, b: vec3<f32>) -> Extent {
    let crosses = (a.z >= projection.least_w) != (b.z >= projection.least_w);
    let t = (projection.least_w - a.z) / select(1.0, b.z - a.z, crosses);
    let place = mix(a.xy, b.xy, t) / projection.least_w;
    return Extent(
        select(extent.low, min(extent.low, place), crosses),
        select(extent.high, max(extent.high, place), crosses),
    );
}

fn texels_of_triangle(projection: Projection, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Extent {
    let ta = times(projection.texel_from_place, vec3<f32>(a.xy, 1.0));
    let tb = times(projection.texel_from_place, vec3<f32>(b.xy, 1.0));
    let tc = times(projection.texel_from_place, vec3<f32>(c.xy, 1.0));
    var extent = Extent(vec2<f32>(3.0e38), vec2<f32>(-3.0e38));
    extent = grown_by_corner(projection, extent, ta);
    extent = grown_by_corner(projection, extent, tb);
    extent = grown_by_corner(projection, extent, tc);
    extent = grown_by_crossing(projection, extent, ta, tb);
    extent = grown_by_crossing(projection, extent, tb, tc);
    return grown_by_crossing(projection, extent, tc, ta);
}

// The line on which an edge's function, times what is positive before the horizon, is zero
// among centred texels: its coefficients of x and y, its constant, and what float32 may round of the
// function within `reach` of the axis.
fn line_of_edge(projection: Projection, edge: vec3<f32>, reach: vec2<f32>) -> vec4<f32> {
    let rows = projection.place_from_texel;
    let line = edge.x * rows[0].xyz + edge.y * rows[1].xyz + edge.z * rows[2].xyz;
    let sizes = abs(edge.x * rows[0].xyz) + abs(edge.y * rows[1].xyz) + abs(edge.z * rows[2].xyz);
    return vec4<f32>(line, FUNCTION_ROUNDING * dot(sizes, vec3<f32>(reach, 1.0)));
}

// A bound of an edge's function, times what is positive before the horizon, in a box of centred texels.
fn greatest_of_edge(projection: Projection, edge: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> f32 {
    let line = line_of_edge(projection, edge, abs(middle) + reach);
    return dot(line.xy, middle) + line.z + dot(abs(line.xy), reach) + line.w;
}

// Centred texel times w, and w: what depths are divided by before they are interpolated along lines of
// the map.
fn homogeneous_texel(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return times(projection.texel_from_place, vec3<f32>(q.xy, 1.0));
}

// Positive in the half of space that corners can be taken from to the map: before the horizon.
fn side_from_projected(projection: Projection, q: vec3<f32>) -> f32 {
    return homogeneous_texel(projection, q).z - projection.least_w;
}
