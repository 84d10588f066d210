// Rasterization: triangles to the nearest depth (and triangle) of each texel. Exact, along the texel's own
// ray; or linear, where the casters are pieces with straight edges in the map (caster/pieces.wgsl).
//
// Three entry points, one after the other:
//   bin    a triangle an invocation: culls, and lists the rest as items of work: a small triangle is
//          one item, a large one is cut into coarse tiles;
//   split  a coarse tile an invocation: lists the fine tiles in it that the triangle may cover;
//   walk   items to texels. No item has more than `small_area` texels, so that work is even and no
//          invocation comes near the 65,535 loop iterations after which some drivers stop in silence.
#import projection
#import warp
#import target
#import caster

// Lengths of the lists; also counts items beyond their capacity: the host then makes room and runs again.
struct Counters {
    items: atomic<u32>,
    coarse_tiles: atomic<u32>,
    outside: atomic<u32>,               // triangles whose bound holds no texel centre
    behind: atomic<u32>,                // triangles outside the range of depths
    pieces: u32,                        // from tessellate.wgsl
}

// A triangle and a tile, x and y in 16 bits each; WHOLE stands for the whole triangle.
struct Item {
    triangle: u32,
    tile: u32,
}

const WHOLE: u32 = 0xffffffffu;

struct Job {
    projection: Projection,
    triangle_count: u32,
    coarse_shift: u32,                  // binary logarithm of the side of a coarse tile
}

// Load it once, before any loop, and pass it on: a software driver reads a uniform anew at each use.
@group(0) @binding(0) var<uniform> job_uniform: Job;
@group(0) @binding(4) var<storage, read_write> counters: Counters;
@group(0) @binding(6) var<storage, read_write> items: array<Item>;
@group(0) @binding(7) var<storage, read_write> coarse_tiles: array<Item>;
// Arguments of the indirect dispatches of `split` and of `walk`.
@group(0) @binding(8) var<storage, read_write> split_groups: array<u32, 3>;
@group(0) @binding(9) var<storage, read_write> walk_groups: array<u32, 3>;
@group(0) @binding(2) var<storage, read_write> bin_groups: array<u32, 3>;

override items_per_invocation: u32 = 1u;
// Texels in the bound of an item at most: the square of the side of a fine tile.
override small_area: u32 = 256u;
override fine_shift: u32 = 4u;
// Texels that a lane walks before it looks for its next item.
override chunk: u32 = 8u;

const GROUP: u32 = 64u;

// Texels, inclusive.
struct Bound {
    first: vec2<i32>,
    last: vec2<i32>,
}

// ---- bounds ----

// A conservative bound of the texel centres that the triangle may cover.
fn bound_from_projected(
    projection: Projection,
    warp: Warp,
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
) -> Bound {
    let extent = texels_of_triangle(projection, a, b, c);
    // A texel is a candidate if its centre, at half-integers, is inside, give or take rounding.
    let slack = 0.01 + 1e-6 * max(abs(extent.low), abs(extent.high));
    let size = vec2<f32>(projection.size);
    var low = extent.low - slack + projection.centre;
    var high = extent.high + slack + projection.centre;
    if IS_WARPED {
        let is_outside = any(low > size) || any(high < vec2<f32>(0.0));
        let image = warped_bound(warp, clamp(low / size, vec2<f32>(0.0), vec2<f32>(1.0)), clamp(high / size, vec2<f32>(0.0), vec2<f32>(1.0)));
        low = select(image.xy * size - 0.01, vec2<f32>(3.0e38), is_outside);
        high = select(image.zw * size + 0.01, vec2<f32>(-3.0e38), is_outside);
    }
    let first = clamp(ceil(low - 0.5), vec2<f32>(0.0), size);
    let last = clamp(floor(high - 0.5), vec2<f32>(-1.0), size - 1.0);
    return Bound(vec2<i32>(first), vec2<i32>(last));
}

fn bound_of_tile(bound: Bound, tile: u32, side: i32) -> Bound {
    let corner = vec2<i32>(vec2<u32>(tile & 0xffffu, tile >> 16u)) * side;
    return Bound(max(corner, bound.first), min(corner + side - 1, bound.last));
}

// Whether the triangle may cover a texel of the bound: no edge has all of it outside.
fn may_cover(projection: Projection, warp: Warp, triangle: Triangle, bound: Bound) -> bool {
    let size = vec2<f32>(projection.size);
    let linear = linear_bound(warp, bound.first, bound.last, projection.size);
    let middle = 0.5 * (linear.xy + linear.zw) * size - projection.centre;
    let reach = 0.5 * (linear.zw - linear.xy) * size + 0.01;
    let greatest = vec3<f32>(
        greatest_of_edge(projection, triangle.edge0, middle, reach),
        greatest_of_edge(projection, triangle.edge1, middle, reach),
        greatest_of_edge(projection, triangle.edge2, middle, reach),
    );
    return all(greatest >= vec3<f32>(0.0));
}

