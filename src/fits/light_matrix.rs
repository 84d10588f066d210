//! Light matrices: the 4 x 4 matrices that a light's map may have, and how good one is.
//!
//! Rows 1, 2 and 4 take a point to its place in the map; row 3, the depth, is a matter of its own.
//! The three rows must send all of a light's ray to one place, so what is left to choose is a
//! homography between the bundle of rays ([`RayBundle`](super::light_rays::RayBundle)) and the map.
//!
//! The measure is that of Hamilton Yu-Ik Chong and Steven J. Gortler. Scene optimized shadow mapping.
//! Harvard University, technical report TR-07-07, 2007: the sum over samples of the squares of the
//! entries of the inverse Jacobian, how far the image moves per texel (Eq. 6).

use super::light_rays::Sample;
use glam::{DMat3, DVec2, DVec3};
use std::ops::Mul;

/// A light matrix: place in the map = (x b, y b) / (w b), in texels from the middle of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightMatrix {
    pub x: DVec3,
    pub y: DVec3,
    /// The optical axis, p4 of the paper: a unit vector.
    pub w: DVec3,
}

/// The matrix of these rows.
pub fn rows([x, y, z]: [DVec3; 3]) -> DMat3 {
    DMat3::from_cols(x, y, z).transpose()
}

/// The matrices multiplied in the order in which they stand: the last is applied first, and rounding is that of one
/// step after the other.
pub fn product<M: Mul<Output = M>, const N: usize>(factors: [M; N]) -> M {
    let steps = factors.into_iter().rev();
    let product = steps.reduce(|applied, next| next * applied);
    product.expect("at least one matrix")
}

impl From<DMat3> for LightMatrix {
    fn from(map_from_ray: DMat3) -> Self {
        let rows = map_from_ray.transpose();
        Self {
            x: rows.x_axis,
            y: rows.y_axis,
            w: rows.z_axis,
        }
    }
}

impl LightMatrix {
    pub fn rows(&self) -> [DVec3; 3] {
        [self.x, self.y, self.w]
    }

    pub fn matrix(&self) -> DMat3 {
        rows(self.rows())
    }

    pub fn with_unit_axis(self) -> Self {
        Self {
            w: self.w.normalize(),
            ..self
        }
    }

    /// Where a ray is in the map; not a number where it is behind the map's horizon.
    pub fn place(&self, ray: DVec3) -> DVec2 {
        let w = self.w.dot(ray);
        if w > 0.0 {
            DVec2::new(self.x.dot(ray), self.y.dot(ray)) / w
        } else {
            DVec2::NAN
        }
    }

    /// The Jacobian du/dx times w², by rows, and w. Both maps are quotients of linear functions
    /// (the paper's appendix), the depth a function of the place in the image.
    fn scaled_jacobian(&self, sample: &Sample) -> ([[f64; 2]; 2], f64) {
        let w = self.w.dot(sample.ray);
        let rows = [self.x, self.y].map(|row| {
            let value = row.dot(sample.ray);
            sample
                .steps
                .map(|step| row.dot(step) * w - value * self.w.dot(step))
        });
        (rows, w)
    }

    /// How badly a sample is served: the sum of the squares of dx/du, in squared pixels per squared
    /// texel. Infinite where it is behind the horizon or its Jacobian has no inverse.
    pub fn badness(&self, sample: &Sample) -> f64 {
        let ([[a, b], [c, d]], w) = self.scaled_jacobian(sample);
        let determinant = a * d - b * c;
        if w <= 0.0 || determinant == 0.0 {
            return f64::INFINITY;
        }
        // The inverse of a 2 x 2 matrix has the same entries, but for signs, over the determinant.
        (a * a + b * b + c * c + d * d) * (w * w / determinant).powi(2)
    }

    /// The paper's h (Eq. 6).
    pub fn h(&self, samples: &[Sample]) -> f64 {
        samples.iter().map(|sample| self.badness(sample)).sum()
    }

