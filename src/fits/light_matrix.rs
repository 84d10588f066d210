//! Light matrices: the 4 x 4 matrices that a light's map may have, and how good one is.
//!
//! Rows 1, 2 and 4 take a point to its place in the map; row 3, the depth, is a matter of its own.
//! The three rows must send all of a light's ray to one place, so what is left to choose is a
//! homography between the bundle of rays and the map. A ray has *homogeneous coordinates* b here
//! ([`RayBundle`]), three numbers up to their scale; the light matrix holds three covectors of such.
//!
//! The measure is that of Hamilton Yu-Ik Chong and Steven J. Gortler. Scene optimized shadow mapping.
//! Harvard University, technical report TR-07-07, 2007: the sum over samples of the squares of the
//! entries of the inverse Jacobian, how far the image moves per texel (Eq. 6).

use crate::camera::Camera;
use crate::geometry::convex_hull;
use argmin::core::{CostFunction, Executor};
use argmin::solver::neldermead::NelderMead;
use glam::{DMat3, DQuat, DVec2, DVec3, DVec4};

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
    light: DVec4,
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
        // The axes are orthogonal, as long as one over the radius.
        let rows = self.axes.transpose();
        let step = |row: DVec3| (row / row.length_squared()).extend(0.0);
        [
            step(rows.x_axis),
            step(rows.y_axis),
            self.origin.extend(1.0),
        ]
    }

    /// The covectors of rays, from three linear functions of homogeneous points that vanish at the
    /// light.
    pub fn covectors(&self, functions: [DVec4; 3]) -> [DVec3; 3] {
        let columns = self.world_from_ray();
        functions.map(|f| DVec3::from(columns.map(|column| f.dot(column))))
    }

    pub fn light(&self) -> DVec4 {
        self.light
    }

    /// Rows (x, y, w) of a light matrix as functions of homogeneous points in the world.
    pub fn world_rows(&self, matrix: &LightMatrix) -> [DVec4; 3] {
        matrix.rows().map(|row| {
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
    let sight = point - camera.eye;
    let depth = sight.dot(camera.forward);
    let turns = [camera.right / camera.focal.x, -camera.up / camera.focal.y];
    turns.map(|turn| depth * (turn - sight * (normal.dot(turn) / normal.dot(sight))))
}

/// A light matrix: place in the map = (x b, y b) / (w b), in texels from the middle of the map.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightMatrix {
    pub x: DVec3,
    pub y: DVec3,
    /// The optical axis, p4 of the paper: a unit vector.
    pub w: DVec3,
}

impl LightMatrix {
    pub fn rows(&self) -> [DVec3; 3] {
        [self.x, self.y, self.w]
    }

    pub fn is_finite(&self) -> bool {
        self.rows().iter().all(|row| row.is_finite())
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

    /// The gradient of h over the optical axis, x and y kept.
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

/// The rays that a map must hold, as the corners of their convex hull in the plane of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    pub corners: Vec<DVec3>,
}

/// No optical axis may stretch one side of the map more than this against the other: float32 could
/// not follow.
const MAX_STRETCH: f64 = 1e5;

impl Hull {
    /// `None` where there is no ray, or one is behind the plane of the axis.
    pub fn new(axis: DVec3, rays: impl Iterator<Item = DVec3>) -> Option<Self> {
        let [x, y] = across(axis);
        let mut places = Vec::new();
        let mut depths = (f64::INFINITY, 0.0_f64);
        for ray in rays {
            let w = axis.dot(ray);
            if w.is_nan() || w <= 0.0 {
                return None;
            }
            depths = (depths.0.min(w), depths.1.max(w));
            places.push(DVec2::new(x.dot(ray), y.dot(ray)) / w);
        }
        if !places.iter().all(|place| place.is_finite()) {
            return None;
        }
        let hull = convex_hull(&without_interior(places));
        let corners = hull.iter().map(|p| x * p.x + y * p.y + axis);
        (!hull.is_empty()).then(|| Self {
            corners: corners.collect(),
        })
    }

    /// The corners in the coordinates of an optical axis, if all are before its horizon; the hull of
    /// rays is that of their places through any axis that has all of them in front.
    fn places(&self, [x, y]: [DVec3; 2], w: DVec3) -> Option<Vec<DVec2>> {
        let depths = self.corners.iter().map(|corner| w.dot(*corner));
        let (least, greatest) = depths
            .fold((f64::INFINITY, 0.0_f64), |(least, greatest), depth| {
                (least.min(depth), greatest.max(depth))
            });
        if least.is_nan() || least * MAX_STRETCH <= greatest {
            return None;
        }
        let place = |ray: &DVec3| DVec2::new(x.dot(*ray), y.dot(*ray)) / w.dot(*ray);
        Some(self.corners.iter().map(place).collect())
    }

    /// The matrix with the optical axis whose map is the smallest parallelogram around the hull that
    /// the paper finds. `None` where the hull crosses the axis' horizon.
    pub fn fit(&self, w: DVec3, size: MapSize) -> Option<LightMatrix> {
        let axes = across(w);
        let frame = smallest_parallelogram(&self.places(axes, w)?);
        Some(frame.matrix(axes, w, size))
    }

    /// The matrix with the optical axis whose map is the box around the hull along the rows x and y.
    pub fn fit_box(&self, axes: [DVec3; 2], w: DVec3, size: MapSize) -> Option<LightMatrix> {
        let places = self.places(axes, w)?;
        Some(Parallelogram::around(&places, DVec2::X, 0.0).matrix(axes, w, size))
    }
}

/// What a map is fitted into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapSize {
    /// Texels along each side.
    pub texels: f64,
    /// By how much of its size the frame is widened.
    pub margin: f64,
}

/// Unit vectors across an axis: those of the coordinates, turned with the third onto the axis.
fn across(axis: DVec3) -> [DVec3; 2] {
    let turn = DQuat::from_rotation_arc(DVec3::Z, axis);
    [turn * DVec3::X, turn * DVec3::Y]
}

/// The points without those strictly inside the octagon of extreme ones, which cannot be corners of
/// the hull (S. G. Akl, G. T. Toussaint. A fast convex hull algorithm. IPL 7(5), 1978).
fn without_interior(points: Vec<DVec2>) -> Vec<DVec2> {
    const DIRECTIONS: [DVec2; 8] = [
        DVec2::new(1.0, 0.0),
        DVec2::new(1.0, 1.0),
        DVec2::new(0.0, 1.0),
        DVec2::new(-1.0, 1.0),
        DVec2::new(-1.0, 0.0),
        DVec2::new(-1.0, -1.0),
        DVec2::new(0.0, -1.0),
        DVec2::new(1.0, -1.0),
    ];
    let farthest = |direction: DVec2| {
        let values = points.iter().map(|p| direction.dot(*p));
        let best = values.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(index, _)| points[index])
    };
    let octagon: Vec<_> = DIRECTIONS.into_iter().filter_map(farthest).collect();
    let edges: Vec<_> = (0..octagon.len())
        .map(|i| (octagon[i], octagon[(i + 1) % octagon.len()] - octagon[i]))
        .filter(|(_, edge)| *edge != DVec2::ZERO)
        .collect();
    if edges.is_empty() {
        return points;
    }
    let is_inside = |p: DVec2| {
        edges
            .iter()
            .all(|(start, edge)| edge.perp_dot(p - *start) > 0.0)
    };
    points.into_iter().filter(|&p| !is_inside(p)).collect()
}

