// The tiles of a shadow map that receivers look at: the rest of the map need not be drawn.
#import projection
#import lib/receivers
#import lib/image_tiles
#import lib/lookup_place
#import warp
#import lib/seams

struct ReceiverTiles {
    shift: u32,                         // binary logarithm of the side of a tile
    columns: u32,
    reach: f32,                         // texels around a receiver's place that its lookup may ask for
}

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(1) var<uniform> tiles_uniform: ReceiverTiles;
@group(0) @binding(2) var<storage, read_write> receiver_tiles: array<atomic<u32>>;

// The lookup of a torn warp begins up to a texel beside the receiver's own, and this pass may round otherwise.
const TORN_REACH: f32 = 1.0;

@compute @workgroup_size(IMAGE_TILE.x)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let tiles = tiles_uniform;
    let warp = load_warp();
    let size = vec2<f32>(projection.size);
    let pixel = first_pixel(group, local);
    let reach = tiles.reach + select(TORN_REACH, 0.0, is_rectilinear);
    // Neighbours mostly look at the same tiles.
    var known = vec4<u32>(0xffffffffu);
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = pixel.y + i;
        if pixel.x < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, pixel.x, row);
            let start = place_of_lookup(receivers, projection, warp, receiver);
            let corners = tiles_around(tiles, start.place, reach, size);
            var is_new = receiver.faces_light && any(corners != known);
            while is_new {
                known = corners;
                is_new = false;
                mark(tiles, corners);
            }
            if !is_rectilinear {
                let own_patch = patch_of(warp, start.warped, projection.size);
                let outside = texels_outside(own_patch, vec2<i32>(start.place), i32(ceil(reach)) + 1);
                var torn = select(0u, seam_sides(warp, start.warped, outside), receiver.faces_light);
                while torn != 0u {
                    let side = SIDES[firstTrailingBit(torn)];
                    torn &= torn - 1u;
                    let across = texel_across(warp, start.linear, start.warped, side, projection.size);
                    mark(tiles, tiles_around(tiles, vec2<f32>(across) + 0.5, reach, size));
                }
            }
        }
    }
}

// Columns and rows of the tiles at the corners of a square around a place.
fn tiles_around(tiles: ReceiverTiles, place: vec2<f32>, reach: f32, size: vec2<f32>) -> vec4<u32> {
    let first = vec2<u32>(clamp(place - reach, vec2<f32>(0.0), size - 1.0));
    let last = vec2<u32>(clamp(place + reach, vec2<f32>(0.0), size - 1.0));
    return vec4<u32>(first, last) >> vec4<u32>(tiles.shift);
}

fn mark(tiles: ReceiverTiles, corners: vec4<u32>) {
    atomicStore(&receiver_tiles[corners.y * tiles.columns + corners.x], 1u);
    atomicStore(&receiver_tiles[corners.y * tiles.columns + corners.z], 1u);
    atomicStore(&receiver_tiles[corners.w * tiles.columns + corners.x], 1u);
    atomicStore(&receiver_tiles[corners.w * tiles.columns + corners.z], 1u);
}
