//! Pass "shadow map": casters to nearest depth per texel, seen from the light.

use super::rasterize::{RasterJob, rasterize};
use crate::error::Result;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::scene_tables::SceneTables;

pub const LABEL: &str = "shadow map";

pub fn shadow_map(
    frame: &mut Recording,
    scene: &SceneTables,
    job: RasterJob,
) -> Result<PooledBuffer> {
    rasterize(frame, LABEL, scene, job)
}

/// Depth in [0, 1] of a texel, 1 where it is empty.
pub fn depth_from_key(key: u32) -> f32 {
    if key == 0 { 1.0 } else { f32::from_bits(!key) }
}