/// A parallelogram whose second side leans: x' = x + shear y along its axes.
#[derive(Debug, Clone, Copy)]
struct Parallelogram {
    axis: DVec2,
    shear: f64,
    centre: DVec2,
    half: DVec2,
}

impl Parallelogram {
    fn around(points: &[DVec2], axis: DVec2, shear: f64) -> Self {
        let bounds = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        let (low, high) = points.iter().fold(bounds, |(low, high), &p| {
            let y = axis.perp_dot(p);
            let seen = DVec2::new(axis.dot(p) + shear * y, y);
            (low.min(seen), high.max(seen))
        });
        Self {
            axis,
            shear,
            centre: 0.5 * (low + high),
            half: 0.5 * (high - low),
        }
    }

    fn area(&self) -> f64 {
        self.half.x * self.half.y
    }

    /// The light matrix that makes it the map.
    fn matrix(&self, [x, y]: [DVec3; 2], w: DVec3, size: MapSize) -> LightMatrix {
        // A hull without a width gets one.
        let least = 1e-6 * (1.0 + self.half.max_element());
        let half = (self.half * (1.0 + size.margin)).max(DVec2::splat(least));
        let scale = 0.5 * size.texels / half;
        let along = x * self.axis.x + y * self.axis.y;
        let over = y * self.axis.x - x * self.axis.y;
        LightMatrix {
            x: (along + self.shear * over - self.centre.x * w) * scale.x,
            y: (over - self.centre.y * w) * scale.y,
            w,
        }
    }
}

