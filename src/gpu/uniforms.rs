//! The uniforms of a frame: one after the other in a buffer, which is written once before each submission.

use super::bind_groups::Bound;
use super::device::Gpu;
use super::pool::PooledBuffer;
use wgpu::BufferUsages;

/// Bytes of a buffer of uniforms: those of most frames fit into one.
const BLOCK: usize = 1 << 16;

/// What every device can have the start of a uniform at (WebGPU, `minUniformBufferOffsetAlignment`).
const ALIGNMENT: usize = 256;

/// Uniforms that a submission reads. None of their buffers goes back to the pool before this is dropped, and
/// that is to be after the submission.
#[derive(Default)]
pub struct Uniforms {
    /// Of these the last one is being filled.
    blocks: Vec<PooledBuffer>,
    /// What it is to hold.
    bytes: Vec<u8>,
    /// How many of these bytes are on their way.
    sent: usize,
}

impl Uniforms {
    /// Finds a place for a value.
    pub fn place(&mut self, gpu: &Gpu, value: &[u8]) -> Bound {
        assert!(value.len() <= BLOCK, "{} bytes of a uniform", value.len());
        let start = self.bytes.len().next_multiple_of(ALIGNMENT);
        let start = match self.blocks.is_empty() || start + value.len() > BLOCK {
            true => {
                self.send(gpu);
                let usage = BufferUsages::UNIFORM | BufferUsages::COPY_DST;
                let block = gpu.pool.scratch("uniforms", BLOCK as u64, usage);
                self.blocks.push(block.expect("every device has so much"));
                (self.bytes, self.sent) = (Vec::with_capacity(BLOCK), 0);
                0
            }
            false => start,
        };
        self.bytes.resize(start, 0);
        self.bytes.extend_from_slice(value);
        let block = self.blocks.last().expect("just made");
        Bound::Part {
            buffer: (**block).clone(),
            start: start as u64,
            size: wgpu::BufferSize::new(value.len() as u64).expect("a value has bytes"),
        }
    }

    /// Has them written before whatever is submitted from now on.
    pub fn send(&mut self, gpu: &Gpu) {
        if let Some(block) = self.blocks.last().filter(|_| self.sent < self.bytes.len()) {
            // Values have whole words, and so has the space between them.
            let bytes = &self.bytes[self.sent..];
            gpu.queue.write_buffer(block, self.sent as u64, bytes);
            self.sent = self.bytes.len();
        }
    }
}
