//! Pass "receiver tiles": the tiles of a shadow map that receivers look at.

use super::inputs::Receivers;
use super::rasterize::{TILE_SHIFT, tiles_of_map};
use super::warp_map::{self, WarpMap};
use crate::error::Result;
use crate::gpu::frame::{Dispatch, Frame, buffer};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::shaders::Shader;
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
/// on each side of its own, less than a tile.
pub fn receiver_tiles(
    frame: &mut Frame,
    seen: Receivers,
    projection: &Projection,
    warp: Option<&WarpMap>,
    reach: u8,
) -> Result<PooledBuffer> {
    let [columns, rows] = tiles_of_map(projection);
    let tiles = frame.storage(LABEL, 4 * u64::from(columns) * u64::from(rows))?;
    frame.clear(&tiles);
    let uniform = ReceiverTilesUniform {
        shift: TILE_SHIFT,
        columns,
        reach: f32::from(reach) + SLACK,
    };
    let uniform = frame.uniform(LABEL, &uniform);
    let receivers = frame.uniform("receivers", &seen.uniform(projection));
    let projected = frame.uniform("projection", &projection.uniform(seen.scene.origin));
    let shader = Shader {
        projection: projection.shader(),
        warp: warp_map::shader(warp),
        ..Shader::new("receiver_tiles")
    };
    let rows_per_invocation = frame.gpu.work_per_invocation(1, 32);
    let mut constants = seen.constants().to_vec();
    constants.extend(seen.tiles_constants(rows_per_invocation));
    constants.extend(warp_map::constants(warp));
    let pipeline = frame.gpu.clone().pipeline(shader, "main", &constants);
    let mut bindings = seen.bindings(&receivers).to_vec();
    bindings.extend([
        seen.tiles_binding(),
        (0, buffer(&projected)),
        (1, buffer(&uniform)),
        (2, buffer(&tiles)),
    ]);
    bindings.extend(warp.map(WarpMap::bindings).unwrap_or_default());
    frame.pass(
        LABEL,
        &[Dispatch {
            pipeline: &pipeline,
            bindings,
            groups: seen.groups(rows_per_invocation),
        }],
    );
    Ok(tiles)
}
