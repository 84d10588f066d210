// The shadow test of every pixel: its receiver against what the texels around it hold.
//
//   depth     The receiver's texel holds the depth of the nearest caster on the ray through the texel's
//             centre. With `receiver_plane` the receiver's own plane is evaluated on that ray too, so
//             that a lit plane meets itself at any incidence and only rounding is left to a bias.
//   triangle  The receiver's own light ray against the triangles that the texels around it hold: no
//             false shadow, and no bias; a caster that no texel there saw is missed. Related: Lecocq
//             et al., "Sub-pixel shadow maps", 2014.
//   auto      In shadow if a triangle of the 3 x 3 texels is hit, or if nearly all depth tests there say
//             so, weighed bilinearly: the second finds casters smaller than a texel, which the first misses.
//   pcf       The share of depth tests in a disc around the receiver that find it lit (Reeves et al.,
//             "Rendering antialiased shadows with depth maps", 1987). Rosen, section 6.2: a disc in the
//             warped map antialiases edges; one across the light's rays, warped at the last possible
//             moment, makes them soft.
//   revectorized   The depth test in the receiver's own texel, with edges that run straight where those of the
//             texels are stairs (Bondarev, "Shadow map silhouette revectorization", I3D 2014).
#import projection
#import warp
#import lib/axes
#import lib/bias
#import lib/receivers
#import lib/lookup_place
#import lib/image_tiles
#import lib/edges
#import lib/seams
#import mask
#import paging
#import stored

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(6) var<storage, read_write> visibility: array<u32>;

// Texels on each side of the receiver's own: 0, 1 or 2 for 1, 3 x 3 or 5 x 5.
override reach: i32 = 0;
override uses_triangles: bool = false;
override uses_depths: bool = true;
// Depth tests in the disc of `pcf`; 0 for the other ways.
override samples: u32 = 0u;
// Whether the disc lies across the receiver's light ray, in world units, or in the warped map, in texels.
override is_unwarped: bool = false;
// Whether tests in the disc weigh less the farther they are from its middle, and whether each pixel turns it.
override is_gaussian: bool = false;
override is_jittered: bool = false;
// Whether edges of the depth tests are straight where those of the texels are stairs.
override is_revectorized: bool = false;

// What share of the depth tests must agree in `auto`, each by its bilinear weight. A triangle that several
// texels hold is large, and its own test knows better where its shadow ends. Where most texels hold something
// nearer and each another triangle, these are smaller than texels, and none saw those that make the edge. Less
// than four of nine may be a caster that is thinner than a texel, beside the receiver. Of all thirtieths these
// leave about the fewest wrong pixels over 32 suns and 32 point lights in eight scenes, 28 suns over the built-in
// ones and 4 more over 1.1 million triangles on a floor, with maps of 400 to 1024 texels.
const AGREEING: f32 = 0.9;
const AGREEING_OF_SMALL: f32 = 0.6;
// The bits of the receiver's own texel and of those beside it.
const NINE: u32 = 0x1ffu;
const NINE_OF_25: u32 = 0x739c0u;

// Texels that an edge is followed on each side of a receiver, at most.
const MAX_RUN: i32 = 16;

@compute @workgroup_size(IMAGE_TILE.x)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let warp = load_warp();
    let first = first_pixel(group, local);
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = first.y + i;
        let pixel = row * receivers.width + first.x;
        if first.x < receivers.width && row < receivers.height && is_chosen(pixel) {
            let receiver = load_receiver(receivers, first.x, row);
            if receiver.faces_light {
                let lit = lit_share(receivers, projection, warp, receiver, vec2<u32>(first.x, row));
                if lit != UNKNOWN && !is_asking() {
                    visibility[pixel] = bitcast<u32>(lit);
                }
            }
        }
    }
}

// Of a receiver that the map says nothing of: on the border of two layers the other one may. Until then it is lit.
const UNKNOWN: f32 = -1.0;

