//! Filtered maps: moments of the depths in a filter, and how much of it they say is lit.
//!
//! Depths are linear along the layer, from -1 at its nearest to 1 at its farthest: around 0 least is rounded.

use crate::error::{Result, ensure_value};
use crate::lanes::{Each, Lane};

/// The greatest exponent: the square of what it makes of a depth is still a float32.
pub const MAX_EXPONENT: f64 = 42.0;

/// Of what four moments leave open, as a share of the variance: above what rounding makes of nothing.
const LEAST_REST: f64 = 1e-9;

/// A map whose texels hold moments, filtered before they are looked up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilteredMap {
    pub moments: Moments,
    /// Texels on each side of one that are averaged.
    pub blur: f64,
    pub kernel: Kernel,
    /// Whether coarser maps answer pixels that cover many texels.
    pub mips: bool,
    /// Shares up to it are dark, and the rest is stretched.
    pub bleeding_reduction: f64,
}

/// How much the texels of a blur weigh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kernel {
    /// A Gaussian of half the radius.
    Gaussian,
    /// All the same; that at the end as far as it is within the radius.
    Box,
}

/// Which moments a texel holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Moments {
    /// The mean and the mean square (Donnelly and Lauritzen 2006). No variance is below the least, in squares of
    /// the layer's range of depths.
    Variance { least: f64 },
    /// The same of exponentials of depths, and of those of the negative ones if they have an exponent (Lauritzen and
    /// McCool 2008).
    Exponential {
        exponent: f64,
        negative: Option<f64>,
        least: f64,
    },
    /// Means of four powers (Peters and Klein 2015), mixed with those of both ends of the layer by so much.
    Four { bias: f64 },
}

impl Kernel {
    /// Weights of texels so many from the middle, on to the last that weighs anything; those of both sides add up to 1.
    pub fn weights(self, radius: f64) -> Vec<f32> {
        let reach = radius.ceil() as usize;
        let weight = |offset: usize| match (self, offset) {
            (_, 0) if radius == 0.0 => 1.0,
            (Self::Gaussian, offset) => (-2.0 * (offset as f64 / radius).powi(2)).exp(),
            (Self::Box, offset) => (radius + 0.5 - offset as f64).clamp(0.0, 1.0),
        };
        let weights: Vec<f64> = (0..=reach).map(weight).collect();
        let sum = 2.0 * weights.iter().sum::<f64>() - weights[0];
        weights.iter().map(|weight| (weight / sum) as f32).collect()
    }
}

impl Moments {
    /// How many there are.
    pub fn count(self) -> usize {
        match self {
            Self::Variance { .. } | Self::Exponential { negative: None, .. } => 2,
            Self::Exponential { .. } | Self::Four { .. } => 4,
        }
    }

    /// What exponentials make of a depth, each with the slope there.
    fn warped(self, depth: f32) -> [[f32; 2]; 2] {
        let Self::Exponential {
            exponent, negative, ..
        } = self
        else {
            return [[depth, 1.0]; 2];
        };
        let (up, down) = (exponent as f32, negative.unwrap_or(0.0) as f32);
        let (above, below) = ((up * depth).exp(), -(-down * depth).exp());
        [[above, up * above], [below, -down * below]]
    }

    /// Those of one depth.
    pub fn of_depth(self, depth: f32) -> [f32; 4] {
        match self {
            Self::Four { .. } => {
                let square = depth * depth;
                [depth, square, square * depth, square * square]
            }
            _ => {
                let [[above, _], [below, _]] = self.warped(depth);
                [above, above * above, below, below * below]
            }
        }
    }

    /// What is compared with them: a receiver's depth, or what exponentials make of it and the least variances there.
    pub fn of_receiver(self, depth: f32) -> [f32; 4] {
        let least = match self {
            Self::Four { .. } => return [depth; 4],
            Self::Variance { least } | Self::Exponential { least, .. } => least,
        };
        // Depths run over 2, not 1.
        let deviation = 2.0 * least.sqrt() as f32;
        let [[above, up], [below, down]] = self.warped(depth);
        let [up, down] = [up, down].map(|slope| (slope * deviation).powi(2));
        [above, up, below, down]
    }

