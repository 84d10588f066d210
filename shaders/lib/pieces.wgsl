// A piece of a triangle in the map: of each corner the centred texel, the depth and w.

struct Piece {
    a: vec4<f32>,
    b: vec4<f32>,
    c: vec4<f32>,
    triangle: u32,
}
