// Casters against the receivers in the texels of the light's grid that they may touch: each receiver's
// own light ray is tested, so the answer is exact wherever the texels lie. Grid space tells, with room for
// its rounding, which receivers a triangle shadows for sure and which it may; lib/receiver_ray decides about
// these.
//
// A triangle of few tiles that have receivers behind it is items at once, others are coarse tiles first.
// The receivers of a row of texels stand side by side in the lists, so a row of a triangle's bound is one
// run of receivers.
//
// The part of an item is a tile, x and y in 8 bits each, and which of its receivers: no item has more than
// PART, so that no invocation comes near the 65,535 iterations after which some drivers stop in silence.
#import lib/light_grid
#import lib/receiver_ray
#import lib/unsure
#import lib/work_items
#import lib/pairs
#import warp

@group(0) @binding(5) var<storage, read> tiles: array<Pair>;
@group(0) @binding(9) var<storage, read> starts: array<u32>;
@group(0) @binding(13) var<storage, read> listed: array<Pair>;
@group(0) @binding(14) var<storage, read> details: array<Pair>;
@group(0) @binding(15) var<storage, read_write> visibility: array<u32>;
@group(0) @binding(16) var<storage, read_write> tests: atomic<u32>;

// Receivers that a lane tests before it looks for its next row or item; at most 32.
override chunk: u32 = 8u;

// With 32 items to an invocation at most 31,000 iterations, those of all nested loops together.
const PART: u32 = 256u;
// Tiles along each side of a triangle that `bin` takes in itself.
const FEW: i32 = 2;

struct Caster {
    a: vec3<f32>,
    b: vec3<f32>,
    c: vec3<f32>,
    // Texels, inclusive; empty where the triangle has no part in front of the light.
    first: vec2<i32>,
    last: vec2<i32>,
    // The corners before the warp, in texels, where all are in front of the light.
    pa: vec2<f32>,
    pb: vec2<f32>,
    pc: vec2<f32>,
    is_whole: bool,
    slack: vec2<f32>,
    farthest: f32,              // corner from the eye, world units
}

// Whether the triangle may have a part inside the grid's pyramid that is nearer to the light than z_near.
fn is_at_light(grid: LightGrid, id: u32, a: vec3<f32>, b: vec3<f32>, c: vec3<f32>) -> bool {
    let reach = 4.0 * grid.z_near + grid.rounding;
    let normal = grid_from_offset(grid, normal_of_triangle(id));
    return abs(dot(normal, a - grid.light)) <= reach
        && all(min(min(a, b), c) - grid.light <= vec3<f32>(reach))
        && all(max(max(a, b), c) - grid.light >= vec3<f32>(-reach));
}

