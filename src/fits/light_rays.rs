//! The rays of a light, as coordinates that light matrices are made of.
//!
//! A ray has *homogeneous coordinates* b: three numbers up to their scale. They are a place in a plane that the
//! rays cross, and a 3 x 3 matrix over them moves that place.

use crate::camera::Camera;
use glam::{DMat3, DMat4, DVec3, DVec4};

/// The rays of a light and their homogeneous coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct RayBundle {
    /// The world's point with coordinates `constant` if the rays are parallel; where they start if
    /// not.
    pub origin: DVec3,
    /// Rows of the matrix from world vectors to coordinates.
    axes: DMat3,
    constant: DVec3,
    /// The point, finite or at infinity, that all rays go through.
    pub light: DVec4,
}

impl RayBundle {
    /// Parallel rays: b = (x, y, 1), world units over `radius` across `direction` from `origin`.
    pub fn parallel(origin: DVec3, direction: DVec3, x_axis: DVec3, radius: f64) -> Self {
        let y_axis = direction.cross(x_axis);
        Self {
            origin,
            axes: DMat3::from_cols(x_axis / radius, y_axis / radius, DVec3::ZERO).transpose(),
            constant: DVec3::Z,
            light: direction.extend(0.0),
        }
    }

    /// The same of rays that meet before the origin, one over the convergence away: b = (x, y, 1 + convergence z), z
    /// along the direction.
    pub fn with_convergence(self, convergence: f64) -> Self {
        let direction = self.light.truncate();
        let [x, y] = [self.axes.row(0), self.axes.row(1)];
        let towards_light = self.origin * convergence - direction;
        Self {
            axes: DMat3::from_cols(x, y, direction * convergence).transpose(),
            light: match convergence == 0.0 {
                true => self.light,
                false => towards_light.extend(convergence),
            },
            ..self
        }
    }

    /// Rays from `position`: b is the vector from there, in axes of which the last is `z_axis`.
    pub fn central(position: DVec3, x_axis: DVec3, z_axis: DVec3) -> Self {
        let y_axis = z_axis.cross(x_axis);
        Self {
            origin: position,
            axes: DMat3::from_cols(x_axis, y_axis, z_axis).transpose(),
            constant: DVec3::ZERO,
            light: position.extend(1.0),
        }
    }

    /// The ray through a point.
    pub fn ray_from_point(&self, point: DVec3) -> DVec3 {
        self.axes * (point - self.origin) + self.constant
    }

    /// How the ray changes as the point moves by a vector.
    pub fn ray_from_step(&self, step: DVec3) -> DVec3 {
        self.axes * step
    }

    /// Some point of the world on a ray, homogeneous and linear in the ray: columns.
    fn world_from_ray(&self) -> [DVec4; 3] {
        if self.constant == DVec3::ZERO {
            let vectors = self.axes.inverse();
            return [vectors.x_axis, vectors.y_axis, vectors.z_axis].map(|v| v.extend(0.0));
        }
        // The first two axes are orthogonal, as long as one over the radius, and span the plane of the rays' places.
        let rows = self.axes.transpose();
        let step = |row: DVec3| (row / row.length_squared()).extend(0.0);
        [
            step(rows.x_axis),
            step(rows.y_axis),
            self.origin.extend(1.0),
        ]
    }

    /// What a matrix over homogeneous points of the world, whose rows 1, 2 and 4 vanish at the light, makes of rays: rows
    /// (x, y, w).
    pub fn map_from_ray(&self, shadow_from_world: DMat4) -> [DVec3; 3] {
        let columns = self.world_from_ray();
        let over_rays = |row: DVec4| DVec3::from(columns.map(|column| row.dot(column)));
        [0, 1, 3].map(|i| over_rays(shadow_from_world.row(i)))
    }

    /// Rows over rays as functions of homogeneous points in the world.
    pub fn world_rows(&self, rows: [DVec3; 3]) -> [DVec4; 3] {
        rows.map(|row| {
            let vector = self.axes.transpose() * row;
            vector.extend(row.dot(self.constant) - vector.dot(self.origin))
        })
    }
}

/// A receiver as a light sees it: its ray, and how that changes per pixel to the right and down.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    pub ray: DVec3,
    pub steps: [DVec3; 2],
}

impl Sample {
    /// Of a point on a surface with that normal, seen by the camera.
    pub fn new(rays: &RayBundle, camera: &Camera, point: DVec3, normal: DVec3) -> Self {
        Self {
            ray: rays.ray_from_point(point),
            steps: surface_steps(camera, point, normal).map(|step| rays.ray_from_step(step)),
        }
    }
}

/// How a point on a surface with that normal moves as its place in the image moves by a pixel, to the
/// right and down: derivatives of where the camera's ray meets the plane.
pub fn surface_steps(camera: &Camera, point: DVec3, normal: DVec3) -> [DVec3; 2] {
    let from_eye = point - camera.eye;
    let sight = camera.sight_of(from_eye);
    let width = camera.width_at(from_eye.dot(camera.forward));
    let turns = [camera.right / camera.focal.x, -camera.up / camera.focal.y];
    turns.map(|turn| width * (turn - sight * (normal.dot(turn) / normal.dot(sight))))
}
