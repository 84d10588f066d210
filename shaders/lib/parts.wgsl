// Parts of triangles: a tile of the map is what one item has at most. Which parts need not be drawn: no
// receiver looks at them, or they lie behind others.
#import lib/coverage
#import lib/fine_tiles
#import paging

fn bound_of_fine_tile(projection: Projection, tile: vec2<i32>) -> Bound {
    let first = tile * SIDE;
    return Bound(first, min(first + SIDE, vec2<i32>(projection.size)) - 1);
}

// Whether a receiver looks at a tile of the bound, whose sides are at most those of a tile.
fn is_looked_at(projection: Projection, bound: Bound) -> bool {
    let first = vec2<u32>(bound.first) >> vec2<u32>(FINE_SHIFT);
    let last = vec2<u32>(bound.last) >> vec2<u32>(FINE_SHIFT);
    return are_looked_at(indices_of_tiles(projection, first, last));
}

// Every band of a bound.
const ALL_BANDS: u32 = 0xffffffffu;

// A part of a triangle that an item is of: what it has in a tile, in one band or in all, or all of a triangle
// that is no larger than a tile and begins in it.
struct Part {
    tile: vec2<u32>,
    band: u32,
    is_whole: bool,
    nearest: f32,                       // in steps of depth; no texel of the part is nearer
}

// In the place of a band.
fn whole_triangle(job: Job) -> u32 {
    return (1u << job.band_bits) - 1u;
}

fn bits_of_part(job: Job, tile: vec2<i32>, band: u32, nearest: f32) -> u32 {
    let step = u32(clamp(nearest * job.steps_per_depth, 0.0, job.last_step));
    let band_shift = job.tile_bits.x + job.tile_bits.y;
    return u32(tile.x) | (u32(tile.y) << job.tile_bits.x) | (band << band_shift)
        | (step << (band_shift + job.band_bits));
}

fn part_from_bits(job: Job, bits: u32) -> Part {
    let band_shift = job.tile_bits.x + job.tile_bits.y;
    let depth_shift = band_shift + job.band_bits;
    let tile = vec2<u32>(
        extractBits(bits, 0u, job.tile_bits.x),
        extractBits(bits, job.tile_bits.x, job.tile_bits.y),
    );
    let band = extractBits(bits, band_shift, job.band_bits);
    return Part(
        tile,
        select(band, ALL_BANDS, job.has_bands == 0u),
        band == whole_triangle(job),
        f32(extractBits(bits, depth_shift, 32u - depth_shift)),
    );
}

// Hierarchical z, after Greene, Kass and Miller, "Hierarchical Z-buffer visibility", 1993: of each fine tile the
// farthest depth of the nearest triangle found that covers all of it. Bits are inverted, as those of a map, so
// zero where there is none. What lies behind is not drawn; the map is the same without it.
@group(0) @binding(13) var<storage, read_write> depths_of_tiles: array<atomic<u32>>;
override culls_hidden: bool = false;

// Of a triangle in a box.
fn depths_in_box(projection: Projection, triangle: Triangle, box: Box) -> vec2<f32> {
    let depths = depths_on_plane_in_box(projection, triangle.plane, box.middle, box.reach);
    let clamped = clamp(depths, vec2<f32>(triangle.depths.x), vec2<f32>(triangle.depths.y));
    return vec2<f32>(clamp_to_nearest(clamped.x, projection.z_floor), clamp_to_nearest(clamped.y, projection.z_floor));
}

// Notes that nothing is seen behind a triangle in a tile, all of which lies in the box, if it covers the box.
fn hide_behind(projection: Projection, triangle: Triangle, box: Box, tile: vec2<i32>) {
    let depths = depths_in_box(projection, triangle, box);
    let is_in_range = depths.x >= projection.z_min && depths.y <= projection.z_max;
    if is_in_range && covers_all(projection, triangle, box) {
        let key = ~bitcast<u32>(stored_depth(projection, depths.y));
        atomicMax(&depths_of_tiles[indices_of_tiles(projection, vec2<u32>(tile), vec2<u32>(tile)).x], key);
    }
}

// Of a tile that is not stored that of the nearest depth: nothing is drawn in it.
fn key_of_tile(index: u32) -> u32 {
    if !is_stored(index) {
        return 0xffffffffu;
    }
    return atomicLoad(&depths_of_tiles[index]);
}

fn is_hidden(job: Job, part: Part) -> bool {
    if !culls_hidden {
        return false;
    }
    let tiles = tiles_of_map(job.projection);
    // A whole triangle may reach into the next ones.
    let last = select(part.tile, min(part.tile + 1u, tiles - 1u), part.is_whole);
    let at = indices_of_tiles(job.projection, part.tile, last);
    let key = min(min(key_of_tile(at.x), key_of_tile(at.y)), min(key_of_tile(at.z), key_of_tile(at.w)));
    // Farther by more than the product is rounded.
    return key != 0u && part.nearest > bitcast<f32>(~key) * job.steps_per_depth + 0.01;
}