fn load_caster(grid: LightGrid, warp: Warp, id: u32) -> Caster {
    let corners = corners_in_grid(grid, id);
    let a = corners[0];
    let b = corners[1];
    let c = corners[2];
    let farthest = max(max(absolute_sum(a), absolute_sum(b)), absolute_sum(c));
    var caster = Caster(a, b, c, vec2<i32>(0), vec2<i32>(-1), vec2<f32>(), vec2<f32>(), vec2<f32>(), true, vec2<f32>(), farthest);
    caster.pa = linear_from_grid(grid, a);
    caster.pb = linear_from_grid(grid, b);
    caster.pc = linear_from_grid(grid, c);
    var low = min(min(caster.pa, caster.pb), caster.pc);
    var high = max(max(caster.pa, caster.pb), caster.pc);
    var nearest = 1.0;
    if is_local {
        let depths = grid.light.z - vec3<f32>(a.z, b.z, c.z);
        nearest = max(min(min(depths.x, depths.y), depths.z), grid.z_near);
        if all(depths < vec3<f32>(grid.z_near)) && !is_at_light(grid, id, a, b, c) {
            return caster;
        }
        caster.is_whole = all(depths >= vec3<f32>(grid.z_near));
        if !caster.is_whole {
            let da = vec3<f32>(a.xy - grid.light.xy, depths.x);
            let db = vec3<f32>(b.xy - grid.light.xy, depths.y);
            let dc = vec3<f32>(c.xy - grid.light.xy, depths.z);
            let ends = array<vec3<f32>, 4>(da, db, dc, da);
            low = vec2<f32>(3.0e38);
            high = vec2<f32>(-3.0e38);
            for (var i = 0; i < 3; i += 1) {
                let p = ends[i];
                let q = ends[i + 1];
                let is_seen = p.z >= grid.z_near;
                var slope = p.xy / select(1.0, p.z, is_seen);
                low = select(low, min(low, slope), is_seen);
                high = select(high, max(high, slope), is_seen);
                let crosses = is_seen != (q.z >= grid.z_near);
                let t = (grid.z_near - p.z) / select(1.0, q.z - p.z, crosses);
                slope = mix(p.xy, q.xy, t) / grid.z_near;
                low = select(low, min(low, slope), crosses);
                high = select(high, max(high, slope), crosses);
            }
            low = low * grid.scale + grid.offset;
            high = high * grid.scale + grid.offset;
            if is_at_light(grid, id, a, b, c) {
                low = vec2<f32>(0.0);
                high = vec2<f32>(f32(grid.size));
            }
        }
    }
    let size = vec2<f32>(f32(grid.size));
    caster.slack = TEXEL_ROUNDING + (grid.rounding / nearest) * abs(grid.scale);
    low -= caster.slack;
    high += caster.slack;
    if any(low >= size) || any(high < vec2<f32>(0.0)) {
        return caster;
    }
    if IS_WARPED {
        let image = warped_bound(warp, clamp(low / size, vec2<f32>(0.0), vec2<f32>(1.0)), clamp(high / size, vec2<f32>(0.0), vec2<f32>(1.0)));
        low = image.xy * size - TEXEL_ROUNDING;
        high = image.zw * size + TEXEL_ROUNDING;
    }
    caster.first = vec2<i32>(clamp(low, vec2<f32>(0.0), size - 1.0));
    caster.last = vec2<i32>(clamp(high, vec2<f32>(0.0), size - 1.0));
    return caster;
}

// ---- bin and split ----

// Whether all of a box is on the outer side of the line from a to b, seen from c.
fn is_beyond(a: vec2<f32>, b: vec2<f32>, c: vec2<f32>, middle: vec2<f32>, half: vec2<f32>) -> bool {
    let d = b - a;
    let normal = vec2<f32>(d.y, -d.x) * select(1.0, -1.0, d.y * (c.x - a.x) - d.x * (c.y - a.y) < 0.0);
    let reach = dot(abs(normal), half);
    // Rounding of the products, with room.
    let slack = 1e-5 * (abs(normal.x * (middle.x - a.x)) + abs(normal.y * (middle.y - a.y)));
    return dot(normal, middle - a) < -reach - slack;
}

// Whether no ray of a local light through the box of slopes can meet the triangle: the box is outside of
// the plane through the light and an edge (Olano and Greer, 1997).
fn is_outside(grid: LightGrid, caster: Caster, low: vec2<f32>, high: vec2<f32>) -> bool {
    let a = vec3<f32>(caster.a.xy - grid.light.xy, grid.light.z - caster.a.z);
    let b = vec3<f32>(caster.b.xy - grid.light.xy, grid.light.z - caster.b.z);
    let c = vec3<f32>(caster.c.xy - grid.light.xy, grid.light.z - caster.c.z);
    let middle = (0.5 * (low + high) - grid.offset) / grid.scale;
    let half = 0.5 * (high - low) / grid.scale;
    let ea = cross(b, c - b);
    let eb = cross(c, a - c);
    let ec = cross(a, b - a);
    let volume = dot(a, ea);
    // Of products of positions, each known to `rounding`.
    let size = max(max(absolute_sum(a), absolute_sum(b)), absolute_sum(c));
    let room = 4.0 * grid.rounding * size;
    if abs(volume) <= room * size {
        return false;
    }
    let side = sign(volume);
    let u = vec3<f32>(middle, 1.0);
    let e = side * vec3<f32>(dot(ea, u), dot(eb, u), dot(ec, u));
    let reach = vec3<f32>(dot(abs(ea.xy), half), dot(abs(eb.xy), half), dot(abs(ec.xy), half));
    return any(e < -(reach + room * (1.0 + absolute_sum(u))));
}

