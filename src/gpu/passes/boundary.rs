//! Pass "boundary": weights of the receivers near the boundaries of shadows, from a visibility image.

use super::inputs::Receivers;
use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::importance::{BOUNDARY_BLOCK, Grid};

pub const LABEL: &str = "boundary";

/// Of each block of the image `weight` where a boundary is near, else 1.
pub fn boundary(
    frame: &mut Recording,
    seen: Receivers,
    visibility: &wgpu::Buffer,
    weight: f64,
) -> Result<Grid<PooledBuffer>> {
    let columns = seen.camera.width.div_ceil(BOUNDARY_BLOCK);
    let rows = seen.camera.height.div_ceil(BOUNDARY_BLOCK);
    let size = 4 * u64::from(columns) * u64::from(rows);
    let marks = frame.storage(LABEL, size)?;
    let weights = frame.storage("boundary weights", size)?;
    // Which receivers face the light does not depend on a projection.
    let receivers = seen.camera_uniform();
    let groups = Groups::Grid(columns.div_ceil(64), rows);
    let mark = Kernel::new("boundary")
        .entry("mark")
        .receivers(seen, &receivers)
        .bind(0, visibility)
        .bind(1, &marks);
    let weigh = Kernel::new("boundary")
        .entry("weigh")
        .constant("boundary_weight", weight)
        .receivers_uniform(seen, &receivers)
        .bind(1, &marks)
        .bind(2, &weights);
    frame.pass(
        LABEL,
        &[mark.dispatch(groups.clone()), weigh.dispatch(groups)],
    );
    Ok(Grid {
        values: weights,
        columns,
        rows,
    })
}
