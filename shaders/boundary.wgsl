// Where the boundaries of the shadows are in the image, by blocks of 4 x 4 pixels:
//
//   mark    which blocks hold lit receivers that face the light, and which hold receivers in shadow
//   weigh   a block that holds both, alone or with its eight neighbours, weighs more: its pixels are
//           within 4 to 8 pixels of a boundary
#import lib/receivers

@group(0) @binding(0) var<storage, read> visibility: array<f32>;
@group(0) @binding(1) var<storage, read_write> marks: array<u32>;
@group(0) @binding(2) var<storage, read_write> weights: array<f32>;

const BOUNDARY_BLOCK: u32 = 4u;
const HAS_LIT: u32 = 1u;
const HAS_SHADOWED: u32 = 2u;

override boundary_weight: f32 = 20.0;

@compute @workgroup_size(64)
fn mark(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let columns = (receivers.width + BOUNDARY_BLOCK - 1u) / BOUNDARY_BLOCK;
    if invocation.x >= columns {
        return;
    }
    var found = 0u;
    for (var i = 0u; i < BOUNDARY_BLOCK * BOUNDARY_BLOCK; i += 1u) {
        let column = invocation.x * BOUNDARY_BLOCK + i % BOUNDARY_BLOCK;
        let row = invocation.y * BOUNDARY_BLOCK + i / BOUNDARY_BLOCK;
        if column < receivers.width && row < receivers.height {
            if load_receiver(receivers, column, row).faces_light {
                let is_lit = visibility[row * receivers.width + column] > 0.5;
                found |= select(HAS_SHADOWED, HAS_LIT, is_lit);
            }
        }
    }
    marks[invocation.y * columns + invocation.x] = found;
}

@compute @workgroup_size(64)
fn weigh(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let receivers = receivers_uniform;
    let columns = i32((receivers.width + BOUNDARY_BLOCK - 1u) / BOUNDARY_BLOCK);
    let rows = i32((receivers.height + BOUNDARY_BLOCK - 1u) / BOUNDARY_BLOCK);
    let place = vec2<i32>(invocation.xy);
    if place.x >= columns {
        return;
    }
    var found = 0u;
    for (var y = max(place.y - 1, 0); y <= min(place.y + 1, rows - 1); y += 1) {
        for (var x = max(place.x - 1, 0); x <= min(place.x + 1, columns - 1); x += 1) {
            found |= marks[y * columns + x];
        }
    }
    weights[place.y * columns + place.x] = select(1.0, boundary_weight, found == (HAS_LIT | HAS_SHADOWED));
}