// Lists the triangle in a tile, in parts, if it may shadow a receiver there. Gives their number.
fn append_if_touched(grid: LightGrid, caster: Caster, id: u32, tile: vec2<i32>) -> u32 {
    let base = 3u * (u32(tile.y) * grid.tiles + u32(tile.x));
    let range = tiles[base + 2u];
    let number = second_of(range);
    let nearest = max(max(caster.a.z, caster.b.z), caster.c.z);
    if number == 0u || nearest < bitcast<f32>(first_of(range)) - grid.rounding {
        return 0u;
    }
    let low = floats_of(tiles[base]) - caster.slack;
    let high = floats_of(tiles[base + 1u]) + caster.slack;
    if all(high < vec2<f32>(1.0e38)) {
        let middle = 0.5 * (low + high);
        let half = 0.5 * (high - low);
        var is_apart = false;
        if caster.is_whole {
            is_apart = any(max(max(caster.pa, caster.pb), caster.pc) < low)
                || any(min(min(caster.pa, caster.pb), caster.pc) > high);
        }
        if is_local {
            is_apart = is_apart || is_outside(grid, caster, low, high);
        } else {
            is_apart = is_apart
                || is_beyond(caster.pa, caster.pb, caster.pc, middle, half)
                || is_beyond(caster.pb, caster.pc, caster.pa, middle, half)
                || is_beyond(caster.pc, caster.pa, caster.pb, middle, half);
        }
        if is_apart {
            return 0u;
        }
    }
    let parts = (number + PART - 1u) / PART;
    let slot = atomicAdd(&counters.items, parts);
    for (var part = 0u; part < parts; part += 1u) {
        if slot + part < arrayLength(&items) {
            items[slot + part] = Item(id, u32(tile.x) | (u32(tile.y) << 8u) | (part << 16u));
        }
    }
    return parts;
}

@compute @workgroup_size(GROUP)
fn bin(invocation: Invocation) {
    let grid = light_grid_uniform;
    let warp = load_warp();
    let start = index_of_invocation(invocation, GROUP * items_per_invocation);
    var outside = 0u;
    var behind = 0u;
    for (var i = 0u; i < items_per_invocation; i += 1u) {
        let id = grid.first_triangle + start + i * GROUP;
        if id >= grid.end_triangle {
            break;
        }
        let caster = load_caster(grid, warp, id);
        let first = caster.first >> vec2<u32>(GRID_TILE_SHIFT);
        let last = caster.last >> vec2<u32>(GRID_TILE_SHIFT);
        if any(caster.last < caster.first) {
            outside += 1u;
        } else if all(last - first < vec2<i32>(FEW)) {
            var listed_parts = 0u;
            for (var y = first.y; y <= last.y; y += 1) {
                for (var x = first.x; x <= last.x; x += 1) {
                    listed_parts += append_if_touched(grid, caster, id, vec2<i32>(x, y));
                }
            }
            behind += u32(listed_parts == 0u);
        } else {
            let coarse_first = caster.first >> vec2<u32>(grid.coarse_shift);
            let coarse_last = caster.last >> vec2<u32>(grid.coarse_shift);
            var tile = coarse_first;
            while tile.y <= coarse_last.y {
                append_coarse_item(id, u32(tile.x) | (u32(tile.y) << 8u));
                tile.x += 1;
                if tile.x > coarse_last.x {
                    tile = vec2<i32>(coarse_first.x, tile.y + 1);
                }
            }
        }
    }
    atomicAdd(&counters.outside, outside);
    atomicAdd(&counters.behind, behind);
}

