//! Pass "shadow map": casters to nearest depth per texel, seen from the light.

use super::inputs::Inputs;
use super::rasterize::{RasterJob, Rasterized, rasterize};
use crate::error::Result;
use crate::gpu::frame::Frame;

pub const LABEL: &str = "shadow map";

pub fn shadow_map(frame: &mut Frame, inputs: Inputs, drawn: RasterJob) -> Result<Rasterized> {
    rasterize(frame, LABEL, inputs.scene, drawn)
}

/// Depth in [0, 1] of a texel, 1 where it is empty.
pub fn depth_from_key(key: u32) -> f32 {
    if key == 0 { 1.0 } else { f32::from_bits(!key) }
}
