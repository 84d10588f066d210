// A map of depths and triangles, as target/depth_triangle.wgsl stores them.
#import lib/pairs

@group(0) @binding(5) var<storage, read> shadow_map: array<Pair>;

const NO_TRIANGLE: u32 = 0xffffffffu;

struct Stored {
    depth: f32,                 // beyond every depth where the texel is empty
    triangle: u32,
}

fn load_stored(index: u32) -> Stored {
    let key = shadow_map[index];
    let triangle = ~first_of(key);
    let depth = bitcast<f32>(~second_of(key));
    return Stored(select(depth, 3.0e38, triangle == NO_TRIANGLE), triangle);
}
