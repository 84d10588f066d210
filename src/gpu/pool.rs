//! Scratch memory that is kept from frame to frame: fresh pages cost more than the work done in them.

use super::{Gpu, lock};
use crate::error::{Error, Result};
use std::sync::Arc;
use wgpu::BufferUsages;

/// Buffers that no frame is using.
#[derive(Default)]
pub(super) struct Pool {
    free: Vec<wgpu::Buffer>,
    /// How often everything was forgotten; a buffer from before does not come back.
    epoch: u64,
}

/// At most this many free buffers are kept; the ones freed longest ago go first.
const CAPACITY: usize = 64;

/// A buffer that goes back to the pool when it is dropped.
pub struct PooledBuffer {
    gpu: Arc<Gpu>,
    buffer: Option<wgpu::Buffer>,
    epoch: u64,
}

impl std::ops::Deref for PooledBuffer {
    type Target = wgpu::Buffer;

    fn deref(&self) -> &wgpu::Buffer {
        self.buffer.as_ref().expect("taken only when dropped")
    }
}

impl Drop for PooledBuffer {
    fn drop(&mut self) {
        let mut pool = lock(&self.gpu.pool);
        if pool.epoch != self.epoch {
            return;
        }
        pool.free.extend(self.buffer.take());
        if pool.free.len() > CAPACITY {
            pool.free.remove(0);
        }
    }
}

impl PooledBuffer {
    /// Frees the buffer for good: after a failed submission it may be mapped still.
    pub fn discard(mut self) {
        if let Some(buffer) = self.buffer.take() {
            buffer.destroy();
        }
    }
}

/// A scratch buffer of exactly `size` bytes, its content undefined.
pub fn scratch(gpu: &Arc<Gpu>, what: &str, size: u64, usage: BufferUsages) -> Result<PooledBuffer> {
    check_size(gpu, what, size, usage)?;
    let mut pool = lock(&gpu.pool);
    let found = pool
        .free
        .iter()
        .rposition(|buffer| buffer.size() == size && buffer.usage() == usage);
    let buffer = match found {
        Some(index) => pool.free.remove(index),
        None => gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some(what),
            size,
            usage,
            mapped_at_creation: false,
        }),
    };
    Ok(PooledBuffer {
        gpu: gpu.clone(),
        buffer: Some(buffer),
        epoch: pool.epoch,
    })
}

/// Frees the buffers that no frame is using.
pub fn clear(gpu: &Gpu) {
    lock(&gpu.pool).free.clear();
}

/// Frees them, and those in use as soon as they are not: any may be one that the device had no memory for.
pub(super) fn forget(gpu: &Gpu) {
    let mut pool = lock(&gpu.pool);
    pool.free.clear();
    pool.epoch += 1;
}

/// Bytes in buffers that no frame is using.
#[cfg(test)]
pub fn free_bytes(gpu: &Gpu) -> u64 {
    lock(&gpu.pool).free.iter().map(wgpu::Buffer::size).sum()
}

/// Refuses what the device cannot hold before it is asked to.
pub fn check_size(gpu: &Gpu, what: &str, size: u64, usage: BufferUsages) -> Result<()> {
    let most = if usage.contains(BufferUsages::STORAGE) {
        gpu.largest_storage()
    } else {
        gpu.limits.max_buffer_size
    };
    if size > most {
        return Err(Error::Device(format!(
            "the {what} needs {size} bytes in one buffer, the device {} allows {most}",
            gpu.adapter.name
        )));
    }
    Ok(())
}