    /// How much of the filter is lit at most, in [0, 1].
    #[inline(always)]
    pub fn lit_share<L: Lane>(self, moments: [L; 4], receiver: [L; 4]) -> L {
        let [a, b, c, d] = moments;
        let [depth, least, below, least_below] = receiver;
        match self {
            Self::Four { bias } => lit_share_of_four(moments, depth, bias),
            Self::Variance { .. } | Self::Exponential { negative: None, .. } => {
                one_sided_bound([a, b], depth, least)
            }
            Self::Exponential { .. } => one_sided_bound([a, b], depth, least).min(one_sided_bound(
                [c, d],
                below,
                least_below,
            )),
        }
    }
}

impl FilteredMap {
    /// Refuses mips where so many functions along each axis tear the map.
    pub fn check_warp(&self, functions: usize) -> Result<()> {
        ensure_value!(
            functions == 1 || !self.mips,
            "mips must be False where a warp tears the map, since a coarse texel would mix what lies far apart; got \
             True with {functions} functions along each axis"
        );
        Ok(())
    }

    /// A share as far as it is no light that bleeds.
    #[inline(always)]
    pub fn without_bleeding<L: Lane>(&self, share: L) -> L {
        let (zero, one) = (share.constant(0.0), share.constant(1.0));
        let dark = share.constant(self.bleeding_reduction);
        ((share - dark) / (one - dark)).clamp(zero, one)
    }
}

/// Chebyshev's one-sided inequality: the greatest share of depths with that mean and mean square that may lie at or
/// behind a receiver.
#[inline(always)]
fn one_sided_bound<L: Lane>([mean, square]: [L; 2], depth: L, least: L) -> L {
    let one = mean.constant(1.0);
    let variance = (square - mean * mean).max(least);
    let behind = depth - mean;
    let bound = variance / (variance + behind * behind);
    L::select(depth.at_most(mean), one, bound)
}

