// Exact rasterization: triangles to the nearest depth (and triangle) along each texel's own ray. Through
// a warp of many functions it is rasterize_bands.wgsl. Linear where the casters are pieces with straight
// edges (caster/pieces.wgsl).
//
// A small triangle is one item, a large one is cut into coarse tiles, and those into fine ones. No item
// has more than `small_area` texels, so that work is even and no invocation comes near the 65,535 loop
// iterations after which some drivers stop in silence.
#import lib/coverage

// Texels in the bound of an item at most: the square of the side of a fine tile.
override small_area: u32 = 256u;
override fine_shift: u32 = 4u;
// Texels that a lane walks before it looks for its next item.
override chunk: u32 = 8u;

// 1 for each fine tile that a receiver looks at, in rows; what is drawn in the others changes no picture.
@group(0) @binding(9) var<storage, read> receiver_tiles: array<u32>;
override has_receiver_tiles: bool = false;

// Whether a receiver looks at a tile of the bound; one of more than 2 x 2 tiles is not asked about.
fn is_looked_at(projection: Projection, bound: Bound) -> bool {
    if !has_receiver_tiles {
        return true;
    }
    let first = vec2<u32>(bound.first) >> vec2<u32>(fine_shift);
    let last = vec2<u32>(bound.last) >> vec2<u32>(fine_shift);
    let columns = (projection.size.x + (1u << fine_shift) - 1u) >> fine_shift;
    let marks = receiver_tiles[first.y * columns + first.x] | receiver_tiles[first.y * columns + last.x]
        | receiver_tiles[last.y * columns + first.x] | receiver_tiles[last.y * columns + last.x];
    return marks != 0u || any(last - first > vec2<u32>(1u));
}

// The part of an item is a tile, x and y in 16 bits each; WHOLE stands for the whole triangle.
const WHOLE: u32 = 0xffffffffu;

fn name_of_tile(tile: vec2<i32>) -> u32 {
    return u32(tile.x) | (u32(tile.y) << 16u);
}

fn bound_of_tile(bound: Bound, tile: u32, side: i32) -> Bound {
    let corner = vec2<i32>(vec2<u32>(tile & 0xffffu, tile >> 16u)) * side;
    return Bound(max(corner, bound.first), min(corner + side - 1, bound.last));
}

fn bound_from_extent(projection: Projection, warp: Warp, extent: Extent) -> Bound {
    if IS_WARPED {
        return warped_bound_of_extent(projection, warp, extent);
    }
    return bound_of_extent(projection, extent);
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

// Where the number of casters is only known here.
@compute @workgroup_size(1)
fn prepare_bin() {
    let count = caster_count(0u, counters.pieces);
    groups_of_next = groups_for((count + items_per_invocation - 1u) / items_per_invocation);
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
    let start = (group.y * groups.x + group.x) * GROUP * items_per_invocation + local;
    let count = caster_count(job.triangle_count, counters.pieces);
    var outside = 0u;
    var behind = 0u;
    for (var i = 0u; i < items_per_invocation; i += 1u) {
        let id = start + i * GROUP;
        if id >= count {
            break;
        }
        let corners = corners_of_caster(projection, id);
        let extent = extent_in_map(projection, corners);
        let bound = bound_from_extent(projection, warp, extent);
        let size = bound.last - bound.first + 1;
        if is_out_of_depth(projection, depths_of_triangle(corners.a, corners.b, corners.c)) {
            behind += 1u;
        } else if min(size.x, size.y) <= 0 {
            outside += 1u;
        } else if max(size.x, size.y) <= i32(small_area) && size.x * size.y <= i32(small_area) {
            if is_looked_at(projection, bound) {
                append_item(id, WHOLE);
            } else {
                outside += 1u;
            }
        } else {
            let first = bound.first >> vec2<u32>(job.coarse_shift);
            let last = bound.last >> vec2<u32>(job.coarse_shift);
            var tile = first;
            while tile.y <= last.y {
                append_coarse_item(id, name_of_tile(tile));
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
    if index >= coarse_item_count() {
        return;
    }
    let item = coarse_items[index];
    let corners = corners_of_caster(projection, item.triangle);
    let triangle = caster_from_corners(projection, item.triangle, corners).triangle;
    let extent = extent_in_map(projection, corners);
    let bound = bound_of_tile(bound_from_extent(projection, warp, extent), item.part, 1 << job.coarse_shift);
    let first = bound.first >> vec2<u32>(fine_shift);
    let last = bound.last >> vec2<u32>(fine_shift);
    var tile = first;
    while tile.y <= last.y {
        let name = name_of_tile(tile);
        let part = bound_of_tile(bound, name, 1 << fine_shift);
        if is_looked_at(projection, part) && may_cover(projection, warp, triangle, part) {
            append_item(item.triangle, name);
        }
        tile.x += 1;
        if tile.x > last.x {
            tile = vec2<i32>(first.x, tile.y + 1);
        }
    }
}

fn span_of_row(projection: Projection, sides: Sides, bound: Bound, row: i32) -> vec2<i32> {
    if IS_WARPED {
        // The edges are no lines here.
        return vec2<i32>(bound.first.x, bound.last.x);
    }
    let y = f32(row) + 0.5 - projection.centre.y;
    // Texel columns are at half-integers of the map, whose axis is at `centre`.
    let span = span_of(sides, y, y) + projection.centre.x - 0.5;
    let first = max(span.x, f32(bound.first.x));
    let last = min(span.y, f32(bound.last.x));
    // Clamped, so that an edge along the row, whose crossing is at infinity, makes an empty span.
    return vec2<i32>(vec2<f32>(ceil(min(first, 1.0e6)), floor(max(last, -1.0))));
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
    let start = (group.y * groups.x + group.x) * GROUP * items_per_invocation + local;
    let end = min(start + GROUP * items_per_invocation, item_count());
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
            if item.part == WHOLE {
                bound = bound_from_extent(projection, warp, extent_in_map(projection, corners));
            } else {
                bound = bound_of_tile(whole_map, item.part, 1 << fine_shift);
            }
            let lines = lines_of_triangle(projection, caster.triangle);
            sides = sides_along(lines.x, lines.y, lines.constant, lines.rounding);
            row = bound.first.y;
            span = span_of_row(projection, sides, bound, row);
            x = span.x;
        }
        for (var i = 0u; i < chunk; i += 1u) {
            if row <= bound.last.y && x <= span.y {
                let texel = vec2<i32>(x, row);
                var place = vec2<f32>(texel) + 0.5;
                if IS_WARPED {
                    place = linear_from_texel(warp, texel, projection.size) * vec2<f32>(projection.size);
                }
                store_if_covered(projection, caster, id, texel, place - projection.centre);
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