@compute @workgroup_size(GROUP)
fn split(invocation: Invocation) {
    let grid = light_grid_uniform;
    let warp = load_warp();
    let index = index_of_invocation(invocation, GROUP);
    if index >= coarse_item_count() {
        return;
    }
    let item = coarse_items[index];
    let caster = load_caster(grid, warp, item.triangle);
    let corner = vec2<i32>(vec2<u32>(item.part & 0xffu, item.part >> 8u) << vec2<u32>(grid.coarse_shift));
    let side = 1 << grid.coarse_shift;
    let first = max(corner, caster.first) >> vec2<u32>(GRID_TILE_SHIFT);
    let last = min(corner + side - 1, caster.last) >> vec2<u32>(GRID_TILE_SHIFT);
    var tile = first;
    while tile.y <= last.y {
        append_if_touched(grid, caster, item.triangle, tile);
        tile.x += 1;
        if tile.x > last.x {
            tile = vec2<i32>(first.x, tile.y + 1);
        }
    }
}

// ---- walk ----

// Least and greatest x of an edge within a band of rows.
fn grown_by_edge(span: vec2<f32>, a: vec2<f32>, b: vec2<f32>, low: f32, high: f32) -> vec2<f32> {
    let reaches = max(a.y, b.y) >= low && min(a.y, b.y) <= high;
    let d = b - a;
    // A flat edge has all of its x in the band.
    let is_flat = abs(d.y) < 1e-3;
    let slope = d.x / select(d.y, 1.0, is_flat);
    let from_y = clamp(a.y, low, high);
    let to_y = clamp(b.y, low, high);
    let xs = select(vec2<f32>(a.x + (from_y - a.y) * slope, b.x + (to_y - b.y) * slope), vec2<f32>(a.x, b.x), is_flat);
    return select(span, vec2<f32>(min(span.x, min(xs.x, xs.y)), max(span.y, max(xs.x, xs.y))), reaches);
}

// First and last texel of a row that the triangle may touch.
fn span_of_row(grid: LightGrid, caster: Caster, row: i32, first: i32, last: i32) -> vec2<i32> {
    if IS_WARPED || !caster.is_whole {
        // The edges are no lines here.
        return vec2<i32>(first, last);
    }
    let low = f32(row) - caster.slack.y;
    let high = f32(row) + 1.0 + caster.slack.y;
    var span = vec2<f32>(3.0e38, -3.0e38);
    span = grown_by_edge(span, caster.pa, caster.pb, low, high);
    span = grown_by_edge(span, caster.pb, caster.pc, low, high);
    span = grown_by_edge(span, caster.pc, caster.pa, low, high);
    // Rounding of a crossing far along an edge.
    let room = caster.slack.x + SHORT_ROUNDING * max(abs(caster.pa.x), max(abs(caster.pb.x), abs(caster.pc.x)));
    let from_x = clamp(span.x - room, f32(first), f32(last + 1));
    let to_x = clamp(span.y + room, f32(first - 1), f32(last));
    return vec2<i32>(vec2<f32>(floor(from_x), floor(to_x)));
}

// The ray of a receiver in grid space, and how far a corner relative to the receiver may be off there.
struct GridRay {
    ray: LightRay,
    room: f32,
}

fn grid_ray(grid: LightGrid, caster: Caster, q: vec3<f32>, margin: f32) -> GridRay {
    let room = ROUNDING * (caster.farthest + absolute_sum(q)) + margin;
    let shear = slope_of_ray(grid, q);
    if is_far_away {
        return GridRay(LightRay(shear, 1.0 / grid.light.z - q.z), 2.0 * room * (1.0 + abs(shear.x) + abs(shear.y)));
    }
    if is_local {
        let to_light = grid.light - q;
        // The ray itself turns by its ends' rounding.
        let reach = max(max(abs(caster.a.z - q.z), abs(caster.b.z - q.z)), abs(caster.c.z - q.z)) / to_light.z;
        let turned = (1.0 + reach) * (1.0 + abs(shear.x) + abs(shear.y));
        return GridRay(LightRay(shear, to_light.z), (room + ROUNDING * absolute_sum(grid.light)) * turned);
    }
    return GridRay(LightRay(shear, 3.0e38), room);
}

