// Tables: lists of vectors in textures, row-major, `1 << ROW_SHIFT` to the row. One load brings a whole
// vector, and a software driver gathers texels eight at a time where it reads buffers one by one.

const ROW_SHIFT: u32 = 12u;

fn place_from_index(index: u32) -> vec2<u32> {
    return vec2<u32>(index & ((1u << ROW_SHIFT) - 1u), index >> ROW_SHIFT);
}
