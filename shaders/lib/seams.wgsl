// The sides on which a warp of many functions is torn beside a texel: above, below, left and right of its patch.

const SIDES = array<vec2<i32>, 4>(vec2<i32>(0, -1), vec2<i32>(0, 1), vec2<i32>(-1, 0), vec2<i32>(1, 0));

// How many of the texels up to `reach` from one lie beyond its patch, on each side.
fn texels_outside(own_patch: Patch, middle: vec2<i32>, reach: i32) -> vec4<i32> {
    let before = own_patch.low - (middle - reach);
    let after = middle + reach - own_patch.high;
    return min(vec4<i32>(before.y, after.y, before.x, after.x), vec4<i32>(reach));
}

// A bit for each side where there are such texels, and another patch.
fn seam_sides(warp: Warp, warped: Warped, outside: vec4<i32>) -> u32 {
    let has_seam = (outside > vec4<i32>(0)) & has_patches(warp, warped);
    let bits = select(vec4<u32>(0u), vec4<u32>(1u, 2u, 4u, 8u), has_seam);
    return bits.x | bits.y | bits.z | bits.w;
}
