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
        .uniform(0, &uniform)
        .bind(1, visibility_buffer)
        .bind(2, &samples);
    let groups = Groups::Grid(coarse.width.div_ceil(64), coarse.height);
    frame.pass(LABEL, &[kernel.dispatch(groups)]);
    Ok((coarse, samples))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::adapters::adapter;
    use crate::gpu::device::Gpu;
    use crate::gpu::recording::Source;
    use std::sync::Arc;

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn each_of_many_uniforms_is_read_where_it_is() {
        let gpu = Arc::new(Gpu::new(&adapter("").unwrap()).unwrap());
        let mut frame = Recording::together(&gpu, 1, true).remove(0);
        let numbers: Vec<u64> = (0..600).map(|i| 7 * i).collect();
        let table = frame.constants("numbers", &numbers).unwrap();
        // The second time with places that were used before.
        for _ in 0..2 {
            let mut reads = Vec::new();
            for (i, first) in (0..600).rev().enumerate() {
                let found = frame.storage("found", 8).unwrap();
                let uniform = SamplingUniform {
                    size: [1; 2],
                    width: 0,
                    stride: 1,
                    first,
                    padding: 0,
                };
                let kernel = Kernel::new("samples").uniform(0, &uniform);
                let kernel = kernel.bind(1, &table).bind(2, &found);
                frame.pass("samples", &[kernel.dispatch(Groups::ONE)]);
                reads.push(frame.read::<u64>(Source::Taken(found), 1).unwrap());
                // Some are on their way while others find their place.
                if i % 100 == 50 {
                    frame.send();
                }
            }
            let results = frame.submit().unwrap();
            let found = reads.iter().map(|read| results.take(read).unwrap()[0]);
            let expected: Vec<u64> = numbers.iter().rev().copied().collect();
            assert_eq!(found.collect::<Vec<_>>(), expected);
        }
    }
}
