//! Light space perspective: the texels narrow along the view as the pixels do.
//!
//! ```text
//! shadow_from_ray = focus * warp * align
//! ```
//!
//! Michael Wimmer, Daniel Scherzer, Werner Purgathofer. Light space perspective shadow maps. Eurographics Symposium
//! on Rendering 2004.

use super::hull::MapSize;
use super::light_matrix::{LightMatrix, product, rows};
use super::subject::Subject;
use crate::camera::{Camera, Rays};
use crate::geometry::range_of;
use glam::{DMat3, DVec2, DVec3};

/// The near end z_n of the frustum is no less than this share of the farthest depth: a frustum that begins at the eye
/// would put the apex there, and all texels with it. Of 1/1000, 1/100 and 1/20 the last had the fewest wrong pixels in
/// eight scenes; receivers are seldom so near that it matters.
const NEAREST: f64 = 1.0 / 20.0;

/// `None` where the light shines along the view, and no direction across the light is the view's.
pub fn light_space_perspective(
    subject: &Subject,
    camera: &Camera,
    size: MapSize,
) -> Option<LightMatrix> {
    let rays = &subject.rays;
    let middle = rays.ray_from_point(subject.middle());
    // How places across the light move with a step in the world, at the middle.
    let motion = |step: DVec3| {
        let turn = rays.ray_from_step(step);
        (turn.truncate() - middle.truncate() * (turn.z / middle.z)) / middle.z
    };
    let view = motion(camera.forward);
    let view_direction = view.try_normalize()?;
    // Places per world unit: a step across the light that is one unit long moves the place so far.
    let axes = [camera.right, camera.up, camera.forward];
    let squares = axes.map(|axis| motion(axis).length_squared());
    let scale = (0.5 * squares.iter().sum::<f64>()).sqrt();
    // Of the angle gamma between the light and the view.
    let sine = (view.length() / scale).min(1.0);
    if sine < 1e-3 {
        return None;
    }
    let place = |ray: &DVec3| ray.truncate() / ray.z;
    let places = subject.hull.corners.iter().map(place);
    let (start, end) = range_of(places.map(|place| view_direction.dot(place)));
    let (z_near, farthest) = subject.depths(camera);
    let z_near = z_near.max(NEAREST * farthest);
    let z_far = z_near + (end - start) / scale * sine;
    // The optimal distance of the apex before the frustum (section 4.2), n = (z_n + sqrt(z_n z_f)) / sin(gamma).
    let distance = (z_near + (z_near * z_far).sqrt()) / sine * scale;
    let eye = rays.ray_from_point(camera.eye);
    let beside = view_direction.perp();
    let eye_or_middle = if eye.z > 0.0 { eye } else { middle };
    let column = beside.dot(place(&eye_or_middle));

    // The view runs up the second coordinate.
    let align = rows([beside.extend(0.0), view_direction.extend(0.0), DVec3::Z]);
    // A perspective along the view: its apex lies beside the eye, the distance before the nearest point. Pixels of
    // parallel rays do not narrow: the optimal distance is infinite.
    let warp = match camera.rays {
        Rays::Perspective => perspective_from(DVec2::new(column, start - distance)),
        Rays::Orthographic => DMat3::IDENTITY,
    };
    let map_from_ray = LightMatrix::from(product([warp, align]));
    subject.hull.boxed(map_from_ray.with_unit_axis(), size)
}

/// The perspective along the second coordinate, from an apex in the plane.
fn perspective_from(apex: DVec2) -> DMat3 {
    rows([
        DVec3::new(1.0, 0.0, -apex.x),
        DVec3::Z,
        DVec3::new(0.0, 1.0, -apex.y),
    ])
}