    /// The gradient of h over the optical axis, x and y fixed.
    ///
    /// With N the Jacobian times w², m the determinant of the rows and D that of the ray and its
    /// steps, det N = m D w, so that h = |N|² w² / (m D)²: a product of three factors.
    pub fn gradient(&self, samples: &[Sample]) -> DVec3 {
        let volume = self.x.cross(self.y);
        let m = volume.dot(self.w);
        let gradients = samples.iter().map(|sample| {
            let (rows, w) = self.scaled_jacobian(sample);
            let squares: f64 = rows.iter().flatten().map(|n| n * n).sum();
            let determinant = rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0];
            let factor = (w * w / determinant).powi(2);
            let mut along = DVec3::ZERO;
            for (row, entries) in [self.x, self.y].into_iter().zip(rows) {
                for (step, entry) in sample.steps.into_iter().zip(entries) {
                    along += entry * (row.dot(step) * sample.ray - row.dot(sample.ray) * step);
                }
            }
            2.0 * factor * (along + squares * (sample.ray / w - volume / m))
        });
        gradients.sum()
    }

    /// The median of the badness of samples: what tells whether a matrix is worth a change.
    pub fn median_badness(&self, samples: &[Sample]) -> f64 {
        let mut values: Vec<_> = samples.iter().map(|sample| self.badness(sample)).collect();
        if values.is_empty() {
            return 0.0;
        }
        let middle = values.len() / 2;
        *values.select_nth_unstable_by(middle, f64::total_cmp).1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::fixtures::{FRAME, bundles, camera, seen, surfaces};

    #[test]
    fn jacobian_is_that_of_finite_differences() {
        let camera = camera(-0.2);
        for rays in bundles() {
            let matrix = LightMatrix {
                x: DVec3::new(90.0, 10.0, 3.0),
                y: DVec3::new(-20.0, 70.0, -8.0),
                w: DVec3::new(0.1, -0.2, 1.0).normalize(),
            };
            for (point, normal) in surfaces(&camera).into_iter().step_by(17) {
                let sample = Sample::new(&rays, &camera, point, normal);
                let (scaled, w) = matrix.scaled_jacobian(&sample);
                if w <= 0.0 {
                    continue;
                }
                let step = 1e-3;
                let sight = (point - camera.eye) / (point - camera.eye).dot(camera.forward);
                let turns = [camera.right / camera.focal.x, -camera.up / camera.focal.y];
                for (j, turn) in turns.into_iter().enumerate() {
                    let place = |t: f64| {
                        let ray = sight + turn * t;
                        let at =
                            camera.eye + ray * (normal.dot(point - camera.eye) / normal.dot(ray));
                        matrix.place(rays.ray_from_point(at))
                    };
                    let slope = (place(step) - place(-step)) / (2.0 * step);
                    for i in 0..2 {
                        let got = scaled[i][j] / (w * w);
                        assert!(
                            (got - slope[i]).abs() < 1e-4 * (1.0 + slope.length()),
                            "{got} {slope}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn badness_is_the_norm_of_the_inverse() {
        let camera = camera(-0.2);
        for rays in bundles() {
            let (samples, hull) = seen(&rays, &camera);
            let matrix = hull.focused_along(DVec3::Z, FRAME).unwrap();
            for sample in samples.iter().step_by(11) {
                let ([[a, b], [c, d]], w) = matrix.scaled_jacobian(sample);
                let columns = (DVec2::new(a, c), DVec2::new(b, d));
                let jacobian = glam::DMat2::from_cols(columns.0, columns.1) * (1.0 / (w * w));
                let inverse = jacobian.inverse().to_cols_array();
                let sum: f64 = inverse.iter().map(|entry| entry * entry).sum();
                assert!((matrix.badness(sample) / sum - 1.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn gradient_is_that_of_finite_differences() {
        let camera = camera(-0.2);
        for rays in bundles() {
            let (samples, hull) = seen(&rays, &camera);
            for w in [DVec3::Z, DVec3::new(0.05, -0.08, 1.0).normalize()] {
                let Some(matrix) = hull.focused_along(w, FRAME) else {
                    continue;
                };
                let gradient = matrix.gradient(&samples);
                for axis in DVec3::AXES {
                    let step = 1e-6;
                    let h = |t: f64| {
                        let w = matrix.w + axis * t;
                        LightMatrix { w, ..matrix }.h(&samples)
                    };
                    let slope = (h(step) - h(-step)) / (2.0 * step);
                    let error = (gradient.dot(axis) - slope).abs();
                    assert!(error < 1e-5 * gradient.length(), "{gradient} {slope}");
                }
            }
        }
    }
}
