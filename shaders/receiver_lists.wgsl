// Receivers sorted into the texels of the light's grid, by counting (Johnson et al., "The irregular
// Z-buffer", ACM TOG 24(4), 2005; Aila and Laine, "Alias-free shadow maps", EGSR 2004).
//
//   count     each receiver takes a number in its texel. Most of those in shadow are settled first, by the
//             triangle that a shadow map holds where they are, and take none;
//   sum, scan, place      prefix sums: where each texel's list begins;
//   scatter   receivers to their places;
//   measure   of each tile of texels: the box of its receivers, and the farthest from the light.
//
// The order within a list changes from run to run. No answer depends on it.
#import lib/receivers
#import lib/image_tiles
#import lib/light_grid
#import lib/receiver_ray
#import lib/pairs
#import warp

@group(0) @binding(16) var<storage, read_write> visibility: array<u32>;
// Where the list of each texel begins, and after the last where that ends.
@group(0) @binding(14) var<storage, read_write> starts: array<u32>;
// How many receivers each texel has.
@group(0) @binding(15) var<storage, read_write> counts: array<atomic<u32>>;
// The same, once they are complete: an atomic load costs several common ones.
@group(0) @binding(13) var<storage, read> lengths_of_lists: array<u32>;
// Of each pixel: its texel and its number there.
@group(0) @binding(4) var<storage, read_write> places: array<Pair>;
// Two for each receiver: (x, y), (z, margin) in grid space.
@group(0) @binding(5) var<storage, read_write> listed: array<Pair>;
// One for each receiver: (triangle, pixel).
@group(0) @binding(6) var<storage, read_write> details: array<Pair>;
@group(0) @binding(7) var<storage, read_write> sums: array<u32>;
// Three for each tile: least and greatest linear texel, (farthest z, number of receivers).
@group(0) @binding(8) var<storage, read_write> tiles: array<Pair>;
@group(0) @binding(9) var<storage, read_write> counters: ListCounters;

// Depth and triangle with inverted bits, as the rasterizer stores them.
@group(0) @binding(17) var<storage, read> shadow_map: array<Pair>;

struct ListCounters {
    receivers: u32,
    longest_list: atomic<u32>,
}

const NOWHERE: u32 = 0xffffffffu;
const FAR: f32 = 3.0e38;
// Texels that an invocation adds up.
const SEGMENT: u32 = 256u;
const SCAN_GROUP: u32 = 256u;

// Whether receivers that the shadow map settles are left out of the lists.
override settles: bool = true;

// Whether the receiver is met for sure by the triangle that the shadow map holds in its texel.
fn is_settled(grid: LightGrid, receiver: Receiver, linear: vec2<f32>) -> bool {
    let size = f32(grid.map_size);
    let texel = vec2<u32>(clamp(linear * size, vec2<f32>(0.0), vec2<f32>(size - 1.0)));
    let id = ~first_of(shadow_map[texel.y * grid.map_size + texel.x]);
    var is_candidate = id != 0xffffffffu && id != receiver.triangle;
    var is_hit = false;
    // A while loop that ends at once is skipped where an if is not.
    while is_candidate {
        is_candidate = false;
        let ray = ray_of_receiver(receiver, receivers_uniform.is_local > 0.0);
        is_hit = meets(ray, id, vertices_of_triangle(id), grid.eye_high, grid.eye_low).is_certain;
    }
    return is_hit;
}

@compute @workgroup_size(IMAGE_TILE.x)
fn count(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let grid = light_grid_uniform;
    let warp = load_warp();
    let first = first_pixel(group, local);
    let size = vec2<f32>(f32(grid.size));
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = first.y + i;
        if first.x < receivers.width && row < grid.row_count {
            let receiver = load_receiver(receivers, first.x, grid.first_row + row);
            var place = pair(NOWHERE, 0u);
            let q = grid_from_offset(grid, receiver.point);
            let linear = linear_from_grid(grid, q) / size;
            let is_hit = settles && receiver.faces_light && is_settled(grid, receiver, linear);
            if receiver.faces_light && !is_hit {
                let warped = warped_from_linear(warp, linear).uv * size;
                let texel = vec2<u32>(clamp(warped, vec2<f32>(0.0), size - 1.0));
                let index = texel.y * grid.size + texel.x;
                place = pair(index, atomicAdd(&counts[index], 1u));
            }
            places[row * receivers.width + first.x] = place;
            if is_hit {
                visibility[(grid.first_row + row) * receivers.width + first.x] = IN_SHADOW;
            }

        }
    }
}

// ---- prefix sums ----

@compute @workgroup_size(64)
fn sum(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let grid = light_grid_uniform;
    let texels = grid.size * grid.size;
    let first = invocation.x * SEGMENT;
    if first >= texels {
        return;
    }
    var total = 0u;
    var longest = 0u;
    for (var i = first; i < min(first + SEGMENT, texels); i += 1u) {
        let length = lengths_of_lists[i];
        total += length;
        longest = max(longest, length);
    }
    sums[invocation.x] = total;
    atomicMax(&counters.longest_list, longest);
}

