//! Pass "importance map": what the receivers make of each cell of the light's map.

use super::Receivers;
use super::warp_map::{self, WarpMap};
use crate::error::Result;
use crate::gpu::frame::{Dispatch, Frame, Groups, buffer, table};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::shaders::Shader;
use crate::projection::Projection;
use bytemuck::{Pod, Zeroable};

pub const LABEL: &str = "importance map";

/// What a cell is worth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Importance {
    /// How many receivers fall in it, cells along x in each of `functions` rows.
    CountAlongX { functions: u32 },
    /// The same along y in each of `functions` columns, once the receivers went through the warp's
    /// functions along x.
    CountAlongY { functions: u32 },
    /// The greatest importance of a receiver in it: a product of Rosen's functions.
    Maximum(Factors),
}

/// Rosen's importance functions (section 5); every receiver is in the desired view.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Factors {
    /// One over the distance along the viewing direction (5.2).
    pub distance: bool,
    /// The surface normal (5.4), with its bonus beta.
    pub normal: Option<f64>,
}

/// An importance map on the device, `cells` to each of `functions` rows.
pub struct ImportanceMap {
    pub buffer: PooledBuffer,
    pub functions: u32,
    pub cells: u32,
    /// Whether a cell holds a count, or the bits of a float32.
    pub is_count: bool,
}

impl ImportanceMap {
    pub fn value_from_bits(&self, bits: u32) -> f32 {
        if self.is_count {
            bits as f32
        } else {
            f32::from_bits(bits)
        }
    }
}

/// As `Importance` in the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct ImportanceUniform {
    functions: u32,
    cells: u32,
    along_y: u32,
    uses_distance: u32,
    uses_normal: u32,
    normal_bonus: f32,
    padding: [u32; 2],
}

/// Records the pass.
pub fn importance_map(
    frame: &mut Frame,
    seen: Receivers,
    projection: &Projection,
    cells: u32,
    importance: Importance,
    warp: Option<&WarpMap>,
) -> Result<ImportanceMap> {
    let (entry_point, functions, along_y, factors) = match importance {
        Importance::CountAlongX { functions } => ("count", functions, false, None),
        Importance::CountAlongY { functions } => ("count", functions, true, None),
        Importance::Maximum(factors) => ("maximum", cells, false, Some(factors)),
    };
    let normal = factors.and_then(|factors| factors.normal);
    let uniform = ImportanceUniform {
        functions,
        cells,
        along_y: u32::from(along_y),
        uses_distance: u32::from(factors.is_some_and(|factors| factors.distance)),
        uses_normal: u32::from(normal.is_some()),
        normal_bonus: normal.unwrap_or(0.0) as f32,
        padding: [0; 2],
    };
    let size = 4 * u64::from(functions) * u64::from(cells);
    let map = frame.storage(LABEL, size)?;
    frame.clear(&map);
    let receivers = seen.uniform(projection);
    let receivers = frame.uniform("receivers", &receivers);
    let projected = frame.uniform("projection", &projection.uniform(seen.scene.origin));
    let uniform = frame.uniform("importance", &uniform);
    let shader = Shader {
        projection: projection.kind.shader(),
        warp: warp_map::shader(warp),
        ..Shader::new("importance_map")
    };
    let rows = frame.gpu.work_per_invocation(1, 32);
    let mut constants = vec![("rows_per_invocation", f64::from(rows))];
    constants.extend(seen.constants());
    let pipeline = frame.gpu.clone().pipeline(shader, entry_point, &constants);
    let mut bindings = vec![
        (20, buffer(&receivers)),
        (21, buffer(seen.visibility_buffer)),
        (10, table(&seen.scene.unit_normals)),
        (0, buffer(&projected)),
        (1, buffer(&uniform)),
        (2, buffer(&map)),
    ];
    if factors.is_none() {
        bindings.extend(warp.map(WarpMap::bindings).unwrap_or_default());
    }
    frame.pass(
        LABEL,
        &[Dispatch {
            pipeline: &pipeline,
            bindings,
            groups: Groups::Grid(
                seen.camera.width.div_ceil(64),
                seen.camera.height.div_ceil(rows),
            ),
        }],
    );
    Ok(ImportanceMap {
        buffer: map,
        functions,
        cells,
        is_count: factors.is_none(),
    })
}
