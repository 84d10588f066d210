//! The lights. They look along their own -Z, as glTF's do.

use crate::error::{Result, ensure_value};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// A light that casts shadows.
#[derive(Debug, Clone, PartialEq)]
pub enum Light {
    /// Parallel rays along a unit direction, from the light towards the scene.
    Directional { direction: DVec3 },
    /// Rays from a point, to all sides.
    Point { position: DVec3 },
    /// Rays from a point within a cone around the unit axis; half the opening is `outer`, radians.
    Spot {
        position: DVec3,
        axis: DVec3,
        outer: f64,
    },
    /// Rays from a point to the side of the unit axis.
    Hemisphere { position: DVec3, axis: DVec3 },
}

/// Directions within half the opening of the axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cone {
    pub axis: DVec3,
    pub cosine: f64,
    pub sine: f64,
}

impl Cone {
    /// How far inside its surface the end of a vector from the light is.
    pub fn depth_of(&self, from_light: DVec3) -> f64 {
        let aside = self.aside(from_light);
        self.sine * from_light.dot(self.axis) - self.cosine * aside.length()
    }

    /// The vector from the axis to the end of one from the light.
    pub fn aside(&self, from_light: DVec3) -> DVec3 {
        from_light.reject_from_normalized(self.axis)
    }
}

/// The unit vector along a direction of any length but zero.
fn unit_vector(name: &str, vector: DVec3) -> Result<DVec3> {
    ensure_value!(
        vector.is_finite(),
        "light {name} must be finite, got {:?}",
        vector.to_array()
    );
    // Scaled first, so that neither tiny nor huge vectors under- or overflow.
    let largest = vector.abs().max_element();
    ensure_value!(
        largest > 0.0,
        "light {name} must not have zero length, got {:?}",
        vector.to_array()
    );
    Ok((vector / largest).normalize())
}

fn finite_position(position: DVec3) -> Result<DVec3> {
    ensure_value!(
        position.is_finite(),
        "light position must be finite, got {:?}",
        position.to_array()
    );
    Ok(position)
}

impl Light {
    /// `direction` points from the light towards the scene, in world space, any length but zero.
    pub fn directional(direction: DVec3) -> Result<Self> {
        Ok(Self::Directional {
            direction: unit_vector("direction", direction)?,
        })
    }

    pub fn point(position: DVec3) -> Result<Self> {
        Ok(Self::Point {
            position: finite_position(position)?,
        })
    }

    /// `outer` is the angle between the axis and the edge of the cone, radians.
    pub fn spot(position: DVec3, axis: DVec3, outer: f64) -> Result<Self> {
        ensure_value!(
            outer > 0.0 && outer <= FRAC_PI_2,
            "light outer cone angle must be above 0 and at most pi / 2, got {outer}"
        );
        Ok(Self::Spot {
            position: finite_position(position)?,
            axis: unit_vector("direction", axis)?,
            outer,
        })
    }

    pub fn hemisphere(position: DVec3, axis: DVec3) -> Result<Self> {
        Ok(Self::Hemisphere {
            position: finite_position(position)?,
            axis: unit_vector("axis", axis)?,
        })
    }

    /// What it is called in messages.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Directional { .. } => "directional",
            Self::Point { .. } => "point",
            Self::Spot { .. } => "spot",
            Self::Hemisphere { .. } => "hemisphere",
        }
    }

    /// Where the rays start, if not at infinity.
    pub fn position(&self) -> Option<DVec3> {
        match self {
            Self::Directional { .. } => None,
            Self::Point { position }
            | Self::Spot { position, .. }
            | Self::Hemisphere { position, .. } => Some(*position),
        }
    }

    /// The vector from a point in the world towards the light; its length is the distance to the
    /// light, or 1 where the light is at infinity.
    pub fn vector_from_point(&self, point_in_world: DVec3) -> DVec3 {
        match self {
            Self::Directional { direction } => -*direction,
            Self::Point { position }
            | Self::Spot { position, .. }
            | Self::Hemisphere { position, .. } => *position - point_in_world,
        }
    }

    /// The distance from a point in the world, infinite where the light is.
    pub fn distance_from_point(&self, point_in_world: DVec3) -> f64 {
        self.position()
            .map_or(f64::INFINITY, |position| position.distance(point_in_world))
    }

    /// What the light reaches, if not every direction.
    pub fn cone(&self) -> Option<Cone> {
        match *self {
            Self::Directional { .. } | Self::Point { .. } => None,
            Self::Spot { axis, outer, .. } => Some(Cone {
                axis,
                cosine: outer.cos(),
                sine: outer.sin(),
            }),
            Self::Hemisphere { axis, .. } => Some(Cone {
                axis,
                cosine: 0.0,
                sine: 1.0,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn direction_is_normalized_at_any_length() {
        for length in [1e-300, 1.0, 1e300] {
            let light = Light::directional(DVec3::new(3.0, 0.0, -4.0) * length).unwrap();
            let to_light = light.vector_from_point(DVec3::ONE);
            assert!((to_light - DVec3::new(-0.6, 0.0, 0.8)).length() < 1e-15);
        }
    }

    #[test]
    fn zero_and_nan_vectors_are_refused() {
        assert!(Light::directional(DVec3::ZERO).is_err());
        assert!(Light::directional(DVec3::new(0.0, f64::NAN, 1.0)).is_err());
        assert!(Light::point(DVec3::new(0.0, f64::INFINITY, 1.0)).is_err());
        assert!(Light::hemisphere(DVec3::ZERO, DVec3::ZERO).is_err());
    }

    #[test]
    fn cone_angles_out_of_range_are_refused() {
        for outer in [0.0, -1.0, 1.6, f64::NAN] {
            assert!(Light::spot(DVec3::ZERO, DVec3::X, outer).is_err());
        }
        assert!(Light::spot(DVec3::ZERO, DVec3::X, FRAC_PI_2).is_ok());
    }
}