// ---- bin ----

fn append_item(triangle: u32, tile: u32) {
    let slot = atomicAdd(&counters.items, 1u);
    if slot < arrayLength(&items) {
        items[slot] = Item(triangle, tile);
    }
}

fn append_coarse_tile(triangle: u32, tile: u32) {
    let slot = atomicAdd(&counters.coarse_tiles, 1u);
    if slot < arrayLength(&coarse_tiles) {
        coarse_tiles[slot] = Item(triangle, tile);
    }
}

@compute @workgroup_size(GROUP)
fn bin(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let job = job_uniform;
    let projection = job.projection;
    let warp = load_warp();
    let count = caster_count(job.triangle_count, counters.pieces);
    let start = (group.y * groups.x + group.x) * GROUP * items_per_invocation + local;
    var outside = 0u;
    var behind = 0u;
    for (var i = 0u; i < items_per_invocation; i += 1u) {
        let id = start + i * GROUP;
        if id >= count {
            break;
        }
        let corners = corners_of_caster(projection, id);
        let a = corners.a;
        let b = corners.b;
        let c = corners.c;
        let bound = bound_from_projected(projection, warp, a, b, c);
        let size = bound.last - bound.first + 1;
        if is_out_of_depth(projection, depths_of_triangle(a, b, c)) {
            behind += 1u;
        } else if min(size.x, size.y) <= 0 {
            outside += 1u;
        } else if max(size.x, size.y) <= i32(small_area) && size.x * size.y <= i32(small_area) {
            append_item(id, WHOLE);
        } else {
            let first = bound.first >> vec2<u32>(job.coarse_shift);
            let last = bound.last >> vec2<u32>(job.coarse_shift);
            var tile = first;
            while tile.y <= last.y {
                append_coarse_tile(id, u32(tile.x) | (u32(tile.y) << 16u));
                tile.x += 1;
                if tile.x > last.x {
                    tile = vec2<i32>(first.x, tile.y + 1);
                }
            }
        }
    }
    atomicAdd(&counters.outside, outside);
    atomicAdd(&counters.behind, behind);
}

fn is_out_of_depth(projection: Projection, depths: vec2<f32>) -> bool {
    return depths.x > projection.z_max || clamp_to_nearest(depths.y, projection.z_min) < projection.z_min;
}

// ---- split ----

fn groups_for(count: u32) -> array<u32, 3> {
    let groups = (count + GROUP - 1u) / GROUP;
    let width = max(min(groups, 32768u), 1u);
    return array<u32, 3>(width, (groups + width - 1u) / width, 1u);
}

// Where the number of casters is only known here.
@compute @workgroup_size(1)
fn prepare_bin() {
    let count = caster_count(0u, counters.pieces);
    bin_groups = groups_for((count + items_per_invocation - 1u) / items_per_invocation);
}

@compute @workgroup_size(1)
fn prepare_split() {
    split_groups = groups_for(min(atomicLoad(&counters.coarse_tiles), arrayLength(&coarse_tiles)));
}

@compute @workgroup_size(GROUP)
fn split(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let job = job_uniform;
    let projection = job.projection;
    let warp = load_warp();
    let index = (group.y * groups.x + group.x) * GROUP + local;
    if index >= min(atomicLoad(&counters.coarse_tiles), arrayLength(&coarse_tiles)) {
        return;
    }
    let item = coarse_tiles[index];
    let corners = corners_of_caster(projection, item.triangle);
    let triangle = caster_from_corners(projection, item.triangle, corners).triangle;
    let all_of_it = bound_from_projected(projection, warp, corners.a, corners.b, corners.c);
    let bound = bound_of_tile(all_of_it, item.tile, 1 << job.coarse_shift);
    let first = bound.first >> vec2<u32>(fine_shift);
    let last = bound.last >> vec2<u32>(fine_shift);
    var tile = first;
    while tile.y <= last.y {
        let name = u32(tile.x) | (u32(tile.y) << 16u);
        if may_cover(projection, warp, triangle, bound_of_tile(bound, name, 1 << fine_shift)) {
            append_item(item.triangle, name);
        }
        tile.x += 1;
        if tile.x > last.x {
            tile = vec2<i32>(first.x, tile.y + 1);
        }
    }
}

// ---- walk ----

@compute @workgroup_size(1)
fn prepare_walk() {
    let count = min(atomicLoad(&counters.items), arrayLength(&items));
    walk_groups = groups_for((count + items_per_invocation - 1u) / items_per_invocation);
}

// Where the edges cross a row, as lines x = slope * y + offset: those that bound it from the left and
// those that bound it from the right, a little more rather than less.
struct Sides {
    left_slope: vec3<f32>,
    left_offset: vec3<f32>,
    right_slope: vec3<f32>,
    right_offset: vec3<f32>,
}

