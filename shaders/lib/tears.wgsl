// The sides on which a warp of many functions is torn beside a texel: above, below, left and right of its sheet.

const SIDES = array<vec2<i32>, 4>(vec2<i32>(0, -1), vec2<i32>(0, 1), vec2<i32>(-1, 0), vec2<i32>(1, 0));

// How many of the texels up to `reach` from one lie beyond its sheet, on each side.
fn texels_outside(sheet: Sheet, middle: vec2<i32>, reach: i32) -> vec4<i32> {
    let before = sheet.low - (middle - reach);
    let after = middle + reach - sheet.high;
    return min(vec4<i32>(before.y, after.y, before.x, after.x), vec4<i32>(reach));
}

// A bit for each side where there are such texels, and another sheet.
fn torn_sides(warp: Warp, warped: Warped, outside: vec4<i32>) -> u32 {
    let is_torn = (outside > vec4<i32>(0)) & has_sheets(warp, warped);
    let bits = select(vec4<u32>(0u), vec4<u32>(1u, 2u, 4u, 8u), is_torn);
    return bits.x | bits.y | bits.z | bits.w;
}
