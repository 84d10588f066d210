//! Pass "samples": a coarse image of what the camera sees, for the CPU to look at.

use crate::camera::Camera;
use crate::error::Result;
use crate::fits::samples::{coarse_camera, first_sample};
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::Recording;
use crate::gpu::shader_struct::shader_struct;

pub const LABEL: &str = "samples";

shader_struct! {
    pub struct SamplingUniform is Sampling in "samples" {
        size: [u32; 2],
        width: u32,
        stride: u32,
        first: u32,
        padding: u32,
    }
}

/// Every `stride`-th pixel of the camera's visibility buffer, and the camera that has these pixels.
pub fn samples(
    frame: &mut Recording,
    camera: &Camera,
    visibility_buffer: &wgpu::Buffer,
    stride: u32,
) -> Result<(Camera, PooledBuffer)> {
    let coarse = coarse_camera(camera, stride);
    let uniform = SamplingUniform {
        size: [coarse.width, coarse.height],
        width: camera.width,
        stride,
        first: first_sample(camera, stride),
        padding: 0,
    };
    let samples = frame.storage(LABEL, 8 * coarse.pixel_count() as u64)?;
    let kernel = Kernel::new("samples")
        .uniform(&frame.gpu, 0, &uniform)
        .bind(1, visibility_buffer)
        .bind(2, &samples);
    let groups = Groups::Grid(coarse.width.div_ceil(64), coarse.height);
    frame.pass(LABEL, &[kernel.dispatch(groups)]);
    Ok((coarse, samples))
}
