//! Pass "receiver tiles": the tiles of a shadow map that receivers look at.

use super::inputs::Receivers;
use super::rasterize::{FINE_SHIFT, tiles_of_map};
use super::warp_map::WarpMap;
use crate::error::Result;
use crate::gpu::kernel::Kernel;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::shader_struct::shader_struct;
use crate::projection::Projection;

pub const LABEL: &str = "receiver tiles";

/// Rounding between this pass and the lookup, in texels.
const SLACK: f32 = 0.5;

shader_struct! {
    pub struct ReceiverTilesUniform is ReceiverTiles in "receiver_tiles" {
        shift: u32,
        columns: u32,
        reach: f32,
    }
}

/// Records the pass; 1 for each tile, in rows, that a receiver may ask for, whose lookup takes `reach` texels
/// on each side of its own, less than a tile. Positions are known to `rounding`.
pub fn receiver_tiles(
    frame: &mut Recording,
    seen: Receivers,
    projection: &Projection,
    warp: Option<&WarpMap>,
    reach: u8,
    rounding: f64,
) -> Result<PooledBuffer> {
    let [columns, rows] = tiles_of_map(projection);
    let tiles = frame.storage(LABEL, 4 * u64::from(columns) * u64::from(rows))?;
    frame.clear(&tiles);
    let uniform = ReceiverTilesUniform {
        shift: FINE_SHIFT,
        columns,
        reach: f32::from(reach) + SLACK,
    };
    let mut receivers = seen.uniform(projection);
    receivers.margin = rounding as f32;
    let rows_per_invocation = frame.gpu.work_per_invocation(1, 32);
    let kernel = Kernel::new("receiver_tiles")
        .projection(0, projection, seen.scene.origin)
        .uniform(1, &uniform)
        .bind(2, &tiles)
        .receivers(seen, &receivers)
        .tiles(seen, rows_per_invocation)
        .warp(warp);
    frame.pass(LABEL, &[kernel.dispatch(seen.groups(rows_per_invocation))]);
    Ok(tiles)
}
