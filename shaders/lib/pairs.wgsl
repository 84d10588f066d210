// Two numbers of 32 bits side by side, and integers of 64 bits, which not every device has. Of an integer the first one
// is the low half.

alias Pair = vec2<u32>;

fn pair(low: u32, high: u32) -> Pair {
    return vec2<u32>(low, high);
}

fn first_of(value: Pair) -> u32 {
    return value.x;
}

fn second_of(value: Pair) -> u32 {
    return value.y;
}

fn floats_of(value: Pair) -> vec2<f32> {
    return bitcast<vec2<f32>>(value);
}

// ---- as an integer ----

fn sum_of(a: Pair, b: Pair) -> Pair {
    let low = a.x + b.x;
    return vec2<u32>(low, a.y + b.y + select(0u, 1u, low < a.x));
}

fn difference_of(a: Pair, b: Pair) -> Pair {
    return vec2<u32>(a.x - b.x, a.y - b.y - select(0u, 1u, a.x < b.x));
}

fn is_zero(value: Pair) -> bool {
    return all(value == vec2<u32>(0u));
}

const TWO_TO_32: f32 = 4294967296.0;

// Of a whole number.
fn integer_from_float(value: f32) -> Pair {
    let high = floor(value / TWO_TO_32);
    return vec2<u32>(u32(value - high * TWO_TO_32), u32(high));
}

// The leading 32 bits, of which the last one stands for all that follow, are rounded once.
fn float_from_integer(value: Pair) -> f32 {
    let shift = 32u - countLeadingZeros(value.y);
    if shift == 0u {
        return f32(value.x);
    }
    let rest = extractBits(value.x, 0u, shift);
    let leading = insertBits(value.x >> (shift & 31u), value.y, 32u - shift, shift);
    let power_of_two = bitcast<f32>((127u + shift) << 23u);
    return f32(leading | select(0u, 1u, rest != 0u)) * power_of_two;
}
