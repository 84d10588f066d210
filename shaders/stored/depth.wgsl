// A map of depths, as target/depth.wgsl stores them.

@group(0) @binding(5) var<storage, read> shadow_map: array<u32>;

const NO_TRIANGLE: u32 = 0xffffffffu;

struct Stored {
    depth: f32,                 // beyond every depth where the texel is empty
    triangle: u32,
}

fn load_stored(index: u32) -> Stored {
    let key = shadow_map[index];
    return Stored(select(bitcast<f32>(~key), 3.0e38, key == 0u), NO_TRIANGLE);
}
