//! Scratch memory that is kept from frame to frame: fresh pages cost more than the work done in them.

use crate::error::{Error, Result};
use crate::lock::lock;
#[cfg(test)]
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};
use wgpu::BufferUsages;

/// The scratch memory of one device.
pub struct Pool {
    device: wgpu::Device,
    device_name: String,
    /// The largest number of bytes that one storage buffer may hold for a shader.
    pub largest_storage: u64,
    largest_buffer: u64,
    state: Mutex<State>,
    /// Buffers that were not there yet, and bind groups.
    #[cfg(test)]
    made: AtomicUsize,
}

/// Buffers that no frame is using.
#[derive(Default)]
struct State {
    free: Vec<wgpu::Buffer>,
    /// How often everything was forgotten; a buffer from before does not come back.
    epoch: u64,
}

/// At most this many free buffers are kept; the ones freed longest ago go first.
const CAPACITY: usize = 64;

/// The epoch of no pool.
const NEVER: u64 = u64::MAX;

/// A buffer that goes back to the pool when it is dropped.
pub struct PooledBuffer {
    pool: Arc<Pool>,
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
        let mut pool = lock(&self.pool.state);
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

impl Pool {
    pub(super) fn new(device: &wgpu::Device, limits: &wgpu::Limits, device_name: &str) -> Self {
        Self {
            device: device.clone(),
            device_name: device_name.to_string(),
            largest_storage: limits
                .max_storage_buffer_binding_size
                .min(limits.max_buffer_size),
            largest_buffer: limits.max_buffer_size,
            state: Mutex::default(),
            #[cfg(test)]
            made: AtomicUsize::new(0),
        }
    }

    /// A scratch buffer of exactly `size` bytes, its content undefined.
    pub fn scratch(
        self: &Arc<Self>,
        what: &str,
        size: u64,
        usage: BufferUsages,
    ) -> Result<PooledBuffer> {
        self.check_size(what, size, usage)?;
        let mut state = lock(&self.state);
        let free = state.free.iter().enumerate();
        let fitting = free.filter(|(_, free)| free.size() == size && free.usage() == usage);
        // The first of all that are there, so that the next frame of the kind takes each buffer at the same
        // place, and its bind groups are the same.
        let first = fitting.min_by(|(_, a), (_, b)| a.cmp(b));
        let buffer = match first.map(|(index, _)| index) {
            Some(index) => state.free.remove(index),
            None => {
                #[cfg(test)]
                self.count_made();
                self.device.create_buffer(&wgpu::BufferDescriptor {
                    label: Some(what),
                    size,
                    usage,
                    mapped_at_creation: false,
                })
            }
        };
        Ok(PooledBuffer {
            pool: self.clone(),
            buffer: Some(buffer),
            epoch: state.epoch,
        })
    }

    /// A buffer of someone's own, which does not come back.
    pub fn lent(self: &Arc<Self>, buffer: wgpu::Buffer) -> PooledBuffer {
        PooledBuffer {
            pool: self.clone(),
            buffer: Some(buffer),
            epoch: NEVER,
        }
    }

    /// Frees the buffers that no frame is using.
    pub fn clear(&self) {
        lock(&self.state).free.clear();
    }

    /// Frees them, and those in use as soon as they are not: any may be one that the device had no memory for.
    pub(super) fn forget(&self) {
        let mut state = lock(&self.state);
        state.free.clear();
        state.epoch += 1;
    }

    #[cfg(test)]
    pub fn count_made(&self) {
        self.made.fetch_add(1, Ordering::Relaxed);
    }

    /// How many buffers and bind groups were made so far.
    #[cfg(test)]
    pub fn made(&self) -> usize {
        self.made.load(Ordering::Relaxed)
    }

    /// Bytes in buffers that no frame is using.
    #[cfg(test)]
    pub fn free_bytes(&self) -> u64 {
        lock(&self.state).free.iter().map(wgpu::Buffer::size).sum()
    }

    /// Refuses what the device cannot hold before it is asked to.
    pub fn check_size(&self, what: &str, size: u64, usage: BufferUsages) -> Result<()> {
        let most = if usage.contains(BufferUsages::STORAGE) {
            self.largest_storage
        } else {
            self.largest_buffer
        };
        if size > most {
            return Err(Error::Device(format!(
                "the {what} needs {size} bytes in one buffer, the device {} allows {most}",
                self.device_name
            )));
        }
        Ok(())
    }
}
