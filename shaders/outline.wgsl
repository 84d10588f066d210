// Where the receivers that face the light lie across it: what a rotation of the map is fitted to.
//
//   extremes  of each tile of the image the farthest receiver in each of eight directions. The convex
//             hull of all of them is the receivers' but for what bulges out between two directions.
//   samples   the receivers of a regular grid of pixels
#import projection
#import lib/receivers

struct Outline {
    columns: u32,                       // of the grid of `samples`
    step: u32,                          // pixels from one of its columns, or rows, to the next
}

@group(0) @binding(0) var<uniform> outline_uniform: Outline;
// Texels from the axis of the light's projection; NOWHERE where there is no receiver.
@group(0) @binding(1) var<storage, read_write> points: array<vec2<f32>>;
@group(0) @binding(2) var<uniform> projection_uniform: Projection;

const NOWHERE: f32 = 3.0e38;
const GROUP: u32 = 64u;
const EXTREMES: u32 = 8u;
override rows_per_invocation: u32 = 16u;

var<workgroup> reaches: array<f32, EXTREMES * GROUP>;
var<workgroup> places: array<vec2<f32>, EXTREMES * GROUP>;

@compute @workgroup_size(GROUP)
fn extremes(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_index) local: u32) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    var reach: array<f32, EXTREMES>;
    var place: array<vec2<f32>, EXTREMES>;
    for (var d = 0u; d < EXTREMES; d += 1u) {
        reach[d] = -NOWHERE;
        place[d] = vec2<f32>(NOWHERE);
    }
    let column = group.x * GROUP + local;
    for (var i = 0u; i < rows_per_invocation; i += 1u) {
        let row = group.y * rows_per_invocation + i;
        if column < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, column, row);
            if receiver.faces_light {
                let q = centred_texel_from_projected(projection, receiver.q);
                // Along the axes, along the diagonals, and against them.
                let along = vec4<f32>(q, q.x + q.y, q.x - q.y);
                for (var d = 0u; d < 4u; d += 1u) {
                    if along[d] > reach[d] {
                        reach[d] = along[d];
                        place[d] = q;
                    }
                    if -along[d] > reach[d + 4u] {
                        reach[d + 4u] = -along[d];
                        place[d + 4u] = q;
                    }
                }
            }
        }
    }
    for (var d = 0u; d < EXTREMES; d += 1u) {
        reaches[d * GROUP + local] = reach[d];
        places[d * GROUP + local] = place[d];
    }
    workgroupBarrier();
    // One invocation for each direction.
    if local < EXTREMES {
        var farthest = local * GROUP;
        for (var i = farthest + 1u; i < (local + 1u) * GROUP; i += 1u) {
            farthest = select(farthest, i, reaches[i] > reaches[farthest]);
        }
        let columns = (receivers.width + GROUP - 1u) / GROUP;
        points[(group.y * columns + group.x) * EXTREMES + local] = places[farthest];
    }
}

@compute @workgroup_size(64)
fn samples(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let projection = projection_uniform;
    let outline = outline_uniform;
    let column = invocation.x * outline.step + outline.step / 2u;
    let row = invocation.y * outline.step + outline.step / 2u;
    if invocation.x < outline.columns {
        var place = vec2<f32>(NOWHERE);
        if column < receivers.width && row < receivers.height {
            let receiver = load_receiver(receivers, column, row);
            if receiver.faces_light {
                place = centred_texel_from_projected(projection, receiver.q);
            }
        }
        points[invocation.y * outline.columns + invocation.x] = place;
    }
}
