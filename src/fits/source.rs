//! Where the rays of a light come from, as far as a fit can tell.
//!
//! A light that is far from all that it lights is a sun in all but name: its rays are parallel but for a small angle,
//! and float32 holds a distance to it only to some share of that distance. So maps of such a light are fitted as those of
//! parallel rays are, around what they light, and the angle is one number of the projection, its convergence. It
//! shrinks to nothing as the light moves away, and so does the difference between the two kinds of light.

use super::parallel::{axes_at, moved};
use super::receivers::Setting;
use super::rotation::Rotation;
use crate::projection::{Homography, Projection};
use glam::{DMat3, DVec3};

/// A light is far away from this many times the size of the scene on. Nearer, a cube or a paraboloid around it has the
/// texels that its method is known for; farther, the scene takes up few of them.
const FAR_AWAY: f64 = 4.0;

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// Rays along a unit direction.
    AtInfinity { direction: DVec3 },
    /// Rays from a point beyond all that they light.
    FarAway { position: DVec3 },
    /// Rays from a point.
    Near { position: DVec3 },
}

/// Whether a light is far from a box of all that it lights.
pub fn is_far_away(position: DVec3, (low, high): (DVec3, DVec3)) -> bool {
    distance_to(position, (low, high)) > FAR_AWAY * low.distance(high)
}

fn distance_to(point: DVec3, (low, high): (DVec3, DVec3)) -> f64 {
    point.distance(point.clamp(low, high))
}

impl Setting<'_> {
    pub fn source(&self) -> Source {
        let Some(position) = self.light.position() else {
            let direction = -self.light.vector_from_point(self.camera.eye);
            return Source::AtInfinity { direction };
        };
        let scene = self.scene.bounds();
        // As seen from the eye it must be on its side of the scene, too.
        let is_beyond_eye =
            distance_to(position, scene) > 2.0 * distance_to(self.camera.eye, scene);
        match is_far_away(position, scene) && is_beyond_eye {
            true => Source::FarAway { position },
            false => Source::Near { position },
        }
    }

    /// Where the rays start, if that is not far away.
    pub fn near_position(&self) -> Option<DVec3> {
        match self.source() {
            Source::Near { position } => Some(position),
            Source::AtInfinity { .. } | Source::FarAway { .. } => None,
        }
    }

    /// The middle of the scene's box.
    pub fn middle(&self) -> DVec3 {
        let (low, high) = self.scene.bounds();
        0.5 * low + 0.5 * high
    }

    /// Axes of rays that do not start nearby. Around the eye float32 resolves what the camera sees best.
    pub fn axes(&self) -> Projection {
        self.axes_around(self.camera.eye, |axes| axes)
    }

    /// The same, rotated.
    pub fn axes_rotated(&self, rotation: Rotation) -> Projection {
        let rotated = |axes| rotation.of_parallel(self.scene, axes);
        self.axes_around(self.camera.eye, rotated)
    }

    /// The same around the scene.
    pub fn axes_of_scene(&self, rotation: Rotation) -> Projection {
        let rotated = |axes| rotation.of_parallel(self.scene, axes);
        self.axes_around(self.middle(), rotated)
    }

    fn axes_around(&self, origin: DVec3, turn: impl Fn(Projection) -> Projection) -> Projection {
        let position = match self.source() {
            Source::AtInfinity { direction } => return turn(axes_at(origin, direction)),
            Source::FarAway { position } | Source::Near { position } => position,
        };
        // The eye may turn or move: texels hold still if their plane follows from the light and the scene.
        let (low, high) = self.scene.bounds();
        let middle = self.middle();
        let sight = middle - position;
        let axes = turn(axes_at(middle, sight.normalize()));
        let reach = low.distance(high).max(f64::MIN_POSITIVE.sqrt());
        let kind = Homography::new(DMat3::IDENTITY, reach);
        let axes = Projection {
            kind: kind.with_convergence(sight.length().recip()).into(),
            ..axes
        };
        moved(&axes, reach, origin.clamp(low, high))
    }
}
