//! Light space perspective: the texels narrow along the view as the pixels do.
//!
//! ```text
//! shadow_from_ray = focus * warp * align
//! ```
//!
//! Michael Wimmer, Daniel Scherzer, Werner Purgathofer. Light space perspective shadow maps. Eurographics Symposium
//! on Rendering 2004.

use super::hull::MapFrame;
use super::light_matrix::{LightMatrix, product, rows};
use super::subject::Subject;
use super::view_across::ViewAcross;
use crate::camera::{Camera, Rays};
use glam::{DMat3, DVec2, DVec3};

/// The near end z_n of the frustum is no less than this share of the farthest depth: a frustum that begins at the eye
/// would put the apex there, and all texels with it. Of 1/1000, 1/100 and 1/20 the last had the fewest wrong pixels in
/// eight scenes; receivers are seldom so near that it matters.
const NEAREST: f64 = 1.0 / 20.0;

/// `None` where the light shines along the view, and no direction across the light is the view's.
pub fn light_space_perspective(
    subject: &Subject,
    camera: &Camera,
    frame: MapFrame,
) -> Option<LightMatrix> {
    let view = ViewAcross::new(subject, camera)?;
    let (start, end) = view.range;
    let (z_near, farthest) = subject.depths(camera);
    let z_near = z_near.max(NEAREST * farthest);
    let z_far = z_near + (end - start) / view.scale * view.sine;
    // The optimal distance of the apex before the frustum (section 4.2), n = (z_n + sqrt(z_n z_f)) / sin(gamma).
    let distance = (z_near + (z_near * z_far).sqrt()) / view.sine * view.scale;
    let column = view.beside_and_along(view.eye).x;
    // A perspective along the view: its apex lies beside the eye, the distance before the nearest point. Pixels of
    // parallel rays do not narrow: the optimal distance is infinite.
    let warp = match camera.rays {
        Rays::Perspective => perspective_from(DVec2::new(column, start - distance)),
        Rays::Orthographic => DMat3::IDENTITY,
    };
    let map_from_ray = LightMatrix::from(product([warp, view.align()]));
    subject.hull.boxed(map_from_ray.with_unit_axis(), frame)
}

/// The perspective along the second coordinate, from an apex in the plane.
fn perspective_from(apex: DVec2) -> DMat3 {
    rows([
        DVec3::new(1.0, 0.0, -apex.x),
        DVec3::Z,
        DVec3::new(0.0, 1.0, -apex.y),
    ])
}
