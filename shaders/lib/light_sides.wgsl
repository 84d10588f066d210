// On which side of a triangle's plane the light is, decided in float64 where float32 may be wrong: src/sides.rs.
#import lib/tables

// 2 bits for each triangle, 16 triangles to a word: 0 where float32 finds the side, else the side plus 2.
@group(0) @binding(18) var light_sides: texture_2d<u32>;

// False where float32 finds all of them: then nothing is fetched.
override has_light_sides: bool = false;

const FOUND_IN_FLOAT32: i32 = 2;

// 1 where the triangle's normal points to the light, -1 where it points away, 0 where the light is in the plane.
fn light_side(triangle: u32) -> i32 {
    if !has_light_sides {
        return FOUND_IN_FLOAT32;
    }
    let word = textureLoad(light_sides, place_from_index(triangle >> 4u), 0).x;
    let code = i32((word >> (2u * (triangle & 15u))) & 3u);
    return select(code - 2, FOUND_IN_FLOAT32, code == 0);
}
