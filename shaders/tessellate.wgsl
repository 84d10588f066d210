// Linear rasterization, as published: corners go through projection and warp, and edges are straight between
// them. Triangles are split first, until no edge is longer than a share of the map (Rosen, section 6.1 and
// Table 3).
//
//   begin      a triangle an invocation: cut where the projection ends or far off the map, then settled;
//   refine     a piece an invocation, in rounds: settled;
//   finish     what the last round would split again: kept as it is.
//
// To settle is to write a piece for the rasterizer, or to split it at the middles of its long edges for the
// next round. An edge alone tells whether and where it is split, so that neighbours fit without cracks.
// Where a warp is torn between two of its functions no splitting makes an edge short: there it ends with what
// is no longer, or much thinner, than a function is wide. Not even there where straight edges are curved in the map,
// of a paraboloid: corners in a line can leave an area for ever. The last round ends that.
#import projection
#import warp
#import lib/counters
#import lib/edges
#import lib/invocations
#import lib/pieces

// Not yet in the map, because it may be split.
struct Unfinished {
    a: vec3<f32>,
    triangle: u32,
    b: vec3<f32>,
    c: vec3<f32>,
}

struct Tessellation {
    projection: Projection,
    triangle_count: u32,
    longest_edge: f32,                  // as a share of the map
    rounding: f32,                      // of a place, as a share of the map
}

@group(0) @binding(0) var<uniform> job_uniform: Tessellation;
@group(0) @binding(4) var<storage, read_write> counters: Counters;
@group(0) @binding(5) var<storage, read_write> pieces: array<Piece>;
@group(0) @binding(6) var<storage, read> unfinished: array<Unfinished>;
@group(0) @binding(7) var<storage, read_write> split: array<Unfinished>;
// Arguments of the next indirect dispatch.
@group(0) @binding(8) var<storage, read_write> next_groups: array<u32, 3>;

// ---- corners ----

struct Corner {
    place: vec4<f32>,                   // as in a piece
    linear: vec2<f32>,                  // before the warp, in [0, 1] on the map
    sides: u32,                         // of the map that it is beyond, a bit each
}

fn corner_from_projected(projection: Projection, warp: Warp, q: vec3<f32>) -> Corner {
    let size = vec2<f32>(projection.size);
    var texel = centred_texel_from_projected(projection, q);
    let linear = (texel + projection.centre) / size;
    if IS_WARPED {
        // Beyond its ends a warp moves nothing.
        let inside = clamp(linear, vec2<f32>(0.0), vec2<f32>(1.0));
        let warped = warped_from_linear(warp, inside).uv + (linear - inside);
        texel = warped * size - projection.centre;
    }
    let sides = u32(linear.x < 0.0) | (u32(linear.y < 0.0) << 1u)
        | (u32(linear.x > 1.0) << 2u) | (u32(linear.y > 1.0) << 3u);
    let place = vec4<f32>(texel, depth_from_projected(q), homogeneous_texel(projection, q).z);
    return Corner(place, linear, sides);
}

fn is_too_long(job: Tessellation, seam_width: f32, a: Corner, b: Corner) -> bool {
    let length_in_map = length((a.place.xy - b.place.xy) / vec2<f32>(job.projection.size));
    let step = abs(a.linear - b.linear);
    // What lies beyond one side of the map needs no better edge.
    return length_in_map > job.longest_edge && (a.sides & b.sides) == 0u
        && max(step.x, step.y) > seam_width;
}

// ---- settling ----

fn append_piece(triangle: u32, a: vec4<f32>, b: vec4<f32>, c: vec4<f32>) {
    let slot = atomicAdd(&counters.pieces, 1u);
    if slot < arrayLength(&pieces) {
        pieces[slot] = Piece(a, b, c, triangle);
    } else {
        atomicAdd(&counters.lost, 1u);
    }
}

fn append_split(triangle: u32, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) {
    let slot = atomicAdd(&counters.next_unfinished, 1u);
    if slot < arrayLength(&split) {
        split[slot] = Unfinished(a, triangle, b, c);
    } else {
        atomicAdd(&counters.lost, 1u);
    }
}

// Of an edge in the linear map; from the same end for both triangles at it.
fn middle(projection: Projection, a: vec3<f32>, b: vec3<f32>) -> vec3<f32> {
    let swap = is_before(b, a);
    let from_end = select(a, b, swap);
    let to_end = select(b, a, swap);
    let w = homogeneous_texel(projection, from_end).z;
    return mix(from_end, to_end, w / (w + homogeneous_texel(projection, to_end).z));
}

