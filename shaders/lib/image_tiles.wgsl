// Which pixels a pass over the receivers of a layer looks at: all, or some tiles of the image.

// As in image_tiles.rs.
const IMAGE_TILE: vec2<u32> = vec2<u32>(64u, 32u);

// Tiles that may hold receivers of the layer: column (low half) and row (high half).
@group(0) @binding(22) var<storage, read> image_tiles: array<u32>;

override has_tiles: bool = false;
// Divides the rows of a tile.
override rows_per_invocation: u32 = 1u;

// The first pixel of an invocation, which looks at `rows_per_invocation` of a column; a workgroup has as many
// columns as a tile.
fn first_pixel(group: vec3<u32>, local: u32) -> vec2<u32> {
    var corner = group.xy * vec2<u32>(IMAGE_TILE.x, rows_per_invocation);
    if has_tiles {
        let tile = image_tiles[group.x];
        corner = vec2<u32>(tile & 0xffffu, tile >> 16u) * IMAGE_TILE;
        corner.y += group.y * rows_per_invocation;
    }
    return corner + vec2<u32>(local, 0u);
}
