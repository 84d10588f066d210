//! What one light matrix is fitted to: a light's rays, and the points that its map must hold.

use super::hull::{Hull, MapFrame};
use super::light_matrix::LightMatrix;
use super::light_rays::RayBundle;
use super::source::Source;
use crate::camera::Camera;
use crate::geometry::range_of;
use glam::DVec3;

/// A light's rays with the points that its map must hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Subject {
    pub rays: RayBundle,
    pub points: Vec<DVec3>,
    pub hull: Hull,
}

/// Cosine of the widest angle between a ray and the middle of the rays that one map holds: that
/// of a face of a cube, nearly.
const WIDEST_COSINE: f64 = 0.55;

impl Subject {
    /// `None` where there is no point, or a light with a position is so much among them that one
    /// plane before it does not do.
    pub fn new(source: Source, points: Vec<DVec3>) -> Option<Self> {
        if points.is_empty() {
            return None;
        }
        let middle = points.iter().sum::<DVec3>() / points.len() as f64;
        let position = match source {
            Source::AtInfinity { direction } => {
                return Self::parallel(middle, direction, 0.0, points);
            }
            Source::FarAway { position } => {
                let sight = middle - position;
                let convergence = sight.length().recip();
                return Self::parallel(middle, sight * convergence, convergence, points);
            }
            Source::Near { position } => position,
        };
        let towards = |point: &DVec3| (*point - position).normalize_or_zero();
        let forward = points.iter().map(towards).sum::<DVec3>().try_normalize()?;
        let is_ahead = |point| towards(point).dot(forward) > WIDEST_COSINE;
        points.iter().all(is_ahead).then_some(())?;
        Self::central(position, forward, points)
    }

    /// Around the middle of the points; the rays meet one over the convergence before it.
    fn parallel(
        middle: DVec3,
        direction: DVec3,
        convergence: f64,
        points: Vec<DVec3>,
    ) -> Option<Self> {
        let count = points.len() as f64;
        let spread = |point: &DVec3| (*point - middle).reject_from(direction).length();
        let mean = points.iter().map(spread).sum::<f64>() / count;
        // Points at one place have no radius; rounding has.
        let farthest = points.iter().map(|p| p.abs().max_element());
        let radius = mean.max(1e-12 * farthest.fold(1e-280, f64::max));
        let rays = RayBundle::parallel(middle, direction, level_axis(direction), radius);
        Self::with_rays(rays.with_convergence(convergence), points)
    }

    /// Around a light with a position, the optical axis given.
    pub fn central(position: DVec3, forward: DVec3, points: Vec<DVec3>) -> Option<Self> {
        let rays = RayBundle::central(position, level_axis(forward), forward);
        Self::with_rays(rays, points)
    }

    /// The same rays with other points.
    pub fn with_points(&self, points: Vec<DVec3>) -> Option<Self> {
        Self::with_rays(self.rays.clone(), points)
    }

    fn with_rays(rays: RayBundle, points: Vec<DVec3>) -> Option<Self> {
        let hull = Hull::new(DVec3::Z, points.iter().map(|&p| rays.ray_from_point(p)))?;
        Some(Self { rays, points, hull })
    }

    /// The smallest parallelogram around what is seen, without a perspective: the light looks along its own axis, the
    /// third coordinate of its rays (Chong and Gortler, TR-07-07, sections 2.3 and 3).
    pub fn focused(&self, frame: MapFrame) -> Option<LightMatrix> {
        self.hull.focused_along(DVec3::Z, frame)
    }

    pub fn middle(&self) -> DVec3 {
        self.points.iter().sum::<DVec3>() / self.points.len() as f64
    }

    /// Least and greatest depth along the viewing direction, not nearer than the near plane.
    pub fn depths(&self, camera: &Camera) -> (f64, f64) {
        let sights = self.points.iter().map(|p| *p - camera.eye);
        let (least, greatest) = range_of(sights.map(|sight| sight.dot(camera.forward)));
        let least = least.max(camera.znear);
        (least, greatest.max(least))
    }
}

/// A horizontal unit vector across a direction; the world's X where that is vertical.
fn level_axis(direction: DVec3) -> DVec3 {
    let across = direction.cross(DVec3::Y);
    if across.length_squared() > 1e-4 {
        across.normalize()
    } else {
        DVec3::X.reject_from(direction).normalize()
    }
}