var<workgroup> parts: array<u32, SCAN_GROUP>;

@compute @workgroup_size(SCAN_GROUP)
fn scan(@builtin(local_invocation_index) local: u32) {
    let grid = light_grid_uniform;
    let texels = grid.size * grid.size;
    let segments = (texels + SEGMENT - 1u) / SEGMENT;
    let each = (segments + SCAN_GROUP - 1u) / SCAN_GROUP;
    let first = min(local * each, segments);
    let end = min(first + each, segments);
    var total = 0u;
    for (var i = first; i < end; i += 1u) {
        total += sums[i];
    }
    parts[local] = total;
    workgroupBarrier();
    var before = 0u;
    for (var i = 0u; i < local; i += 1u) {
        before += parts[i];
    }
    for (var i = first; i < end; i += 1u) {
        let own = sums[i];
        sums[i] = before;
        before += own;
    }
    if local == SCAN_GROUP - 1u {
        starts[texels] = before;
        counters.receivers = before;
    }
}

@compute @workgroup_size(64)
fn place(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let grid = light_grid_uniform;
    let texels = grid.size * grid.size;
    let first = invocation.x * SEGMENT;
    if first >= texels {
        return;
    }
    var before = sums[invocation.x];
    for (var i = first; i < min(first + SEGMENT, texels); i += 1u) {
        starts[i] = before;
        before += lengths_of_lists[i];
    }
}

// ---- scatter ----

@compute @workgroup_size(IMAGE_TILE.x)
fn scatter(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let grid = light_grid_uniform;
    let first = first_pixel(group, local);
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = first.y + i;
        if first.x < receivers.width && row < grid.row_count {
            let known = places[row * receivers.width + first.x];
            let texel = first_of(known);
            if texel != NOWHERE {
                let receiver = load_receiver(receivers, first.x, grid.first_row + row);
                let point = receiver.point;
                let q = grid_from_offset(grid, point);
                let margin = margin_of_receiver(receiver, point);
                let slot = starts[texel] + second_of(known);
                listed[2u * slot] = pair(bitcast<u32>(q.x), bitcast<u32>(q.y));
                listed[2u * slot + 1u] = pair(bitcast<u32>(q.z), bitcast<u32>(margin));
                details[slot] = pair(receiver.triangle, (grid.first_row + row) * receivers.width + first.x);
            }
        }
    }
}

// ---- measure ----

// A row of a tile an invocation; the first of each tile joins them.
const ROWS: u32 = 1u << GRID_TILE_SHIFT;
const TILES: u32 = 4u;

var<workgroup> least: array<vec2<f32>, TILES * ROWS>;
var<workgroup> greatest: array<vec2<f32>, TILES * ROWS>;
var<workgroup> farthest: array<f32, TILES * ROWS>;
var<workgroup> lengths: array<u32, TILES * ROWS>;

// Receivers that an invocation looks at: below the iterations after which some drivers stop in silence.
// A row with more is taken to reach everywhere.
const MAX_LOOKED_AT: u32 = 32768u;

@compute @workgroup_size(ROWS, TILES)
fn measure(
    @builtin(workgroup_id) group: vec3<u32>,
    @builtin(local_invocation_id) local: vec3<u32>,
    @builtin(local_invocation_index) index: u32,
) {
    let grid = light_grid_uniform;
    let tile = vec2<u32>(group.x * TILES + local.y, group.y);
    let first = tile << vec2<u32>(GRID_TILE_SHIFT);
    let row = first.y + local.x;
    var low = vec2<f32>(FAR);
    var high = vec2<f32>(-FAR);
    var far = FAR;
    var number = 0u;
    if tile.x < grid.tiles && row < grid.size {
        let start = starts[row * grid.size + first.x];
        let end = starts[row * grid.size + min(first.x + ROWS, grid.size)];
        number = end - start;
        if number > MAX_LOOKED_AT {
            low = vec2<f32>(-FAR);
            high = vec2<f32>(FAR);
            far = -FAR;
        } else {
            for (var i = start; i < end; i += 1u) {
                let z = bitcast<f32>(first_of(listed[2u * i + 1u]));
                let linear = linear_from_grid(grid, vec3<f32>(floats_of(listed[2u * i]), z));
                low = min(low, linear);
                high = max(high, linear);
                far = min(far, z);
            }
        }
    }
    least[index] = low;
    greatest[index] = high;
    farthest[index] = far;
    lengths[index] = number;
    workgroupBarrier();
    if local.x == 0u && tile.x < grid.tiles {
        for (var i = 1u; i < ROWS; i += 1u) {
            low = min(low, least[index + i]);
            high = max(high, greatest[index + i]);
            far = min(far, farthest[index + i]);
            number += lengths[index + i];
        }
        let base = 3u * (tile.y * grid.tiles + tile.x);
        tiles[base] = pair(bitcast<u32>(low.x), bitcast<u32>(low.y));
        tiles[base + 1u] = pair(bitcast<u32>(high.x), bitcast<u32>(high.y));
        tiles[base + 2u] = pair(bitcast<u32>(far), number);
    }
}
