//! What a light sees of a layer, where a map is not to be looked up but looked at.

use super::rasterize::{NONE, rasterize};
use super::view::{Nearness, View};
use crate::projection::Projection;
use crate::scene::Scene;
use crate::sides::Source;
use glam::DVec2;
use rayon::prelude::*;

/// Row by row.
#[derive(Debug, Clone)]
pub struct DepthImage {
    /// World units along the rays; infinite where nothing is seen.
    pub depths: Vec<f32>,
    pub triangles: Vec<u32>,
}

impl DepthImage {
    /// `None` where texels follow from points by no matrix.
    pub fn new(projection: &Projection, scene: &Scene, light: Source) -> Option<Self> {
        let is_central = projection.kind.is_central();
        let (width, height) = (projection.width as usize, projection.height as usize);
        let view = View {
            origin: projection.origin,
            rows: projection.homogeneous_rows()?,
            nearness: match is_central {
                true => Nearness::Inverse,
                false => Nearness::Linear(-projection.z_axis.extend(0.0)),
            },
            width,
            height,
            seen: match is_central {
                true => (0.0, f64::INFINITY),
                false => (f64::NEG_INFINITY, f64::INFINITY),
            },
            light: Some(light),
        };
        let image = rasterize(&view, scene);
        let texel = |i: usize| {
            let triangle = image.triangles[image.tiling.index(i % width, i / width)];
            if triangle == NONE {
                return (f32::INFINITY, NONE);
            }
            let place = DVec2::new((i % width) as f64, (i / width) as f64) + 0.5;
            let (start, ray) = projection.ray_from_texel(place);
            let [a, b, c] = scene.corners(triangle);
            let normal = (b - a).cross(c - a);
            let depth = normal.dot(a - start) / normal.dot(ray);
            (depth as f32, triangle)
        };
        let texels = (0..width * height).into_par_iter().with_min_len(1 << 10);
        let (depths, triangles) = texels.map(texel).unzip();
        Some(Self { depths, triangles })
    }
}