fn lit_share(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    receiver: Receiver,
    pixel: vec2<u32>,
) -> f32 {
    let start = place_of_lookup(receivers, projection, warp, receiver);
    let size = vec2<f32>(projection.size);
    // Off the map there is no caster.
    if !is_on_map(size, start.centred + projection.centre) {
        return UNKNOWN;
    }
    let own_patch = patch_of(warp, start.warped, projection.size);
    // The receiver's own texel, or the one beside it whose centre is of the same patch.
    let own = clamp(vec2<i32>(floor(start.place)), own_patch.low, own_patch.high);
    var middle = clamp(own, vec2<i32>(0), vec2<i32>(projection.size) - 1);
    // Alone it may lie on the inner side of an edge-on surface: then the one across the seam is asked.
    let outside = vec2<i32>(floor(start.place)) - own;
    var is_torn_off = !is_rectilinear && reach == 0 && start.is_edge_on && any(outside != vec2<i32>(0));
    while is_torn_off {
        is_torn_off = false;
        let side = select(vec2<i32>(0, sign(outside.y)), vec2<i32>(sign(outside.x), 0), outside.x != 0);
        let across = texel_across(warp, start.linear, start.warped, side, projection.size);
        middle = clamp(across, vec2<i32>(0), vec2<i32>(projection.size) - 1);
    }
    let bias = bias_of_receiver(receivers, projection, receiver, start.normal);
    let plane = ReceiverPlane(receiver.q, bias, receiver.triangle, start);
    if samples > 0u {
        return share_in_disc(receivers, projection, warp, receiver, plane, own_patch, middle, pixel);
    }
    if is_revectorized {
        return lit_by_silhouette(receivers, projection, warp, plane, own_patch, middle);
    }
    var around = Around(0u, 0u, 0u, 0u, 0u, NO_TRIANGLE);
    var ids: array<u32, 25>;            // of the triangles across seams
    look_beside(receivers, projection, warp, plane, own_patch, middle, &around);
    look_across_seams(receivers, projection, warp, plane, own_patch, middle, &around, &ids);

    let lit = select(1.0, UNKNOWN, around.texels == 0u);
    var hit = uses_depths && is_behind(around, start.place - vec2<f32>(middle) - 0.5);
    if !uses_triangles {
        return select(lit, 0.0, hit);
    }
    var candidates = around.candidates;
    while candidates != 0u && !hit {
        let place = i32(firstTrailingBit(candidates));
        candidates &= candidates - 1u;
        let side = 2 * reach + 1;
        let texel = middle + vec2<i32>(place % side, place / side) - reach;
        var id = stored_at(projection, texel).triangle;
        if !is_rectilinear {
            id = select(id, ids[place], ((around.moved >> u32(place)) & 1u) != 0u);
        }
        hit = hits(projection, id, plane, receivers.margin);
    }
    return select(lit, 0.0, hit);
}

fn stored_at(projection: Projection, texel: vec2<i32>) -> Stored {
    let index = index_looked_at(projection, vec2<u32>(texel));
    if !is_stored(index) {
        return Stored(3.0e38, NO_TRIANGLE);
    }
    return load_stored(index);
}

// A receiver in the light's projection, what is taken off its depth, and where it is looked up.
struct ReceiverPlane {
    q: vec3<f32>,
    bias: Bias,
    triangle: u32,
    start: LookupPlace,
}

// Of the texels around a receiver, a bit each.
struct Around {
    texels: u32,                        // that are on the map and before the receiver's surface
    nearer: u32,                        // of these, that hold something before the receiver's plane
    known: u32,                         // that hold a triangle that was seen before
    candidates: u32,                    // that hold another one, which may be met before the receiver
    moved: u32,                         // that lie across a seam
    previous: u32,                      // the triangle that was seen last
}

// Compares the texel of a bit with the receiver's plane, and gives the triangle that it holds.
fn look_at_texel(
    receivers: Receivers,
    projection: Projection,
    plane: ReceiverPlane,
    texel: vec2<i32>,
    linear: vec2<f32>,
    bit: u32,
    around: ptr<function, Around>,
) -> u32 {
    let step = linear * vec2<f32>(projection.size) - projection.centre - plane.start.centred;
    let stored = stored_at(projection, texel);
    let depth = least_lit_depth(receivers, projection, plane.q, plane.start.normal, plane.bias, step);
    if is_before_surface(plane.start, step) {
        (*around).texels |= bit;
        (*around).nearer |= select(0u, bit, stored_depth(projection, depth) > stored.depth);
    }
    return stored.triangle;
}