/// The greatest share of depths with those four moments that may lie at or behind a receiver: of all such
/// distributions it leaves that with three depths, one of them the receiver's (Hamburger).
///
/// With p the second orthogonal polynomial of the distribution, the kernel K(x, y) = 1 + x y / v + p(x) p(y) / r is zero
/// between two depths of the three, and the share of each is 1 / K(x, x).
#[inline(always)]
fn lit_share_of_four<L: Lane>(moments: [L; 4], depth: L, bias: f64) -> L {
    let constant = |value: f64| depth.constant(value);
    let (zero, one, least) = (constant(0.0), constant(1.0), constant(bias));
    // Half of the bias at each end, where depths are -1 and 1.
    let [mean, b, c, d] = [
        moments[0] - moments[0] * least,
        moments[1] + (one - moments[1]) * least,
        moments[2] - moments[2] * least,
        moments[3] + (one - moments[3]) * least,
    ];
    // Moments around the mean. The bias has a variance of 1.
    let square = mean * mean;
    let v = (b - square).max(least);
    let third = c - mean * (b * constant(3.0) - square * constant(2.0));
    let fourth =
        d - mean * (c * constant(4.0) - mean * (b * constant(6.0) - square * constant(3.0)));
    let skew = third / v;
    let r = (fourth - v * v - third * skew).max(v * constant(LEAST_REST));
    let p = |x: L| x * (x - skew) - v;
    let share = |x: L| {
        let p = p(x);
        one / (one + x * x / v + p * p / r)
    };
    // The other two depths: where a quadratic is zero.
    let x = depth - mean;
    let (a, b) = (p(x) * v, x * r - p(x) * third);
    let c = v * (r - p(x) * v);
    let root = (b * b - a * c * constant(4.0)).max(zero).sqrt();
    let q = (b + L::select(b.less(zero), -root, root)) * constant(-0.5);
    let far = constant(1e3);
    let other = [q / a, c / q].each(|x| L::select(x.abs().less(far), x, far));
    let (low, high) = (other[0].min(other[1]), other[0].max(other[1]));
    let dark = L::select(high.less(x), one - share(x), share(low));
    one - L::select(low.less(x), dark, zero)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::Shader;
    use crate::twin::{Random, Twin, assert_twins};

    #[test]
    fn weights_of_both_sides_add_up_to_one() {
        for kernel in [Kernel::Gaussian, Kernel::Box] {
            assert_eq!(kernel.weights(0.0), [1.0]);
            for radius in [0.3, 1.0, 2.5, 7.0] {
                let weights = kernel.weights(radius);
                let sum = 2.0 * weights.iter().sum::<f32>() - weights[0];
                assert!((sum - 1.0).abs() < 1e-6, "{kernel:?} {radius} {sum}");
                assert!(weights.windows(2).all(|pair| pair[0] >= pair[1]));
            }
        }
        // A width of seven texels.
        let even = [1.0 / 7.0; 4];
        let found = Kernel::Box.weights(3.5);
        assert!((0..4).all(|i| (found[i] - even[i]).abs() < 1e-6) && found[4] == 0.0);
    }

    #[test]
    fn four_moments_know_two_depths() {
        let moments = |share: f64| {
            let mean = |power| share * (-0.6f64).powi(power) + (1.0 - share) * 0.2f64.powi(power);
            [1, 2, 3, 4].map(mean)
        };
        for share in [0.1, 0.5, 0.9] {
            for (depth, dark) in [(-0.8, 0.0), (-0.2, share), (0.1, share), (0.7, 1.0)] {
                let lit = lit_share_of_four(moments(share), depth, 1e-12);
                assert!((lit - (1.0 - dark)).abs() < 1e-4, "{share} {depth} {lit}");
            }
        }
    }

    const WGSL: &str = "
fn twin(i: u32) -> array<f32, 2> {
    let moments = vec4<f32>(inputs[i], inputs[i + 1u], inputs[i + 2u], inputs[i + 3u]);
    let receiver = vec4<f32>(inputs[i + 4u], inputs[i + 5u], inputs[i + 6u], inputs[i + 7u]);
    let share = lit_share_of_moments(moments, receiver);
    return array<f32, 2>(share, without_bleeding(share));
}
";

    impl Twin for FilteredMap {
        fn evaluate<L: Lane>(&self, inputs: &[L]) -> Vec<L> {
            let four = |first: usize| [0, 1, 2, 3].map(|i| inputs[first + i]);
            let share = self.moments.lit_share(four(0), four(4));
            vec![share, self.without_bleeding(share)]
        }
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn shaders_of_moments_compute_what_rust_does() {
        let exponential = |negative| Moments::Exponential {
            exponent: 3.0,
            negative,
            least: 1e-4,
        };
        for (kind, moments) in [
            (0, Moments::Variance { least: 1e-4 }),
            (1, exponential(None)),
            (2, exponential(Some(2.0))),
            (3, Moments::Four { bias: 0.01 }),
        ] {
            let map = FilteredMap {
                moments,
                blur: 0.0,
                kernel: Kernel::Box,
                mips: false,
                bleeding_reduction: 0.25,
            };
            let mut random = Random(4);
            let mut case = || {
                // Means over two depths.
                let share = random.share() as f32;
                let depths = [random.number(), random.number()].map(|depth: f32| depth.sin());
                let [a, b] = depths.map(|depth| moments.of_depth(depth));
                let mean = |i: usize| a[i] + share * (b[i] - a[i]);
                let receiver = moments.of_receiver(random.number().sin());
                let mut case = [0.0; 8];
                for i in 0..4 {
                    (case[i], case[4 + i]) = (mean(i), receiver[i]);
                }
                case
            };
            let cases: Vec<_> = (0..20_000).map(|_| case()).collect();
            let mut source = Shader::new("lib/moments").compose() + WGSL;
            for (name, ty, old, new) in [
                ("moment_kind", "u32", "0u", format!("{kind}u")),
                ("moment_bias", "f32", "0.0", "0.01".to_string()),
                ("bleeding_reduction", "f32", "0.0", "0.25".to_string()),
            ] {
                let declared = |value: &str| format!("override {name}: {ty} = {value};");
                assert!(source.contains(&declared(old)));
                source = source.replace(&declared(old), &declared(&new));
            }
            assert_twins(&source, &map, &cases, &[]);
        }
    }
}
