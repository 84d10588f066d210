//! What is taken off a receiver's depth before it is compared with a texel's, twin of `shaders/lib/bias.wgsl`.

use crate::lanes::{Lane, V2, V3};
use crate::projection::Formulas;

/// The sine of the angle below which a surface is edge-on, see `shaders/lib/lookup_place.wgsl`.
const EDGE_ON: f64 = 0.01;
const TEXEL_REACH: f64 = 2.0;
const DISC_REACH: f64 = 10_000.0;

/// The numbers of a bias.
#[derive(Debug, Clone, Copy)]
pub struct Rule<L> {
    /// World units.
    pub constant: L,
    /// Texels.
    pub slope: L,
    /// World units per growth of a texel's beam.
    pub beam: L,
    /// World units that a position may be rounded.
    pub rounding: L,
    /// 1: compare with the receiver's plane on the texel's ray, 0: with the receiver.
    pub receiver_plane: L,
}

impl<L> Rule<L> {
    /// The same in other numbers.
    #[inline(always)]
    pub fn map<M>(self, f: impl Fn(L) -> M) -> Rule<M> {
        Rule {
            constant: f(self.constant),
            slope: f(self.slope),
            beam: f(self.beam),
            rounding: f(self.rounding),
            receiver_plane: f(self.receiver_plane),
        }
    }
}

/// A receiver in the light's projection: its place and its plane's normal, a covector of projection space.
#[derive(Debug, Clone, Copy)]
pub struct Plane<L> {
    pub q: V3<L>,
    pub normal: V3<L>,
}

/// What a rule takes off the depth of one receiver.
#[derive(Debug, Clone, Copy)]
pub struct Bias<L: Lane> {
    pub rounding: L,
    /// The constant and what rounding may do.
    pub even: L,
    /// The same, and what the slope does within a texel.
    pub least: L,
    pub beam: L,
    /// Per texel along each axis.
    pub slope: V2<L>,
    /// Whether the light's rays run along the receiver's plane, which then has no slope.
    pub is_edge_on: L::Mask,
}

impl<L: Lane> Plane<L> {
    /// Whether the ray of a texel, `step` texels from the receiver, says anything of it. `normal` is to the side of
    /// the light.
    #[inline(always)]
    pub fn is_before_surface(
        &self,
        kind: &impl Formulas<L>,
        bias: &Bias<L>,
        step: V2<L>,
    ) -> L::Mask {
        let outward = kind.height_slope(self.normal, self.q);
        !bias.is_edge_on | step.x.constant(0.0).at_most(outward.dot(step))
    }
}

impl<L: Lane> Rule<L> {
    /// `normal` is unit and `from_light` goes from the light to the receiver, both in world axes.
    #[inline(always)]
    pub fn bias_of_receiver(
        &self,
        kind: &impl Formulas<L>,
        plane: &Plane<L>,
        normal: V3<L>,
        from_light: V3<L>,
    ) -> Bias<L> {
        // Rounding moves a depth, and moves it again by the slope where it moves the texel.
        let (zero, one) = (self.rounding.constant(0.0), self.rounding.constant(1.0));
        let cosine = normal.dot(from_light / from_light.length()).abs();
        let is_edge_on = cosine.less(cosine.constant(EDGE_ON));
        let rounding = self.rounding * (one / L::select(is_edge_on, one, cosine));
        let even = self.constant + rounding;
        let slope = kind.depth_slope(plane.normal, plane.q);
        let slope = slope.map(|slope| L::select(is_edge_on, zero, slope.abs()));
        Bias {
            rounding,
            even,
            least: even + self.slope * (slope.x + slope.y),
            beam: self.beam * kind.beam_growth(plane.q),
            slope: slope * self.slope,
            is_edge_on,
        }
    }

    /// The depth that is compared `step` texels from the receiver, moved by no more than `reach`.
    #[inline(always)]
    fn compared_depth(
        &self,
        kind: &impl Formulas<L>,
        plane: &Plane<L>,
        bias: &Bias<L>,
        step: V2<L>,
        reach: f64,
    ) -> L {
        let (step, reach) = (step * self.receiver_plane, self.rounding.constant(reach));
        let on_plane = kind.depth_of_neighbour(plane.normal, plane.q, step, reach);
        L::select(
            bias.is_edge_on,
            kind.depth_from_projected(plane.q),
            on_plane,
        )
    }

    /// The depth that a texel, `step` texels from the receiver, must hold at least to leave it lit.
    #[inline(always)]
    pub fn least_lit_depth(
        &self,
        kind: &impl Formulas<L>,
        plane: &Plane<L>,
        bias: &Bias<L>,
        step: V2<L>,
    ) -> L {
        let depth = self.compared_depth(kind, plane, bias, step, TEXEL_REACH);
        // The farther a curved surface is taken for its plane, the more that is wrong.
        depth - (bias.least + bias.beam * step.length().max(self.rounding.constant(1.0)))
    }

