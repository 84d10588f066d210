// A warp by monotone functions along rows and columns:
//
//   x' = X_i(x), i = floor(y rows)          y' = Y_j(y), j = floor(x' columns)
//
// after Milet et al., "Non-orthogonal texture warping", Eq. 6; one function for all rows and one for
// all columns make it Rosen's rectilinear warp. Functions are piecewise linear between the boundaries
// of cells; all coordinates are in [0, 1]. The inverse is exact, and only asked for at centres of
// texels, where it is tabulated:
//
//   y = Y_j^-1(y'), j = floor(x' columns)   x = X_i^-1(x'), i = floor(y rows)

struct Warp {
    functions: vec2<u32>,       // rows, columns: how many functions there are along x, along y
    cells: vec2<u32>,           // of each function along x, along y
    // First elements in the table: values at boundaries of cells, [function][cell + 1]; inverses at
    // centres of texels, [function][texel]; least and greatest values of BLOCK functions, [block][cell + 1].
    forward: vec2<u32>,
    inverse: vec2<u32>,
    least: vec2<u32>,
    greatest: vec2<u32>,
}

struct Warped {
    uv: vec2<f32>,
    functions: vec2<u32>,       // that took it there: of its row, of its column
}

// Texels, from `low` to `high`, whose centres the same two functions take there: between patches the map is
// torn, and what lies beside a texel comes from elsewhere.
struct Patch {
    low: vec2<i32>,
    high: vec2<i32>,
}

const IS_WARPED: bool = true;
// Whether there is one function along each axis.
override is_rectilinear: bool = false;
// More are not looked through: all loops of an invocation together must stay short, see passes/rasterize.rs.
const MAX_FUNCTIONS: u32 = 64u;
// Functions that share an envelope.
const BLOCK: u32 = 16u;

@group(0) @binding(11) var<uniform> warp_uniform: Warp;
@group(0) @binding(12) var<storage, read> warp_table: array<f32>;

fn load_warp() -> Warp {
    return warp_uniform;
}

// The value at x of a function whose boundaries start at `first`.
fn value_at(first: u32, cells: u32, x: f32) -> f32 {
    let place = clamp(x, 0.0, 1.0) * f32(cells);
    let cell = min(u32(place), cells - 1u);
    let a = warp_table[first + cell];
    let b = warp_table[first + cell + 1u];
    return a + (b - a) * (place - f32(cell));
}

// Of a function along an axis.
fn value_of_function(warp: Warp, axis: u32, function: u32, x: f32) -> f32 {
    return value_at(warp.forward[axis] + function * (warp.cells[axis] + 1u), warp.cells[axis], x);
}

fn function_at(place: f32, functions: u32) -> u32 {
    if is_rectilinear {
        return 0u;
    }
    return min(u32(clamp(place, 0.0, 1.0) * f32(functions)), functions - 1u);
}

fn warped_from_linear(warp: Warp, uv: vec2<f32>) -> Warped {
    let row = function_at(uv.y, warp.functions.x);
    let x = value_of_function(warp, 0u, row, uv.x);
    let column = function_at(x, warp.functions.y);
    return Warped(vec2<f32>(x, value_of_function(warp, 1u, column, uv.y)), vec2<u32>(row, column));
}

// The first texel whose centre is not before a place.
fn first_centre(place: f32, size: u32) -> i32 {
    return i32(ceil(place * f32(size) - 0.5));
}

// The patch of a place's two functions; it may be empty.
fn patch_of(warp: Warp, warped: Warped, size: vec2<u32>) -> Patch {
    return patch_of_functions(warp, warped.functions, size);
}

// The same of those of a row and of a column.
fn patch_of_functions(warp: Warp, taken: vec2<u32>, size: vec2<u32>) -> Patch {
    if is_rectilinear {
        return Patch(vec2<i32>(0), vec2<i32>(size) - 1);
    }
    let functions = vec2<f32>(warp.functions.yx);
    let low = vec2<f32>(taken.yx) / functions;
    let high = vec2<f32>(taken.yx + 1u) / functions;
    let top = value_of_function(warp, 1u, taken.y, low.y);
    let bottom = value_of_function(warp, 1u, taken.y, high.y);
    return Patch(
        vec2<i32>(first_centre(low.x, size.x), first_centre(top, size.y)),
        vec2<i32>(first_centre(high.x, size.x), first_centre(bottom, size.y)) - 1,
    );
}

