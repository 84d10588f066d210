// The texels of a tile that a caster covers. A software driver pays some 500 cycles for a texel that is drawn
// and for one that only might be. So which of them are covered is found first, from what eight columns and
// eight rows share.
#import lib/parts

// Of eight columns or rows. An array with a variable index would be in memory.
struct Places {
    first: vec4<f32>,
    second: vec4<f32>,
}

fn place_at(places: Places, i: u32) -> f32 {
    let four = select(places.first, places.second, i >= 4u);
    let two = select(four.xy, four.zw, (i & 2u) != 0u);
    return select(two.x, two.y, (i & 1u) != 0u);
}

fn with_place(places: Places, i: u32, place: f32) -> Places {
    let order = vec4<u32>(0u, 1u, 2u, 3u);
    return Places(
        select(places.first, vec4<f32>(place), order == vec4<u32>(i)),
        select(places.second, vec4<f32>(place), order + 4u == vec4<u32>(i)),
    );
}

// What a caster covers of a bound.
struct Coverage {
    columns: Places,
    rows: Places,
    texels: vec2<u32>,                  // a bit each, in rows of SIDE
}

fn place_of(coverage: Coverage, texel: vec2<u32>) -> vec2<f32> {
    return vec2<f32>(place_at(coverage.columns, texel.x), place_at(coverage.rows, texel.y));
}

// Of the columns `within`, a bit each, which share a function along y, in a band.
fn coverage_of_bound(
    projection: Projection,
    warp: Warp,
    caster: Caster,
    bound: Bound,
    function: u32,
    within: u32,
    band: u32,
) -> Coverage {
    let none = Places(vec4<f32>(0.0), vec4<f32>(0.0));
    var coverage = Coverage(none, none, vec2<u32>(0u));
    let last = vec2<u32>(bound.last - bound.first);
    for (var x = 0u; x < u32(SIDE); x += 1u) {
        let column = bound.first.x + i32(min(x, last.x));
        let place = place_of_column(warp, band, column, projection.size) - projection.centre.x;
        coverage.columns = with_place(coverage.columns, x, place);
    }
    var y = 0u;
    // No `for`, which would be unrolled with the columns in it.
    while y <= last.y {
        let place = place_of_row(warp, function, bound.first.y + i32(y), projection.size);
        coverage.rows = with_place(coverage.rows, y, place - projection.centre.y);
        var row = 0u;
        for (var x = 0u; x < u32(SIDE); x += 1u) {
            let direction = direction_from_texel(projection, place_of(coverage, vec2<u32>(x, y)));
            row |= select(0u, 1u << x, is_covered(caster, direction));
        }
        let is_in_band = band_of_row(warp, function, bound.first.y + i32(y), projection.size) == band;
        row = select(0u, row & within, is_in_band) << (8u * (y & 3u));
        coverage.texels |= select(vec2<u32>(row, 0u), vec2<u32>(0u, row), y >= 4u);
        y += 1u;
    }
    return coverage;
}

// The band of the first row of a bound that is in a later one than this. A tile has rows in eight bands at most,
// and where there are many others lie between them.
fn band_after(projection: Projection, warp: Warp, function: u32, bound: Bound, band: u32) -> u32 {
    var row = bound.first.y;
    var found = band;
    while found <= band && row < bound.last.y {
        row += 1;
        found = band_of_row(warp, function, row, projection.size);
    }
    return max(found, band + 1u);
}

