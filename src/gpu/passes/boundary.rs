//! Pass "boundary": weights of the receivers near the boundaries of shadows, from a visibility image.

use super::inputs::Receivers;
use crate::error::Result;
use crate::gpu::frame::{Dispatch, Frame, Groups, buffer};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::shaders::Shader;

pub const LABEL: &str = "boundary";

const SHADER: Shader = Shader::new("boundary");

/// Pixels along each side of a tile, as in the shader.
const TILE: u32 = 4;

/// Weights by tiles of the image.
pub struct BoundaryWeights {
    pub weights: PooledBuffer,
    pub columns: u32,
}

/// `weight` where a boundary is near, 1 elsewhere.
pub fn boundary(
    frame: &mut Frame,
    seen: Receivers,
    visibility: &wgpu::Buffer,
    weight: f64,
) -> Result<BoundaryWeights> {
    let columns = seen.camera.width.div_ceil(TILE);
    let rows = seen.camera.height.div_ceil(TILE);
    let size = 4 * u64::from(columns) * u64::from(rows);
    let marks = frame.storage(LABEL, size)?;
    let weights = frame.storage("boundary weights", size)?;
    // Which receivers face the light does not depend on a projection.
    let receivers = seen.camera_uniform();
    let receivers = frame.uniform("receivers", &receivers);
    let gpu = frame.gpu.clone();
    let mark = gpu.pipeline(SHADER, "mark", &seen.constants());
    let weigh = gpu.pipeline(SHADER, "weigh", &[("boundary_weight", weight)]);
    let groups = || Groups::Grid(columns.div_ceil(64), rows);
    frame.pass(
        LABEL,
        &[
            Dispatch {
                pipeline: &mark,
                bindings: [
                    &seen.bindings(&receivers)[..],
                    &[(0, buffer(visibility)), (1, buffer(&marks))],
                ]
                .concat(),
                groups: groups(),
            },
            Dispatch {
                pipeline: &weigh,
                bindings: vec![
                    (20, buffer(&receivers)),
                    (1, buffer(&marks)),
                    (2, buffer(&weights)),
                ],
                groups: groups(),
            },
        ],
    );
    Ok(BoundaryWeights { weights, columns })
}