// The receiver's own texel and those beside it that are of the same patch.
fn look_beside(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    plane: ReceiverPlane,
    own_patch: Patch,
    middle: vec2<i32>,
    around: ptr<function, Around>,
) {
    var bit = 1u;
    // A triangle is tested once where it follows itself along the row or begins the row before.
    var above = NO_TRIANGLE;
    var first_of_row = NO_TRIANGLE;
    var neighbours = neighbours_of_texel(warp, middle, reach, projection.size);
    for (var y = -reach; y <= reach; y += 1) {
        above = first_of_row;
        for (var x = -reach; x <= reach; x += 1) {
            let texel = middle + vec2<i32>(x, y);
            let is_beside = all(texel >= own_patch.low) && all(texel <= own_patch.high);
            if is_beside || (x == 0 && y == 0) {
                let place = vec2<i32>(x, y) + reach;
                let linear = linear_from_neighbour(&neighbours, place, texel, projection.size);
                let id = look_at_texel(receivers, projection, plane, texel, linear, bit, around);
                if id == (*around).previous || id == above {
                    (*around).known |= bit;
                }
                if id != NO_TRIANGLE && id != plane.triangle {
                    (*around).candidates |= bit;
                }
                (*around).previous = id;
                first_of_row = select(first_of_row, id, x == -reach);
            }
            bit <<= 1u;
        }
    }
    (*around).candidates &= ~(*around).known;
}

// Across a seam, the texels around the nearest one there stand for those that would be beside the middle.
// Corners belong to the patches above and below.
fn look_across_seams(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    plane: ReceiverPlane,
    own_patch: Patch,
    middle: vec2<i32>,
    around: ptr<function, Around>,
    ids: ptr<function, array<u32, 25>>,
) {
    let outside = texels_outside(own_patch, middle, reach);
    var torn = seam_sides(warp, plane.start.warped, outside);
    while !is_rectilinear && reach > 0 && torn != 0u {
        let i = firstTrailingBit(torn);
        torn &= torn - 1u;
        let side = SIDES[i];
        let along = abs(side.yx);
        let nearest = texel_across(warp, plane.start.linear, plane.start.warped, side, projection.size);
        for (var j = 0; j < outside[i] * (2 * reach + 1); j += 1) {
            let step_out = j / (2 * reach + 1);
            let step_along = j % (2 * reach + 1) - reach;
            let texel = nearest + side * step_out + along * step_along;
            let beside = side * (reach + 1 - outside[i] + step_out) + along * step_along;
            let row = middle.y + beside.y;
            let is_corner = side.y == 0 && (row < own_patch.low.y || row > own_patch.high.y);
            if !is_corner && all(texel >= vec2<i32>(0)) && all(texel < vec2<i32>(projection.size)) {
                let place = u32((beside.y + reach) * (2 * reach + 1) + beside.x + reach);
                let bit = 1u << place;
                let there = linear_from_texel(warp, texel, projection.size);
                let id = look_at_texel(receivers, projection, plane, texel, there, bit, around);
                if id == (*around).previous {
                    (*around).known |= bit;
                } else if id != NO_TRIANGLE && id != plane.triangle {
                    (*around).candidates |= bit;
                }
                (*around).moved |= bit;
                (*ids)[place] = id;
                (*around).previous = id;
            }
        }
    }
}

// Whether the depths of the texels around say that the receiver is in shadow. It lies so far aside of the middle
// of its own texel.
fn is_behind(around: Around, aside: vec2<f32>) -> bool {
    let nine = select(NINE, NINE_OF_25, reach == 2);
    let ninths = 9u * countOneBits(around.nearer & nine) / max(countOneBits(around.texels & nine), 1u);
    let are_small = (around.nearer & around.known & nine) == 0u && ninths >= 6u;
    let agreeing = select(AGREEING, AGREEING_OF_SMALL, are_small);
    return ninths >= 4u && bilinear_share(around.nearer, aside) >= agreeing * bilinear_share(around.texels, aside);
}

// The weight of the texels whose bits are set, of which only the four around the receiver have any. The receiver
// lies so far aside of the middle of its own texel.
fn bilinear_share(bits: u32, aside: vec2<f32>) -> f32 {
    let middle = reach * (2 * reach + 1) + reach;
    let beside = select(-1, 1, aside.x > 0.0) * min(reach, 1);
    let above = select(-1, 1, aside.y > 0.0) * min(reach, 1) * (2 * reach + 1);
    let weights = min(abs(aside), vec2<f32>(0.5));
    let near = vec2<f32>(f32((bits >> u32(middle)) & 1u), f32((bits >> u32(middle + beside)) & 1u));
    let far = vec2<f32>(f32((bits >> u32(middle + above)) & 1u), f32((bits >> u32(middle + above + beside)) & 1u));
    return mix(mix(near.x, near.y, weights.x), mix(far.x, far.y, weights.x), weights.y);
}

fn texel_at(size: vec2<f32>, place: vec2<f32>) -> vec2<i32> {
    return vec2<i32>(clamp(floor(place), vec2<f32>(0.0), size - 1.0));
}