// Whether the triangle is met for sure on the light ray of the receiver in a pixel; what float32 does not know is
// left open.
fn shadows_pixel(grid: LightGrid, id: u32, pixel: u32) -> bool {
    let width = receivers_uniform.width;
    let receiver = load_receiver(receivers_uniform, pixel % width, pixel / width);
    let ray = ray_of_receiver(receiver, receivers_uniform.is_local > 0.0);
    let met = meets(ray, id, vertices_of_triangle(id), grid.eye_high, grid.eye_low);
    leave_open_if(met.is_possible && !met.is_certain, pixel, receiver.triangle, id);
    return met.is_certain;
}

@compute @workgroup_size(GROUP)
fn walk(invocation: Invocation) {
    let grid = light_grid_uniform;
    let warp = load_warp();
    let start = index_of_invocation(invocation, GROUP * items_per_invocation);
    let end = min(start + GROUP * items_per_invocation, item_count());
    var index = start;
    var caster: Caster;
    var id = 0u;
    var first = vec2<i32>(0);
    var last = vec2<i32>(-1);
    var row = 0;
    // The run of receivers, and what is left to skip and to take of the item's part.
    var next = 0u;
    var run_end = 0u;
    var skipped = 0u;
    var left = 0u;
    var tested = 0u;
    while index < end || row <= last.y || next < run_end {
        // A while loop that ends at once is skipped where an if is not.
        while next >= run_end && row > last.y && index < end {
            let item = items[index];
            index += GROUP;
            id = item.triangle;
            caster = load_caster(grid, warp, id);
            let corner = vec2<i32>(vec2<u32>(item.part & 0xffu, (item.part >> 8u) & 0xffu) << vec2<u32>(GRID_TILE_SHIFT));
            first = max(corner, caster.first);
            last = min(corner + (1 << GRID_TILE_SHIFT) - 1, caster.last);
            row = first.y;
            skipped = (item.part >> 16u) * PART;
            left = PART;
        }
        while next >= run_end && row <= last.y {
            let span = span_of_row(grid, caster, row, first.x, last.x);
            if span.x <= span.y {
                let line = u32(row) * grid.size;
                next = starts[line + u32(span.x)];
                run_end = starts[line + u32(span.y) + 1u];
                let length = run_end - next;
                let skip = min(skipped, length);
                skipped -= skip;
                next += skip;
                run_end = min(run_end, next + left);
                left -= run_end - next;
            }
            row = select(row + 1, last.y + 1, left == 0u);
        }
        // A bit for each receiver of the chunk that grid space leaves undecided.
        var unsure = 0u;
        for (var i = 0u; i < chunk; i += 1u) {
            let slot = next + i;
            if slot < run_end {
                tested += 1u;
                let xy = floats_of(listed[2u * slot]);
                let z_and_margin = floats_of(listed[2u * slot + 1u]);
                let q = vec3<f32>(xy, z_and_margin.x);
                let a = caster.a - q;
                let b = caster.b - q;
                let c = caster.c - q;
                let in_grid = grid_ray(grid, caster, q, z_and_margin.y);
                let edges = meet_edges(in_grid.ray.shear, a, b, c, in_grid.room);
                var is_candidate = edges.may_be_inside && max(max(a.z, b.z), c.z) > -in_grid.room;
                while is_candidate {
                    is_candidate = false;
                    let detail = details[slot];
                    let normal = grid_from_offset(grid, normal_of_triangle(id));
                    let met = meeting(in_grid.ray, edges, a, b, c, normal, in_grid.room);
                    let is_own = first_of(detail) == id;
                    if met.is_certain && !is_own && !is_masked(id) {
                        visibility[second_of(detail)] = IN_SHADOW;
                    } else if met.is_possible && !is_own {
                        unsure |= 1u << i;
                    }
                }
            }
        }
        while unsure != 0u {
            let pixel = second_of(details[next + firstTrailingBit(unsure)]);
            unsure &= unsure - 1u;
            if shadows_pixel(grid, id, pixel) {
                visibility[pixel] = IN_SHADOW;
            }
        }
        next = min(next + chunk, run_end);
    }
    atomicAdd(&tests, tested);
}
