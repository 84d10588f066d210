//! How a shadow map is rasterized, biased and looked up, whichever engine does it.

use crate::bias::Rule;
use crate::moments::FilteredMap;
use crate::projection::Projection;
use crate::rounding::ROUNDING;
use glam::DVec3;

/// How a shadow map is rasterized and looked up.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSettings {
    pub rasterization: Rasterization,
    pub lookup: Comparison,
    pub bias: BiasRule,
}

impl MapSettings {
    /// Whether triangles are looked up, and receivers compared with their planes less what rounding may do, which is what
    /// texels hold: then a texel that holds the receiver's own triangle says nothing against it.
    pub fn knows_own_triangle(self) -> bool {
        let is_on_plane = matches!(self.bias.kind, Bias::Auto | Bias::ReceiverPlane);
        self.lookup.triangles && self.rasterization == Rasterization::Exact && is_on_plane
    }

    /// For a first pass that asks where shadows are: each receiver lit or not.
    pub fn without_filter(self) -> Self {
        Self {
            lookup: Comparison {
                filter: None,
                moments: None,
                ..self.lookup
            },
            ..self
        }
    }
}

/// How triangles become texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rasterization {
    /// Each texel takes its own ray.
    Exact,
    /// As published: corners are projected and warped, edges between them are straight in the map.
    /// Triangles are split until no edge is longer than this share of the map's side.
    Linear { longest_edge: Option<f64> },
}

/// How a receiver is compared with the texels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Comparison {
    /// Texels on each side of the receiver's own.
    pub reach: u8,
    /// Whether the receiver's own light ray is tested against the triangles of those texels.
    pub triangles: bool,
    /// Whether depth tests that all agree decide.
    pub depths: bool,
    /// Depth tests in a disc instead, whose mean is the answer.
    pub filter: Option<Filter>,
    /// Moments of filtered depths instead.
    pub moments: Option<FilteredMap>,
    /// Whether edges of the depth tests are straight where those of the texels are stairs.
    pub is_revectorized: bool,
}

/// Texels that an edge is followed on each side of a receiver, at most; that in the shader.
pub const MAX_RUN: u32 = 16;

/// Percentage closer filtering.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Filter {
    /// Of the disc: in texels of the warped map, or in world units.
    pub radius: f64,
    pub samples: u32,
    /// Whether the disc lies across the receiver's light ray, before the warp, or in the warped map.
    pub is_unwarped: bool,
    /// Whether a test weighs less the farther it is from the receiver, or as much as any other.
    pub is_gaussian: bool,
    /// Whether each pixel turns the disc by an angle of its own.
    pub is_jittered: bool,
}

impl Filter {
    /// Of a test at a point of the unit disc: a Gaussian of half the radius.
    pub fn weight(self, point: [f32; 2]) -> f32 {
        let [x, y] = point;
        match self.is_gaussian {
            true => (-2.0 * (x * x + y * y)).exp(),
            false => 1.0,
        }
    }

    /// The angle that a pixel turns the disc by, from a hash of its place (O'Neill, "PCG", 2014).
    pub fn turn(self, pixel: [u32; 2]) -> f32 {
        if !self.is_jittered {
            return 0.0;
        }
        let seed = pixel[0].wrapping_add(pixel[1].wrapping_mul(65_536));
        let state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
        let hash = (word >> 22) ^ word;
        (hash >> 8) as f32 * (std::f32::consts::TAU / 16_777_216.0)
    }
}

impl Comparison {
    pub const DEPTH: Self = Self {
        reach: 0,
        triangles: false,
        depths: true,
        filter: None,
        moments: None,
        is_revectorized: false,
    };

    pub const REVECTORIZED: Self = Self {
        is_revectorized: true,
        ..Self::DEPTH
    };

    /// Whether it may look at any texel of the map: a disc may be of any size, and an edge is followed far.
    pub fn looks_far(self) -> bool {
        self.is_filtered() || self.is_revectorized
    }

    /// Whether receivers may be lit in part.
    pub fn is_filtered(self) -> bool {
        self.filter.is_some() || self.moments.is_some()
    }

    /// Texels along each side of what is looked at.
    pub fn side(self) -> usize {
        2 * usize::from(self.reach) + 1
    }

    pub fn filtered(filter: Filter) -> Self {
        Self {
            // Without a radius every test is the receiver's own.
            filter: Some(filter).filter(|filter| filter.radius > 0.0),
            ..Self::DEPTH
        }
    }

