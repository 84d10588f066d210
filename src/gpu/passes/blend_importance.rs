//! Pass "blend importance": an importance map with that of the frame before.

use super::importance_map::ImportanceMap;
use super::warp_map::WarpMap;
use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::recording::Recording;
use crate::gpu::shader_struct::shader_struct;
use crate::importance::OldImportance;

pub const LABEL: &str = "blend importance";

shader_struct! {
    pub struct BlendUniform is Blend in "blend_importance" {
        old_from_new: [[f32; 4]; 3],
        determinant: f32,
        share: f32,
        unit: f32,
        cells: u32,
        old_columns: u32,
        old_rows: u32,
        padding: [u32; 2],
    }
}

/// Blends the map in place: counts along y, where there is a `warp` whose functions along x say where the
/// old ones belong, or else what is laid out as the map is.
pub fn blend_importance(
    frame: &mut Recording,
    map: &ImportanceMap,
    old: OldImportance,
    warp: Option<&WarpMap>,
) -> Result<()> {
    let matrix = old.old_from_new_cells(map.cells);
    let rows = matrix.transpose();
    let uniform = BlendUniform {
        old_from_new: [rows.x_axis, rows.y_axis, rows.z_axis]
            .map(|row| row.as_vec3().extend(0.0).to_array()),
        determinant: matrix.determinant() as f32,
        share: old.share as f32,
        unit: map.count_unit.unwrap_or(1.0) as f32,
        cells: map.cells,
        old_columns: old.columns,
        old_rows: old.rows,
        padding: [0; 2],
    };
    let values = frame.constants("old importance", old.values)?;
    let groups = Groups::Grid(map.cells.div_ceil(64), map.cells);
    let kernel = Kernel::new("blend_importance").uniform(0, &uniform);
    let blend = kernel.clone().bind(2, &map.values);
    let dispatches = match (map.count_unit, warp) {
        (None, _) => vec![blend.entry("maximum").bind(1, &values)],
        (Some(_), None) => vec![blend.entry("count").bind(1, &values)],
        (Some(_), Some(_)) => {
            let splat = kernel.entry("splat").bind(1, &values).bind(3, &map.values);
            vec![blend.entry("fade"), splat.warp(warp)]
        }
    };
    let dispatches = dispatches.into_iter();
    let dispatches = dispatches.map(|kernel| kernel.dispatch(groups.clone()));
    frame.pass(LABEL, &dispatches.collect::<Vec<_>>());
    Ok(())
}