/// The smallest of the rectangles on the edges of a convex polygon (counter-clockwise), each with the
/// shear that brings its extreme corners over the edge (the paper's section 2.3 and Fig. 3).
fn smallest_parallelogram(hull: &[DVec2]) -> Parallelogram {
    let mut best = Parallelogram::around(hull, DVec2::X, 0.0);
    for i in 0..hull.len() {
        let j = (i + 1) % hull.len();
        let axis = (hull[j] - hull[i]).normalize_or_zero();
        if axis == DVec2::ZERO {
            continue;
        }
        // The others above the edge, with the edge's ends at 0 and `end`.
        let end = axis.dot(hull[j] - hull[i]);
        let others = (0..hull.len()).filter(|&k| k != i && k != j).map(|k| {
            let offset = hull[k] - hull[i];
            DVec2::new(axis.dot(offset), axis.perp_dot(offset))
        });
        let (mut left, mut right) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for other in others {
            left = if other.x < left.x { other } else { left };
            right = if other.x > right.x { other } else { right };
        }
        let mut shears = vec![0.0];
        if left.x < 0.0 && right.x < end {
            shears.push(-left.x / left.y);
        } else if left.x > 0.0 && right.x > end {
            shears.push((end - right.x) / right.y);
        }
        for shear in shears.into_iter().filter(|shear| shear.abs() < MAX_SHEAR) {
            let candidate = Parallelogram::around(hull, axis, shear);
            if candidate.area() < best.area() {
                best = candidate;
            }
        }
    }
    best
}

/// A frame that leans more makes texels long and thin.
const MAX_SHEAR: f64 = 1.0;

/// Rotations of the optical axis that an iteration tries, degrees (section 2.4).
const ANGLES: [f64; 9] = [-10.0, 3.0, 5.0, 9.0, 16.0, 23.0, 30.0, 40.0, 50.0];

/// The paper's iterations.
const ITERATIONS: usize = 3;

/// The paper's Algorithm 1, step 4: from an optical axis along the negative gradient, the best kept.
/// `None` where the first axis does not hold the hull; never worse than that axis.
pub fn optimize(
    axis: DVec3,
    hull: &Hull,
    samples: &[Sample],
    size: MapSize,
) -> Option<LightMatrix> {
    let mut best = hull.fit(axis, size)?;
    let mut least = best.h(samples);
    for _ in 0..ITERATIONS {
        let down = -best.gradient(samples);
        let Some(rotation_axis) = best.w.cross(down).try_normalize() else {
            break;
        };
        let start = best.w;
        let before = least;
        for degrees in ANGLES {
            let w = DQuat::from_axis_angle(rotation_axis, degrees.to_radians()) * start;
            let Some(candidate) = hull.fit(w.normalize(), size) else {
                continue;
            };
            let h = candidate.h(samples);
            if h < least {
                (best, least) = (candidate, h);
            }
        }
        if least == before {
            break;
        }
    }
    Some(best)
}

/// h over the optical axes around one, as offsets across it.
struct Landscape<'a> {
    axis: DVec3,
    across: [DVec3; 2],
    hull: &'a Hull,
    samples: &'a [Sample],
    size: MapSize,
}

impl Landscape<'_> {
    fn matrix(&self, offsets: &[f64]) -> Option<LightMatrix> {
        let [x, y] = self.across;
        let w = self.axis + x * offsets[0] + y * offsets[1];
        self.hull.fit(w.try_normalize()?, self.size)
    }
}

impl CostFunction for Landscape<'_> {
    type Param = Vec<f64>;
    type Output = f64;

    fn cost(&self, offsets: &Vec<f64>) -> std::result::Result<f64, argmin::core::Error> {
        let matrix = self.matrix(offsets);
        Ok(matrix.map_or(f64::INFINITY, |matrix| matrix.h(self.samples)))
    }
}

/// Steps of the downhill simplex, of one or two axes tried each.
const STEPS: u64 = 25;

/// First side of the downhill simplex, about radians.
const REACH: f64 = 0.1;

