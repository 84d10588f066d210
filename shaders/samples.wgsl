// A coarse visibility buffer: every so many pixels of a fine one, as they are.
#import lib/pairs

struct Sampling {
    size: vec2<u32>,            // of the coarse image
    width: u32,                 // of the fine image
    stride: u32,
    first: u32,                 // column and row of the first sample in the fine image
}

@group(0) @binding(0) var<uniform> sampling_uniform: Sampling;
@group(0) @binding(1) var<storage, read> visibility_buffer: array<Pair>;
@group(0) @binding(2) var<storage, read_write> samples: array<Pair>;

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) invocation: vec3<u32>) {
    let sampling = sampling_uniform;
    if all(invocation.xy < sampling.size) {
        let pixel = invocation.xy * sampling.stride + sampling.first;
        samples[invocation.y * sampling.size.x + invocation.x] =
            visibility_buffer[pixel.y * sampling.width + pixel.x];
    }
}
