// A map of depths. Bits are inverted, so that cleared memory (zero) is the farthest of all and the
// nearest depth wins by a maximum.

@group(0) @binding(5) var<storage, read_write> target_texels: array<atomic<u32>>;

// Whether the casters are not walked again.
fn is_last_walk() -> bool {
    return true;
}

fn store_texel(index: u32, depth: f32, triangle: u32) {
    let key = ~bitcast<u32>(depth);
    atomicMax(&target_texels[index], key);
}
