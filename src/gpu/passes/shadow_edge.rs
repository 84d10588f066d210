//! Pass "shadow edge": depth discontinuities of a light's depth image.

use super::rasterize::Target;
use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::scene_tables::SceneTables;
use crate::gpu::shader_struct::shader_struct;
use crate::importance::{EdgeBias, Grid};
use crate::projection::Projection;

pub const LABEL: &str = "shadow edge";

shader_struct! {
    pub struct ShadowEdgeUniform is ShadowEdge in "shadow_edge" {
        constant_bias: f32,
        beam_bias: f32,
        floor: f32,
    }
}

/// The factor of each texel of an image of depths and triangles: 1 where its depth differs from a
/// neighbour's by more than the bias, else `floor`.
pub fn shadow_edge(
    frame: &mut Recording,
    scene: &SceneTables,
    projection: &Projection,
    texels: &wgpu::Buffer,
    bias: EdgeBias,
    floor: f64,
) -> Result<Grid<PooledBuffer>> {
    let edges = frame.storage(LABEL, 4 * projection.texel_count() as u64)?;
    let [constant, beam] = bias.depths(projection, projection.unit());
    let uniform = ShadowEdgeUniform {
        constant_bias: constant as f32,
        beam_bias: beam as f32,
        floor: floor as f32,
    };
    let kernel = Kernel::new("shadow_edge")
        .projection(0, projection, scene.origin)
        .uniform(1, &uniform)
        .bind(2, &edges)
        .stored(Target::DepthTriangle)
        .bind(5, texels);
    let groups = Groups::Grid(projection.width.div_ceil(64), projection.height);
    frame.pass(LABEL, &[kernel.dispatch(groups)]);
    Ok(Grid {
        values: edges,
        columns: projection.width,
        rows: projection.height,
    })
}
