//! Pass "boundary": weights of the receivers near the boundaries of shadows, from a visibility image.

use super::inputs::Receivers;
use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;

pub const LABEL: &str = "boundary";

/// Pixels along each side of a block, as in the shader.
const BLOCK: u32 = 4;

/// Weights by blocks of the image.
pub struct BoundaryWeights {
    pub weights: PooledBuffer,
    pub columns: u32,
}

/// `weight` where a boundary is near, 1 elsewhere.
pub fn boundary(
    frame: &mut Recording,
    seen: Receivers,
    visibility: &wgpu::Buffer,
    weight: f64,
) -> Result<BoundaryWeights> {
    let columns = seen.camera.width.div_ceil(BLOCK);
    let rows = seen.camera.height.div_ceil(BLOCK);
    let size = 4 * u64::from(columns) * u64::from(rows);
    let marks = frame.storage(LABEL, size)?;
    let weights = frame.storage("boundary weights", size)?;
    // Which receivers face the light does not depend on a projection.
    let (gpu, receivers) = (&frame.gpu, seen.camera_uniform());
    let groups = Groups::Grid(columns.div_ceil(64), rows);
    let mark = Kernel::new("boundary")
        .entry("mark")
        .receivers(gpu, seen, &receivers)
        .bind(0, visibility)
        .bind(1, &marks);
    let weigh = Kernel::new("boundary")
        .entry("weigh")
        .constant("boundary_weight", weight)
        .uniform(gpu, 20, &receivers)
        .bind(1, &marks)
        .bind(2, &weights);
    frame.pass(
        LABEL,
        &[mark.dispatch(groups.clone()), weigh.dispatch(groups)],
    );
    Ok(BoundaryWeights { weights, columns })
}