fn sides_of_triangle(projection: Projection, triangle: Triangle) -> Sides {
    let a = vec3<f32>(triangle.edge0.x, triangle.edge1.x, triangle.edge2.x);
    let b = vec3<f32>(triangle.edge0.y, triangle.edge1.y, triangle.edge2.y);
    let c = vec3<f32>(triangle.edge0.z, triangle.edge1.z, triangle.edge2.z);
    let is_left = a > vec3<f32>(0.0);
    let is_right = a < vec3<f32>(0.0);
    let inverse = 1.0 / select(vec3<f32>(1.0), a, is_left | is_right);
    let slope = -b * inverse;
    // Texel columns are at half-integers of the map, whose axis is at `centre`.
    let offset = -c * inverse + projection.centre.x - 0.5;
    let slack = 0.01 + 2e-6 * (abs(slope) * f32(projection.size.y) + abs(offset));
    return Sides(
        select(vec3<f32>(0.0), slope, is_left),
        select(vec3<f32>(-1.0e6), offset - slack, is_left),
        select(vec3<f32>(0.0), slope, is_right),
        select(vec3<f32>(1.0e6), offset + slack, is_right),
    );
}

fn span_of_row(projection: Projection, sides: Sides, bound: Bound, row: i32) -> vec2<i32> {
    if IS_WARPED || !HAS_STRAIGHT_EDGES {
        // The edges are no lines here.
        return vec2<i32>(bound.first.x, bound.last.x);
    }
    let y = f32(row) + 0.5 - projection.centre.y;
    let left = sides.left_slope * y + sides.left_offset;
    let right = sides.right_slope * y + sides.right_offset;
    let first = max(max(left.x, left.y), max(left.z, f32(bound.first.x)));
    let last = min(min(right.x, right.y), min(right.z, f32(bound.last.x)));
    // Clamped, so that an edge along the row, whose crossing is at infinity, makes an empty span.
    return vec2<i32>(vec2<f32>(ceil(min(first, 1.0e6)), floor(max(last, -1.0))));
}

fn store_if_covered(projection: Projection, warp: Warp, caster: Caster, id: u32, x: i32, y: i32) {
    var texel = vec2<f32>(f32(x), f32(y)) + 0.5 - projection.centre;
    if IS_WARPED {
        let size = vec2<f32>(projection.size);
        texel = linear_from_texel(warp, vec2<i32>(x, y), projection.size) * size - projection.centre;
    }
    let ray = ray_from_texel(projection, texel);
    let e = vec3<f32>(
        evaluate_edge(caster.triangle.edge0, ray),
        evaluate_edge(caster.triangle.edge1, ray),
        evaluate_edge(caster.triangle.edge2, ray),
    );
    let z = clamp_to_nearest(depth_of_caster(caster, ray, e), projection.z_min);
    if min(min(e.x, e.y), e.z) >= 0.0 && max(max(e.x, e.y), e.z) > 0.0 && z >= projection.z_min && z <= projection.z_max {
        let depth = (z - projection.depth_offset) * projection.depth_scale;
        store_texel(u32(y) * projection.size.x + u32(x), depth, id);
    }
}

@compute @workgroup_size(GROUP)
fn walk(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
    @builtin(local_invocation_index) local: u32,
) {
    let job = job_uniform;
    let projection = job.projection;
    let warp = load_warp();
    let count = min(atomicLoad(&counters.items), arrayLength(&items));
    let start = (group.y * groups.x + group.x) * GROUP * items_per_invocation + local;
    let end = min(start + GROUP * items_per_invocation, count);
    let whole_map = Bound(vec2<i32>(0), vec2<i32>(projection.size) - 1);
    var index = start;
    var caster: Caster;
    var sides: Sides;
    var id = 0u;
    var bound = Bound(vec2<i32>(0), vec2<i32>(-1));
    var row = 0;
    var x = 0;
    var span = vec2<i32>(0, -1);
    // Lanes in lockstep would wait for the largest of their items. Instead each walks a few texels,
    // then those that are done take their next item while the others go on with theirs.
    while index < end || row <= bound.last.y {
        if row > bound.last.y {
            let item = items[index];
            index += GROUP;
            id = triangle_of_caster(item.triangle);
            let corners = corners_of_caster(projection, item.triangle);
            caster = caster_from_corners(projection, item.triangle, corners);
            if item.tile == WHOLE {
                bound = bound_from_projected(projection, warp, corners.a, corners.b, corners.c);
            } else {
                bound = bound_of_tile(whole_map, item.tile, 1 << fine_shift);
            }
            sides = sides_of_triangle(projection, caster.triangle);
            row = bound.first.y;
            span = span_of_row(projection, sides, bound, row);
            x = span.x;
        }
        for (var i = 0u; i < chunk; i += 1u) {
            if row <= bound.last.y && x <= span.y {
                store_if_covered(projection, warp, caster, id, x, row);
            }
            x += 1;
            if x > span.y {
                row += 1;
                span = span_of_row(projection, sides, bound, row);
                x = span.x;
            }
        }
    }
}
