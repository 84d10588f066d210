//! Pass "packed image": the visibility image a byte a pixel, so that a quarter of it is read back.

use crate::error::Result;
use crate::gpu::kernel::{Groups, Kernel};
use crate::gpu::pool::PooledBuffer;
use crate::gpu::recording::{Read, ReadResults, Recording, Source};
use crate::instructions::level;
use fearless_simd::dispatch;
use rayon::prelude::*;

pub const LABEL: &str = "packed image";

/// Pixels of a word.
const PER_WORD: usize = 4;

/// Pixels that are unpacked at once.
const BLOCK: usize = 256;

/// Below so many, another thread takes longer to wake.
const BLOCKS_OF_THREAD: usize = 1024;

/// Bits of the NaN that the shaders write.
const NO_SURFACE: u32 = 0x7fc0_0000;

/// A visibility image that the next submission brings.
pub enum ImageRead {
    Whole(Read<f32>),
    /// Words, and how many pixels there are.
    Packed(Read<u32>, usize),
}

impl ImageRead {
    /// Of so many pixels, none of which is lit in part unless the image is filtered.
    pub fn new(
        frame: &mut Recording,
        visibility: PooledBuffer,
        pixels: usize,
        is_filtered: bool,
    ) -> Result<Self> {
        if is_filtered {
            let read = frame.read(Source::Taken(visibility), pixels)?;
            return Ok(Self::Whole(read));
        }
        let words = pixels.div_ceil(PER_WORD);
        let packed = frame.storage(LABEL, (PER_WORD * words) as u64)?;
        let kernel = Kernel::new("packed_image")
            .bind(0, &visibility)
            .bind(1, &packed);
        let groups = Groups::Linear((words as u64).div_ceil(64));
        frame.pass(LABEL, &[kernel.dispatch(groups)]);
        let read = frame.read(Source::Taken(packed), words)?;
        Ok(Self::Packed(read, pixels))
    }

    /// 1 lit, 0 in shadow, NaN where no surface is seen.
    pub fn take(&self, results: &ReadResults) -> Result<Vec<f32>> {
        match self {
            Self::Whole(read) => results.take(read),
            Self::Packed(read, pixels) => results.with(read, |words| unpacked(words, *pixels)),
        }
    }
}

/// On several threads: four times as many bytes are written as were read.
fn unpacked(words: &[u32], pixels: usize) -> Vec<f32> {
    let bytes: &[u8] = bytemuck::cast_slice(words);
    let blocks = bytes.par_chunks(BLOCK).with_min_len(BLOCKS_OF_THREAD);
    let floats = blocks.map(|bytes| dispatch!(level(), _simd => floats_of(bytes)));
    let mut image = floats.collect::<Vec<_>>().into_flattened();
    image.truncate(pixels);
    image
}

/// Without branches, so that the compiler finds the lanes.
#[inline(always)]
fn floats_of(bytes: &[u8]) -> [f32; BLOCK] {
    let mask = |is: bool| u32::from(is).wrapping_neg();
    let mut floats = [0.0; BLOCK];
    for (float, &byte) in floats.iter_mut().zip(bytes) {
        *float = f32::from_bits(mask(byte == 1) & 1.0_f32.to_bits() | mask(byte == 2) & NO_SURFACE);
    }
    floats
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu;

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn an_image_comes_back_as_it_was() {
        let gpu = gpu::gpu("").unwrap();
        let mut frame = Recording::together(&gpu, 1, true).remove(0);
        let half = 0.5_f32.to_bits();
        // Whole words and others, and more than a row of workgroups has place for.
        for pixels in [1, 2, 3, 4, 5, 255, 256, 257, 4 * 64 * 32_768 + 7] {
            for is_filtered in [false, true] {
                let of_pixel = |pixel| match (pixel * pixel / 7) % 4 {
                    0 => 0,
                    1 => NO_SURFACE,
                    2 if is_filtered => half,
                    _ => 1.0_f32.to_bits(),
                };
                let image: Vec<u32> = (0..pixels).map(of_pixel).collect();
                let visibility = frame.storage("image", 4 * pixels as u64).unwrap();
                gpu.queue
                    .write_buffer(&visibility, 0, bytemuck::cast_slice(&image));
                let read = ImageRead::new(&mut frame, visibility, pixels, is_filtered).unwrap();
                let found = read.take(&frame.submit().unwrap()).unwrap();
                let found = found.into_iter().map(f32::to_bits);
                assert!(found.eq(image), "{pixels} pixels, {is_filtered}");
            }
        }
    }
}