// A point of the disc is compared as the texel's own ray meets the receiver's plane there, so that a plane
// never shadows itself. What falls off the layer says nothing, nor what lies inside an edge-on surface: the mean
// is over the rest.
fn share_in_disc(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    receiver: Receiver,
    plane: ReceiverPlane,
    own_patch: Patch,
    middle: vec2<i32>,
    pixel: vec2<u32>,
) -> f32 {
    let size = vec2<f32>(projection.size);
    let axes = axes_across(normalize(receiver.from_light));
    let right_step = projected_from_offset(projection, axes.x * receivers.filter_radius);
    let up_step = projected_from_offset(projection, axes.y * receivers.filter_radius);
    let angle = turn_of_disc(pixel);
    let turn = vec2<f32>(cos(angle), sin(angle));
    var tests = 0.0;
    var lit = 0.0;
    for (var i = 0u; i < samples; i += 1u) {
        var offset = point_of_disc(i);
        // A Gaussian of half the radius.
        let weight = select(1.0, exp(-2.0 * dot(offset, offset)), is_gaussian);
        if is_jittered {
            offset = vec2<f32>(offset.x * turn.x - offset.y * turn.y, offset.x * turn.y + offset.y * turn.x);
        }
        var texel = plane.start.place + offset * receivers.filter_radius;
        if is_unwarped {
            let q = receiver.q + right_step * offset.x + up_step * offset.y;
            let linear = centred_texel_from_projected(projection, q) + projection.centre;
            texel = warped_from_linear(warp, linear / size).uv * size;
            texel = select(vec2<f32>(-1e8), texel, is_on_map(size, linear));
        }
        if is_on_map(size, texel) {
            var whole = texel_at(size, texel);
            whole = select(clamp(whole, own_patch.low, own_patch.high), whole, is_unwarped);
            // A patch without a texel may end before the map begins.
            whole = clamp(whole, vec2<i32>(0), vec2<i32>(projection.size) - 1);
            let step = step_to_texel(projection, warp, plane, whole);
            let counts = select(0.0, weight, is_before_surface(plane.start, step));
            tests += counts;
            lit += counts * f32(is_lit_at(receivers, projection, plane, whole, step));
        }
    }
    if tests == 0.0 {
        let step = step_to_texel(projection, warp, plane, middle);
        let is_lit = is_lit_at(receivers, projection, plane, middle, step);
        return select(UNKNOWN, f32(is_lit), is_before_surface(plane.start, step));
    }
    return lit / tests;
}

// The angle that a pixel turns the disc by, from a hash of its place (O'Neill, "PCG", 2014).
fn turn_of_disc(pixel: vec2<u32>) -> f32 {
    let state = (pixel.x + pixel.y * 65536u) * 747796405u + 2891336453u;
    let word = ((state >> ((state >> 28u) + 4u)) ^ state) * 277803737u;
    let hash = (word >> 22u) ^ word;
    return f32(hash >> 8u) * (6.2831853 / 16777216.0);
}

// Point i of a spiral that covers the unit disc evenly (Vogel, "A better way to construct the sunflower
// head", 1979), with two arms: points come in pairs opposite each other, so that their mean is the middle,
// where an odd number has one more.
fn point_of_disc(i: u32) -> vec2<f32> {
    let odd = samples & 1u;
    let pair = (i + odd) / 2u;
    let radius = sqrt(f32(2u * pair + 1u - odd) / f32(samples));
    let angle = f32(pair) * 1.9416111;           // half of the golden angle's complement
    let arm = 1.0 - 2.0 * f32((i + odd) & 1u);
    return arm * radius * vec2<f32>(cos(angle), sin(angle));
}

// From the receiver, in texels of the map before the warp.
fn step_to_texel(projection: Projection, warp: Warp, plane: ReceiverPlane, texel: vec2<i32>) -> vec2<f32> {
    let linear = linear_from_texel(warp, texel, projection.size);
    return linear * vec2<f32>(projection.size) - projection.centre - plane.start.centred;
}

fn is_lit_at(
    receivers: Receivers,
    projection: Projection,
    plane: ReceiverPlane,
    texel: vec2<i32>,
    step: vec2<f32>,
) -> bool {
    let depth = least_lit_depth_in_disc(receivers, projection, plane.q, plane.start.normal, plane.bias, step);
    let stored = stored_at(projection, texel);
    return stored_depth(projection, depth) <= stored.depth;
}

