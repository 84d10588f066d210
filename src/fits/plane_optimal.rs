//! Plane optimal: on a plane each texel is a pixel. A point's place is where its shadow on the plane is in the image.
//!
//! ```text
//! shadow_from_world = focus * image * onto_plane
//! ```
//!
//! Hamilton Y. Chong, Steven J. Gortler. A lixel for every pixel. Eurographics Symposium on Rendering 2004. One such map
//! cannot hold all that is seen (Chong and Gortler, TR-07-07, section 1: "requiring division into smaller sub-frusta").

use super::hull::{MAX_STRETCH, MapFrame};
use super::layer::Layer;
use super::light_matrix::{LightMatrix, product};
use super::light_rays::RayBundle;
use super::matrix_layers::{Extent, Part, Target, matrix_layers, parts_of_target};
use super::psm::from_rows;
use super::receivers::ReceiverQueries;
use super::samples::Surface;
use super::subject::Subject;
use crate::camera::Camera;
use crate::error::Result;
use crate::geometry::bounds_of;
use crate::region::HalfSpace;
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};

/// A plane that surfaces lie in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Of homogeneous points.
    pub function: DVec4,
    /// How far from it a point is still in it.
    tolerance: f64,
}

impl Plane {
    fn holds(&self, point: DVec3) -> bool {
        self.function.dot(point.extend(1.0)).abs() <= self.tolerance
    }
}

/// The plane in which the surfaces have most weight.
pub fn dominant_plane(surfaces: &[Surface]) -> Option<Plane> {
    let step = surfaces.len().div_ceil(CANDIDATES).max(1);
    let (low, high) = bounds_of(surfaces.iter().map(|surface| surface.point));
    let tolerance = 1e-3 * (high - low).length();
    let votes = surfaces.iter().step_by(step).map(|candidate| {
        let normal = candidate.normal;
        let plane = Plane {
            function: normal.extend(-normal.dot(candidate.point)),
            tolerance,
        };
        let agrees = |surface: &&Surface| {
            surface.normal.dot(normal).abs() > 0.999 && plane.holds(surface.point)
        };
        let light: f64 = surfaces.iter().filter(agrees).map(|s| s.weight).sum();
        (light, plane)
    });
    // The first of those with most votes.
    let best = votes.reduce(|best, other| if other.0 > best.0 { other } else { best });
    best.map(|(_, plane)| plane)
}

/// Planes that stand for election.
const CANDIDATES: usize = 128;

/// The farthest shadow on the plane is at most so many times as far as the nearest that the map is for.
const MAX_DEPTHS: f64 = 1e3;

/// Layers that are even on the plane. Of the receivers, those that have no place in such a map have a focused one.
pub fn plane_layers(
    receivers: &mut dyn ReceiverQueries<'_>,
    target: Target,
    plane: Plane,
) -> Result<Vec<Layer>> {
    let (setting, frame) = (receivers.setting(), target.frame);
    let mut parts = parts_of_target(receivers, target)?;
    if target.extent == Extent::Receivers {
        let split = |part| split_by_place(part, setting.camera, plane);
        parts = parts.into_iter().flat_map(split).collect();
    }
    Ok(matrix_layers(setting, parts, frame.size, |part| {
        let subject = &part.subject;
        plane_optimal(subject, setting.camera, plane, target.extent, frame)
            .or_else(|| subject.focused(frame))
    }))
}

/// `None` where the light shines along the plane, where no point is in it, and where the light moves some behind the
/// camera's plane on their way to it.
pub fn plane_optimal(
    subject: &Subject,
    camera: &Camera,
    plane: Plane,
    extent: Extent,
    frame: MapFrame,
) -> Option<LightMatrix> {
    let map = even_map(&subject.rays, camera, plane)?;
    match extent {
        Extent::Frustum => Some(focus_on_image(map, camera, frame)),
        Extent::Receivers => {
            subject.points.iter().find(|point| plane.holds(**point))?;
            subject.hull.boxed(map, frame)
        }
    }
}

/// Points that have a place in a map that is even on the plane, and the others, where there are any.
fn split_by_place(part: Part, camera: &Camera, plane: Plane) -> Vec<Part> {
    let Some(border) = border_of_places(&part.subject, camera, plane) else {
        return vec![part];
    };
    match [border, border.opposite()].map(|side| part.within(side)) {
        [Some(held), Some(others)] => vec![held, others],
        _ => vec![part],
    }
}

/// Where the depth of a point's shadow on the plane is that of the nearest point that is in the plane, nearly: what is
/// nearer would be as large as all that the map is for.
fn border_of_places(subject: &Subject, camera: &Camera, plane: Plane) -> Option<HalfSpace> {
    let map = even_map(&subject.rays, camera, plane)?;
    let depth = |point: &DVec3| {
        let ray = subject.rays.ray_from_point(*point);
        map.w.dot(ray) / ray.z
    };
    let in_plane = subject.points.iter().filter(|point| plane.holds(**point));
    let nearest = in_plane.map(depth).reduce(f64::min)?;
    let farthest = subject.points.iter().map(depth).fold(0.0, f64::max);
    // Pixels between the samples may be nearer.
    let least = (0.5 * nearest).max(farthest / MAX_DEPTHS);
    let row = map.w - least * DVec3::Z;
    let [function, ..] = subject.rays.world_rows([row; 3]);
    HalfSpace::of_function(function)
}

/// The map before it is focused: its depths are those of the shadows on the plane.
fn even_map(rays: &RayBundle, camera: &Camera, plane: Plane) -> Option<LightMatrix> {
    let (plane, light) = (plane.function, rays.light);
    let height = plane.dot(light);
    if height.abs() * MAX_STRETCH < light.length() * plane.truncate().length() {
        return None;
    }
    let [column, row, width] = camera.rows_of_centred_image();
    let image = from_rows([column, row, DVec4::ZERO, width]);
    let shadow_from_world = after_shadow_on(plane, light, image);
    let [x, y, w] = rays.map_from_ray(shadow_from_world);
    let [x, y, w] = [x, y, w].map(|row| row / w.length());
    Some(LightMatrix { x, y, w })
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
