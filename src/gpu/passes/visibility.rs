//! Pass "visibility": camera to nearest depth and triangle per pixel.

use super::rasterize::{RasterJob, rasterize};
use crate::camera::Camera;
use crate::error::Result;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::scene_tables::SceneTables;
use crate::projection::Projection;

pub const LABEL: &str = "visibility";

pub fn visibility(
    frame: &mut Recording,
    scene: &SceneTables,
    camera: &Camera,
) -> Result<PooledBuffer> {
    // Nothing is beyond the scene. A near plane says little of how long lengths are, a far one does.
    let projection = Projection {
        far: camera.zfar.min(2.0 * scene.farthest(camera.eye)),
        ..Projection::from_camera(camera)
    };
    rasterize(frame, LABEL, scene, RasterJob::plain(&projection))
}

/// Triangle of each pixel from its key in the visibility buffer, -1 where nothing is seen.
pub fn triangle_from_key(key: u64) -> i32 {
    !(key as u32) as i32
}
