// Box around the receivers that face the light, in centred texels and depth of the light's projection,
// by a parallel reduction; and how many they are.
#import projection
#import lib/receivers
#import lib/image_tiles

struct Bounds {
    // Order-preserving integers of the negative and of the positive coordinates: the largest of each; zero where no receiver faces the light.
    extremes: array<atomic<u32>, 6>,
    facing: atomic<u32>,
}

@group(0) @binding(0) var<uniform> projection_uniform: Projection;
@group(0) @binding(1) var<storage, read_write> bounds: Bounds;

const GROUP: u32 = IMAGE_TILE.x;

var<workgroup> low: array<vec3<f32>, GROUP>;
var<workgroup> high: array<vec3<f32>, GROUP>;
var<workgroup> counts: array<u32, GROUP>;

fn ordered_from_float(value: f32) -> u32 {
    let bits = bitcast<u32>(value);
    return select(bits | 0x80000000u, ~bits, (bits >> 31u) == 1u);
}

@compute @workgroup_size(GROUP)
fn main(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    var least = vec3<f32>(3.0e38);
    var greatest = vec3<f32>(-3.0e38);
    var count = 0u;
    let first = first_pixel(group, local);
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = first.y + i;
        if first.x < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, first.x, row);
            if receiver.faces_light {
                count += 1u;
                let q = receiver.q;
                let place = vec3<f32>(centred_texel_from_projected(projection, q), depth_from_projected(q));
                least = min(least, place);
                greatest = max(greatest, place);
            }
        }
    }
    low[local] = least;
    high[local] = greatest;
    counts[local] = count;
    for (var half = GROUP / 2u; half > 0u; half /= 2u) {
        workgroupBarrier();
        if local < half {
            low[local] = min(low[local], low[local + half]);
            high[local] = max(high[local], high[local + half]);
            counts[local] += counts[local + half];
        }
    }
    if local == 0u && counts[0] > 0u {
        atomicAdd(&bounds.facing, counts[0]);
        for (var axis = 0u; axis < 3u; axis += 1u) {
            atomicMax(&bounds.extremes[axis], ordered_from_float(-low[0][axis]));
            atomicMax(&bounds.extremes[axis + 3u], ordered_from_float(high[0][axis]));
        }
    }
}
