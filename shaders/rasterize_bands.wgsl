// Exact rasterization through a warp of many functions, as rasterize.wgsl with few or none.
//
// Such a warp has a function along x for each *band* of the map before it, and one along y for each column
// of cells behind that (warp/grid.wgsl). In a band a column of texels stands on a line x = constant, its
// rows on points of that line in their order. So what of the line is inside a triangle is a span of the
// column, and the bands that a triangle touches are walked column by column. Where the functions differ
// from band to band, bounds of the triangle's image would hold a hundred times the texels that it covers.
//
// A small triangle is one item; a large one is cut into blocks of bands, and those into strips: some
// columns of a band.
#import lib/coverage

// A lane walks so many columns before it looks for its next item, and so many texels of each.
const COLUMNS_IN_TURN: u32 = 4u;
const ROWS_IN_TURN: u32 = 4u;

// The part of an item: a band in 14 bits, its first column in 14, and the binary logarithm of the number
// of columns; WHOLE stands for the whole triangle.
const WHOLE: u32 = 0xffffffffu;
// Bands of a coarse item.
const BLOCK_OF_BANDS: i32 = 16;
// No item has more than this many columns of bands, or more than this many texels, unless a single
// column has: the host then gives an invocation so few items that it stays below the 65,535 loop
// iterations after which some drivers stop in silence.
const SMALL: i32 = 128;
const SMALL_AREA: i32 = 512;
const MOST_COLUMNS: i32 = 16;

// A triangle in the map before the warp.
struct Unwarped {
    extent: Extent,
    bands: vec2<i32>,                   // first and last that it touches
    along_x: Sides,
    along_y: Sides,
}

// First and last band of an extent that is not outside the map.
fn bands_of_extent(projection: Projection, warp: Warp, extent: Extent) -> vec2<i32> {
    let height = f32(projection.size.y);
    return vec2<i32>(
        i32(function_at(extent.low.y / height, warp.functions.x)),
        i32(function_at(extent.high.y / height, warp.functions.x)),
    );
}

fn unwarped_from_projected(
    projection: Projection,
    warp: Warp,
    triangle: Triangle,
    corners: Corners,
) -> Unwarped {
    let extent = extent_in_map(projection, corners);
    let lines = lines_of_triangle(projection, triangle);
    return Unwarped(
        extent,
        bands_of_extent(projection, warp, extent),
        sides_along(lines.x, lines.y, lines.constant, lines.rounding),
        sides_along(lines.y, lines.x, lines.constant, lines.rounding),
    );
}

// The part of the triangle's extent along y in a band.
fn heights_in_band(projection: Projection, warp: Warp, extent: Extent, band: i32) -> vec2<f32> {
    let height = f32(projection.size.y) / f32(warp.functions.x);
    return vec2<f32>(
        max(f32(band) * height - 0.01, extent.low.y),
        min(f32(band + 1) * height + 0.01, extent.high.y),
    );
}

// First and last texel along an axis of an interval that a function maps to [low, high], in texels.
fn texels_between(warp: Warp, axis: u32, function: u32, low: f32, high: f32, size: f32) -> vec2<i32> {
    let cells = warp.cells[axis];
    let start = warp.forward[axis] + function * (cells + 1u);
    let from_place = value_and_slope(start, cells, low / size).x * size - 0.01;
    let to_place = value_and_slope(start, cells, high / size).x * size + 0.01;
    let first = i32(clamp(ceil(from_place - 0.5), 0.0, size));
    let last = i32(clamp(floor(to_place - 0.5), -1.0, size - 1.0));
    return vec2<i32>(first, select(last, -1, low > high || low > size || high < 0.0));
}

// First and last column that the triangle may cover in a band.
fn columns_of_band(projection: Projection, warp: Warp, unwarped: Unwarped, band: i32) -> vec2<i32> {
    let y = heights_in_band(projection, warp, unwarped.extent, band) - projection.centre.y;
    let span = span_of(unwarped.along_x, y.x, y.y) + projection.centre.x;
    let low = max(span.x, unwarped.extent.low.x);
    let high = min(span.y, unwarped.extent.high.x);
    return texels_between(warp, 0u, u32(band), low, high, f32(projection.size.x));
}

// A column of a band: where it stands, centred, its function along y, and the rows that may be covered.
struct Column {
    x: f32,
    function: u32,
    rows: vec2<i32>,
}

fn column_of_band(projection: Projection, warp: Warp, unwarped: Unwarped, band: i32, column: i32) -> Column {
    let size = vec2<f32>(projection.size);
    let unwarped_x = warp_table[warp.inverse.x + u32(band) * projection.size.x + u32(column)];
    let x = unwarped_x * size.x - projection.centre.x;
    let function = function_at((f32(column) + 0.5) / size.x, warp.functions.y);
    let y = heights_in_band(projection, warp, unwarped.extent, band);
    let span = span_of(unwarped.along_y, x, x) + projection.centre.y;
    let rows = texels_between(warp, 1u, function, max(span.x, y.x), min(span.y, y.y), size.y);
    return Column(x, function, rows);
}

