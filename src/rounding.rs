//! What float32 rounds, and how numbers are kept from it.

use glam::{DVec3, Vec3};

/// A float64 vector as the sum of two float32 ones.
pub fn double_single(v: DVec3) -> (Vec3, Vec3) {
    let high = v.as_vec3();
    (high, (v - high.as_dvec3()).as_vec3())
}
