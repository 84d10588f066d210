//! Pass "shadow edge": depth discontinuities of a light's depth image.

use crate::error::Result;
use crate::gpu::frame::{Dispatch, Frame, Groups, buffer};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::shaders::Shader;
use crate::passes::Inputs;
use crate::projection::Projection;
use bytemuck::{Pod, Zeroable};

pub const LABEL: &str = "shadow edge";

/// As `ShadowEdge` in the shader.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
struct ShadowEdgeUniform {
    bias: f32,
    floor: f32,
}

/// The factor of each texel of an image of depths and triangles: 1 where its depth differs from a
/// neighbour's by more than `bias` world units (times the growth of a beam, where beams widen), else
/// `floor`.
pub fn shadow_edge(
    frame: &mut Frame,
    inputs: Inputs,
    projection: &Projection,
    texels: &wgpu::Buffer,
    bias: f64,
    floor: f64,
) -> Result<PooledBuffer> {
    let edges = frame.storage(LABEL, 4 * projection.texel_count() as u64)?;
    let unit = if projection.beams_widen() {
        1.0
    } else {
        projection.unit()
    };
    let uniform = ShadowEdgeUniform {
        bias: (bias * unit) as f32,
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
