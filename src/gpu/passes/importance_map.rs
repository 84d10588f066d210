//! Pass "importance map": what the receivers make of each cell of the light's map.

use super::inputs::Receivers;
use super::warp_map::WarpMap;
use crate::error::Result;
use crate::gpu::kernel::Kernel;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::shader_struct::shader_struct;
use crate::importance::{self, Importance};
use crate::projection::Projection;
use crate::warp::Axis;

pub const LABEL: &str = "importance map";

pub type Factors<'a> = importance::Factors<'a, PooledBuffer>;
pub type ImportanceMap = importance::ImportanceMap<PooledBuffer>;

impl Kernel {
    /// Factors that light and camera both see; `unused` stands for one that is not there.
    pub fn factors(self, factors: Factors, unused: &wgpu::Buffer) -> Self {
        self.constant("uses_distance", factors.distance)
            .constant("uses_normal", factors.normal.is_some())
            .constant("uses_shadow_edge", factors.shadow_edge.is_some())
            .constant("uses_map_weights", factors.map_weights.is_some())
            .bind(4, factors.map_weights.map_or(unused, |grid| &grid.values))
            .bind(6, factors.shadow_edge.map_or(unused, |grid| &grid.values))
    }
}

shader_struct! {
    pub struct ImportanceUniform is Importance in "importance_map" {
        cells: u32,
        along_y: u32,
        map_weights: [u32; 2],
        normal_bonus: f32,
        shadow_edges: u32,
        blocks: u32,
        unit: f32,
    }
}

/// Records the pass.
pub fn importance_map(
    frame: &mut Recording,
    seen: Receivers,
    projection: &Projection,
    cells: u32,
    importance: Importance,
    factors: Factors,
    warp: Option<&WarpMap>,
) -> Result<ImportanceMap> {
    let (along, count_unit) = match importance {
        Importance::Count { along, unit } => (along, Some(unit)),
        Importance::Maximum => (Axis::X, None),
    };
    let uniform = ImportanceUniform {
        cells,
        along_y: u32::from(along == Axis::Y),
        map_weights: factors
            .map_weights
            .map_or([1; 2], |grid| [grid.columns, grid.rows]),
        normal_bonus: factors.normal.unwrap_or(0.0) as f32,
        shadow_edges: factors.shadow_edge.map_or(1, |grid| grid.columns),
        blocks: factors.boundary.map_or(1, |grid| grid.columns),
        unit: count_unit.unwrap_or(1.0) as f32,
    };
    let map = frame.storage(LABEL, 4 * u64::from(cells).pow(2))?;
    frame.clear(&map);
    let rows = frame.gpu.work_per_invocation(1, 32);
    let unused = frame.storage("unused weights", 4)?;
    let boundary = factors.boundary.map_or(&unused, |grid| &grid.values);
    let pixels = factors.pixel_weights.map_or(&unused, |grid| &grid.values);
    let kernel = Kernel::new("importance_map")
        .constant("counts", count_unit.is_some())
        .projection(0, projection, seen.scene.origin)
        .uniform(1, &uniform)
        .bind(2, &map)
        .bind(3, pixels)
        .bind(7, boundary)
        .constant("uses_boundary", factors.boundary.is_some())
        .constant("uses_pixel_weights", factors.pixel_weights.is_some())
        .receivers(seen, &seen.uniform(projection))
        .tiles(seen, rows)
        .factors(factors, &unused)
        .warp(warp);
    frame.pass(LABEL, &[kernel.dispatch(seen.groups(rows))]);
    Ok(ImportanceMap {
        values: map,
        cells,
        count_unit,
    })
}
