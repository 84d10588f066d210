//! Focused: no perspective, only the smallest parallelogram around what is seen.
//!
//!     shadow_from_ray = focus * light_view
//!
//! Hamilton Yu-Ik Chong, Steven J. Gortler. Scene optimized shadow mapping. Harvard University, technical report
//! TR-07-07, 2007, sections 2.3 and 3.

use super::hull::MapSize;
use super::light_matrix::LightMatrix;
use super::subject::Subject;
use glam::DVec3;

/// The light looks along its own axis, the third coordinate of its rays.
pub fn focused(subject: &Subject, size: MapSize) -> Option<LightMatrix> {
    subject.hull.focused_along(DVec3::Z, size)
}
