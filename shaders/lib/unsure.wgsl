// Tests of a receiver against a caster that float32 leaves open: the CPU decides them in float64, see
// src/occlusion.rs.

struct UnsureTests {
    count: atomic<u32>,         // those that found no room among them
    // (pixel, triangle of the receiver, caster) of each. Without a caster the light's cone is asked.
    tests: array<u32>,
}

const NO_CASTER: u32 = 0xffffffffu;

@group(0) @binding(19) var<storage, read_write> unsure: UnsureTests;

fn leave_open_if(is_open: bool, pixel: u32, receiver: u32, caster: u32) {
    var is_left = is_open;
    // A while loop that ends at once is skipped where an if is not.
    while is_left {
        is_left = false;
        let slot = 3u * atomicAdd(&unsure.count, 1u);
        if slot + 2u < arrayLength(&unsure.tests) {
            unsure.tests[slot] = pixel;
            unsure.tests[slot + 1u] = receiver;
            unsure.tests[slot + 2u] = caster;
        }
    }
}
