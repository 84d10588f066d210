//! Pass "samples": a coarse image of what the camera sees, for the CPU to look at.

use crate::camera::Camera;
use crate::error::Result;
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
        first: first(camera, stride),
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

/// The first of the samples lies in the middle of its block, or in a smaller image.
fn first(camera: &Camera, stride: u32) -> u32 {
    (stride / 2).min(camera.width.min(camera.height) - 1)
}

/// The camera whose pixels' centres are those of every `stride`-th pixel.
fn coarse_camera(camera: &Camera, stride: u32) -> Camera {
    let first = first(camera, stride);
    let scale = f64::from(stride);
    Camera {
        focal: camera.focal / scale,
        centre: (camera.centre - f64::from(first) - 0.5) / scale + 0.5,
        width: (camera.width - first).div_ceil(stride),
        height: (camera.height - first).div_ceil(stride),
        ..camera.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat4, DVec2};

    #[test]
    fn coarse_pixels_have_the_rays_of_fine_ones() {
        for (width, height) in [(7, 5), (1, 1), (64, 3), (1920, 1080)] {
            let focal = DVec2::new(900.0, 880.0);
            let centre = DVec2::new(3.1, 2.7);
            let camera =
                Camera::new(DMat4::IDENTITY, focal, centre, (width, height), (0.1, 9.0)).unwrap();
            for stride in [1, 2, 3, 11] {
                let coarse = coarse_camera(&camera, stride);
                let first = first(&camera, stride);
                for (column, row) in [(0, 0), (coarse.width - 1, coarse.height - 1)] {
                    let (x, y) = (column * stride + first, row * stride + first);
                    assert!(x < width && y < height);
                    let fine = camera.ray_from_pixel(x, y);
                    assert!((coarse.ray_from_pixel(column, row) - fine).length() < 1e-12);
                }
            }
        }
    }
}
