// Which texels of a map a triangle covers: bounds, and the test of one texel.
#import projection
#import target
#import warp
#import caster
#import mask
#import paging
#import lib/work_items

struct Job {
    projection: Projection,
    triangle_count: u32,
    coarse_shift: u32,                  // binary logarithm of the side of a coarse tile
    tile_bits: vec2<u32>,               // that a tile's column and row take in an item's part
    band_bits: u32,                     // the same of a band
    has_bands: u32,                     // 0 where a part is of all bands
    steps_per_depth: f32,               // that stored depths are rounded down to in a part
    last_step: f32,
}

// Load it once, before any loop, and pass it on: a software driver reads a uniform anew at each use.
@group(0) @binding(0) var<uniform> job_uniform: Job;

// Texels, inclusive.
struct Bound {
    first: vec2<i32>,
    last: vec2<i32>,
}

// A conservative extent of the triangle in texels from the map's corner, rounding included.
fn extent_in_map(projection: Projection, corners: Corners) -> Extent {
    let extent = texels_of_triangle(projection, corners.a, corners.b, corners.c);
    let slack = TEXEL_ROUNDING + SHORT_ROUNDING * max(abs(extent.low), abs(extent.high));
    return Extent(extent.low - slack + projection.centre, extent.high + slack + projection.centre);
}

// A box of centred texels before the warp.
struct Box {
    middle: vec2<f32>,
    reach: vec2<f32>,
}

// That the texels of a bound lie in, rounding included.
fn box_of_bound(projection: Projection, warp: Warp, bound: Bound) -> Box {
    let size = vec2<f32>(projection.size);
    let linear = linear_bound(warp, bound.first, bound.last, projection.size);
    return Box(
        0.5 * (linear.xy + linear.zw) * size - projection.centre,
        0.5 * (linear.zw - linear.xy) * size + TEXEL_ROUNDING,
    );
}

fn greatest_of_edges(projection: Projection, edges: mat3x3<f32>, box: Box) -> vec3<f32> {
    return vec3<f32>(
        greatest_of_edge(projection, edges[0], box.middle, box.reach),
        greatest_of_edge(projection, edges[1], box.middle, box.reach),
        greatest_of_edge(projection, edges[2], box.middle, box.reach),
    );
}

// Whether the triangle may cover a texel of the box: no edge has all of it outside.
fn may_cover(projection: Projection, triangle: Triangle, box: Box) -> bool {
    let edges = mat3x3<f32>(triangle.edge0, triangle.edge1, triangle.edge2);
    return all(greatest_of_edges(projection, edges, box) >= vec3<f32>(0.0));
}

// Whether it covers every texel of the box: each edge has all of it inside.
fn covers_all(projection: Projection, triangle: Triangle, box: Box) -> bool {
    let edges = mat3x3<f32>(-triangle.edge0, -triangle.edge1, -triangle.edge2);
    return all(greatest_of_edges(projection, edges, box) < vec3<f32>(0.0));
}

// The texels whose centres, at half-integers, are in an extent.
fn bound_of_extent(projection: Projection, extent: Extent) -> Bound {
    let size = vec2<f32>(projection.size);
    let first = clamp(ceil(extent.low - 0.5), vec2<f32>(0.0), size);
    let last = clamp(floor(extent.high - 0.5), vec2<f32>(-1.0), size - 1.0);
    return Bound(vec2<i32>(first), vec2<i32>(last));
}

// A bound of the texels that an extent before the warp may cover; empty where it is outside the map.
fn warped_bound_of_extent(projection: Projection, warp: Warp, extent: Extent) -> Bound {
    let size = vec2<f32>(projection.size);
    let is_outside = any(extent.low > size) || any(extent.high < vec2<f32>(0.0));
    let low = clamp(extent.low / size, vec2<f32>(0.0), vec2<f32>(1.0));
    let high = clamp(extent.high / size, vec2<f32>(0.0), vec2<f32>(1.0));
    let image = warped_bound(warp, low, high);
    let bound = bound_of_extent(projection, Extent(image.xy * size - TEXEL_ROUNDING, image.zw * size + TEXEL_ROUNDING));
    return Bound(bound.first, select(bound.last, vec2<i32>(-1), is_outside));
}

