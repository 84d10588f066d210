//! Pass "blend importance": an importance map with that of the frame before.

use super::importance_map::ImportanceMap;
use super::warp_map::{self, WarpMap};
use crate::error::Result;
use crate::gpu::frame::{Dispatch, Frame, Groups, buffer};
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::shaders::Shader;
use glam::{DMat3, DVec2};

pub const LABEL: &str = "blend importance";

/// The importance map of the frame before.
#[derive(Clone, Copy)]
pub struct OldImportance<'a> {
    pub values: &'a [f32],
    pub columns: u32,
    pub rows: u32,
    /// Its sides from those of the new map, both from 0 to 1, homogeneous.
    pub old_from_new: DMat3,
    /// Its part of the blended map.
    pub share: f64,
}

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
    frame: &mut Frame,
    map: &ImportanceMap,
    old: OldImportance,
    warp: Option<&WarpMap>,
) -> Result<()> {
    // Both maps in cells.
    let sides = |columns: u32, rows: u32| DVec2::new(f64::from(columns), f64::from(rows));
    let to_old = DMat3::from_scale(sides(old.columns, old.rows));
    let from_new = DMat3::from_scale(sides(map.cells, map.cells).recip());
    let matrix = to_old * old.old_from_new * from_new;
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
    let uniform = frame.uniform(LABEL, &uniform);
    let values = frame.constants("old importance", old.values)?;
    let gpu = frame.gpu.clone();
    let shader = |warp| Shader {
        warp: warp_map::shader(warp),
        ..Shader::new("blend_importance")
    };
    let entry_point = match (map.count_unit, warp) {
        (None, _) => "maximum",
        (Some(_), None) => "count",
        (Some(_), Some(_)) => "fade",
    };
    let blend = gpu.pipeline(shader(None), entry_point, &[]);
    let groups = || Groups::Grid(map.cells.div_ceil(64), map.cells);
    let mut bindings = vec![(0, buffer(&uniform)), (2, buffer(&map.buffer))];
    if entry_point != "fade" {
        bindings.push((1, buffer(&values)));
    }
    let mut dispatches = vec![Dispatch {
        pipeline: &blend,
        bindings,
        groups: groups(),
    }];
    let splat;
    if entry_point == "fade" {
        splat = gpu.pipeline(shader(warp), "splat", &[]);
        let mut bindings = vec![
            (0, buffer(&uniform)),
            (1, buffer(&values)),
            (3, buffer(&map.buffer)),
        ];
        bindings.extend(warp.map(WarpMap::bindings).unwrap_or_default());
        dispatches.push(Dispatch {
            pipeline: &splat,
            bindings,
            groups: groups(),
        });
    }
    frame.pass(LABEL, &dispatches);
    Ok(())
}
