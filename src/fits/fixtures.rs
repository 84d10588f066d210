//! Views, lights and samples that tests of fits share.

use super::hull::{Hull, MapFrame};
use super::light_rays::{RayBundle, Sample};
use crate::camera::Camera;
use crate::map_size::MapSize;
use glam::{DMat4, DVec2, DVec3};
use std::f64::consts::FRAC_PI_4;

pub const FRAME: MapFrame = MapFrame {
    size: MapSize::square(400),
    margin: 0.01,
};

pub fn camera(pitch: f64) -> Camera {
    let pose = DMat4::from_translation(DVec3::new(1.0, 1.7, 2.0)) * DMat4::from_rotation_x(pitch);
    let focal = DVec2::splat(150.0);
    let centre = DVec2::splat(90.0);
    Camera::new(pose, focal, centre, (180, 180), (0.1, 100.0)).unwrap()
}

/// Points of a floor and a wall behind it that the camera sees, with their normals.
pub fn surfaces(camera: &Camera) -> Vec<(DVec3, DVec3)> {
    let mut points = Vec::new();
    for row in (4..180).step_by(7) {
        for column in (3..180).step_by(5) {
            let (_, ray) = camera.ray_from_pixel(column, row);
            let (floor, wall) = (-camera.eye.y / ray.y, (-20.0 - camera.eye.z) / ray.z);
            if floor > 0.0 && floor < wall {
                points.push((camera.eye + ray * floor, DVec3::Y));
            } else if (row + column) % 2 == 0 {
                points.push((camera.eye + ray * wall, DVec3::Z));
            }
        }
    }
    points
}

/// Some lights: parallel rays at many angles, nearly along the view among them, and points.
pub fn bundles() -> Vec<RayBundle> {
    let mut bundles = Vec::new();
    for (i, height) in [-0.03, -0.2, -0.6, -1.0, -3.0].into_iter().enumerate() {
        for turn in 0..8 {
            let (sin, cos) = (f64::from(turn) * FRAC_PI_4 + 0.01 * i as f64).sin_cos();
            let direction = DVec3::new(sin, height, cos).normalize();
            let x_axis = direction.any_orthonormal_vector();
            bundles.push(RayBundle::parallel(
                DVec3::new(1.0, 0.0, -8.0),
                direction,
                x_axis,
                15.0,
            ));
        }
    }
    for position in [DVec3::new(4.0, 30.0, -5.0), DVec3::new(-40.0, 9.0, 20.0)] {
        let z_axis = (DVec3::new(1.0, 1.0, -10.0) - position).normalize();
        bundles.push(RayBundle::central(
            position,
            z_axis.any_orthonormal_vector(),
            z_axis,
        ));
    }
    bundles
}

pub fn seen(rays: &RayBundle, camera: &Camera) -> (Vec<Sample>, Hull) {
    let facing = surfaces(camera).into_iter().filter(|(point, normal)| {
        let light = rays.light;
        normal.dot(light.truncate() - *point * light.w) * (light.w - 0.5) > 1e-3
    });
    let samples: Vec<_> = facing
        .map(|(point, normal)| Sample::new(rays, camera, point, normal))
        .collect();
    let hull = Hull::new(DVec3::Z, samples.iter().map(|s| s.ray)).unwrap();
    (samples, hull)
}