// Whether there are patches above, below, left and right of a place's own.
fn has_patches(warp: Warp, warped: Warped) -> vec4<bool> {
    let before = warped.functions > vec2<u32>(0u);
    let after = warped.functions + 1u < warp.functions;
    return vec4<bool>(before.x, after.x, before.y, after.y);
}

// The texel beside a place that is nearest to it across the tear on that side of its patch.
fn texel_across(warp: Warp, linear: vec2<f32>, warped: Warped, side: vec2<i32>, size: vec2<u32>) -> vec2<i32> {
    let functions = vec2<f32>(warp.functions.yx);
    let beside = vec2<u32>(vec2<i32>(warped.functions) + side.yx);
    let edge = vec2<f32>(vec2<i32>(warped.functions.yx) + max(side, vec2<i32>(0))) / functions;
    let is_along_y = side.y != 0;
    let x = select(edge.x, value_of_function(warp, 0u, beside.x, linear.x), is_along_y);
    let column = select(beside.y, function_at(x, warp.functions.y), is_along_y);
    let y = value_of_function(warp, 1u, column, select(linear.y, edge.y, is_along_y));
    let last = min(side, vec2<i32>(0));
    let along_y = vec2<i32>(i32(x * f32(size.x)), first_centre(y, size.y) + last.y);
    let along_x = vec2<i32>(first_centre(x, size.x) + last.x, i32(y * f32(size.y)));
    return select(along_x, along_y, is_along_y);
}

// How wide a function is in the linear map: between two of them the warp is torn. 0 where there is one.
fn width_of_function(warp: Warp) -> f32 {
    let most = max(warp.functions.x, warp.functions.y);
    return select(0.0, 1.0 / f32(most), most > 1u);
}

// The function along y of a column of texels, and the band, the function along x, of a row of them.
fn function_of_column(warp: Warp, column: i32, size: vec2<u32>) -> u32 {
    return function_at((f32(column) + 0.5) / f32(size.x), warp.functions.y);
}

fn band_of_row(warp: Warp, function: u32, row: i32, size: vec2<u32>) -> u32 {
    if is_rectilinear {
        return 0u;
    }
    return function_at(linear_from_row(warp, function, row, size), warp.functions.x);
}

// Linear map coordinates, in [0, 1], of the centres of a column's texels in a band and of a row's.
fn linear_from_column(warp: Warp, band: u32, column: i32, size: vec2<u32>) -> f32 {
    return warp_table[warp.inverse.x + band * size.x + u32(column)];
}

fn linear_from_row(warp: Warp, function: u32, row: i32, size: vec2<u32>) -> f32 {
    return warp_table[warp.inverse.y + function * size.y + u32(row)];
}

// The same in texels.
fn place_of_column(warp: Warp, band: u32, column: i32, size: vec2<u32>) -> f32 {
    return linear_from_column(warp, band, column, size) * f32(size.x);
}

fn place_of_row(warp: Warp, function: u32, row: i32, size: vec2<u32>) -> f32 {
    return linear_from_row(warp, function, row, size) * f32(size.y);
}

// Linear map coordinates, in [0, 1], of a texel's centre.
fn linear_from_texel(warp: Warp, texel: vec2<i32>, size: vec2<u32>) -> vec2<f32> {
    let y = linear_from_row(warp, function_of_column(warp, texel.x, size), texel.y, size);
    return vec2<f32>(linear_from_column(warp, function_at(y, warp.functions.x), texel.x, size), y);
}

// Texels around one, `reach` on each side: the middle's two functions leave their columns and rows straight,
// and each is asked for once.
struct Neighbours {
    columns: array<f32, 5>,
    rows: array<f32, 5>,
}

