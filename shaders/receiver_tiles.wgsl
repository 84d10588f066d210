// The tiles of a shadow map that receivers look at: the rest of the map need not be drawn.
#import projection
#import lib/receivers
#import lib/image_tiles
#import warp

struct Tiles {
    shift: u32,                         // binary logarithm of the side of a tile
    columns: u32,
    reach: f32,                         // texels around a receiver's place that its lookup may ask for
    padding: u32,
}

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(1) var<uniform> tiles_uniform: Tiles;
@group(0) @binding(2) var<storage, read_write> receiver_tiles: array<atomic<u32>>;

// Of the map.
const WIDTH_OF_BORDER: f32 = 2e-6;

@compute @workgroup_size(IMAGE_TILE.x)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let tiles = tiles_uniform;
    let warp = load_warp();
    let size = vec2<f32>(projection.size);
    let pixel = first_pixel(group, local);
    // Between two functions a receiver may look at either's tiles, as the lookup rounds.
    let sides = select(2u, 1u, is_rectilinear);
    // Neighbours mostly look at the same tiles.
    var known = vec4<u32>(0xffffffffu);
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = pixel.y + i;
        if pixel.x < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, pixel.x, row);
            let texel = centred_texel_from_projected(projection, receiver.q) + projection.centre;
            for (var side = 0u; side < sides; side += 1u) {
                let aside = select(0.0, f32(side) - 0.5, sides == 2u) * WIDTH_OF_BORDER;
                let place = warped_from_linear(warp, texel / size + aside).uv * size;
                let first = vec2<u32>(clamp(place - tiles.reach, vec2<f32>(0.0), size - 1.0));
                let last = vec2<u32>(clamp(place + tiles.reach, vec2<f32>(0.0), size - 1.0));
                let corners = vec4<u32>(first, last) >> vec4<u32>(tiles.shift);
                var is_new = receiver.faces_light && any(corners != known);
                while is_new {
                    known = corners;
                    is_new = false;
                    atomicStore(&receiver_tiles[corners.y * tiles.columns + corners.x], 1u);
                    atomicStore(&receiver_tiles[corners.y * tiles.columns + corners.z], 1u);
                    atomicStore(&receiver_tiles[corners.w * tiles.columns + corners.x], 1u);
                    atomicStore(&receiver_tiles[corners.w * tiles.columns + corners.z], 1u);
                }
            }
        }
    }
}
