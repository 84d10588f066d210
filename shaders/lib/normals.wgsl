// Unit normals of the triangles by their winding, rounded from float64: a needle's corners do not give
// one in float32. Zero where the area is zero. The fourth component is the triangle's longest edge.
#import lib/tables

@group(0) @binding(10) var unit_normals: texture_2d<f32>;

fn normal_of_triangle(triangle: u32) -> vec3<f32> {
    return textureLoad(unit_normals, place_from_index(triangle), 0).xyz;
}

fn extent_of_triangle(triangle: u32) -> f32 {
    return textureLoad(unit_normals, place_from_index(triangle), 0).w;
}
