//! The recording of a frame: passes in order, each with a label that is also its timer's key.

use super::bind_groups::BindGroups;
use super::device::{Gpu, UNUSED_IMAGE};
use super::gathering::Member;
use super::kernel::{Dispatch, Draw, Groups, Kernel, Vertices, rows_of_groups};
use super::pool::PooledBuffer;
use super::uniforms::Uniforms;
use crate::error::{Error, Result};
use crate::stats::{Facts, FactsOfPasses};
use bytemuck::Pod;
use std::marker::PhantomData;
use std::sync::Arc;
use std::time::Instant;
use wgpu::BufferUsages;
use wgpu::util::DeviceExt;

/// GPU time of a pass in milliseconds, in the order of execution.
pub type Timings = Vec<(&'static str, f64)>;

/// At most this many passes in one submission: a query set holds no more than twice as many queries.
const MAX_PASSES: u32 = 2048;

/// Records passes and submits them; a frame may be submitted several times where the CPU needs an
/// answer in between.
pub struct Recording {
    pub gpu: Arc<Gpu>,
    /// Whether what cannot change a picture is left out; `false` is for the proof that it cannot.
    pub culls: bool,
    member: Member,
    /// Of the next submission, once there is something to record.
    encoder: Option<wgpu::CommandEncoder>,
    bind_groups: BindGroups,
    /// Of the next submission.
    uniforms: Uniforms,
    queries: Option<wgpu::QuerySet>,
    labels: Vec<&'static str>,
    timings: Timings,
    reads: Vec<PooledBuffer>,
    /// What the next submission counts.
    pending: Vec<Pending>,
    /// What passes counted so far.
    pub facts: FactsOfPasses,
    /// Whether every list of work was long enough; else there is room for the next try.
    pub had_room: bool,
}

/// A buffer to be read after the submission.
pub struct Read<T> {
    index: usize,
    count: usize,
    element: PhantomData<T>,
}

/// What was read after a submission.
pub struct ReadResults(Vec<PooledBuffer>);

/// Reads what a pass counted in each of its parts; fails where that tells that the pass did not do all its work.
type Describe = Box<dyn Fn(&Gpu, &[Vec<u32>]) -> Result<Counted> + Send>;

/// What a pass tells of itself.
pub struct Counted {
    pub facts: Facts,
    /// Whether every list was long enough; else there is room for the next try.
    pub had_room: bool,
}

/// Counters of a pass that the next submission brings.
struct Pending {
    label: &'static str,
    parts: Vec<Read<u32>>,
    describe: Describe,
}

impl Recording {
    /// Frames to be recorded side by side, each on its thread: none is submitted before the others are, or
    /// are dropped.
    pub fn together(gpu: &Arc<Gpu>, count: usize, culls: bool) -> Vec<Self> {
        let members = Member::gather(gpu, count).into_iter();
        members
            .map(|member| Self::new(gpu, member, culls))
            .collect()
    }

    pub(super) fn new(gpu: &Arc<Gpu>, member: Member, culls: bool) -> Self {
        let queries = gpu.take_query_set(2 * MAX_PASSES);
        Self {
            gpu: gpu.clone(),
            culls,
            member,
            encoder: None,
            bind_groups: gpu.take_bind_groups(),
            uniforms: Uniforms::default(),
            queries,
            labels: Vec::new(),
            timings: Vec::new(),
            reads: Vec::new(),
            pending: Vec::new(),
            facts: FactsOfPasses::default(),
            had_room: true,
        }
    }

    /// A storage buffer for one frame, its content undefined.
    pub fn storage(&self, what: &str, size: u64) -> Result<PooledBuffer> {
        let mut usage = BufferUsages::STORAGE
            | BufferUsages::COPY_SRC
            | BufferUsages::COPY_DST
            | BufferUsages::INDIRECT;
        if self.reads_in_place() {
            usage |= BufferUsages::MAP_READ;
        }
        let buffer = self.gpu.pool.scratch(what, size, usage)?;
        #[cfg(test)]
        self.gpu.spoil(&buffer);
        Ok(buffer)
    }

    /// A storage buffer that holds the values; not pooled.
    pub fn constants<T: Pod>(&self, what: &str, values: &[T]) -> Result<PooledBuffer> {
        let usage = BufferUsages::STORAGE;
        self.gpu
            .pool
            .check_size(what, size_of_val(values) as u64, usage)?;
        let device = &self.gpu.device;
        let buffer = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some(what),
            contents: bytemuck::cast_slice(values),
            usage,
        });
        Ok(self.gpu.pool.lent(buffer))
    }

    /// Sets the first numbers of a buffer.
    pub fn write(&mut self, buffer: &wgpu::Buffer, values: &[f32]) {
        let device = &self.gpu.device;
        let given = device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("given numbers"),
            contents: bytemuck::cast_slice(values),
            usage: BufferUsages::COPY_SRC,
        });
        let size = size_of_val(values) as u64;
        self.encoder()
            .copy_buffer_to_buffer(&given, 0, buffer, 0, size);
    }

    /// Sets a buffer to zero.
    pub fn clear(&mut self, buffer: &wgpu::Buffer) {
        self.encoder().clear_buffer(buffer, 0, None);
    }

    /// Records a pass: its dispatches in order, timed together under the label.
    pub fn pass(&mut self, label: &'static str, dispatches: &[Dispatch]) {
        let gpu = self.gpu.clone();
        let prepare = |Dispatch { kernel, .. }: &Dispatch| {
            let (shader, constants) = (kernel.shader, &kernel.constants);
            let (pipeline, layout) = gpu.pipeline(shader, kernel.entry_points, constants);
            (pipeline, self.bind_group(kernel, &layout))
        };
        let prepared: Vec<_> = dispatches.iter().map(prepare).collect();
        let start = self.begin_by_clock();
        let query = self.next_query(label);
        let queries = self.queries.clone();
        let mut pass = self
            .encoder()
            .begin_compute_pass(&wgpu::ComputePassDescriptor {
                label: Some(label),
                timestamp_writes: queries.as_ref().zip(query).map(|(query_set, query)| {
                    wgpu::ComputePassTimestampWrites {
                        query_set,
                        beginning_of_pass_write_index: Some(query),
                        end_of_pass_write_index: Some(query + 1),
                    }
                }),
            });
        for (dispatch, (pipeline, bind_group)) in dispatches.iter().zip(&prepared) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, bind_group, &[]);
            match dispatch.groups {
                Groups::Linear(count) => {
                    let [columns, rows] = rows_of_groups(count);
                    pass.dispatch_workgroups(columns, rows, 1);
                }
                Groups::Grid(columns, rows) => pass.dispatch_workgroups(columns, rows, 1),
                Groups::Indirect(ref buffer, start) => {
                    pass.dispatch_workgroups_indirect(buffer, start);
                }
            }
        }
        drop(pass);
        self.end_by_clock(label, start);
    }

    /// Records a pass of the rasterization hardware: its draws in order over an image of (width, height),
    /// timed together under the label. Fragments write to storage alone; the image is thrown away.
    pub fn draw(&mut self, label: &'static str, (width, height): (u32, u32), draws: &[Draw]) {
        self.gpu.before_draw();
        let gpu = self.gpu.clone();
        let prepare = |Draw { kernel, .. }: &Draw| {
            let (shader, constants) = (kernel.shader, &kernel.constants);
            let (pipeline, layout) = gpu.render_pipeline(shader, kernel.entry_points, constants);
            (pipeline, self.bind_group(kernel, &layout))
        };
        let prepared: Vec<_> = draws.iter().map(prepare).collect();
        let start = self.begin_by_clock();
        let query = self.next_query(label);
        // A pass must have one.
        let image = self.gpu.device.create_texture(&wgpu::TextureDescriptor {
            label: Some(label),
            size: wgpu::Extent3d {
                width,
                height,
                depth_or_array_layers: 1,
            },
            mip_level_count: 1,
            sample_count: 1,
            dimension: wgpu::TextureDimension::D2,
            format: UNUSED_IMAGE,
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            view_formats: &[],
        });
        let queries = self.queries.clone();
        let mut pass = self
            .encoder()
            .begin_render_pass(&wgpu::RenderPassDescriptor {
                label: Some(label),
                color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                    view: &image.create_view(&wgpu::TextureViewDescriptor::default()),
                    depth_slice: None,
                    resolve_target: None,
                    ops: wgpu::Operations {
                        load: wgpu::LoadOp::Clear(wgpu::Color::BLACK),
                        store: wgpu::StoreOp::Discard,
                    },
                })],
                timestamp_writes: queries.as_ref().zip(query).map(|(query_set, query)| {
                    wgpu::RenderPassTimestampWrites {
                        query_set,
                        beginning_of_pass_write_index: Some(query),
                        end_of_pass_write_index: Some(query + 1),
                    }
                }),
                ..Default::default()
            });
        for (draw, (pipeline, bind_group)) in draws.iter().zip(&prepared) {
            pass.set_pipeline(pipeline);
            pass.set_bind_group(0, bind_group, &[]);
            match &draw.vertices {
                Vertices::Number(count) => pass.draw(0..*count, 0..1),
                Vertices::Indirect(buffer) => pass.draw_indirect(buffer, 0),
            }
        }
        drop(pass);
        self.end_by_clock(label, start);
    }

    fn bind_group(&mut self, kernel: &Kernel, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
        let bound = kernel.bound(&self.gpu, &mut self.uniforms);
        let gpu = &self.gpu;
        self.bind_groups.get(layout, bound, |entries| {
            #[cfg(test)]
            gpu.pool.count_made();
            gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
                label: Some(kernel.shader.file),
                layout,
                entries,
            })
        })
    }

    /// The first of a pass's two timestamps, where it is timed by them.
    fn next_query(&mut self, label: &'static str) -> Option<u32> {
        if self.queries.is_none() || self.gpu.times_by_clock() {
            return None;
        }
        let query = 2 * self.labels.len() as u32;
        assert!(query < 2 * MAX_PASSES, "too many passes in a submission");
        self.labels.push(label);
        Some(query)
    }

    /// The start of a pass that is submitted on its own, where the clock times it.
    fn begin_by_clock(&mut self) -> Option<Instant> {
        self.gpu.times_by_clock().then(|| {
            self.submit_recorded();
            Instant::now()
        })
    }

    fn end_by_clock(&mut self, label: &'static str, start: Option<Instant>) {
        if let Some(start) = start {
            self.submit_recorded();
            self.add_time(label, start.elapsed().as_secs_f64() * 1e3);
        }
    }

    /// Has what was recorded done; what fails there shows at the next `submit`.
    fn submit_recorded(&mut self) {
        self.send();
        let _ = self.gpu.device.poll(wgpu::PollType::wait_indefinitely());
    }

    /// Sends what was recorded on its way, before whatever another frame submits from now on. Does not
    /// wait.
    pub fn send(&mut self) {
        let commands = self.take_recorded();
        self.gpu.queue.submit([commands]);
    }

    fn take_recorded(&mut self) -> wgpu::CommandBuffer {
        self.uniforms.send(&self.gpu);
        let encoder = self.encoder.take();
        encoder.unwrap_or_else(|| new_encoder(&self.gpu)).finish()
    }

    fn encoder(&mut self) -> &mut wgpu::CommandEncoder {
        self.encoder.get_or_insert_with(|| new_encoder(&self.gpu))
    }

    /// Marks the first `count` elements of a storage buffer to be read after the next submission;
    /// a buffer that is `Source::Taken` is given up, one that is `Source::Kept` is copied.
    pub fn read<T: Pod>(&mut self, source: Source, count: usize) -> Result<Read<T>> {
        let size = (count * size_of::<T>()) as u64;
        let staging = match source {
            Source::Taken(buffer) if self.reads_in_place() => buffer,
            Source::Taken(ref buffer) => self.copy_to_staging(buffer, size)?,
            Source::Kept(buffer) => self.copy_to_staging(buffer, size)?,
        };
        self.reads.push(staging);
        Ok(Read {
            index: self.reads.len() - 1,
            count,
            element: PhantomData,
        })
    }

    /// The next submission brings what a pass counted.
    pub fn count(
        &mut self,
        label: &'static str,
        counters: PooledBuffer,
        count: usize,
        describe: impl Fn(&Gpu, &[u32]) -> Result<Facts> + Send + 'static,
    ) -> Result<()> {
        let parts = vec![self.read(Source::Taken(counters), count)?];
        self.count_parts(label, parts, move |gpu, parts| {
            let facts = describe(gpu, &parts[0])?;
            let had_room = true;
            Ok(Counted { facts, had_room })
        });
        Ok(())
    }

    /// The same of a pass in parts, each with its counters.
    pub fn count_parts(
        &mut self,
        label: &'static str,
        parts: Vec<Read<u32>>,
        describe: impl Fn(&Gpu, &[Vec<u32>]) -> Result<Counted> + Send + 'static,
    ) {
        self.pending.push(Pending {
            label,
            parts,
            describe: Box::new(describe),
        });
    }

    fn reads_in_place(&self) -> bool {
        let feature = wgpu::Features::MAPPABLE_PRIMARY_BUFFERS;
        self.gpu.features.contains(feature)
    }

    fn copy_to_staging(&mut self, source: &wgpu::Buffer, size: u64) -> Result<PooledBuffer> {
        let usage = BufferUsages::MAP_READ | BufferUsages::COPY_DST;
        let staging = self.gpu.pool.scratch("read-back", size, usage)?;
        self.encoder()
            .copy_buffer_to_buffer(source, 0, &staging, 0, size);
        Ok(staging)
    }

    /// Submits what was recorded and waits for what is to be read.
    pub fn submit(&mut self) -> Result<ReadResults> {
        let stamps = self.resolve_timestamps()?;
        let commands = self.take_recorded();
        let reads = self.reads.iter().map(|buffer| (**buffer).clone());
        if let Err(error) = self.member.submit(commands, reads) {
            self.reads.drain(..).for_each(PooledBuffer::discard);
            self.gpu.forget();
            return Err(error);
        }
        // It is done, and so is whatever was sent before it.
        self.uniforms = Uniforms::default();
        let results = ReadResults(std::mem::take(&mut self.reads));
        if let Some(stamps) = stamps {
            let ticks = results.take(&stamps)?;
            let period = f64::from(self.gpu.queue.get_timestamp_period());
            let labels = std::mem::take(&mut self.labels);
            for (label, pair) in labels.into_iter().zip(ticks.chunks_exact(2)) {
                let nanoseconds = pair[1].saturating_sub(pair[0]) as f64 * period;
                self.add_time(label, nanoseconds * 1e-6);
            }
        }
        self.labels.clear();
        for pending in std::mem::take(&mut self.pending) {
            if !self.had_room {
                // One list that was too short is enough: the frame is rendered again.
                break;
            }
            let parts = pending.parts.iter().map(|read| results.take(read));
            let counted = (pending.describe)(&self.gpu, &parts.collect::<Result<Vec<_>>>()?)?;
            self.facts.add(pending.label, counted.facts);
            self.had_room &= counted.had_room;
        }
        Ok(results)
    }

    fn resolve_timestamps(&mut self) -> Result<Option<Read<u64>>> {
        let queries = self.queries.clone();
        let Some(queries) = queries.filter(|_| !self.labels.is_empty()) else {
            return Ok(None);
        };
        let count = 2 * self.labels.len() as u32;
        let usage = BufferUsages::QUERY_RESOLVE | BufferUsages::COPY_SRC;
        let resolved = self
            .gpu
            .pool
            .scratch("timestamps", u64::from(2 * MAX_PASSES) * 8, usage)?;
        self.encoder()
            .resolve_query_set(&queries, 0..count, &resolved, 0);
        self.read(Source::Kept(&resolved), count as usize).map(Some)
    }

    /// Adds time to a label; work of the CPU has its own labels.
    pub fn add_time(&mut self, label: &'static str, milliseconds: f64) {
        match self.timings.iter_mut().find(|(known, _)| *known == label) {
            Some((_, time)) => *time += milliseconds,
            None => self.timings.push((label, milliseconds)),
        }
    }

    /// The end of a frame whose submissions are done.
    pub fn timings(self) -> Timings {
        if let Some(queries) = self.queries {
            self.gpu.give_query_set_back(queries);
        }
        self.gpu.give_bind_groups_back(self.bind_groups.next());
        self.timings
    }
}