// The depth test in the receiver's own texel, but for what lies beyond the straight edge.
fn lit_by_silhouette(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    plane: ReceiverPlane,
    own_patch: Patch,
    middle: vec2<i32>,
) -> f32 {
    let step = step_to_texel(projection, warp, plane, middle);
    if !is_before_surface(plane.start, step) {
        return UNKNOWN;
    }
    let low = max(own_patch.low, vec2<i32>(0));
    let high = min(own_patch.high, vec2<i32>(projection.size) - 1);
    let is_lit = is_lit_at(receivers, projection, plane, middle, step);
    let own = Silhouette(Patch(low, high), middle, is_lit);
    let within = clamp(plane.start.place - vec2<f32>(middle), vec2<f32>(0.0), vec2<f32>(1.0));
    var is_beyond = false;
    for (var i = 0; i < 4; i += 1) {
        let across = SIDES[i];
        if differs(receivers, projection, warp, plane, own, middle + across) {
            let along = abs(across.yx);
            let before = end_of_edge(receivers, projection, warp, plane, own, across, -along);
            let after = end_of_edge(receivers, projection, warp, plane, own, across, along);
            let place = before.x + dot(within, vec2<f32>(along));
            // -1 at one end of the edge, 1 at the other.
            let relative = place * 2.0 / (before.x + after.x + 1.0) - 1.0;
            let inside = select(after.y, before.y, relative < 0.0) * abs(relative);
            is_beyond |= 0.5 - dot(within - 0.5, vec2<f32>(across)) < inside;
        }
    }
    return f32(is_lit != is_beyond);
}

// A receiver's own texel, what its depth test says, and the texels that lie side by side with it.
struct Silhouette {
    beside: Patch,
    middle: vec2<i32>,
    is_lit: bool,
}

// Whether a texel answers otherwise than the receiver's own. What is off the map or another patch's says nothing.
fn differs(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    plane: ReceiverPlane,
    own: Silhouette,
    texel: vec2<i32>,
) -> bool {
    if any(texel < own.beside.low) || any(texel > own.beside.high) {
        return false;
    }
    let step = step_to_texel(projection, warp, plane, texel);
    let is_lit = is_lit_at(receivers, projection, plane, texel, step);
    return is_lit != own.is_lit && is_before_surface(plane.start, step);
}

// Follows an edge to one side: it goes on as long as texels answer as the receiver's own and those across
// otherwise. Where one of the two changes, the straight edge crosses the middle of the next side of a texel. Gives
// along how many texels it goes on, and how far it ends in the receiver's side.
fn end_of_edge(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    plane: ReceiverPlane,
    own: Silhouette,
    across: vec2<i32>,
    along: vec2<i32>,
) -> vec2<f32> {
    for (var count = 1; count <= MAX_RUN; count += 1) {
        let texel = own.middle + along * count;
        let beside = texel + across;
        let low = min(texel, beside);
        let high = max(texel, beside);
        if any(low < own.beside.low) || any(high > own.beside.high) {
            return vec2<f32>(f32(count - 1), 0.0);
        }
        let is_other_here = differs(receivers, projection, warp, plane, own, texel);
        let is_other_beside = differs(receivers, projection, warp, plane, own, beside);
        if is_other_here || !is_other_beside {
            let inside = select(0.0, select(-0.5, 0.5, is_other_here), is_other_here == is_other_beside);
            return vec2<f32>(f32(count - 1), inside);
        }
    }
    return vec2<f32>(f32(MAX_RUN), 0.0);
}

// Whether a receiver's own ray meets a triangle before it. What reaches over its plane by no more than rounding
// cannot shadow it: edge-on the depths of both say nothing.
fn hits(projection: Projection, id: u32, plane: ReceiverPlane, margin: f32) -> bool {
    let ray = ray_from_projected(projection, plane.q);
    let corners = load_corners(projection, id);
    let triangle = triangle_from_corners(projection, id, corners);
    let e = edges_at(triangle, ray);
    let depth = clamp(depth_on_plane(projection, triangle.plane, ray), triangle.depths.x, triangle.depths.y);
    let is_before = depth < depth_from_projected(plane.q) - plane.bias.rounding;
    let heights = vec3<f32>(
        dot(plane.start.normal, corners.a - plane.q),
        dot(plane.start.normal, corners.b - plane.q),
        dot(plane.start.normal, corners.c - plane.q),
    );
    let is_level = plane.bias.is_edge_on && max(max(heights.x, heights.y), heights.z) <= margin;
    let is_met = min(min(e.x, e.y), e.z) >= 0.0 && max(max(e.x, e.y), e.z) > 0.0;
    return is_met && is_before && !is_level && is_solid(id, e);
}
