//! Pass "shadow edge": depth discontinuities of a light's depth image.

use super::inputs::Inputs;
use crate::error::Result;
use crate::gpu::frame::{Dispatch, Frame, Groups, buffer};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::shader_struct::shader_struct;
use crate::gpu::shaders::Shader;
use crate::projection::Projection;

pub const LABEL: &str = "shadow edge";

shader_struct! {
    pub struct ShadowEdgeUniform is ShadowEdge in "shadow_edge" {
        constant_bias: f32,
        beam_bias: f32,
        floor: f32,
    }
}

/// By how much the depths of neighbours differ at an edge.
#[derive(Debug, Clone, Copy)]
pub enum EdgeBias {
    /// World units.
    Constant(f64),
    /// Widths of a texel.
    Texels(f64),
}

/// The factor of each texel of an image of depths and triangles: 1 where its depth differs from a
/// neighbour's by more than the bias, else `floor`.
pub fn shadow_edge(
    frame: &mut Frame,
    inputs: Inputs,
    projection: &Projection,
    texels: &wgpu::Buffer,
    bias: EdgeBias,
    floor: f64,
) -> Result<PooledBuffer> {
    let edges = frame.storage(LABEL, 4 * projection.texel_count() as u64)?;
    let (constant, beam) = match bias {
        EdgeBias::Constant(length) => (length * projection.unit(), 0.0),
        EdgeBias::Texels(count) => (0.0, count * projection.kind.beam_width(projection)),
    };
    let uniform = ShadowEdgeUniform {
        constant_bias: constant as f32,
        beam_bias: beam as f32,
        floor: floor as f32,
    };
    let uniform = frame.uniform(LABEL, &uniform);
    let projected = frame.uniform("projection", &projection.uniform(inputs.scene.origin));
    let shader = Shader {
        projection: projection.shader(),
        stored: "stored/depth_triangle",
        ..Shader::new("shadow_edge")
    };
    let pipeline = frame.gpu.clone().pipeline(shader, "main", &[]);
    frame.pass(
        LABEL,
        &[Dispatch {
            pipeline: &pipeline,
            bindings: vec![
                (0, buffer(&projected)),
                (1, buffer(&uniform)),
                (2, buffer(&edges)),
                (5, buffer(texels)),
            ],
            groups: Groups::Grid(projection.width.div_ceil(64), projection.height),
        }],
    );
    Ok(edges)
}
