//! Plane optimal: on a plane each texel is a pixel. A point's place is where its shadow on the plane is in the image.
//!
//! ```text
//! shadow_from_world = focus * image * onto_plane
//! ```
//!
//! Hamilton Y. Chong, Steven J. Gortler. A lixel for every pixel. Eurographics Symposium on Rendering 2004.

use super::hull::{Hull, MapFrame};
use super::light_matrix::{LightMatrix, product};
use super::matrix_layers::Extent;
use super::psm::{MAX_PERSPECTIVE, from_rows};
use super::subject::Subject;
use crate::camera::Camera;
use crate::geometry::bounds_of;
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};

/// The plane, as a function of homogeneous points, that most points of surfaces lie in.
pub fn dominant_plane(points: &[DVec3], normals: &[DVec3]) -> Option<DVec4> {
    let step = points.len().div_ceil(CANDIDATES).max(1);
    let (low, high) = bounds_of(points.iter().copied());
    let tolerance = 1e-3 * (high - low).length();
    let candidates = points.iter().zip(normals).step_by(step);
    let votes = candidates.map(|(point, normal)| {
        let plane = normal.extend(-normal.dot(*point));
        let agree = |(p, n): &(&DVec3, &DVec3)| {
            n.dot(*normal).abs() > 0.999 && plane.dot(p.extend(1.0)).abs() <= tolerance
        };
        (points.iter().zip(normals).filter(agree).count(), plane)
    });
    // The first of those with most votes.
    let best = votes.reduce(|best, other| if other.0 > best.0 { other } else { best });
    best.map(|(_, plane)| plane)
}

/// Planes that stand for election.
const CANDIDATES: usize = 128;

/// `None` where the light shines along the plane.
pub fn plane_optimal(
    subject: &Subject,
    camera: &Camera,
    plane: DVec4,
    extent: Extent,
    frame: MapFrame,
) -> Option<LightMatrix> {
    let rays = &subject.rays;
    let light = rays.light;
    let height = plane.dot(light);
    if height.abs() < 1e-6 * light.length() * plane.truncate().length() {
        return None;
    }
    let [column, row, width] = camera.rows_of_centred_image();
    let image = from_rows([column, row, DVec4::ZERO, width]);
    let shadow_from_world = after_shadow_on(plane, light, image);
    let [x, y, w] = rays.map_from_ray(shadow_from_world);
    let [x, y, w] = [x, y, w].map(|row| row / w.length());
    let map = LightMatrix { x, y, w };
    match extent {
        Extent::Frustum => Some(focus_on_image(map, camera, frame)),
        Extent::Receivers => focus_on_points(map, subject, frame),
    }
}

/// `image * onto_plane`: a point X goes to where the line from the light L through X meets the plane P,
/// X (P L) - L (P X), and from there to the image.
fn after_shadow_on(plane: DVec4, light: DVec4, image: DMat4) -> DMat4 {
    let height = plane.dot(light);
    let image_of_light = image * light;
    let towards_light = DMat4::from_cols(
        image_of_light * plane.x,
        image_of_light * plane.y,
        image_of_light * plane.z,
        image_of_light * plane.w,
    );
    (image * height - towards_light) * height.signum()
}

/// `focus * map`: the map ends where the image does. What the plane shows outside of it is not held.
fn focus_on_image(map: LightMatrix, camera: &Camera, frame: MapFrame) -> LightMatrix {
    let image = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    // The middle of the image is that of the map.
    let shift = DMat3::from_translation(-(0.5 * image - camera.centre));
    // So many texels for a pixel.
    let scale = DMat3::from_diagonal((frame.size.texels() / image).extend(1.0));
    product([scale, shift, map.matrix()]).into()
}

/// `focus * map`: the map ends where the points do. What lies behind the camera's plane once it is moved along the
/// rays has no place.
fn focus_on_points(map: LightMatrix, subject: &Subject, frame: MapFrame) -> Option<LightMatrix> {
    let points = subject.points.iter();
    let rays = points.map(|point| subject.rays.ray_from_point(*point));
    let depths: Vec<_> = rays.map(|ray| (map.w.dot(ray) / ray.z, ray)).collect();
    let greatest = depths.iter().map(|(depth, _)| *depth).fold(0.0, f64::max);
    let held = depths
        .iter()
        .filter(|(depth, _)| depth * MAX_PERSPECTIVE > greatest);
    let hull = Hull::new(DVec3::Z, held.map(|(_, ray)| *ray))?;
    hull.boxed(map, frame)
}
