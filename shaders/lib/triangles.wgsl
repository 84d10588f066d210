// The scene's triangles, relative to a point. Positions are double-single numbers relative to the
// scene's origin: near the point the subtraction of the high parts is exact.
#import lib/tables

@group(0) @binding(1) var vertex_indices: texture_2d<u32>;
@group(0) @binding(2) var positions_high: texture_2d<f32>;
@group(0) @binding(3) var positions_low: texture_2d<f32>;

// False where every low part is zero: then it is not fetched.
override has_low_parts: bool = true;

fn vertices_of_triangle(triangle: u32) -> vec3<u32> {
    return textureLoad(vertex_indices, place_from_index(triangle), 0).xyz;
}

fn offset_from_vertex(vertex: u32, origin_high: vec3<f32>, origin_low: vec3<f32>) -> vec3<f32> {
    let place = place_from_index(vertex);
    let high = textureLoad(positions_high, place, 0).xyz;
    var low = -origin_low;
    if has_low_parts {
        low += textureLoad(positions_low, place, 0).xyz;
    }
    // In another order the sum would lose the low parts. The compilers of Metal and DirectX take any order, but look for
    // no sum behind bits: those that are added here are zero, since no scene has so many vertices.
    let difference = bitcast<vec3<u32>>(high - origin_high) | vec3<u32>(vertex >> 31u);
    return bitcast<vec3<f32>>(difference) + low;
}
