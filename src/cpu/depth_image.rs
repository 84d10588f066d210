//! What a light sees of a layer, where a map is not to be looked up but looked at.

use super::map::Map;
use super::texels::EMPTY;
use crate::projection::Projection;

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
        let depth = |depth: f32| match depth {
            EMPTY => f32::INFINITY,
            depth => depth / unit,
        };
        let depths = tiling.row_by_row(&map.depths).into_iter();
        Self {
            depths: depths.map(depth).collect(),
            triangles: tiling.row_by_row(&map.image.triangles),
        }
    }
}
