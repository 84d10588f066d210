// Triangles with holes, where an alpha image is below its cutoff: sampled at its base level, at the point that a ray
// meets. Twin of src/masks.rs; the tables are from src/gpu/mask_tables.rs.
#import lib/rounding
#import lib/solidity
#import lib/tables

// Of each triangle the row of `mask_corners` that its first corner is in; 0 where it has no holes.
@group(0) @binding(23) var mask_numbers: texture_2d<u32>;
// Two rows of each image: (first texel, columns, rows, wraps), (cutoff, 1 for the
// nearest texel, unused). Then three of each masked triangle:
// (column, row, factor of alpha, first row of the image). What is no whole number is the bits of a float.
@group(0) @binding(24) var mask_corners: texture_2d<u32>;
// Four to the word.
@group(0) @binding(25) var mask_texels: texture_2d<u32>;

const FULL_ALPHA: f32 = 255.0;
// What float32 rounds of an alpha that is put together from four texels.
const ALPHA_ROUNDING: f32 = 2e-4;

// How an image goes on beyond its sides, two bits along each axis.
const WRAP_MIRROR: u32 = 1u;
const WRAP_CLAMP: u32 = 2u;

struct AlphaImage {
    first: u32,
    size: vec2<i32>,
    wraps: vec2<u32>,
    cutoff: f32,
    is_nearest: bool,           // whether the nearest texel is taken, not a mean of four
}

// Column and row in the image, where texels stand at whole numbers, and a factor of alpha.
struct MaskCorners {
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    image: AlphaImage,
}

fn is_masked(triangle: u32) -> bool {
    return textureLoad(mask_numbers, place_from_index(triangle), 0).x != 0u;
}

fn load_mask(triangle: u32) -> MaskCorners {
    let first = textureLoad(mask_numbers, place_from_index(triangle), 0).x;
    let a = textureLoad(mask_corners, place_from_index(first), 0);
    let b = textureLoad(mask_corners, place_from_index(first + 1u), 0);
    let c = textureLoad(mask_corners, place_from_index(first + 2u), 0);
    let image = textureLoad(mask_corners, place_from_index(a.w), 0);
    let rule = textureLoad(mask_corners, place_from_index(a.w + 1u), 0);
    return MaskCorners(
        bitcast<vec3<f32>>(a.xyz),
        bitcast<vec3<f32>>(b.xyz),
        bitcast<vec3<f32>>(c.xyz),
        AlphaImage(
            image.x,
            vec2<i32>(image.yz),
            vec2<u32>(image.w & 3u, image.w >> 2u),
            bitcast<f32>(rule.x),
            rule.y != 0u,
        ),
    );
}

// The texel of a row of so many that stands at a whole number.
fn wrapped_texel(wrap: u32, index: i32, count: i32) -> i32 {
    let period = select(count, 2 * count, wrap == WRAP_MIRROR);
    let within = (index % period + period) % period;
    let texel = select(within, min(within, 2 * count - 1 - within), wrap == WRAP_MIRROR);
    return select(texel, clamp(index, 0, count - 1), wrap == WRAP_CLAMP);
}

fn load_alpha(image: AlphaImage, column: i32, row: i32) -> f32 {
    let x = wrapped_texel(image.wraps.x, column, image.size.x);
    let y = wrapped_texel(image.wraps.y, row, image.size.y);
    let index = image.first + u32(y) * u32(image.size.x) + u32(x);
    let word = textureLoad(mask_texels, place_from_index(index >> 2u), 0).x;
    return f32((word >> (8u * (index & 3u))) & 0xffu);
}

fn alpha_at(image: AlphaImage, place: vec2<f32>) -> f32 {
    let first = floor(select(place, place + 0.5, image.is_nearest));
    let share = select(place - first, vec2<f32>(0.0), image.is_nearest);
    let x = i32(first.x);
    let y = i32(first.y);
    let above = mix(load_alpha(image, x, y), load_alpha(image, x + 1, y), share.x);
    let below = mix(load_alpha(image, x, y + 1), load_alpha(image, x + 1, y + 1), share.x);
    return mix(above, below, share.y);
}

fn place_in_mask(mask: MaskCorners, shares: vec3<f32>) -> vec3<f32> {
    let sum = mask.a * shares.x + mask.b * shares.y + mask.c * shares.z;
    return sum / (shares.x + shares.y + shares.z);
}

// Whether a triangle is there at a point, of which each corner has a share.
fn is_solid(triangle: u32, shares: vec3<f32>) -> bool {
    if !is_masked(triangle) {
        return true;
    }
    let mask = load_mask(triangle);
    let at = place_in_mask(mask, shares);
    return alpha_at(mask.image, at.xy) * at.z >= mask.image.cutoff;
}

// Least and greatest alpha within reach of a place. Between texels no alpha changes by more than all of it.
fn alpha_within(image: AlphaImage, place: vec2<f32>, reach: vec2<f32>) -> vec2<f32> {
    if !image.is_nearest {
        let slack = FULL_ALPHA * (reach.x + reach.y) + ALPHA_ROUNDING;
        return alpha_at(image, place) + vec2<f32>(-slack, slack);
    }
    // Written so that what is no number is beyond it, too.
    if !(max(reach.x, reach.y) < 0.5) {
        return vec2<f32>(0.0, FULL_ALPHA);
    }
    let first = place - reach;
    let last = place + reach;
    let corners = vec4<f32>(
        alpha_at(image, first),
        alpha_at(image, vec2<f32>(last.x, first.y)),
        alpha_at(image, vec2<f32>(first.x, last.y)),
        alpha_at(image, last),
    );
    let low = min(min(corners.x, corners.y), min(corners.z, corners.w));
    return vec2<f32>(low, max(max(corners.x, corners.y), max(corners.z, corners.w)));
}

// The same where the shares may be off by `error` of their sum.
fn solidity_of(triangle: u32, shares: vec3<f32>, error: f32) -> Solidity {
    let mask = load_mask(triangle);
    let at = place_in_mask(mask, shares);
    let low = min(min(mask.a, mask.b), mask.c);
    let high = max(max(mask.a, mask.b), mask.c);
    let reach = error * (high - low) + ROUNDING * max(abs(low), abs(high));
    let within = alpha_within(mask.image, at.xy, reach.xy);
    let cutoff = mask.image.cutoff;
    // What is no number is open.
    return Solidity(
        !(within.y * (at.z + reach.z) < cutoff),
        within.x * max(at.z - reach.z, 0.0) >= cutoff,
    );
}
