// Moments of depths that run from -1 to 1 along a layer, and how much of a filter they say is lit: twin of
// src/moments.rs, which cites where they come from.

// Which moments: those of a depth, of one exponential of it, of two, or of four powers.
override moment_kind: u32 = 0u;
const VARIANCE: u32 = 0u;
const ONE_EXPONENTIAL: u32 = 1u;
const TWO_EXPONENTIALS: u32 = 2u;
const FOUR_POWERS: u32 = 3u;

override exponent: f32 = 1.0;
override negative_exponent: f32 = 1.0;
// The least standard deviation of depths.
override least_deviation: f32 = 0.0;
override moment_bias: f32 = 0.0;
// Of what four moments leave open, as a share of the variance: above what rounding makes of nothing.
const LEAST_REST: f32 = 1e-9;
override bleeding_reduction: f32 = 0.0;

fn moments_of_texel() -> u32 {
    return select(2u, 4u, moment_kind >= TWO_EXPONENTIALS);
}

// What is compared, and the least variance there, of the depth or of its exponentials.
fn moments_of_receiver(depth: f32) -> vec4<f32> {
    if moment_kind == FOUR_POWERS {
        return vec4<f32>(depth);
    }
    if moment_kind == VARIANCE {
        let least = least_deviation * least_deviation;
        return vec4<f32>(depth, least, depth, least);
    }
    let above = exp(exponent * depth);
    let below = -exp(-negative_exponent * depth);
    let up = exponent * above * least_deviation;
    let down = negative_exponent * below * least_deviation;
    return vec4<f32>(above, up * up, below, down * down);
}

fn moments_of_depth(depth: f32) -> vec4<f32> {
    if moment_kind == FOUR_POWERS {
        let square = depth * depth;
        return vec4<f32>(depth, square, square * depth, square * square);
    }
    let warped = moments_of_receiver(depth);
    return vec4<f32>(warped.x, warped.x * warped.x, warped.z, warped.z * warped.z);
}

// Chebyshev's one-sided inequality.
fn one_sided_bound(moments: vec2<f32>, depth: f32, least: f32) -> f32 {
    let variance = max(moments.y - moments.x * moments.x, least);
    let behind = depth - moments.x;
    return select(variance / (variance + behind * behind), 1.0, depth <= moments.x);
}

// The second orthogonal polynomial, and the share of a depth among three.
fn second_polynomial(x: f32, skew: f32, v: f32) -> f32 {
    return x * (x - skew) - v;
}

fn share_of_depth(x: f32, skew: f32, v: f32, r: f32) -> f32 {
    let p = second_polynomial(x, skew, v);
    return 1.0 / (1.0 + x * x / v + p * p / r);
}

fn lit_share_of_four(moments: vec4<f32>, depth: f32) -> f32 {
    // Half of the bias at each end, where depths are -1 and 1.
    let m = moments + (vec4<f32>(0.0, 1.0, 0.0, 1.0) - moments) * moment_bias;
    // Moments around the mean. The bias has a variance of 1.
    let square = m.x * m.x;
    let v = max(m.y - square, moment_bias);
    let third = m.z - m.x * (m.y * 3.0 - square * 2.0);
    let fourth = m.w - m.x * (m.z * 4.0 - m.x * (m.y * 6.0 - square * 3.0));
    let skew = third / v;
    let r = max(fourth - v * v - third * skew, v * LEAST_REST);
    // The other two depths: where a quadratic is zero.
    let x = depth - m.x;
    let p = second_polynomial(x, skew, v);
    let a = p * v;
    let b = x * r - p * third;
    let c = v * (r - p * v);
    let root = sqrt(max(b * b - 4.0 * a * c, 0.0));
    let q = -0.5 * (b + select(root, -root, b < 0.0));
    var other = vec2<f32>(q / a, c / q);
    other = select(vec2<f32>(1e3), other, abs(other) < vec2<f32>(1e3));
    let low = min(other.x, other.y);
    let high = max(other.x, other.y);
    let dark = select(share_of_depth(low, skew, v, r), 1.0 - share_of_depth(x, skew, v, r), high < x);
    return 1.0 - select(0.0, dark, low < x);
}

// How much of the filter is lit at most.
fn lit_share_of_moments(moments: vec4<f32>, receiver: vec4<f32>) -> f32 {
    if moment_kind == FOUR_POWERS {
        return lit_share_of_four(moments, receiver.x);
    }
    let share = one_sided_bound(moments.xy, receiver.x, receiver.y);
    if moment_kind == TWO_EXPONENTIALS {
        return min(share, one_sided_bound(moments.zw, receiver.z, receiver.w));
    }
    return share;
}

// A share as far as it is no light that bleeds.
fn without_bleeding(share: f32) -> f32 {
    return clamp((share - bleeding_reduction) / (1.0 - bleeding_reduction), 0.0, 1.0);
}
