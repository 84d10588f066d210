//! Pass "outline": points of the receivers across the light, for fits that turn the map.

use super::inputs::Receivers;
use crate::error::Result;
use crate::fits::receivers::OutlinePoints;
use crate::gpu::frame::{Dispatch, Frame, Groups, Read, Source, buffer};
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::shaders::Shader;
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
    frame: &mut Frame,
    seen: Receivers,
    projection: &Projection,
    points: OutlinePoints,
) -> Result<Read<[f32; 2]>> {
    let (width, height) = (seen.camera.width, seen.camera.height);
    // Rows that an invocation reduces before its workgroup does.
    let rows_per_invocation = frame.gpu.work_per_invocation(8, 16);
    let step = width.max(height).div_ceil(MAX_SAMPLES);
    let (entry_point, columns, rows) = match points {
        OutlinePoints::Extremes => (
            "extremes",
            width.div_ceil(GROUP),
            height.div_ceil(rows_per_invocation),
        ),
        OutlinePoints::Samples => ("samples", width.div_ceil(step), height.div_ceil(step)),
    };
    let (count, groups, mut constants) = match points {
        OutlinePoints::Extremes => (
            columns * rows * POINTS,
            columns,
            vec![("rows_per_invocation", f64::from(rows_per_invocation))],
        ),
        OutlinePoints::Samples => (columns * rows, columns.div_ceil(64), vec![]),
    };
    let found = frame.storage(LABEL, 8 * u64::from(count))?;
    let uniform = OutlineUniform { columns, step };
    let uniform = frame.uniform(LABEL, &uniform);
    let receivers = seen.uniform(projection);
    let receivers = frame.uniform("receivers", &receivers);
    let projected = frame.uniform("projection", &projection.uniform(seen.scene.origin));
    constants.extend(seen.constants());
    let shader = Shader {
        projection: projection.shader(),
        ..Shader::new("outline")
    };
    let pipeline = frame.gpu.clone().pipeline(shader, entry_point, &constants);
    let mut bindings = seen.bindings(&receivers).to_vec();
    bindings.extend([(1, buffer(&found)), (2, buffer(&projected))]);
    if points == OutlinePoints::Samples {
        bindings.push((0, buffer(&uniform)));
    }
    frame.pass(
        LABEL,
        &[Dispatch {
            pipeline: &pipeline,
            bindings,
            groups: Groups::Grid(groups, rows),
        }],
    );
    frame.read(Source::Taken(found), count as usize)
}