    /// The same of a texel in a disc around the receiver.
    #[inline(always)]
    pub fn least_lit_depth_in_disc(
        &self,
        kind: &impl Formulas<L>,
        plane: &Plane<L>,
        bias: &Bias<L>,
        step: V2<L>,
    ) -> L {
        let depth = self.compared_depth(kind, plane, bias, step, DISC_REACH);
        // The farther, the more a slope's bias must take off.
        let texels = step.map(|s| s.abs().max(s.constant(1.0)));
        depth - (bias.even + bias.beam + bias.slope.dot(texels))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::Shader;
    use crate::projection::{Parallel, Perspective};
    use crate::twin::{Random, Twin, assert_twins};

    const WGSL: &str = "
fn row(i: u32) -> vec3<f32> {
    return vec3<f32>(inputs[i], inputs[i + 1u], inputs[i + 2u]);
}

fn twin(i: u32) -> array<f32, 9> {
    var projection: Projection;
    var receivers: Receivers;
    receivers.constant_bias = inputs[i];
    receivers.slope_bias = inputs[i + 1u];
    receivers.beam_bias = inputs[i + 2u];
    receivers.rounding = inputs[i + 3u];
    receivers.receiver_plane = inputs[i + 4u];
    var receiver: Receiver;
    receiver.q = row(i + 5u);
    receiver.normal = row(i + 11u);
    receiver.from_light = row(i + 14u);
    let normal = row(i + 8u);
    let step = row(i + 17u).xy;
    let bias = bias_of_receiver(receivers, projection, receiver, normal);
    var start: LookupPlace;
    start.is_edge_on = bias.is_edge_on;
    start.outward = height_slope(projection, normal, receiver.q);
    return array<f32, 9>(
        f32(is_before_surface(start, step)),
        bias.rounding, bias.even, bias.least, bias.beam, bias.slope.x, bias.slope.y,
        least_lit_depth(receivers, projection, receiver.q, normal, bias, step),
        least_lit_depth_in_disc(receivers, projection, receiver.q, normal, bias, step),
    );
}
";

    const INPUTS: usize = 20;

    struct Biased {
        is_central: bool,
    }

    fn outputs<L: Lane>(kind: &impl Formulas<L>, inputs: &[L]) -> Vec<L> {
        let row = |i: usize| V3::new(inputs[i], inputs[i + 1], inputs[i + 2]);
        let rule = Rule {
            constant: inputs[0],
            slope: inputs[1],
            beam: inputs[2],
            rounding: inputs[3],
            receiver_plane: inputs[4],
        };
        let (q, normal) = (row(5), row(8));
        let plane = Plane { q, normal };
        let bias = rule.bias_of_receiver(kind, &plane, row(11), row(14));
        let step = row(17).xy();
        let is_before_surface = plane.is_before_surface(kind, &bias, step);
        vec![
            L::select(
                is_before_surface,
                inputs[0].constant(1.0),
                inputs[0].constant(0.0),
            ),
            bias.rounding,
            bias.even,
            bias.least,
            bias.beam,
            bias.slope.x,
            bias.slope.y,
            rule.least_lit_depth(kind, &plane, &bias, step),
            rule.least_lit_depth_in_disc(kind, &plane, &bias, step),
        ]
    }

    impl Twin for Biased {
        fn evaluate<L: Lane>(&self, inputs: &[L]) -> Vec<L> {
            match self.is_central {
                true => outputs(&Perspective, inputs),
                false => outputs(&Parallel, inputs),
            }
        }
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn shaders_of_biases_compute_what_rust_does() {
        for is_central in [false, true] {
            let mut random = Random(1);
            let mut case = || {
                let mut case = [0.0; INPUTS].map(|_: f32| random.number());
                case[4] = random.below(2) as f32;
                if random.below(2) == 0 {
                    // The ray runs along the plane, all but.
                    let [x, y] = [case[14], case[15]];
                    (case[11], case[12], case[13]) = (-y, x, 1e-3 * case[13]);
                }
                case
            };
            let cases: Vec<_> = (0..20_000).map(|_| case()).collect();
            let projection = match is_central {
                true => "projection/perspective",
                false => "projection/parallel",
            };
            let mut shader = Shader::new("lookup");
            shader.fill(projection);
            let source = shader.compose() + WGSL;
            assert_twins(&source, &Biased { is_central }, &cases, &[]);
        }
    }
}
