//! Pass "importance map": what the receivers make of each cell of the light's map.

use super::boundary::BoundaryWeights;
use super::inputs::Receivers;
use super::warp_map::{Axis, WarpMap};
use crate::error::Result;
use crate::gpu::kernel::Kernel;
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::shader_struct::shader_struct;
use crate::projection::Projection;

pub const LABEL: &str = "importance map";

/// What a cell is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Importance {
    /// How much the receivers in it weigh, where a weight of one counts `unit`: in rows of cells along x,
    /// or in columns of cells along y once the receivers went through the warp's functions along x.
    Count { along: Axis, unit: f64 },
    /// The greatest importance of a receiver in it.
    Maximum,
}

/// The factors of a receiver's importance (Rosen, section 5); every receiver is in the desired view.
#[derive(Clone, Copy, Default)]
pub struct Factors<'a> {
    /// One over the distance along the viewing direction (5.2).
    pub distance: bool,
    /// The surface normal (5.4), with its bonus beta.
    pub normal: Option<f64>,
    /// A factor for each texel of an image from the light (5.3), and its side.
    pub shadow_edge: Option<(&'a wgpu::Buffer, u32)>,
    pub boundary: Option<&'a BoundaryWeights>,
    /// A factor for each pixel.
    pub pixel_weights: Option<&'a wgpu::Buffer>,
    /// A factor for each cell of a grid over the light's map, and its columns and rows.
    pub map_weights: Option<(&'a wgpu::Buffer, [u32; 2])>,
}

impl Kernel {
    /// Factors that light and camera both see; `unused` stands for one that is not there.
    pub fn factors(self, factors: Factors, unused: &wgpu::Buffer) -> Self {
        self.constant("uses_distance", factors.distance)
            .constant("uses_normal", factors.normal.is_some())
            .constant("uses_shadow_edge", factors.shadow_edge.is_some())
            .constant("uses_map_weights", factors.map_weights.is_some())
            .bind(4, factors.map_weights.map_or(unused, |(b, _)| b))
            .bind(6, factors.shadow_edge.map_or(unused, |(b, _)| b))
    }
}

/// An importance map on the device, `cells` along each side.
pub struct ImportanceMap {
    pub buffer: PooledBuffer,
    pub cells: u32,
    /// What a weight of one counts where a cell holds a count; else it holds the bits of a float32.
    pub count_unit: Option<f64>,
}

impl ImportanceMap {
    pub fn value_from_bits(&self, bits: u32) -> f32 {
        match self.count_unit {
            Some(unit) => (f64::from(bits) / unit) as f32,
            None => f32::from_bits(bits),
        }
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
        map_weights: factors.map_weights.map_or([1; 2], |(_, size)| size),
        normal_bonus: factors.normal.unwrap_or(0.0) as f32,
        shadow_edges: factors.shadow_edge.map_or(1, |(_, side)| side),
        blocks: factors.boundary.map_or(1, |boundary| boundary.columns),
        unit: count_unit.unwrap_or(1.0) as f32,
    };
    let map = frame.storage(LABEL, 4 * u64::from(cells).pow(2))?;
    frame.clear(&map);
    let rows = frame.gpu.work_per_invocation(1, 32);
    let unused = frame.storage("unused weights", 4)?;
    let boundary = factors.boundary.map_or(&*unused, |b| &*b.weights);
    let kernel = Kernel::new("importance_map")
        .constant("counts", count_unit.is_some())
        .projection(&frame.gpu, 0, projection, seen.scene.origin)
        .uniform(&frame.gpu, 1, &uniform)
        .bind(2, &map)
        .bind(3, factors.pixel_weights.unwrap_or(&unused))
        .bind(7, boundary)
        .constant("uses_boundary", factors.boundary.is_some())
        .constant("uses_pixel_weights", factors.pixel_weights.is_some())
        .receivers(&frame.gpu, seen, &seen.uniform(projection))
        .tiles(seen, rows)
        .factors(factors, &unused)
        .warp(warp);
    frame.pass(LABEL, &[kernel.dispatch(seen.groups(rows))]);
    Ok(ImportanceMap {
        buffer: map,
        cells,
        count_unit,
    })
}
