//! What a light sees of a layer, where a map is not to be looked up but looked at.

use super::map::{EMPTY, Map};
use crate::projection::Projection;
use rayon::prelude::*;

/// Row by row.
#[derive(Debug, Clone)]
pub struct DepthImage {
    /// World units along the rays; infinite where nothing is seen.
    pub depths: Vec<f32>,
    pub triangles: Vec<u32>,
}

impl DepthImage {
    pub fn new(map: &Map, projection: &Projection) -> Self {
        let tiling = map.image.tiling;
        let unit = projection.unit() as f32;
        let texel = |i: usize| {
            let index = tiling.index(i % tiling.width, i / tiling.width);
            let depth = match map.depths[index] {
                EMPTY => f32::INFINITY,
                depth => depth / unit,
            };
            (depth, map.image.triangles[index])
        };
        let texels = (0..tiling.width * tiling.height).into_par_iter();
        let (depths, triangles) = texels.with_min_len(1 << 10).map(texel).unzip();
        Self { depths, triangles }
    }
}