    pub fn of_moments(map: FilteredMap) -> Self {
        Self {
            moments: Some(map),
            ..Self::DEPTH
        }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Bias {
    /// The receiver's plane on the texel's ray, less the width of a texel and a bound of the rounding.
    Auto,
    Constant,
    Slope,
    ReceiverPlane,
}

/// A kind of bias with its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BiasRule {
    pub kind: Bias,
    /// World units; `None` for the default of the kind.
    pub constant: Option<f64>,
    /// Texels.
    pub slope: f64,
}

impl BiasRule {
    /// The bias of a map, whose positions are known to `rounding`.
    pub fn depth_bias(&self, projection: &Projection, rounding: f64) -> DepthBias {
        let texel_width = projection.kind.beam_width(projection);
        let plane = DepthBias {
            receiver_plane: true,
            rounding,
            ..DepthBias::default()
        };
        let fixed = DepthBias {
            receiver_plane: false,
            ..plane
        };
        match self.kind {
            // Where triangles meet at an angle, a texel's ray meets the neighbour, off the receiver's
            // plane by about a texel. Measured over 16 views of 8 scenes: one texel leaves a quarter
            // of the wrong pixels of none, and no choice from half of one to four leaves fewer than
            // nine tenths of what one does.
            Bias::Auto => DepthBias {
                beam: texel_width,
                ..plane
            },
            Bias::Constant => DepthBias {
                constant: self.constant.unwrap_or(0.0),
                beam: self.constant.map_or(texel_width, |_| 0.0),
                rounding: 0.0,
                ..fixed
            },
            Bias::Slope => DepthBias {
                constant: self.constant.unwrap_or(0.0),
                slope: self.slope,
                ..fixed
            },
            Bias::ReceiverPlane => DepthBias {
                constant: self.constant.unwrap_or(0.0),
                ..plane
            },
        }
    }
}

/// What is taken off a receiver's depth before it is compared.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct DepthBias {
    /// World units.
    pub constant: f64,
    /// World units per unit of depth where a texel's beam widens with it, else world units.
    pub beam: f64,
    /// Texels: times the width of a texel and the slope of the receiver against the light.
    pub slope: f64,
    /// Whether the receiver's plane is evaluated on the texel's own ray.
    pub receiver_plane: bool,
    /// Bound of the rounding error of a depth, world units; none where the user gave the whole bias.
    pub rounding: f64,
}

impl DepthBias {
    /// The same for depths in a projection's unit. So is the growth of a beam.
    pub fn rule(&self, unit: f64) -> Rule<f64> {
        Rule {
            constant: self.constant * unit,
            slope: self.slope,
            beam: self.beam,
            rounding: self.rounding * unit,
            receiver_plane: f64::from(u8::from(self.receiver_plane)),
        }
    }
}

/// A bound of the error of a float32 position in the light's space: positions are sums of a few
/// terms, none larger than the distance of the eye and the size of the map's box together.
pub fn position_rounding(projection: &Projection, eye: DVec3) -> f64 {
    let scale = (eye - projection.origin).length() + projection.kind.extent(projection);
    ROUNDING * scale
}

#[cfg(test)]
mod tests {
    use super::*;

    const AUTO: MapSettings = MapSettings {
        rasterization: Rasterization::Exact,
        lookup: Comparison {
            reach: 1,
            triangles: true,
            ..Comparison::DEPTH
        },
        bias: BiasRule {
            kind: Bias::Auto,
            constant: None,
            slope: 1.0,
        },
    };

    #[test]
    fn only_planes_of_exact_maps_know_their_own_triangle() {
        assert!(AUTO.knows_own_triangle());
        let of_bias = |kind| MapSettings {
            bias: BiasRule { kind, ..AUTO.bias },
            ..AUTO
        };
        assert!(of_bias(Bias::ReceiverPlane).knows_own_triangle());
        // These may be less than a texel's depth is off: as published, a surface then shadows itself.
        assert!(!of_bias(Bias::Constant).knows_own_triangle());
        assert!(!of_bias(Bias::Slope).knows_own_triangle());
        let straight = Rasterization::Linear { longest_edge: None };
        let linear = MapSettings {
            rasterization: straight,
            ..AUTO
        };
        assert!(!linear.knows_own_triangle());
        let depths = MapSettings {
            lookup: Comparison::DEPTH,
            ..AUTO
        };
        assert!(!depths.knows_own_triangle());
    }
}