// Whether triangles out of the range of depths are left out before their texels are.
override culls_by_depth: bool = true;

fn is_out_of_depth(projection: Projection, depths: vec2<f32>) -> bool {
    if !culls_by_depth {
        return false;
    }
    return depths.x > projection.z_max || clamp_to_nearest(depths.y, projection.z_floor) < projection.z_min;
}

// Where the edges cross a line along an axis, as lines place = slope * across + offset: those that
// bound it from below and those that bound it from above, a little more rather than less.
struct Sides {
    low_slope: vec3<f32>,
    low_offset: vec3<f32>,
    high_slope: vec3<f32>,
    high_offset: vec3<f32>,
}

// The functions of the edges: along * place + across * place across + constant, positive inside.
fn sides_along(along: vec3<f32>, across: vec3<f32>, constant: vec3<f32>, rounding: vec3<f32>) -> Sides {
    let is_low = along > vec3<f32>(0.0);
    let is_high = along < vec3<f32>(0.0);
    let inverse = 1.0 / select(vec3<f32>(1.0), along, is_low | is_high);
    let slope = -across * inverse;
    let offset = -constant * inverse;
    let slack = TEXEL_ROUNDING + rounding * abs(inverse);
    return Sides(
        select(vec3<f32>(0.0), slope, is_low),
        select(vec3<f32>(-1.0e6), offset - slack, is_low),
        select(vec3<f32>(0.0), slope, is_high),
        select(vec3<f32>(1.0e6), offset + slack, is_high),
    );
}

// What of the lines from `low` to `high` across may be inside.
fn span_of(sides: Sides, low: f32, high: f32) -> vec2<f32> {
    let from_place = sides.low_offset + min(sides.low_slope * low, sides.low_slope * high);
    let to_place = sides.high_offset + max(sides.high_slope * low, sides.high_slope * high);
    return vec2<f32>(
        max(max(from_place.x, from_place.y), from_place.z),
        min(min(to_place.x, to_place.y), to_place.z),
    );
}

// The lines of the three edges: a coefficient each.
struct Lines {
    x: vec3<f32>,
    y: vec3<f32>,
    constant: vec3<f32>,
    rounding: vec3<f32>,
}

fn lines_of_triangle(projection: Projection, triangle: Triangle) -> Lines {
    let reach = max(abs(projection.centre), abs(vec2<f32>(projection.size) - projection.centre));
    let l0 = line_of_edge(projection, triangle.edge0, reach);
    let l1 = line_of_edge(projection, triangle.edge1, reach);
    let l2 = line_of_edge(projection, triangle.edge2, reach);
    return Lines(
        vec3<f32>(l0.x, l1.x, l2.x),
        vec3<f32>(l0.y, l1.y, l2.y),
        vec3<f32>(l0.z, l1.z, l2.z),
        vec3<f32>(l0.w, l1.w, l2.w),
    );
}

// Whether the ray of a texel meets the caster; through an edge that two share it meets both.
fn is_covered(caster: Caster, ray: vec3<f32>) -> bool {
    let e = edges_at(caster.triangle, ray);
    return min(min(e.x, e.y), e.z) >= 0.0 && max(max(e.x, e.y), e.z) > 0.0;
}

// Draws a texel that the caster covers, where its ray meets it in the range of depths and not in a hole.
fn store_covered(projection: Projection, caster: Caster, id: u32, texel: vec2<i32>, ray: vec3<f32>) {
    let z = clamp_to_nearest(depth_of_caster(projection, caster, ray), projection.z_floor);
    let is_in_range = z >= projection.z_min && z <= projection.z_max;
    let index = index_of_texel(projection, vec2<u32>(texel));
    if is_in_range && is_stored(index) && is_solid(id, edges_at(caster.triangle, ray)) {
        store_texel(index, stored_depth(projection, z), id);
    }
}
