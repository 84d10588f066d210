// No warp: texels lie where the projection puts them.

struct Warp {
    unused: u32,
}

struct Warped {
    uv: vec2<f32>,
}

// Texels, from `low` to `high`, between tears.
struct Patch {
    low: vec2<i32>,
    high: vec2<i32>,
}

const IS_WARPED: bool = false;
const is_rectilinear: bool = true;

fn load_warp() -> Warp {
    return Warp(0u);
}

fn warped_from_linear(warp: Warp, uv: vec2<f32>) -> Warped {
    return Warped(uv);
}

fn patch_of(warp: Warp, warped: Warped, size: vec2<u32>) -> Patch {
    return Patch(vec2<i32>(0), vec2<i32>(size) - 1);
}

fn patch_of_functions(warp: Warp, taken: vec2<u32>, size: vec2<u32>) -> Patch {
    return Patch(vec2<i32>(0), vec2<i32>(size) - 1);
}

fn has_patches(warp: Warp, warped: Warped) -> vec4<bool> {
    return vec4<bool>(false);
}

fn texel_across(warp: Warp, linear: vec2<f32>, warped: Warped, side: vec2<i32>, size: vec2<u32>) -> vec2<i32> {
    return vec2<i32>(0);
}

// How wide a function is in the linear map: between two of them the warp is torn. 0 where there is one.
fn width_of_function(warp: Warp) -> f32 {
    return 0.0;
}

// Linear map coordinates, in [0, 1], of a texel's centre.
fn linear_from_texel(warp: Warp, texel: vec2<i32>, size: vec2<u32>) -> vec2<f32> {
    return (vec2<f32>(texel) + 0.5) / vec2<f32>(size);
}

// Texels around one.
struct Neighbours {
    unused: u32,
}

fn neighbours_of_texel(warp: Warp, middle: vec2<i32>, reach: i32, size: vec2<u32>) -> Neighbours {
    return Neighbours(0u);
}

fn linear_from_neighbour(
    neighbours: ptr<function, Neighbours>,
    place: vec2<i32>,
    texel: vec2<i32>,
    size: vec2<u32>,
) -> vec2<f32> {
    return (vec2<f32>(texel) + 0.5) / vec2<f32>(size);
}

fn warped_bound(warp: Warp, low: vec2<f32>, high: vec2<f32>) -> vec4<f32> {
    return vec4<f32>(low, high);
}

fn linear_bound(warp: Warp, first: vec2<i32>, last: vec2<i32>, size: vec2<u32>) -> vec4<f32> {
    return vec4<f32>(vec2<f32>(first) + 0.5, vec2<f32>(last) + 0.5) / vec4<f32>(vec4<u32>(size, size));
}

// The function along y of a column of texels, and the band, the function along x, of a row of them.
fn function_of_column(warp: Warp, column: i32, size: vec2<u32>) -> u32 {
    return 0u;
}

fn band_of_row(warp: Warp, function: u32, row: i32, size: vec2<u32>) -> u32 {
    return 0u;
}

// Of the texels of a column in a band and of a row, in the map before the warp.
fn place_of_column(warp: Warp, band: u32, column: i32, size: vec2<u32>) -> f32 {
    return f32(column) + 0.5;
}

fn place_of_row(warp: Warp, function: u32, row: i32, size: vec2<u32>) -> f32 {
    return f32(row) + 0.5;
}
