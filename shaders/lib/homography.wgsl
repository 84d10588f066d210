// Rays that are parallel or nearly so and a homography of their places, in whose map edges are straight. With H the
// homography and k the convergence, one over how far before the origin the rays meet,
//
//   homogeneous straight texel = H (q.x, q.y, 1 + k q.z)        depth = q.z
//
// The place of a ray is where it crosses the plane q.z = 0. The horizon is the line of places whose last coordinate,
// w, is zero; nothing behind it is in the map. The rays meet farther away than anything is from the origin, so
// that 1 + k q.z is near to one: what float32 knows of a depth does not shrink with the light's distance.
#import lib/parallel_rays

// How wide the rays of a bundle are at a depth, against where they cross the plane of places.
fn width_at(projection: Projection, depth: f32) -> f32 {
    if converges {
        return fma(projection.convergence, depth, 1.0);
    }
    return 1.0;
}

fn place_from_projected(projection: Projection, q: vec3<f32>) -> vec2<f32> {
    return q.xy / width_at(projection, q.z);
}

fn homogeneous_from_projected(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(q.xy, width_at(projection, q.z));
}

fn projected_from_ray(projection: Projection, ray: vec3<f32>, depth: f32) -> vec3<f32> {
    return vec3<f32>(ray.xy * width_at(projection, depth), depth);
}

fn ray_from_projected(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(place_from_projected(projection, q), 1.0);
}

// The slope of the plane against the axis and its depth there: what is over a plane's height would not be precise on
// a steep one.
fn depth_plane(projection: Projection, normal: vec3<f32>, q: vec3<f32>, height: f32) -> vec3<f32> {
    let slope = -normal.xy / normal.z;
    return vec3<f32>(slope, q.z - dot(slope, q.xy));
}

// A quotient of linear functions of the place, as the ray at a place leaves the axis.
fn depth_on_plane(projection: Projection, plane: vec3<f32>, ray: vec3<f32>) -> f32 {
    let depth = fma(plane.x, ray.x, fma(plane.y, ray.y, plane.z));
    if converges {
        return depth / (1.0 - projection.convergence * dot(plane.xy, ray.xy));
    }
    return depth;
}

// A texel behind the horizon has the negative of a ray, which no triangle covers.
fn straight_ray(projection: Projection, texel: vec2<f32>) -> vec3<f32> {
    let ray = times(projection.place_from_texel, vec3<f32>(texel, 1.0));
    return ray / abs(ray.z);
}

// Centred texel times w, and w: what depths are divided by before they are interpolated along lines of
// the map.
fn straight_texel(projection: Projection, q: vec3<f32>) -> vec3<f32> {
    return times(projection.texel_from_place, homogeneous_from_projected(projection, q));
}

fn times(rows: array<vec4<f32>, 3>, v: vec3<f32>) -> vec3<f32> {
    return vec3<f32>(dot(rows[0].xyz, v), dot(rows[1].xyz, v), dot(rows[2].xyz, v));
}

// The product of a plane's normal (a covector of projection space) with the direction of the ray through a place.
fn steepness_at(projection: Projection, normal: vec3<f32>, place: vec2<f32>) -> f32 {
    if converges {
        return fma(projection.convergence, dot(normal.xy, place), normal.z);
    }
    return normal.z;
}

// How a place moves as its texel does by a step: the quotient's difference, in which nothing cancels.
fn place_step(projection: Projection, place: vec2<f32>, step: vec2<f32>) -> vec2<f32> {
    let w = dot(projection.texel_from_place[2].xyz, vec3<f32>(place, 1.0));
    let x = dot(projection.place_from_texel[0].xy, step);
    let y = dot(projection.place_from_texel[1].xy, step);
    let z = dot(projection.place_from_texel[2].xy, step);
    // A neighbour near the horizon is taken for a nearer one.
    return w * (vec2<f32>(x, y) - place * z) / max(1.0 + w * z, 0.1);
}

