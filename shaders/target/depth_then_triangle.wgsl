// A map of depths with the triangle seen, as target/depth_triangle.wgsl stores them, by atomics of 32 bits. The
// casters are walked twice: first for the nearest depth of each texel, then for the triangle where that depth is met
// again. It is the same pipeline, so that both walks round alike.

@group(0) @binding(5) var<storage, read_write> target_texels: array<atomic<u32>>;
@group(0) @binding(15) var<uniform> walks_before: u32;

fn is_last_walk() -> bool {
    return walks_before == 1u;
}

fn store_texel(index: u32, depth: f32, triangle: u32) {
    let key = ~bitcast<u32>(depth);
    if !is_last_walk() {
        atomicMax(&target_texels[2u * index + 1u], key);
    } else if atomicLoad(&target_texels[2u * index + 1u]) == key {
        atomicMax(&target_texels[2u * index], ~triangle);
    }
}
