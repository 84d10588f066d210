//! Pass "visibility": camera to nearest depth and triangle per pixel.

use super::inputs::Inputs;
use super::rasterize::{RasterJob, Rasterization, Rasterized, Target, rasterize};
use crate::error::Result;
use crate::gpu::frame::Frame;
use crate::projection::Projection;

pub const LABEL: &str = "visibility";

pub fn visibility(frame: &mut Frame, inputs: Inputs) -> Result<Rasterized> {
    let camera = inputs.camera;
    // Nothing is beyond the scene. A near plane says little of how long lengths are, a far one does.
    let projection = Projection {
        far: camera.zfar.min(2.0 * inputs.scene.farthest(camera.eye)),
        ..Projection::from_camera(camera)
    };
    let drawn = RasterJob {
        projection: &projection,
        warp: None,
        target: Target::DepthTriangle,
        rasterization: Rasterization::Exact,
        receiver_tiles: None,
    };
    rasterize(frame, LABEL, inputs.scene, drawn)
}

/// Triangle of each pixel from its key in the visibility buffer, -1 where nothing is seen.
pub fn triangle_from_key(key: u64) -> i32 {
    !(key as u32) as i32
}
