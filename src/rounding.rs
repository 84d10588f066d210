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

/// Of a position relative to the eye, as a share of the scene's size: where float32 rounds by more, it cannot tell
/// what is seen. That is from two thousand times the size of the scene.
pub const MAX_SEEN_ROUNDING: f64 = 1.0 / (1 << 10) as f64;

/// What float64 rounds of a position, as a share of the distances that it is a sum of: 32 times the largest error of
/// rounding one number. A coordinate goes through some ten operations until it is before a ray.
pub const FLOAT64_ROUNDING: f64 = 1.0 / (1_u64 << 48) as f64;

/// A float64 vector as the sum of two float32 ones.
pub fn double_single(v: DVec3) -> (Vec3, Vec3) {
    let high = v.as_vec3();
    (high, (v - high.as_dvec3()).as_vec3())
}
