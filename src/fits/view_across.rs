//! The viewing direction as the light sees it, in the plane of its rays' places: what maps are laid along that narrow as
//! the view does.

use super::light_matrix::rows;
use super::subject::Subject;
use crate::camera::Camera;
use crate::geometry::range_of;
use glam::{DMat3, DVec2, DVec3};

/// The view across the light.
pub struct ViewAcross {
    /// Unit vector of the plane.
    pub direction: DVec2,
    /// Of the angle between the light and the view.
    pub sine: f64,
    /// A step across the light that is one world unit long moves the place so far, at the middle of what is seen.
    pub scale: f64,
    /// The place of the eye; that of the middle where the light does not shine towards the eye.
    pub eye: DVec2,
    /// Of what the map must hold, the least and the greatest place along the direction.
    pub range: (f64, f64),
}

/// Below this sine of the angle between them the light shines along the view.
const ALONG: f64 = 1e-3;

/// The place where a ray crosses the plane.
pub fn place(ray: DVec3) -> DVec2 {
    ray.truncate() / ray.z
}

impl ViewAcross {
    /// `None` where the light shines along the view, and no direction across the light is the view's.
    pub fn new(subject: &Subject, camera: &Camera) -> Option<Self> {
        let rays = &subject.rays;
        let middle = rays.ray_from_point(subject.middle());
        // How places across the light move with a step in the world, at the middle.
        let motion = |step: DVec3| {
            let turn = rays.ray_from_step(step);
            (turn.truncate() - middle.truncate() * (turn.z / middle.z)) / middle.z
        };
        let view = motion(camera.forward);
        let direction = view.try_normalize()?;
        let axes = [camera.right, camera.up, camera.forward];
        let squares = axes.map(|axis| motion(axis).length_squared());
        let scale = (0.5 * squares.iter().sum::<f64>()).sqrt();
        let sine = (view.length() / scale).min(1.0);
        if sine < ALONG {
            return None;
        }
        let eye = rays.ray_from_point(camera.eye);
        let corners = subject.hull.corners.iter();
        Some(Self {
            direction,
            sine,
            scale,
            eye: place(if eye.z > 0.0 { eye } else { middle }),
            range: range_of(corners.map(|corner| direction.dot(place(*corner)))),
        })
    }

    /// Of a place, how far it is beside the view, and along it.
    pub fn beside_and_along(&self, place: DVec2) -> DVec2 {
        DVec2::new(self.direction.perp().dot(place), self.direction.dot(place))
    }

    /// Turns places so that the view runs up the second coordinate.
    pub fn align(&self) -> DMat3 {
        let (beside, along) = (self.direction.perp(), self.direction);
        rows([beside.extend(0.0), along.extend(0.0), DVec3::Z])
    }
}
