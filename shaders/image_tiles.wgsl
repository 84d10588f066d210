// The visibility image before any caster, and the tiles of the image that may hold receivers of a layer, as tiled
// shading finds those that a light may reach (Olsson and Assarsson, "Tiled shading", 2011).
//
//   begin   the image; of each tile the nearest and the farthest receiver that faces the light
//   list    the tiles whose part of the view, between the two depths, meets the layer's region
#import lib/receivers
#import lib/image_tiles
#import lib/unsure

@group(0) @binding(6) var<storage, read_write> visibility: array<u32>;
// Two for each tile: of the nearest depth the inverted bits, of the farthest the bits; 0 where there is none.
@group(0) @binding(0) var<storage, read_write> ranges: array<atomic<u32>>;
// Pixels that see a surface.
@group(0) @binding(4) var<storage, read_write> seen: atomic<u32>;
// The ranges, once they are complete.
@group(0) @binding(1) var<storage, read> depth_ranges: array<u32>;
@group(0) @binding(2) var<storage, read_write> listed: array<u32>;
// Workgroups for invocations of 1, 2, 4, ... rows: (tiles, workgroups in a tile, 1) each.
@group(0) @binding(3) var<storage, read_write> groups: array<u32>;
// Tiles that were listed, and all there are.
@group(0) @binding(5) var<storage, read_write> counters: vec2<u32>;

fn tiles_of_image(receivers: Receivers) -> vec2<u32> {
    return (vec2<u32>(receivers.width, receivers.height) + IMAGE_TILE - 1u) / IMAGE_TILE;
}

// A tile a workgroup.
@compute @workgroup_size(IMAGE_TILE.x)
fn begin(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let first = group.xy * IMAGE_TILE + vec2<u32>(local, 0u);
    var nearest = 0u;
    var farthest = 0u;
    var seen_here = 0u;
    for (var row = first.y; row < min(first.y + IMAGE_TILE.y, receivers.height); row += 1u) {
        if first.x < receivers.width {
            let receiver = load_receiver(receivers, first.x, row);
            // In shadow where it faces away, lit until a caster is met.
            let lit = select(IN_SHADOW, LIT, receiver.faces_light);
            let pixel = row * receivers.width + first.x;
            visibility[pixel] = select(NO_SURFACE, lit, receiver.is_seen);
            leave_open_if(receiver.is_at_rim, pixel, receiver.triangle, NO_CASTER);
            let depth = bitcast<u32>(receiver.depth);
            nearest = max(nearest, select(0u, ~depth, receiver.faces_light));
            farthest = max(farthest, select(0u, depth, receiver.faces_light));
            seen_here += select(0u, 1u, receiver.is_seen);
        }
    }
    if seen_here != 0u {
        atomicAdd(&seen, seen_here);
    }
    if nearest != 0u {
        let tile = group.y * tiles_of_image(receivers).x + group.x;
        atomicMax(&ranges[2u * tile], nearest);
        atomicMax(&ranges[2u * tile + 1u], farthest);
    }
}

const LIST_GROUP: u32 = 256u;
var<workgroup> count: atomic<u32>;

@compute @workgroup_size(LIST_GROUP)
fn list(@builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let size = tiles_of_image(receivers);
    for (var tile = local; tile < size.x * size.y; tile += LIST_GROUP) {
        let nearest = depth_ranges[2u * tile];
        let depths = vec2<f32>(bitcast<f32>(~nearest), bitcast<f32>(depth_ranges[2u * tile + 1u]));
        let place = vec2<u32>(tile % size.x, tile / size.x);
        if nearest != 0u && meets_region(receivers, place * IMAGE_TILE, depths) {
            listed[atomicAdd(&count, 1u)] = place.x | (place.y << 16u);
        }
    }
    workgroupBarrier();
    let tiles = atomicLoad(&count);
    // Beyond 31 a shift begins again.
    if local <= firstLeadingBit(IMAGE_TILE.y) {
        groups[3u * local] = tiles;
        groups[3u * local + 1u] = IMAGE_TILE.y >> local;
        groups[3u * local + 2u] = 1u;
    }
    if local == 0u {
        counters = vec2<u32>(tiles, size.x * size.y);
    }
}

// Whether no half-space has all corners of the tile's part of the view outside.
fn meets_region(receivers: Receivers, first: vec2<u32>, depths: vec2<f32>) -> bool {
    let end = min(first + IMAGE_TILE, vec2<u32>(receivers.width, receivers.height));
    let low = vec2<f32>(first) - receivers.centre;
    let high = vec2<f32>(end) - receivers.centre;
    var meets = true;
    for (var i = 0u; i < 5u; i += 1u) {
        let plane = receivers.region[i];
        // How fast each corner's ray leaves the plane.
        let along_x = dot(plane.xyz, receivers.ray_x) * vec4<f32>(low.x, high.x, low.x, high.x);
        let along_y = dot(plane.xyz, receivers.ray_y) * vec4<f32>(low.y, low.y, high.y, high.y);
        let ahead = dot(plane.xyz, receivers.ray_z);
        let rates = along_x + along_y + ahead;
        let farthest = select(
            max(rates * depths.x, rates * depths.y),
            along_x + along_y + max(ahead * depths.x, ahead * depths.y),
            is_orthographic,
        );
        let side = max(max(farthest.x, farthest.y), max(farthest.z, farthest.w)) + plane.w;
        meets = meets && side >= -receivers.rounding;
    }
    return meets;
}
