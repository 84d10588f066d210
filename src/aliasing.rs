//! How coarse a shadow map is where the camera looks, in float64: measures that need no reference.

use crate::camera::Camera;
use crate::light::Light;
use crate::methods::fit_uniform;
use crate::projection::Projection;
use crate::reference::surface;
use crate::scene::Scene;
use crate::warp::Warp;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// The aliasing error m = w'_l / w'_i of each pixel: the width of the beam of the light's texel over
/// the width of the pixel's, both where they meet the surface.
///
/// As m = (w_l / w_i) (cos theta_i / cos theta_l), Stamminger and Drettakis, "Perspective shadow
/// maps", 2002, and Navrátil's thesis, Eq. 3.2, with the widths across the beams taken as square roots
/// of their areas. NaN where no surface is seen or no layer is there.
pub fn aliasing_error(
    scene: &Scene,
    camera: &Camera,
    light: &Light,
    layers: &[Projection],
    warps: &[Warp],
    triangle_id: &[i32],
) -> Vec<f32> {
    let Some(map) = layers.first() else {
        return vec![f32::NAN; triangle_id.len()];
    };
    let image = Projection::from_camera(camera);
    let (map_steps, image_steps) = (map.steps(), image.steps());
    let size = DVec2::new(f64::from(map.width), f64::from(map.height));
    let (positions, normals, _) = surface(scene, camera, triangle_id);
    positions
        .into_par_iter()
        .zip(normals)
        .map(|(position, normal)| {
            let point = DVec3::from(position);
            if point.is_nan() {
                return f32::NAN;
            }
            let normal = DVec3::from(normal.map(f64::from));
            let to_light = light.vector_from_point(point).normalize();
            let to_eye = (camera.eye - point).normalize();
            let scale = warps.first().map_or(DVec2::ONE, |warp| {
                warp.scale(map.texel_from_point(point).truncate() / size)
            });
            let area_of_texel = map.texel_area(&map_steps, point) / (scale.x * scale.y);
            let width_of_texel = area_of_texel.sqrt();
            let width_of_pixel = image.texel_area(&image_steps, point).sqrt();
            let cosines = normal.dot(to_eye).abs() / normal.dot(to_light).abs();
            (width_of_texel / width_of_pixel * cosines) as f32
        })
        .collect()
}

/// Rosen's maximum effective resolution, (width, height): the size that a uniform map over the
/// casters' box would need to match the smallest texel of this one (Rosen, "Rectilinear texture
/// warping", 2012, section 6). NaN where no layer is there.
pub fn max_effective_resolution(
    scene: &Scene,
    camera: &Camera,
    light: &Light,
    layers: &[Projection],
    warps: &[Warp],
) -> DVec2 {
    let Light::Directional { direction } = *light;
    let Some(map) = layers.first() else {
        return DVec2::NAN;
    };
    // One texel: its steps are the sides of the box.
    let uniform = fit_uniform(scene, camera.eye, direction, 1).steps();
    let steps = map.steps();
    DVec2::new(
        uniform.x_axis.length() / steps.x_axis.length(),
        uniform.y_axis.length() / steps.y_axis.length(),
    ) * warps.first().map_or(DVec2::ONE, Warp::greatest_scale)
}
