// Exact rasterization: triangles to the nearest depth (and triangle) along each texel's own ray. Through
// a warp of many functions it is rasterize_bands.wgsl. Linear where the casters are pieces with straight
// edges (caster/pieces.wgsl).
//
// A small triangle is one item, a large one is cut into coarse tiles, and those into fine ones. No item
// has more than 8 x 8 texels.
#import lib/tiles

// Texels along each side of a block of tiles.
const SIDE_OF_BLOCK: i32 = 32;

// The part of a coarse item is a tile, x and y in 16 bits each.
fn name_of_tile(tile: vec2<i32>) -> u32 {
    return u32(tile.x) | (u32(tile.y) << 16u);
}

fn tile_from_name(tile: u32) -> vec2<i32> {
    return vec2<i32>(vec2<u32>(tile & 0xffffu, tile >> 16u));
}

fn bound_of_tile(bound: Bound, tile: u32, side: i32) -> Bound {
    let corner = tile_from_name(tile) * side;
    return Bound(max(corner, bound.first), min(corner + side - 1, bound.last));
}

// Where the number of casters is only known here.
@compute @workgroup_size(1)
fn prepare_bin() {
    let count = caster_count(0u, atomicLoad(&counters.pieces));
    groups_of_next = groups_for((count + items_per_invocation - 1u) / items_per_invocation);
}

// In coarse tiles.
fn append_coarse_items(job: Job, warp: Warp, id: u32, extent: Extent, bound: Bound) {
    let first = bound.first >> vec2<u32>(job.coarse_shift);
    let last = bound.last >> vec2<u32>(job.coarse_shift);
    var tile = first;
    while tile.y <= last.y {
        if has_coarse_tile(vec2<u32>(tile)) {
            append_coarse_item(id, name_of_tile(tile));
        }
        tile.x += 1;
        if tile.x > last.x {
            tile = vec2<i32>(first.x, tile.y + 1);
        }
    }
}

fn split_item(job: Job, warp: Warp, item: Item) {
    let projection = job.projection;
    let corners = corners_of_caster(projection, item.triangle);
    let triangle = caster_from_corners(projection, item.triangle, corners).triangle;
    let extent = extent_in_map(projection, corners);
    let bound = bound_of_tile(bound_from_extent(projection, warp, extent), item.part, 1 << job.coarse_shift);
    if !may_cover(projection, triangle, box_of_bound(projection, warp, bound)) {
        return;
    }
    // Blocks of tiles first: most of a bound that reaches over a cube's edge holds nothing.
    let blocks = Bound(bound.first / SIDE_OF_BLOCK, bound.last / SIDE_OF_BLOCK);
    var block = blocks.first;
    while block.y <= blocks.last.y {
        let block_bound = bound_of_tile(bound, name_of_tile(block), SIDE_OF_BLOCK);
        let first = block_bound.first / SIDE;
        let may_hold = has_block(projection, vec2<u32>(block_bound.first));
        let is_empty = !(may_hold && may_cover(projection, triangle, box_of_bound(projection, warp, block_bound)));
        let last = select(block_bound.last / SIDE, first - 1, is_empty);
        var tile = first;
        while tile.y <= last.y {
            let part = bound_of_tile(bound, name_of_tile(tile), SIDE);
            let box = box_of_bound(projection, warp, part);
            if is_looked_at(projection, part) && may_cover(projection, triangle, box) {
                let nearest = stored_depth(projection, depths_in_box(projection, triangle, box).x);
                append_item(item.triangle, bits_of_part(job, tile, 0u, nearest));
            }
            let whole = bound_of_fine_tile(projection, tile);
            // Not an `if`, which a software driver would do for every tile.
            var may_hide = culls_hidden && !is_masked(item.triangle) && all(part.first == whole.first) && all(part.last == whole.last);
            while may_hide {
                may_hide = false;
                hide_behind(projection, triangle, box, tile);
            }
            tile.x += 1;
            if tile.x > last.x {
                tile = vec2<i32>(first.x, tile.y + 1);
            }
        }
        block.x += 1;
        if block.x > blocks.last.x {
            block = vec2<i32>(blocks.first.x, block.y + 1);
        }
    }
}
