// A map of depths and triangles, as target/depth_triangle.wgsl stores them.

@group(0) @binding(5) var<storage, read> shadow_map: array<u64>;

const NO_TRIANGLE: u32 = 0xffffffffu;

struct Stored {
    depth: f32,                 // beyond every depth where the texel is empty
    triangle: u32,
}

fn load_stored(index: u32) -> Stored {
    let key = ~shadow_map[index];
    let triangle = u32(key & 0xfffffffflu);
    let depth = bitcast<f32>(u32(key >> 32u));
    return Stored(select(depth, 3.0e38, triangle == NO_TRIANGLE), triangle);
}
