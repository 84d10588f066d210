// The tiles of a map that are drawn one by one.
#import lib/projection

// Of a tile, and the most texels of a bound along each side.
const SIDE: i32 = 8;
const FINE_SHIFT: u32 = 3u;

fn tiles_of_map(projection: Projection) -> vec2<u32> {
    return (projection.size + u32(SIDE) - 1u) >> vec2<u32>(FINE_SHIFT);
}
