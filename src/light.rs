//! The lights. They look along their own -Z, as glTF's do.

use crate::error::{Result, ensure_value};
use glam::DVec3;

/// A light that casts shadows.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// Parallel rays along a unit direction, from the light towards the scene.
    Directional { direction: DVec3 },
}

impl Light {
    /// `direction` points from the light towards the scene, in world space, any length but zero.
    pub fn directional(direction: DVec3) -> Result<Self> {
        ensure_value!(
            direction.is_finite(),
            "light direction must be finite, got {:?}",
            direction.to_array()
        );
        // Scaled first, so that neither tiny nor huge vectors under- or overflow.
        let largest = direction.abs().max_element();
        ensure_value!(
            largest > 0.0,
            "light direction must not have zero length, got {:?}",
            direction.to_array()
        );
        Ok(Self::Directional {
            direction: (direction / largest).normalize(),
        })
    }

    /// The vector from a point in the world towards the light; its length is the distance to the
    /// light, or 1 where the light is at infinity.
    pub fn vector_from_point(&self, _point_in_world: DVec3) -> DVec3 {
        match self {
            Self::Directional { direction } => -*direction,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn direction_is_normalized_at_any_length() {
        for length in [1e-300, 1.0, 1e300] {
            let Light::Directional { direction } =
                Light::directional(DVec3::new(3.0, 0.0, -4.0) * length).unwrap();
            assert!((direction - DVec3::new(0.6, 0.0, -0.8)).length() < 1e-15);
        }
    }

    #[test]
    fn zero_and_nan_directions_are_refused() {
        assert!(Light::directional(DVec3::ZERO).is_err());
        assert!(Light::directional(DVec3::new(0.0, f64::NAN, 1.0)).is_err());
    }
}
