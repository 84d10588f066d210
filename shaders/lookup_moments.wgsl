// The receivers of a layer against the moments of its filtered map; twin of src/cpu/lookup/filtered.rs.
#import projection
#import warp
#import lib/receivers
#import lib/lookup_place
#import lib/image_tiles
#import lib/bias
#import lib/moments

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(5) var<storage, read> moment_map: array<f32>;
@group(0) @binding(6) var<storage, read_write> visibility: array<u32>;

// Levels of the map, each of half the texels along each side, one after the other.
override levels: u32 = 1u;

@compute @workgroup_size(IMAGE_TILE.x)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let warp = load_warp();
    let first = first_pixel(group, local);
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = first.y + i;
        if first.x < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, first.x, row);
            if receiver.faces_light {
                let start = place_of_lookup(receivers, projection, warp, receiver);
                // Off the map there is no caster.
                if is_on_map(vec2<f32>(projection.size), start.centred + projection.centre) {
                    let lit = lit_share(receivers, projection, warp, receiver, start);
                    visibility[row * receivers.width + first.x] = bitcast<u32>(lit);
                }
            }
        }
    }
}

fn lit_share(
    receivers: Receivers,
    projection: Projection,
    warp: Warp,
    receiver: Receiver,
    start: LookupPlace,
) -> f32 {
    let bias = bias_of_receiver(receivers, projection, receiver, start.normal);
    let depth = least_lit_depth(receivers, projection, receiver.q, start.normal, bias, vec2<f32>(0.0));
    let linear = clamp(2.0 * stored_depth(projection, depth) - 1.0, -1.0, 1.0);
    var level = 0.0;
    if levels > 1u {
        level = min(level_of_pixel(receivers, projection, warp, receiver), f32(levels - 1u));
    }
    let whole_map = Patch(vec2<i32>(0), vec2<i32>(projection.size) - 1);
    let own_patch = patch_of(warp, start.warped, projection.size);
    var moments = moments_at(projection.size, u32(level), start.place, own_patch);
    let part = fract(level);
    if part > 0.0 {
        let coarse = moments_at(projection.size, u32(level) + 1u, start.place, whole_map);
        moments += part * (coarse - moments);
    }
    return without_bleeding(lit_share_of_moments(moments, moments_of_receiver(linear)));
}

// The level whose texels are as wide as what the receiver's pixel sees, where that is widest.
fn level_of_pixel(receivers: Receivers, projection: Projection, warp: Warp, receiver: Receiver) -> f32 {
    let start = warped_place(projection, warp, receiver.q);
    let width = image_width_at(receiver.depth);
    var widest = 0.0;
    for (var i = 0; i < 2; i += 1) {
        // To the next pixel, and on along its ray to the receiver's plane.
        let across = select(receivers.ray_y, receivers.ray_x, i == 0) * width;
        let slant = dot(receiver.normal, across) / dot(receiver.normal, receiver.ray);
        let step = projected_from_offset(projection, across - receiver.ray * slant);
        widest = max(widest, length(warped_place(projection, warp, receiver.q + step) - start));
    }
    return max(log2(max(widest, 1.0)), 0.0);
}

// Where a point is in the map, after its warp.
fn warped_place(projection: Projection, warp: Warp, q: vec3<f32>) -> vec2<f32> {
    let size = vec2<f32>(projection.size);
    let place = centred_texel_from_projected(projection, q) + projection.centre;
    return warped_from_linear(warp, place / size).uv * size;
}

// Bilinear moments of a level at a place of the map; of the finest one only texels of the patch count.
fn moments_at(map_size: vec2<u32>, level: u32, map_place: vec2<f32>, own_patch: Patch) -> vec4<f32> {
    let count = moments_of_texel();
    var size = map_size;
    var first = 0u;
    for (var i = 0u; i < level; i += 1u) {
        first += size.x * size.y * count;
        size = (size + 1u) / 2u;
    }
    let place = map_place / f32(1u << level) - 0.5;
    let part = place - floor(place);
    let last = vec2<i32>(size) - 1;
    let low = select(vec2<i32>(0), own_patch.low, level == 0u);
    let high = select(last, own_patch.high, level == 0u);
    let corner = vec2<i32>(floor(place));
    let near = clamp(min(max(corner, low), high), vec2<i32>(0), last);
    let far = clamp(min(max(corner + 1, low), high), vec2<i32>(0), last);
    let weights = vec4<f32>(
        (1.0 - part.x) * (1.0 - part.y),
        part.x * (1.0 - part.y),
        (1.0 - part.x) * part.y,
        part.x * part.y,
    );
    var moments = vec4<f32>(0.0);
    for (var i = 0u; i < 4u; i += 1u) {
        let texel = vec2<u32>(select(near, far, vec2<bool>((i & 1u) == 1u, i >= 2u)));
        let of_texel = first + (texel.y * size.x + texel.x) * count;
        for (var k = 0u; k < count; k += 1u) {
            moments[k] += weights[i] * moment_map[of_texel + k];
        }
    }
    return moments;
}