// Draws the texels of a bound that the caster covers, in a band or in all.
fn draw_covered(projection: Projection, warp: Warp, caster: Caster, id: u32, bound: Bound, only_band: u32) {
    let width = u32(bound.last.x - bound.first.x) + 1u;
    // Columns with one function along y after those with another, and in them band after band.
    var column = 0u;
    while column < width {
        let function = function_of_column(warp, bound.first.x + i32(column), projection.size);
        var within = 0u;
        for (var x = 0u; x < u32(SIDE); x += 1u) {
            let is_of_it = function_of_column(warp, bound.first.x + i32(x), projection.size) == function;
            within |= select(0u, 1u << x, is_of_it && x >= column && x < width);
        }
        var band = only_band;
        var last_band = only_band;
        if only_band == ALL_BANDS {
            band = band_of_row(warp, function, bound.first.y, projection.size);
            last_band = band_of_row(warp, function, bound.last.y, projection.size);
        }
        loop {
            let coverage = coverage_of_bound(projection, warp, caster, bound, function, within, band);
            var texels = coverage.texels;
            while any(texels != vec2<u32>(0u)) {
                let is_second = texels.x == 0u;
                let half = select(texels.x, texels.y, is_second);
                let bit = countTrailingZeros(half);
                let rest = half & (half - 1u);
                texels = select(vec2<u32>(rest, texels.y), vec2<u32>(0u, rest), is_second);
                let texel = vec2<u32>(bit & 7u, (bit >> 3u) + select(0u, 4u, is_second));
                let ray = ray_from_texel(projection, place_of(coverage, texel));
                store_covered(projection, caster, id, bound.first + vec2<i32>(texel), ray);
            }
            if band >= last_band {
                break;
            }
            band = band_after(projection, warp, function, bound, band);
        }
        column += countOneBits(within);
    }
}

fn bound_from_extent(projection: Projection, warp: Warp, extent: Extent) -> Bound {
    if IS_WARPED {
        return warped_bound_of_extent(projection, warp, extent);
    }
    return bound_of_extent(projection, extent);
}

// The items of a large triangle are for `append_coarse_items` and `split_item` of the shader that imports this.
@compute @workgroup_size(GROUP)
fn bin(invocation: Invocation) {
    let job = job_uniform;
    let projection = job.projection;
    let warp = load_warp();
    let start = index_of_invocation(invocation, GROUP * items_per_invocation);
    let count = caster_count(job.triangle_count, atomicLoad(&counters.pieces));
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
        let depths = depths_of_triangle(corners.a, corners.b, corners.c);
        let nearest = stored_depth(projection, clamp_to_nearest(depths.x, projection.z_floor));
        if is_out_of_depth(projection, depths) {
            behind += 1u;
        } else if min(size.x, size.y) <= 0 {
            outside += 1u;
        } else if max(size.x, size.y) <= SIDE {
            if is_looked_at(projection, bound) {
                append_item(id, bits_of_part(job, bound.first / SIDE, whole_triangle(job), nearest));
            } else {
                outside += 1u;
            }
        } else {
            append_coarse_items(job, warp, id, extent, bound);
        }
    }
    atomicAdd(&counters.outside, outside);
    atomicAdd(&counters.behind, behind);
}

@compute @workgroup_size(GROUP)
fn split(invocation: Invocation) {
    let index = index_of_invocation(invocation, GROUP);
    if index < coarse_item_count() {
        split_item(job_uniform, load_warp(), coarse_items[index]);
    }
}

@compute @workgroup_size(GROUP)
fn walk(invocation: Invocation) {
    let job = job_uniform;
    let projection = job.projection;
    let warp = load_warp();
    let start = index_of_invocation(invocation, GROUP * items_per_invocation);
    let end = min(start + GROUP * items_per_invocation, item_count());
    var hidden = 0u;
    var index = start;
    loop {
        // The next item that is seen: so those that are not cost little.
        var item: Item;
        var part: Part;
        var is_seen = false;
        while !is_seen && index < end {
            item = items[index];
            part = part_from_bits(job, item.part);
            is_seen = !is_hidden(job, part);
            hidden += select(1u, 0u, is_seen);
            index += GROUP;
        }
        if !is_seen {
            break;
        }
        let corners = corners_of_caster(projection, item.triangle);
        let caster = caster_from_corners(projection, item.triangle, corners);
        var bound = bound_of_fine_tile(projection, vec2<i32>(part.tile));
        var band = part.band;
        if part.is_whole {
            bound = bound_from_extent(projection, warp, extent_in_map(projection, corners));
            band = ALL_BANDS;
        }
        draw_covered(projection, warp, caster, triangle_of_caster(item.triangle), bound, band);
    }
    if culls_hidden && is_last_walk() {
        atomicAdd(&counters.hidden, hidden);
    }
}
