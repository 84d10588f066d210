//! Some pixels of the image, as points in float64: what fits on the CPU look at.

use crate::camera::Camera;
use crate::light::Light;
use crate::reference::surface;
use crate::scene::Scene;
use glam::DVec3;

/// Second difference of one over the depth, as a share of it, that still is smooth.
const MAX_BEND: f64 = 0.02;

/// A surface where a sample meets it.
#[derive(Debug, Clone, Copy)]
pub struct Surface {
    pub point: DVec3,
    pub normal: DVec3,
    pub weight: f64,
}

/// Some pixels of the image, seen by the CPU: rows of a coarse camera's image.
pub struct SampledReceivers {
    pub camera: Camera,
    /// Not a number where nothing is seen.
    pub points: Vec<DVec3>,
    /// Towards the camera.
    pub normals: Vec<DVec3>,
    /// Along the viewing direction; not a number where nothing is seen.
    pub depths: Vec<f64>,
    is_facing: Vec<bool>,
}

impl SampledReceivers {
    /// `triangles` are those of the camera's pixels, -1 where nothing is seen.
    pub fn new(scene: &Scene, light: &Light, camera: Camera, triangles: &[i32]) -> Self {
        let (points, normals, depths) = surface(scene, &camera, triangles);
        let points: Vec<_> = points.into_iter().map(DVec3::from).collect();
        let normals = normals.into_iter().map(|n| DVec3::from(n.map(f64::from)));
        let normals: Vec<_> = normals.collect();
        let faces = |(point, normal): (&DVec3, &DVec3)| {
            let to_light = light.vector_from_point(*point);
            let is_reached = light
                .cone()
                .is_none_or(|cone| cone.depth_of(-to_light) >= 0.0);
            normal.dot(to_light) > 0.0 && is_reached
        };
        Self {
            is_facing: points.iter().zip(&normals).map(faces).collect(),
            camera,
            points,
            normals,
            depths,
        }
    }

    /// Pieces of the surfaces that are seen, each of the same weight.
    pub fn seen_surfaces(&self) -> Vec<Surface> {
        let samples = self.points.iter().zip(&self.normals);
        let seen = samples.filter(|(point, _)| !point.is_nan());
        let surface = |(&point, &normal): (&DVec3, &DVec3)| Surface {
            point,
            normal,
            weight: 1.0,
        };
        seen.map(surface).collect()
    }

    /// Of those that the light could reach, by how much of it falls on them: the cosine of the angle to it.
    pub fn lit_surfaces(&self, light: &Light) -> Vec<Surface> {
        let surface = |i: usize| {
            let (point, normal) = (self.points[i], self.normals[i]);
            Surface {
                point,
                normal,
                weight: normal.dot(light.vector_from_point(point).normalize()),
            }
        };
        self.facing_the_light().into_iter().map(surface).collect()
    }

    /// Indices of the samples that the light could reach.
    pub fn facing_the_light(&self) -> Vec<usize> {
        (0..self.points.len())
            .filter(|&i| self.is_facing[i])
            .collect()
    }

    /// The samples themselves.
    pub fn points_in_light(&self) -> impl Iterator<Item = DVec3> {
        let samples = self.points.iter().zip(&self.is_facing);
        samples
            .filter(|(_, is_facing)| **is_facing)
            .map(|(point, _)| *point)
    }

    pub fn is_facing(&self, index: usize) -> bool {
        self.is_facing[index]
    }

    /// The samples to the left and right, above and below.
    pub fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> {
        let pairs = self.neighbours_across(index).into_iter();
        pairs.flatten().flatten()
    }

    /// Those to the left and right, then those above and below.
    fn neighbours_across(&self, index: usize) -> [[Option<usize>; 2]; 2] {
        let (width, height) = (self.camera.width as usize, self.camera.height as usize);
        let (row, column) = (index / width, index % width);
        let pair = |place: usize, count: usize, step: usize| {
            let before = (place > 0).then(|| index - step);
            [before, (place + 1 < count).then_some(index + step)]
        };
        [pair(column, width, 1), pair(row, height, width)]
    }

    /// Whether the depth changes as a plane's does, so that its derivatives tell of the neighbourhood:
    /// one over it is linear in the image (the paper thresholds its second difference).
    pub fn is_smooth(&self, index: usize) -> bool {
        let here = 1.0 / self.depths[index];
        self.neighbours_across(index).into_iter().all(|pair| {
            let [Some(before), Some(after)] = pair else {
                return true;
            };
            let bend = 1.0 / self.depths[before] + 1.0 / self.depths[after] - 2.0 * here;
            bend.abs() < MAX_BEND * here
        })
    }
}

/// Of samples of about `resolution` pixels along the longer side of the image: pixels from one to the next. An image
/// that is narrower than 16 to 9 has as many samples as that one: of few columns none may see what the others see.
pub fn stride(camera: &Camera, resolution: u32) -> u32 {
    let [width, height] = [camera.width, camera.height].map(f64::from);
    let side_of_wide = (16.0 / 9.0 * width * height).sqrt();
    let side = width.max(height).min(side_of_wide);
    (side / f64::from(resolution)).round().max(1.0) as u32
}

/// The first of the samples lies in the middle of its block, or in a smaller image.
pub fn first_sample(camera: &Camera, stride: u32) -> u32 {
    (stride / 2).min(camera.width.min(camera.height) - 1)
}

/// The camera whose pixels' centres are those of every `stride`-th pixel.
pub fn coarse_camera(camera: &Camera, stride: u32) -> Camera {
    let first = first_sample(camera, stride);
    let scale = f64::from(stride);
    Camera {
        focal: camera.focal / scale,
        centre: (camera.centre - f64::from(first) - 0.5) / scale + 0.5,
        width: (camera.width - first).div_ceil(stride),
        height: (camera.height - first).div_ceil(stride),
        ..camera.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat4, DVec2};

    #[test]
    fn narrow_images_have_as_many_samples_as_others() {
        let stride_of = |width, height| {
            let lens = (DVec2::splat(900.0), DVec2::ZERO);
            let size = (width, height);
            let camera = Camera::new(DMat4::IDENTITY, lens.0, lens.1, size, (0.1, 9.0)).unwrap();
            stride(&camera, 180)
        };
        assert_eq!(stride_of(1920, 1080), 11);
        assert_eq!(stride_of(1024, 1024), 6);
        assert_eq!(stride_of(320, 180), 2);
        assert_eq!(stride_of(3, 500), 1);
        assert_eq!(stride_of(40, 8000), 4);
    }

    #[test]
    fn coarse_pixels_have_the_rays_of_fine_ones() {
        for (width, height) in [(7, 5), (1, 1), (64, 3), (1920, 1080)] {
            let focal = DVec2::new(900.0, 880.0);
            let centre = DVec2::new(3.1, 2.7);
            let camera =
                Camera::new(DMat4::IDENTITY, focal, centre, (width, height), (0.1, 9.0)).unwrap();
            for stride in [1, 2, 3, 11] {
                let coarse = coarse_camera(&camera, stride);
                let first = first_sample(&camera, stride);
                for (column, row) in [(0, 0), (coarse.width - 1, coarse.height - 1)] {
                    let (x, y) = (column * stride + first, row * stride + first);
                    assert!(x < width && y < height);
                    let (_, fine) = camera.ray_from_pixel(x, y);
                    assert!((coarse.ray_from_pixel(column, row).1 - fine).length() < 1e-12);
                }
            }
        }
    }
}