/// A buffer to read: given up, so that it can be read in place, or copied.
pub enum Source<'a> {
    Taken(PooledBuffer),
    Kept(&'a wgpu::Buffer),
}

impl ReadResults {
    pub fn take<T: Pod>(&self, read: &Read<T>) -> Result<Vec<T>> {
        self.with(read, <[T]>::to_vec)
    }

    /// What some work makes of the values where they lie. They are not handed out for longer: wgpu frees what is
    /// mapped when the device is lost, under whoever looks at it, and a forked process shares a GPU's memory with
    /// the one that it came from, or has none.
    pub fn with<T: Pod, R>(&self, read: &Read<T>, work: impl FnOnce(&[T]) -> R) -> Result<R> {
        let size = (read.count * size_of::<T>()) as u64;
        let view = self.0[read.index].get_mapped_range(0..size);
        let view = view.map_err(|error| Error::Device(format!("read-back failed: {error}")))?;
        Ok(match bytemuck::try_cast_slice(&view) {
            Ok(values) => work(values),
            // The driver put it where such numbers cannot be.
            Err(_) => work(&bytemuck::pod_collect_to_vec(&view)),
        })
    }
}

impl Drop for ReadResults {
    fn drop(&mut self) {
        for buffer in &self.0 {
            buffer.unmap();
        }
    }
}

