//! Pass "outline": points of the receivers across the light, for fits that turn the map.

use super::inputs::Receivers;
use crate::error::Result;
use crate::fits::receivers::OutlinePoints;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::recording::{Read, Recording, Source};
use crate::gpu::shader_struct::shader_struct;
use crate::projection::Projection;
use glam::DVec2;

pub const LABEL: &str = "outline";

/// Columns of a workgroup of `extremes`, and the points it finds.
const GROUP: u32 = 64;
const POINTS: u32 = 8;

/// At most this many columns and rows of `samples`.
const MAX_SAMPLES: u32 = 128;

shader_struct! {
    pub struct OutlineUniform is Outline in "outline" {
        columns: u32,
        step: u32,
    }
}

/// Of points that the pass found, those that are there.
pub fn found(points: Vec<[f32; 2]>) -> Vec<DVec2> {
    let points = points.into_iter().filter(|point| point[0] < NOWHERE);
    points
        .map(|point| DVec2::from(point.map(f64::from)))
        .collect()
}

/// As in the shader.
const NOWHERE: f32 = 3.0e38;

/// Points in centred texels of `projection`; its size and centre play no part.
pub fn outline(
    frame: &mut Recording,
    seen: Receivers,
    projection: &Projection,
    points: OutlinePoints,
) -> Result<Read<[f32; 2]>> {
    let (width, height) = (seen.camera.width, seen.camera.height);
    // Rows that an invocation reduces before its workgroup does.
    let rows_per_invocation = frame.gpu.work_per_invocation(8, 16);
    let step = width.max(height).div_ceil(MAX_SAMPLES);
    let rays = seen.uniform(projection);
    let kernel = Kernel::new("outline")
        .projection(2, projection, seen.scene.origin)
        .receivers(seen, &rays);
    let (kernel, [columns, rows], count) = match points {
        OutlinePoints::Extremes => {
            let groups = [width.div_ceil(GROUP), height.div_ceil(rows_per_invocation)];
            let kernel = kernel.constant("rows_per_invocation", rows_per_invocation);
            (
                kernel.entry("extremes"),
                groups,
                groups[0] * groups[1] * POINTS,
            )
        }
        OutlinePoints::Samples => {
            let [columns, rows] = [width, height].map(|side| side.div_ceil(step));
            let kernel = kernel.uniform(0, &OutlineUniform { columns, step });
            (
                kernel.entry("samples"),
                [columns.div_ceil(64), rows],
                columns * rows,
            )
        }
    };
    let found = frame.storage(LABEL, 8 * u64::from(count))?;
    let dispatch = kernel.bind(1, &found).dispatch(Groups::Grid(columns, rows));
    frame.pass(LABEL, &[dispatch]);
    frame.read(Source::Taken(found), count as usize)
}
