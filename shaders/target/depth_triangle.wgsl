// A map of depths with the triangle seen. Bits are inverted, so that cleared memory (zero) is the
// farthest of all; the nearest depth wins by a maximum, and among equals the lowest triangle: the
// answer does not depend on the order of execution.

@group(0) @binding(5) var<storage, read_write> target_texels: array<atomic<u64>>;

// Whether the casters are not walked again.
fn is_last_walk() -> bool {
    return true;
}

fn store_texel(index: u32, depth: f32, triangle: u32) {
    let key = (u64(~bitcast<u32>(depth)) << 32u) | u64(~triangle);
    atomicMax(&target_texels[index], key);
}