/// What a downhill simplex (J. A. Nelder, R. Mead. A simplex method for function minimization. The
/// Computer Journal 7(4), 1965; argmin's) makes of a light matrix; never worse than it.
pub fn descend(start: LightMatrix, hull: &Hull, samples: &[Sample], size: MapSize) -> LightMatrix {
    let landscape = || Landscape {
        axis: start.w,
        across: across(start.w),
        hull,
        samples,
        size,
    };
    let corners = vec![vec![0.0, 0.0], vec![REACH, 0.0], vec![0.0, REACH]];
    let run = Executor::new(landscape(), NelderMead::new(corners))
        .configure(|state| state.max_iters(STEPS))
        .timer(false)
        .run();
    let found = run
        .ok()
        .and_then(|mut result| result.state.take_best_param());
    let candidate = found.and_then(|offsets| landscape().matrix(&offsets));
    candidate
        .filter(|candidate| candidate.h(samples) < start.h(samples))
        .unwrap_or(start)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat4;
    use std::f64::consts::FRAC_PI_4;

    const SIZE: MapSize = MapSize {
        texels: 400.0,
        margin: 0.01,
    };

    fn camera(pitch: f64) -> Camera {
        let pose =
            DMat4::from_translation(DVec3::new(1.0, 1.7, 2.0)) * DMat4::from_rotation_x(pitch);
        let focal = DVec2::splat(150.0);
        let centre = DVec2::splat(90.0);
        Camera::new(pose, focal, centre, (180, 180), (0.1, 100.0)).unwrap()
    }

    /// Points of a floor and a wall behind it that the camera sees, with their normals.
    fn surfaces(camera: &Camera) -> Vec<(DVec3, DVec3)> {
        let mut points = Vec::new();
        for row in (4..180).step_by(7) {
            for column in (3..180).step_by(5) {
                let ray = camera.ray_from_pixel(column, row);
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
    fn bundles() -> Vec<RayBundle> {
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

    fn seen(rays: &RayBundle, camera: &Camera) -> (Vec<Sample>, Hull) {
        let facing = surfaces(camera).into_iter().filter(|(point, normal)| {
            let light = rays.light();
            normal.dot(light.truncate() - *point * light.w) * (light.w - 0.5) > 1e-3
        });
        let samples: Vec<_> = facing
            .map(|(point, normal)| Sample::new(rays, camera, point, normal))
            .collect();
        let hull = Hull::new(DVec3::Z, samples.iter().map(|s| s.ray)).unwrap();
        (samples, hull)
    }

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
            let matrix = hull.fit(DVec3::Z, SIZE).unwrap();
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
                let Some(matrix) = hull.fit(w, SIZE) else {
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

    #[test]
    fn optimized_matrices_hold_every_sample_and_are_not_worse() {
        for pitch in [-0.2, -0.6, 0.0] {
            let camera = camera(pitch);
            let (mut before, mut after, mut lowest) = (0.0, 0.0, 0.0);
            for rays in bundles() {
                let (samples, hull) = seen(&rays, &camera);
                let focused = hull.fit(DVec3::Z, SIZE).unwrap();
                let best = optimize(DVec3::Z, &hull, &samples, SIZE).unwrap();
                assert!(best.is_finite());
                for sample in &samples {
                    let place = best.place(sample.ray);
                    assert!(place.abs().max_element() <= 0.5 * SIZE.texels, "{place}");
                }
                assert!(best.h(&samples) <= focused.h(&samples));
                let lower = descend(best, &hull, &samples, SIZE);
                assert!(lower.h(&samples) <= best.h(&samples));
                before += focused.h(&samples);
                after += best.h(&samples);
                lowest += lower.h(&samples);
            }
            assert!(lowest < 0.9 * after, "{lowest} {after}");
            assert!(after < 0.8 * before, "{after} {before}");
        }
    }

    #[test]
    fn parallelogram_leans_with_the_points() {
        let points = [[0.0, 0.0], [4.0, 0.0], [5.0, 2.0], [1.0, 2.0]].map(DVec2::from);
        let frame = smallest_parallelogram(&convex_hull(&points));
        assert!((4.0 * frame.area() - 8.0).abs() < 1e-12);
        let matrix = frame.matrix([DVec3::X, DVec3::Y], DVec3::Z, SIZE);
        for point in points {
            let place = matrix.place(point.extend(1.0)).abs();
            assert!((place - 200.0 / 1.01).length() < 1e-9, "{place}");
        }
    }

    #[test]
    fn hulls_without_a_width_have_a_matrix() {
        for corners in [1, 2] {
            let corners = [DVec3::new(0.2, 0.1, 1.0), DVec3::new(0.4, -0.3, 1.0)]
                .into_iter()
                .take(corners);
            let hull = Hull::new(DVec3::Z, corners).unwrap();
            let matrix = hull.fit(DVec3::Z, SIZE).unwrap();
            assert!(matrix.is_finite());
            for corner in &hull.corners {
                assert!(matrix.place(*corner).abs().max_element() <= 200.0);
            }
        }
        assert_eq!(Hull::new(DVec3::Z, std::iter::empty()), None);
        assert_eq!(Hull::new(DVec3::Z, [DVec3::NEG_Z].into_iter()), None);
    }

    #[test]
    fn points_inside_the_octagon_are_no_corners() {
        let points: Vec<_> = (0..2000)
            .map(|i| DVec2::from_angle(f64::from(i)) * f64::from(i % 97))
            .collect();
        let kept = without_interior(points.clone());
        assert!(kept.len() < 600);
        assert_eq!(convex_hull(&kept), convex_hull(&points));
    }
}