// The binary logarithm of the number of columns of a strip: fewer where they are high.
fn shift_of_strip(projection: Projection, warp: Warp, unwarped: Unwarped, band: i32, first: i32) -> u32 {
    let size = vec2<f32>(projection.size);
    let y = heights_in_band(projection, warp, unwarped.extent, band) / size.y;
    let from_function = function_at((f32(first) + 0.5) / size.x, warp.functions.y);
    let to_function = function_at((f32(first + MOST_COLUMNS) - 0.5) / size.x, warp.functions.y);
    let rows = values_between(warp, 1u, from_function, to_function, y.x, y.y);
    let height = i32((rows.y - rows.x) * size.y) + 1;
    return firstLeadingBit(u32(clamp(SMALL_AREA / max(height, 1), 1, MOST_COLUMNS)));
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
    var outside = 0u;
    var behind = 0u;
    for (var i = 0u; i < items_per_invocation; i += 1u) {
        let id = start + i * GROUP;
        if id >= job.triangle_count {
            break;
        }
        let corners = corners_of_caster(projection, id);
        let extent = extent_in_map(projection, corners);
        let bound = warped_bound_of_extent(projection, warp, extent);
        let size = bound.last - bound.first + 1;
        if is_out_of_depth(projection, depths_of_triangle(corners.a, corners.b, corners.c)) {
            behind += 1u;
        } else if min(size.x, size.y) <= 0 {
            outside += 1u;
        } else {
            let bands = bands_of_extent(projection, warp, extent);
            let count = bands.y - bands.x + 1;
            if count * size.x <= SMALL && size.x * size.y <= SMALL_AREA {
                append_item(id, WHOLE);
            } else {
                for (var band = bands.x; band <= bands.y; band += BLOCK_OF_BANDS) {
                    append_coarse_item(id, u32(band));
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
    let caster = caster_from_corners(projection, item.triangle, corners);
    let unwarped = unwarped_from_projected(projection, warp, caster.triangle, corners);
    var band = i32(item.part);
    let last_band = min(band + BLOCK_OF_BANDS - 1, unwarped.bands.y);
    var columns = columns_of_band(projection, warp, unwarped, band);
    while band <= last_band {
        let shift = shift_of_strip(projection, warp, unwarped, band, columns.x);
        if columns.x <= columns.y {
            append_item(item.triangle, u32(band) | (u32(columns.x) << 14u) | (shift << 28u));
        }
        columns.x += 1 << shift;
        if columns.x > columns.y {
            band += 1;
            columns = columns_of_band(projection, warp, unwarped, min(band, last_band));
        }
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
    let size = vec2<f32>(projection.size);
    let start = (group.y * groups.x + group.x) * GROUP * items_per_invocation + local;
    let end = min(start + GROUP * items_per_invocation, item_count());
    var index = start;
    var caster: Caster;
    var unwarped: Unwarped;
    var id = 0u;
    // The band, the last of the item, and what is left of the band and of the column.
    var band = 0;
    var last_band = -1;
    var strip = vec2<i32>(0, 0x7fffffff);
    var columns = vec2<i32>(0, -1);
    var column: Column;
    column.rows = vec2<i32>(0, -1);
    // As in rasterize.wgsl, lanes take their next item while others go on with theirs. A while loop that no
    // lane enters is skipped where an if is not: what a column costs is not paid for each of its texels.
    while index < end || band <= last_band {
        while band > last_band && index < end {
            let item = items[index];
            index += GROUP;
            id = item.triangle;
            let corners = corners_of_caster(projection, id);
            caster = caster_from_corners(projection, id, corners);
            unwarped = unwarped_from_projected(projection, warp, caster.triangle, corners);
            let is_whole = item.part == WHOLE;
            band = select(i32(item.part & 0x3fffu), unwarped.bands.x, is_whole);
            last_band = select(band, unwarped.bands.y, is_whole);
            let first = i32((item.part >> 14u) & 0x3fffu);
            strip = select(vec2<i32>(first, first + (1 << (item.part >> 28u)) - 1), vec2<i32>(0, 0x7fffffff), is_whole);
            columns = columns_of_band(projection, warp, unwarped, band);
            columns = vec2<i32>(max(columns.x, strip.x), min(columns.y, strip.y));
            column.rows = vec2<i32>(0, -1);
        }
        for (var i = 0u; i < COLUMNS_IN_TURN; i += 1u) {
            while band <= last_band && columns.x > columns.y && column.rows.x > column.rows.y {
                band += 1;
                if band <= last_band {
                    columns = columns_of_band(projection, warp, unwarped, band);
                    columns = vec2<i32>(max(columns.x, strip.x), min(columns.y, strip.y));
                }
            }
            while column.rows.x > column.rows.y && columns.x <= columns.y {
                column = column_of_band(projection, warp, unwarped, band, columns.x);
                columns.x += 1;
            }
            var steps = 0u;
            while column.rows.x <= column.rows.y && steps < ROWS_IN_TURN {
                steps += 1u;
                let row = column.rows.x;
                column.rows.x += 1;
                let y = warp_table[warp.inverse.y + column.function * projection.size.y + u32(row)];
                if i32(function_at(y, warp.functions.x)) == band {
                    let place = vec2<f32>(column.x, y * size.y - projection.centre.y);
                    store_if_covered(projection, caster, id, vec2<i32>(columns.x - 1, row), place);
                }
            }
        }
    }
}
