// Two numbers of 32 bits side by side in memory, and sums of more than 32 bits: one integer of 64 bits. Where a device
// has none it is pair/vec2u.wgsl, with the same bytes. A software driver loads an integer in one go, a vector in two.

alias Pair = u64;

fn pair(low: u32, high: u32) -> Pair {
    return (u64(high) << 32u) | u64(low);
}

fn first_of(value: Pair) -> u32 {
    return u32(value & 0xfffffffflu);
}

fn second_of(value: Pair) -> u32 {
    return u32(value >> 32u);
}

fn floats_of(value: Pair) -> vec2<f32> {
    return vec2<f32>(bitcast<f32>(first_of(value)), bitcast<f32>(second_of(value)));
}

// ---- as an integer ----

fn sum_of(a: Pair, b: Pair) -> Pair {
    return a + b;
}

fn difference_of(a: Pair, b: Pair) -> Pair {
    return a - b;
}

fn is_zero(value: Pair) -> bool {
    return value == 0lu;
}

fn integer_from_float(value: f32) -> Pair {
    return u64(value);
}

fn float_from_integer(value: Pair) -> f32 {
    return f32(value);
}
