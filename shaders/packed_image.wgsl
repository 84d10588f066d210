// The visibility image of a lookup that does not filter, a byte a pixel: 0 in shadow, 1 lit, 2 no surface.
#import lib/invocations
#import lib/receivers

@group(0) @binding(0) var<storage, read> visibility: array<u32>;     // bits of float32
@group(0) @binding(1) var<storage, read_write> packed: array<u32>;   // four pixels to a word, the first in the lowest byte

@compute @workgroup_size(GROUP)
fn main(invocation: Invocation) {
    let word = index_of_invocation(invocation, GROUP);
    if word >= arrayLength(&packed) {
        return;
    }
    var bytes = 0u;
    for (var i = 0u; i < 4u; i += 1u) {
        let bits = visibility[min(4u * word + i, arrayLength(&visibility) - 1u)];
        bytes |= select(u32(bits != IN_SHADOW), 2u, bits == NO_SURFACE) << (8u * i);
    }
    packed[word] = bytes;
}
