// A map that is stored as a whole, its texels in rows.
#import lib/fine_tiles

// 1 for each fine tile that a receiver looks at, in rows; what is drawn in the others changes no picture.
@group(0) @binding(9) var<storage, read> receiver_tiles: array<u32>;
override has_receiver_tiles: bool = false;

fn index_of_texel(projection: Projection, texel: vec2<u32>) -> u32 {
    return texel.y * projection.size.x + texel.x;
}

// Whether a texel or a tile with that index is stored.
fn is_stored(index: u32) -> bool {
    return true;
}

// In rows, of the tiles from `first` to `last`, which are neighbours or one.
fn indices_of_tiles(projection: Projection, first: vec2<u32>, last: vec2<u32>) -> vec4<u32> {
    let rows = vec2<u32>(first.y, last.y) * tiles_of_map(projection).x;
    return rows.xxyy + vec4<u32>(first.x, last.x, first.x, last.x);
}

// Whether a receiver looks at one of four tiles, by their indices.
fn are_looked_at(tiles: vec4<u32>) -> bool {
    if !has_receiver_tiles {
        return true;
    }
    return (receiver_tiles[tiles.x] | receiver_tiles[tiles.y] | receiver_tiles[tiles.z] | receiver_tiles[tiles.w]) != 0u;
}

// Whether anything is stored of a coarse tile, and of a block of texels in it.
fn has_coarse_tile(tile: vec2<u32>) -> bool {
    return true;
}

fn has_block(projection: Projection, first: vec2<u32>) -> bool {
    return true;
}

// ---- for lookups ----

// Whether a pixel looks into the map.
fn is_chosen(pixel: u32) -> bool {
    return true;
}

// Whether nothing is looked at.
fn is_asking() -> bool {
    return false;
}

fn index_looked_at(projection: Projection, texel: vec2<u32>) -> u32 {
    return index_of_texel(projection, texel);
}
