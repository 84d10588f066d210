// Exact rasterization through a warp of many functions, as rasterize.wgsl with few or none.
//
// Such a warp has a function along x for each *band* of the map before it, and one along y for each column
// of cells behind that (warp/grid.wgsl). In a band a column of texels stands on a line x = constant, its
// rows on points of that line in their order. So tiles are taken where the lines of their columns meet the
// triangle, band by band. Where the functions differ from band to band, bounds of the triangle's image would
// hold a hundred times the texels that it covers.
//
// A small triangle is one item; a large one is cut into blocks of bands and columns, and those into tiles,
// each in one band.
#import lib/tiles

// Of a coarse item, whose part is the block's place in 16 bits each.
const BLOCK_OF_BANDS: i32 = 16;
const BLOCK_OF_COLUMNS: i32 = 64;

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
        max(f32(band) * height - TEXEL_ROUNDING, extent.low.y),
        min(f32(band + 1) * height + TEXEL_ROUNDING, extent.high.y),
    );
}

// First and last texel along an axis of an interval that a function maps to [low, high], in texels.
fn texels_between(warp: Warp, axis: u32, function: u32, low: f32, high: f32, size: f32) -> vec2<i32> {
    let from_place = value_of_function(warp, axis, function, low / size) * size - TEXEL_ROUNDING;
    let to_place = value_of_function(warp, axis, function, high / size) * size + TEXEL_ROUNDING;
    let first = i32(clamp(ceil(from_place - 0.5), 0.0, size));
    let last = i32(clamp(floor(to_place - 0.5), -1.0, size - 1.0));
    return vec2<i32>(first, select(last, -1, low > high || low > size || high < 0.0));
}

// First and last column that the triangle may cover in a band.
fn columns_of_band(
    projection: Projection,
    warp: Warp,
    unwarped: Unwarped,
    band: i32,
    heights: vec2<f32>,
) -> vec2<i32> {
    let y = heights - projection.centre.y;
    let span = span_of(unwarped.along_x, y.x, y.y) + projection.centre.x;
    let low = max(span.x, unwarped.extent.low.x);
    let high = min(span.y, unwarped.extent.high.x);
    return texels_between(warp, 0u, u32(band), low, high, f32(projection.size.x));
}

// First and last row that the triangle may cover in the columns of a band from `first` to `last`, which stand
// from `low.x` to `high.x`; the band's part of the triangle reaches from `low.y` to `high.y`.
fn rows_of_columns(
    projection: Projection,
    warp: Warp,
    unwarped: Unwarped,
    first: i32,
    last: i32,
    low: vec2<f32>,
    high: vec2<f32>,
) -> vec2<i32> {
    let size = vec2<f32>(projection.size);
    let from_x = low.x - projection.centre.x;
    let to_x = high.x - projection.centre.x;
    let span = span_of(unwarped.along_y, from_x, to_x) + projection.centre.y;
    let y = vec2<f32>(max(span.x, low.y), min(span.y, high.y));
    var rows = vec2<i32>(0x7fffffff, -1);
    let last_function = function_of_column(warp, last, projection.size);
    for (var i = function_of_column(warp, first, projection.size); i <= last_function; i += 1u) {
        let of_function = texels_between(warp, 1u, i, y.x, y.y, size.y);
        rows = vec2<i32>(min(rows.x, of_function.x), max(rows.y, of_function.y));
    }
    return vec2<i32>(rows.x, select(-1, rows.y, rows.x <= rows.y));
}

// In blocks of bands and columns.
fn append_coarse_items(job: Job, warp: Warp, id: u32, extent: Extent, bound: Bound) {
    let bands = bands_of_extent(job.projection, warp, extent) / BLOCK_OF_BANDS;
    let columns = vec2<i32>(bound.first.x, bound.last.x) / BLOCK_OF_COLUMNS;
    for (var band = bands.x; band <= bands.y; band += 1) {
        for (var column = columns.x; column <= columns.y; column += 1) {
            append_coarse_item(id, u32(band) | (u32(column) << 16u));
        }
    }
}

fn split_item(job: Job, warp: Warp, item: Item) {
    let projection = job.projection;
    let corners = corners_of_caster(projection, item.triangle);
    let caster = caster_from_corners(projection, item.triangle, corners);
    let unwarped = unwarped_from_projected(projection, warp, caster.triangle, corners);
    let place_of_block = vec2<i32>(vec2<u32>(item.part & 0xffffu, item.part >> 16u));
    let size = vec2<i32>(projection.size);
    let block = place_of_block * vec2<i32>(BLOCK_OF_BANDS, BLOCK_OF_COLUMNS);
    let last_band = min(block.x + BLOCK_OF_BANDS - 1, unwarped.bands.y);
    for (var band = max(block.x, unwarped.bands.x); band <= last_band; band += 1) {
        let heights = heights_in_band(projection, warp, unwarped.extent, band);
        var columns = columns_of_band(projection, warp, unwarped, band, heights);
        columns = vec2<i32>(max(columns.x, block.y), min(columns.y, block.y + BLOCK_OF_COLUMNS - 1));
        while columns.x <= columns.y {
            let next = (columns.x / SIDE + 1) * SIDE;
            let last = min(next - 1, columns.y);
            let is_wide = columns.x % SIDE == 0 && last == min(next, size.x) - 1;
            let low = vec2<f32>(place_of_column(warp, u32(band), columns.x, projection.size), heights.x);
            let high = vec2<f32>(place_of_column(warp, u32(band), last, projection.size), heights.y);
            let box = Box(0.5 * (low + high) - projection.centre, 0.5 * (high - low) + TEXEL_ROUNDING);
            let nearest = stored_depth(projection, depths_in_box(projection, caster.triangle, box).x);
            let rows = rows_of_columns(projection, warp, unwarped, columns.x, last, low, high);
            for (var tile = rows.x / SIDE; tile * SIDE <= rows.y; tile += 1) {
                let corner = vec2<i32>(columns.x / SIDE, tile) * SIDE;
                if is_looked_at(projection, Bound(corner, corner)) {
                    append_item(item.triangle, bits_of_part(job, corner / SIDE, u32(band), nearest));
                }
                // Not an `if`, which a software driver would do for every tile.
                var may_hide = culls_hidden && !is_masked(item.triangle) && is_wide && rows.x <= corner.y;
                while may_hide {
                    may_hide = false;
                    let whole = box_of_bound(projection, warp, bound_of_fine_tile(projection, corner / SIDE));
                    hide_behind(projection, caster.triangle, whole, corner / SIDE);
                }
            }
            columns.x = next;
        }
    }
}