fn settle(job: Tessellation, warp: Warp, triangle: u32, qa: vec3<f32>, qb: vec3<f32>, qc: vec3<f32>) {
    let projection = job.projection;
    let a = corner_from_projected(projection, warp, qa);
    let b = corner_from_projected(projection, warp, qb);
    let c = corner_from_projected(projection, warp, qc);
    // A corner in the light has no place: not a number.
    let sum = a.place.xy + b.place.xy + c.place.xy;
    if (a.sides & b.sides & c.sides) != 0u || any(sum != sum) {
        return;
    }
    let seam_width = width_of_function(warp);
    let ab_is_long = is_too_long(job, seam_width, a, b);
    let bc_is_long = is_too_long(job, seam_width, b, c);
    let ca_is_long = is_too_long(job, seam_width, c, a);
    let long = u32(ab_is_long) + u32(bc_is_long) + u32(ca_is_long);
    let ab = b.linear - a.linear;
    let ac = c.linear - a.linear;
    // And what is thinner than its rounding has no end either.
    let thin = max(seam_width * seam_width / 16.0, job.rounding * job.longest_edge);
    let is_thin = abs(ab.x * ac.y - ab.y * ac.x) < thin;
    if long == 0u || is_thin {
        append_piece(triangle, a.place, b.place, c.place);
        return;
    }
    // Turned so that the first edge is long, and the last one is not if another is not.
    var turned = array<vec3<f32>, 3>(qa, qb, qc);
    if (long == 1u && bc_is_long) || (long == 2u && !ab_is_long) {
        turned = array<vec3<f32>, 3>(qb, qc, qa);
    } else if (long == 1u && ca_is_long) || (long == 2u && !bc_is_long) {
        turned = array<vec3<f32>, 3>(qc, qa, qb);
    }
    let first = middle(projection, turned[0], turned[1]);
    let second = middle(projection, turned[1], turned[2]);
    let third = middle(projection, turned[2], turned[0]);
    if long == 1u {
        append_split(triangle, turned[0], first, turned[2]);
        append_split(triangle, first, turned[1], turned[2]);
        return;
    }
    append_split(triangle, first, turned[1], second);
    if long == 2u {
        append_split(triangle, turned[0], first, second);
        append_split(triangle, turned[0], second, turned[2]);
        return;
    }
    append_split(triangle, turned[0], first, third);
    append_split(triangle, third, second, turned[2]);
    append_split(triangle, first, second, third);
}

// ---- cutting ----

// Maps from the middle to the sides of the band that far triangles are cut to. What reaches out of it is cut
// at it, so that an edge is cut alike for both triangles at it.
const BAND: f32 = 16.0;

// Positive on the side of cut `i` that is kept: before the end of the projection, or within the band.
// Linear in q.
fn side_of_cut(projection: Projection, q: vec3<f32>, i: u32) -> f32 {
    let texel = homogeneous_texel(projection, q);
    let reach = BAND * vec2<f32>(projection.size) * texel.z;
    let low = reach + texel.xy;
    let high = reach - texel.xy;
    let sides = array<f32, 5>(side_from_projected(projection, q), low.x, low.y, high.x, high.y);
    return sides[i];
}

// Rounding of such a corner would move the edges that end there.
fn is_far_off(projection: Projection, q: vec3<f32>) -> bool {
    let texel = homogeneous_texel(projection, q);
    let reach = BAND * vec2<f32>(projection.size) * texel.z;
    return side_from_projected(projection, q) <= 0.0 || any(abs(texel.xy) > reach);
}

// From the same end for both triangles at the edge.
fn crossing(projection: Projection, a: vec3<f32>, b: vec3<f32>, i: u32) -> vec3<f32> {
    let swap = is_before(b, a);
    let from_end = select(a, b, swap);
    let to_end = select(b, a, swap);
    let side = side_of_cut(projection, from_end, i);
    return mix(from_end, to_end, side / (side - side_of_cut(projection, to_end, i)));
}

@compute @workgroup_size(GROUP)
fn begin(invocation: Invocation) {
    let job = job_uniform;
    let projection = job.projection;
    let warp = load_warp();
    let id = index_of_invocation(invocation, GROUP);
    if id >= job.triangle_count {
        return;
    }
    if id == 0u {
        counters.is_linear = 1u;
    }
    let loaded = load_corners(projection, id);
    let q = array<vec3<f32>, 3>(loaded.a, loaded.b, loaded.c);
    var corners: array<vec3<f32>, 8>;
    corners[0] = q[0];
    corners[1] = q[1];
    corners[2] = q[2];
    var count = 3u;
    let is_cut = is_far_off(projection, q[0]) || is_far_off(projection, q[1]) || is_far_off(projection, q[2]);
    let cuts = select(0u, CUTS, is_cut);
    // Sutherland and Hodgman, "Reentrant polygon clipping", 1974.
    for (var cut = 0u; cut < cuts; cut += 1u) {
        var kept: array<vec3<f32>, 8>;
        var kept_count = 0u;
        for (var i = 0u; i < count; i += 1u) {
            let a = corners[i];
            let b = corners[select(i + 1u, 0u, i + 1u == count)];
            let a_is_kept = side_of_cut(projection, a, cut) > 0.0;
            if a_is_kept {
                kept[kept_count] = a;
                kept_count += 1u;
            }
            if a_is_kept != (side_of_cut(projection, b, cut) > 0.0) {
                kept[kept_count] = crossing(projection, a, b, cut);
                kept_count += 1u;
            }
        }
        corners = kept;
        count = kept_count;
    }
    for (var i = 2u; i < count; i += 1u) {
        settle(job, warp, id, corners[0], corners[i - 1u], corners[i]);
    }
}

@compute @workgroup_size(1)
fn prepare_refine() {
    let next = atomicExchange(&counters.next_unfinished, 0u);
    counters.current_unfinished = min(next, arrayLength(&unfinished));
    counters.most_unfinished = max(counters.most_unfinished, next);
    next_groups = groups_for(counters.current_unfinished);
}

fn settle_unfinished(job: Tessellation, invocation: Invocation) {
    let index = index_of_invocation(invocation, GROUP);
    if index >= counters.current_unfinished {
        return;
    }
    let piece = unfinished[index];
    settle(job, load_warp(), piece.triangle, piece.a, piece.b, piece.c);
}

@compute @workgroup_size(GROUP)
fn refine(invocation: Invocation) {
    settle_unfinished(job_uniform, invocation);
}

@compute @workgroup_size(GROUP)
fn finish(invocation: Invocation) {
    var job = job_uniform;
    job.longest_edge = FAR;
    settle_unfinished(job, invocation);
}