// How a place moves per texel along an axis: the columns of the derivative.
fn place_slopes(projection: Projection, place: vec2<f32>) -> mat2x2<f32> {
    let w = dot(projection.texel_from_place[2].xyz, vec3<f32>(place, 1.0));
    let x = projection.place_from_texel[0];
    let y = projection.place_from_texel[1];
    let z = projection.place_from_texel[2];
    return mat2x2<f32>(
        w * (vec2<f32>(x.x, y.x) - place * z.x),
        w * (vec2<f32>(x.y, y.y) - place * z.y),
    );
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

// Least and greatest depth of a plane in a box of centred texels, rounding included. Along any line before the
// horizon depth grows or falls all the way, so the extremes are at corners. A plane that most nearly holds the rays is
// given no bound.
fn straight_depths_in_box(projection: Projection, plane: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> vec2<f32> {
    let x = middle.x + reach.x * vec4<f32>(-1.0, 1.0, -1.0, 1.0);
    let y = middle.y + reach.y * vec4<f32>(-1.0, -1.0, 1.0, 1.0);
    let rows = projection.place_from_texel;
    let across = plane.x * rows[0] + plane.y * rows[1];
    let line = across + plane.z * rows[2];
    let sizes = abs(plane.x * rows[0]) + abs(plane.y * rows[1]) + abs(plane.z * rows[2]);
    let w = rows[2].x * x + rows[2].y * y + rows[2].z;
    var left = w;
    if converges {
        left -= projection.convergence * (across.x * x + across.y * y + across.z);
    }
    let rounding = select(2.0, 4.0, converges) * FUNCTION_ROUNDING * (sizes.x * abs(x) + sizes.y * abs(y) + sizes.z);
    let low = (line.x * x + line.y * y + line.z - rounding) / left;
    let high = (line.x * x + line.y * y + line.z + rounding) / left;
    let is_before_horizon = all(w > vec4<f32>(0.0)) && all(left > 0.5 * w);
    return vec2<f32>(
        select(-FAR, min(min(low.x, low.y), min(low.z, low.w)), is_before_horizon),
        select(FAR, max(max(high.x, high.y), max(high.z, high.w)), is_before_horizon),
    );
}

// Height over the plane through a point, per texel along each axis.
fn straight_height_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    return width_at(projection, q.z) * normal.xy * place_slopes(projection, place_from_projected(projection, q));
}

// Depth per texel of the plane through a point.
fn straight_depth_slope(projection: Projection, normal: vec3<f32>, q: vec3<f32>) -> vec2<f32> {
    let place = place_from_projected(projection, q);
    let slope = -normal.xy / steepness_at(projection, normal, place);
    return width_at(projection, q.z) * slope * place_slopes(projection, place);
}

// Depth of the plane through a point where a ray `step` texels away meets it.
fn straight_depth_of_neighbour(projection: Projection, normal: vec3<f32>, q: vec3<f32>, step: vec2<f32>) -> f32 {
    let place = place_from_projected(projection, q);
    let moved = place_step(projection, place, step);
    let own = steepness_at(projection, normal, place);
    var steepness = own;
    if converges {
        let there = fma(projection.convergence, dot(normal.xy, moved), own);
        // A neighbour whose ray runs along the plane, or away from it, is taken for one that meets it.
        let least = 0.1 * abs(own);
        steepness = select(max(there, least), min(there, -least), own < 0.0);
    }
    return q.z + width_at(projection, q.z) * dot(-normal.xy / steepness, moved);
}

fn straight_extent(projection: Projection, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> Extent {
    let ta = straight_texel(projection, a);
    let tb = straight_texel(projection, b);
    let tc = straight_texel(projection, c);
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
fn straight_line_of_edge(projection: Projection, edge: vec3<f32>, reach: vec2<f32>) -> vec4<f32> {
    let rows = projection.place_from_texel;
    let line = edge.x * rows[0].xyz + edge.y * rows[1].xyz + edge.z * rows[2].xyz;
    let sizes = abs(edge.x * rows[0].xyz) + abs(edge.y * rows[1].xyz) + abs(edge.z * rows[2].xyz);
    return vec4<f32>(line, FUNCTION_ROUNDING * dot(sizes, vec3<f32>(reach, 1.0)));
}

// A bound of an edge's function, times what is positive before the horizon, in a box of centred texels.
fn straight_greatest_of_edge(projection: Projection, edge: vec3<f32>, middle: vec2<f32>, reach: vec2<f32>) -> f32 {
    let line = straight_line_of_edge(projection, edge, abs(middle) + reach);
    return dot(line.xy, middle) + line.z + dot(abs(line.xy), reach) + line.w;
}
