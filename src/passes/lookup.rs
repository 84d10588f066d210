//! Pass "lookup": the shadow test of every pixel.

use super::{Inputs, ReceiversUniform};
use crate::error::Result;
use crate::gpu::frame::{Dispatch, Frame, Groups, buffer, table};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::shaders::Shader;
use crate::projection::{Kind, Projection};
use glam::DVec3;

pub const LABEL: &str = "lookup";

/// What is taken off a receiver's depth before it is compared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DepthBias {
    /// World units.
    pub constant: f64,
    /// Texels: times the width of a texel and the slope of the receiver against the light.
    pub slope: f64,
    /// Whether the receiver's plane is evaluated on the texel's own ray.
    pub receiver_plane: bool,
    /// Bound of the rounding error of a position in light space, world units.
    pub rounding: f64,
}

/// Visibility per pixel, float32: 1 lit, 0 in shadow, NaN where no surface is seen.
pub fn lookup(
    frame: &mut Frame,
    inputs: Inputs,
    visibility_buffer: &wgpu::Buffer,
    light_direction: DVec3,
    projection: &Projection,
    shadow_map: &wgpu::Buffer,
    bias: DepthBias,
) -> Result<PooledBuffer> {
    let shader = Shader {
        file: "lookup",
        slots: match projection.kind {
            Kind::Parallel => &[("projection", "projection/parallel")],
            Kind::Perspective => &[("projection", "projection/perspective")],
        },
    };
    let mut uniform = ReceiversUniform::new(inputs.camera, light_direction, projection);
    uniform.constant_bias = bias.constant as f32;
    uniform.slope_bias = bias.slope as f32;
    uniform.receiver_plane = f32::from(u8::from(bias.receiver_plane));
    uniform.rounding = bias.rounding as f32;
    let uniform = frame.uniform("receivers", &uniform);
    let projection = frame.uniform("projection", &projection.uniform(inputs.scene.origin));
    let pixels = inputs.camera.pixel_count() as u64;
    let visibility = frame.storage("visibility image", 4 * pixels)?;
    let rows = frame.gpu.work_per_invocation(1, 32);
    let constants = [("rows_per_invocation", f64::from(rows))];
    let pipeline = frame.gpu.clone().pipeline(shader, "main", &constants);
    frame.pass(
        LABEL,
        &[Dispatch {
            pipeline: &pipeline,
            bindings: &[
                (0, buffer(&uniform)),
                (1, buffer(visibility_buffer)),
                (2, table(&inputs.scene.unit_normals)),
                (3, buffer(&projection)),
                (4, buffer(shadow_map)),
                (5, buffer(&visibility)),
            ],
            groups: Groups::Grid(
                inputs.camera.width.div_ceil(64),
                inputs.camera.height.div_ceil(rows),
            ),
        }],
    );
    Ok(visibility)
}

/// The visibility image where no receiver faces the light: no map is asked.
pub fn all_in_shadow(
    frame: &mut Frame,
    inputs: Inputs,
    visibility_buffer: &wgpu::Buffer,
    light_direction: DVec3,
) -> Result<PooledBuffer> {
    let projection = Projection::from_camera(inputs.camera);
    let empty = frame.storage("empty shadow map", 4)?;
    frame.clear(&empty);
    let bias = DepthBias {
        constant: 0.0,
        slope: 0.0,
        receiver_plane: false,
        rounding: 0.0,
    };
    lookup(
        frame,
        inputs,
        visibility_buffer,
        light_direction,
        &projection,
        &empty,
        bias,
    )
}