fn new_encoder(gpu: &Gpu) -> wgpu::CommandEncoder {
    gpu.device
        .create_command_encoder(&wgpu::CommandEncoderDescriptor {
            label: Some("lixel"),
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::adapters::adapter;

    const COUNT: usize = 16;

    /// A frame that clears and reads a buffer, which comes back to the pool; and perhaps clears one that
    /// is no more.
    fn clear_and_read(gpu: &Arc<Gpu>, is_broken: bool) -> Result<Vec<u32>> {
        let mut frame = Recording::together(gpu, 1, true).remove(0);
        let buffer = frame.storage("buffer", 4 * COUNT as u64)?;
        frame.clear(&buffer);
        let read = frame.read(Source::Taken(buffer), COUNT)?;
        if is_broken {
            let destroyed = frame.storage("destroyed", 4)?;
            frame.clear(&destroyed);
            destroyed.discard();
        }
        frame.submit()?.take(&read)
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn after_a_failed_submission_the_next_works() {
        let gpu = Arc::new(Gpu::new(&adapter("").unwrap()).unwrap());
        let zeros = vec![0; COUNT];
        assert_eq!(clear_and_read(&gpu, false).unwrap(), zeros);
        let refused = clear_and_read(&gpu, true).unwrap_err().to_string();
        assert!(refused.contains("refused"), "{refused}");
        // The failed frame's buffer may be mapped still: it must not be taken again.
        for _ in 0..3 {
            assert_eq!(clear_and_read(&gpu, false).unwrap(), zeros);
        }
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn a_lost_device_is_an_error_in_words() {
        let gpu = Arc::new(Gpu::new(&adapter("").unwrap()).unwrap());
        gpu.device.destroy();
        // A driver tells of a loss at once, `destroy` when it is asked.
        let _ = gpu.device.poll(wgpu::PollType::wait_indefinitely());
        let error = clear_and_read(&gpu, false).unwrap_err().to_string();
        assert!(
            error.contains("lost") && error.contains("next call"),
            "{error}"
        );
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn cleared_scratch_is_free() {
        let gpu = Arc::new(Gpu::new(&adapter("").unwrap()).unwrap());
        clear_and_read(&gpu, false).unwrap();
        assert!(gpu.pool.free_bytes() >= 4 * COUNT as u64);
        gpu.pool.clear();
        assert_eq!(gpu.pool.free_bytes(), 0);
    }
}