fn neighbours_of_texel(warp: Warp, middle: vec2<i32>, reach: i32, size: vec2<u32>) -> Neighbours {
    let column = function_of_column(warp, middle.x, size);
    let row = band_of_row(warp, column, middle.y, size);
    var neighbours: Neighbours;
    for (var i = 0; i <= 2 * reach; i += 1) {
        let texel = clamp(middle + i - reach, vec2<i32>(0), vec2<i32>(size) - 1);
        neighbours.columns[i] = linear_from_column(warp, row, texel.x, size);
        neighbours.rows[i] = linear_from_row(warp, column, texel.y, size);
    }
    return neighbours;
}

// Linear map coordinates, in [0, 1], of the centre of the neighbour at a place, counted from the first one.
fn linear_from_neighbour(
    neighbours: ptr<function, Neighbours>,
    place: vec2<i32>,
    texel: vec2<i32>,
    size: vec2<u32>,
) -> vec2<f32> {
    return vec2<f32>((*neighbours).columns[place.x], (*neighbours).rows[place.y]);
}

// Least value at `low` and greatest at `high` of the functions from `first` to `last` along an axis.
// Envelopes of blocks of functions keep the loop short where there are many.
fn values_between(warp: Warp, axis: u32, first: u32, last: u32, low: f32, high: f32) -> vec2<f32> {
    let cells = warp.cells[axis];
    let uses_blocks = last - first >= BLOCK;
    let start = select(first, first / BLOCK, uses_blocks);
    let end = select(last, last / BLOCK, uses_blocks);
    let least = select(warp.forward[axis], warp.least[axis], uses_blocks);
    let greatest = select(warp.forward[axis], warp.greatest[axis], uses_blocks);
    var values = vec2<f32>(1.0, 0.0);
    for (var i = start; i <= end; i += 1u) {
        let skipped = i * (cells + 1u);
        values.x = min(values.x, value_at(least + skipped, cells, low));
        values.y = max(values.y, value_at(greatest + skipped, cells, high));
    }
    return values;
}

// A bound of the image of a box: least x and y, greatest x and y.
fn warped_bound(warp: Warp, low: vec2<f32>, high: vec2<f32>) -> vec4<f32> {
    let x = values_between(
        warp,
        0u,
        function_at(low.y, warp.functions.x),
        function_at(high.y, warp.functions.x),
        low.x,
        high.x,
    );
    let y = values_between(
        warp,
        1u,
        function_at(x.x, warp.functions.y),
        function_at(x.y, warp.functions.y),
        low.y,
        high.y,
    );
    return vec4<f32>(x.x, y.x, x.y, y.y);
}

// A bound of the linear map coordinates of the texels from `first` to `last`: least x and y, greatest
// x and y of their centres. All of the map where they are of more than MAX_FUNCTIONS.
fn linear_bound(warp: Warp, first: vec2<i32>, last: vec2<i32>, size: vec2<u32>) -> vec4<f32> {
    let first_column = function_of_column(warp, first.x, size);
    let last_column = function_of_column(warp, last.x, size);
    if last_column - first_column >= MAX_FUNCTIONS {
        return vec4<f32>(0.0, 0.0, 1.0, 1.0);
    }
    var y = vec2<f32>(1.0, 0.0);
    for (var i = first_column; i <= last_column; i += 1u) {
        y.x = min(y.x, linear_from_row(warp, i, first.y, size));
        y.y = max(y.y, linear_from_row(warp, i, last.y, size));
    }
    let first_row = function_at(y.x, warp.functions.x);
    let last_row = function_at(y.y, warp.functions.x);
    if last_row - first_row >= MAX_FUNCTIONS {
        return vec4<f32>(0.0, y.x, 1.0, y.y);
    }
    var x = vec2<f32>(1.0, 0.0);
    for (var i = first_row; i <= last_row; i += 1u) {
        x.x = min(x.x, linear_from_column(warp, i, first.x, size));
        x.y = max(x.y, linear_from_column(warp, i, last.x, size));
    }
    return vec4<f32>(x.x, y.x, x.y, y.y);
}
