//! What float32 rounds, argued once, and how numbers are kept from it. Its twin for the shaders is
//! `shaders/lib/rounding.wgsl`.

use glam::{DVec3, Vec3};

/// Of a position, as a share of the distances that it is a sum of: eight times the largest error, 2^-24, of
/// rounding one number. A coordinate is rounded, then goes through two or three more operations.
pub const ROUNDING: f64 = 1.0 / (1 << 21) as f64;

/// Of a receiver in the light's space, as a share of its distance to the eye and the eye's to the light together:
/// it is put together twice, relative to the eye and then to the light.
pub const RECEIVER_ROUNDING: f64 = 2.0 * ROUNDING;

/// Of a box that float64 finds around numbers of float32, as a share of their size: each is rounded once, and once
/// more where it is compared.
pub const BOX_ROUNDING: f64 = 0.25 * ROUNDING;

/// Of a linear function of the texel, as a share of the sizes of its terms.
pub const FUNCTION_ROUNDING: f64 = 2e-6;

/// A float64 vector as the sum of two float32 ones.
pub fn double_single(v: DVec3) -> (Vec3, Vec3) {
    let high = v.as_vec3();
    (high, (v - high.as_dvec3()).as_vec3())
}
