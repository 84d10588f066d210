//! The device: one for the process, with its pipelines and its memory.

use super::adapters::{
    ATOMICS_OF_64_BITS, AdapterDescription, adapter, describe, lacks, missing, names, unusable,
    used_features,
};
use super::bind_groups::BindGroups;
use super::pipeline_cache::{self, PipelineCache};
use super::pool::Pool;
use super::shaders::Shader;
use crate::error::{Error, Result};
use crate::lock::lock;
use rustc_hash::FxHashMap;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock, Mutex, OnceLock};
use wgpu::{DeviceType, Features};

/// The device in use with everything made for it once.
pub struct Gpu {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    pub adapter: AdapterDescription,
    pub features: Features,
    pub limits: wgpu::Limits,
    is_cpu: bool,
    compiles_ray_queries: OnceLock<bool>,
    /// Set by the first draw on a CPU driver: llvmpipe's timestamps are of no use from then on, since it puts
    /// them off to where it draws.
    times_by_clock: AtomicBool,
    pipelines: Mutex<FxHashMap<PipelineKey, (wgpu::ComputePipeline, wgpu::BindGroupLayout)>>,
    render_pipelines: Mutex<FxHashMap<PipelineKey, (wgpu::RenderPipeline, wgpu::BindGroupLayout)>>,
    pipeline_cache: Option<PipelineCache>,
    /// Of frames before, which are done with them.
    query_sets: Mutex<Vec<wgpu::QuerySet>>,
    /// Of the frame that ended last.
    bind_groups: Mutex<BindGroups>,
    pub pool: Arc<Pool>,
    /// First error that no call returned; the frame that finds it fails with it.
    error: Arc<Mutex<Option<String>>>,
    lost: Arc<Mutex<Option<String>>>,
    #[cfg(test)]
    variant: Variant,
}

/// What a device does otherwise than the one that there is.
#[cfg(test)]
pub struct Variant {
    /// What a compiler may make of a shader, done before it is compiled.
    pub rewrite: fn(String) -> String,
    /// Whether scratch memory holds nothing of use before it is written.
    pub spoils_scratch: bool,
    /// Whether it has a GPU's invocations, which do less one after the other.
    pub is_gpu: bool,
}

#[cfg(test)]
impl Default for Variant {
    fn default() -> Self {
        Self {
            rewrite: |source| source,
            spoils_scratch: false,
            is_gpu: false,
        }
    }
}

/// A shader, its entry points, and its constants by name and bits.
type PipelineKey = (Shader, [&'static str; 2], Vec<(&'static str, u64)>);

fn pipeline_key(
    shader: Shader,
    entry_points: [&'static str; 2],
    constants: &[(&'static str, f64)],
) -> PipelineKey {
    let constants = constants.iter().map(|&(name, v)| (name, v.to_bits()));
    (shader, entry_points, constants.collect())
}

/// Of the image that a render pass must have.
pub const UNUSED_IMAGE: wgpu::TextureFormat = wgpu::TextureFormat::R8Unorm;

/// The devices of this process, by the names that were asked for.
static GPUS: LazyLock<Mutex<HashMap<String, Arc<Gpu>>>> = LazyLock::new(Mutex::default);

/// The device of the best adapter with that in its name, made at the first call, and made anew after it was
/// lost. Two names of one adapter have one device.
pub fn gpu(name: &str) -> Result<Arc<Gpu>> {
    let mut gpus = lock(&GPUS);
    gpus.retain(|_, gpu| lock(&gpu.lost).is_none());
    if let Some(gpu) = gpus.get(name) {
        return Ok(gpu.clone());
    }
    let adapter = adapter(name)?;
    let description = describe(&adapter.get_info());
    let known = gpus.values().find(|gpu| gpu.adapter == description);
    let gpu = match known {
        Some(gpu) => gpu.clone(),
        None => Arc::new(Gpu::new(&adapter)?),
    };
    gpus.insert(name.to_string(), gpu.clone());
    Ok(gpu)
}

/// The devices that were made so far.
pub fn opened() -> Vec<Arc<Gpu>> {
    lock(&GPUS).values().cloned().collect()
}

/// A driver may tell of what is experimental and fail with it: then the device does without.
fn open_device<D, E>(
    wanted: Features,
    mut request: impl FnMut(Features) -> std::result::Result<D, E>,
) -> std::result::Result<(Features, D), E> {
    let plain = wanted - Features::all_experimental_mask();
    match request(wanted) {
        Err(_) if plain != wanted => Ok((plain, request(plain)?)),
        outcome => Ok((wanted, outcome?)),
    }
}

impl Gpu {
    pub(super) fn new(adapter: &wgpu::Adapter) -> Result<Self> {
        let description = describe(&adapter.get_info());
        let missing = missing(adapter);
        if !missing.is_empty() {
            return Err(lacks(&description, &missing));
        }
        let limits = adapter.limits();
        let request = |features| {
            pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
                label: Some("lixel"),
                required_features: features,
                required_limits: limits.clone(),
                // SAFETY: of these, only ray queries are used, as their documentation asks: a query is
                // stepped after its start and until it ends, over a structure that was built.
                experimental_features: unsafe { wgpu::ExperimentalFeatures::enabled() },
                ..Default::default()
            }))
        };
        let (features, (device, queue)) = open_device(used_features(adapter)?, request)
            .map_err(|error| unusable(&description, &format!("gives no device: {error}")))?;
        let error = Arc::new(Mutex::new(None));
        let first_error = error.clone();
        device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| {
            lock(&first_error).get_or_insert_with(|| error.to_string());
        }));
        let lost = Arc::new(Mutex::new(None));
        let why_lost = lost.clone();
        device.set_device_lost_callback(move |reason, message| {
            lock(&why_lost).get_or_insert_with(|| format!("{reason:?}: {message}"));
        });
        let pool = Arc::new(Pool::new(&device, &limits, &description.name));
        let folder = pipeline_cache::folder();
        let open = |folder: PathBuf| PipelineCache::open(&device, &adapter.get_info(), &folder);
        let pipeline_cache = folder.and_then(open);
        Ok(Self {
            device,
            queue,
            adapter: description,
            features,
            limits,
            is_cpu: adapter.get_info().device_type == DeviceType::Cpu,
            compiles_ray_queries: OnceLock::new(),
            times_by_clock: AtomicBool::new(false),
            pipelines: Mutex::default(),
            render_pipelines: Mutex::default(),
            pipeline_cache,
            query_sets: Mutex::default(),
            bind_groups: Mutex::default(),
            pool,
            error,
            lost,
            #[cfg(test)]
            variant: Variant::default(),
        })
    }

    /// A device of its own.
    #[cfg(test)]
    pub fn variant(variant: Variant) -> Arc<Self> {
        let gpu = Self::new(&adapter("").unwrap()).unwrap();
        let is_cpu = gpu.is_cpu && !variant.is_gpu;
        Arc::new(Self {
            is_cpu,
            variant,
            ..gpu
        })
    }

    /// How many bind groups are kept for the next frame.
    #[cfg(test)]
    pub fn kept_bind_groups(&self) -> usize {
        lock(&self.bind_groups).kept()
    }

    /// Fills scratch memory with bits that are no number of use, if the variant does.
    #[cfg(test)]
    pub fn spoil(&self, buffer: &wgpu::Buffer) {
        if self.variant.spoils_scratch {
            let bytes = vec![0xa5; buffer.size() as usize];
            self.queue.write_buffer(buffer, 0, &bytes);
        }
    }

    pub fn has_timestamps(&self) -> bool {
        self.features.contains(Features::TIMESTAMP_QUERY)
    }

    /// Whether shaders have the atomic maximum of 64 bits.
    pub fn has_64_bit_atomics(&self) -> bool {
        self.features.contains(ATOMICS_OF_64_BITS)
    }

    pub fn has_ray_queries(&self) -> bool {
        self.features.contains(Features::EXPERIMENTAL_RAY_QUERY)
    }

    /// Whether ray queries are likely to be faster than a walk in compute: on a CPU driver they are not.
    pub fn prefers_ray_queries(&self) -> bool {
        let compiles = || {
            *self
                .compiles_ray_queries
                .get_or_init(|| self.compiles("ray_queries"))
        };
        self.has_ray_queries() && !self.is_cpu && compiles()
    }

    /// What is experimental may fail in the driver's compiler, too.
    fn compiles(&self, shader: &'static str) -> bool {
        let pipeline = || Ok(self.compile(Shader::new(shader), "main", &[]));
        self.catch_errors(pipeline).is_ok()
    }

    /// Fails where the device has no ray queries.
    pub fn check_ray_queries(&self) -> Result<()> {
        if self.has_ray_queries() {
            return Ok(());
        }
        Err(Error::Device(format!(
            "an acceleration structure needs ray queries ({}), which the adapter {} ({}) lacks",
            names(Features::EXPERIMENTAL_RAY_QUERY).join(", "),
            self.adapter.name,
            self.adapter.driver
        )))
    }

    /// Does the work; what the device refuses in it is this call's error, and no frame's.
    pub(super) fn catch_errors<T>(&self, work: impl FnOnce() -> Result<T>) -> Result<T> {
        let scopes = [
            wgpu::ErrorFilter::Validation,
            wgpu::ErrorFilter::OutOfMemory,
            wgpu::ErrorFilter::Internal,
        ]
        .map(|filter| self.device.push_error_scope(filter));
        let done = work();
        // The last one pushed is the first one popped.
        let errors = scopes.into_iter().rev();
        let errors: Vec<_> = errors
            .filter_map(|scope| pollster::block_on(scope.pop()))
            .collect();
        match errors.first() {
            Some(error) => Err(self.refusal(error)),
            None => done,
        }
    }

    fn refusal(&self, reason: impl std::fmt::Display) -> Error {
        Error::Device(format!(
            "the device {} ({}) refused: {reason}",
            self.adapter.name, self.adapter.driver
        ))
    }

    /// The largest number of bytes that one storage buffer may hold for a shader.
    pub fn largest_storage(&self) -> u64 {
        self.pool.largest_storage
    }

    /// Whether passes are timed by the clock.
    pub fn times_by_clock(&self) -> bool {
        self.times_by_clock.load(Ordering::Relaxed)
    }

    /// Before the rasterization hardware is used.
    pub fn before_draw(&self) {
        self.times_by_clock.store(self.is_cpu, Ordering::Relaxed);
    }

    /// How much an invocation does one after the other: a GPU wants many invocations, a CPU few.
    pub fn work_per_invocation(&self, on_gpu: u32, on_cpu: u32) -> u32 {
        if self.is_cpu { on_cpu } else { on_gpu }
    }

    /// Names of the optional and required features in use.
    pub fn feature_names(&self) -> Vec<String> {
        names(self.features)
    }

    /// Takes the error that no call returned, if there is one.
    pub(super) fn take_error(&self) -> Result<()> {
        if let Some(reason) = lock(&self.lost).clone() {
            return Err(Error::Device(format!(
                "the device {} was lost ({reason}); the next call takes a new one",
                self.adapter.name
            )));
        }
        match lock(&self.error).take() {
            Some(message) => Err(self.refusal(message)),
            None => Ok(()),
        }
    }

    /// Forgets what is kept from frame to frame, after one failed: what the device had no memory for is
    /// there, but cannot be used.
    pub(super) fn forget(&self) {
        self.pool.forget();
        lock(&self.pipelines).clear();
        lock(&self.render_pipelines).clear();
        lock(&self.query_sets).clear();
        self.forget_bind_groups();
    }

    /// Frees the memory that no frame is using.
    pub fn clear(&self) {
        self.forget_bind_groups();
        self.pool.clear();
    }

    /// They hold on to what they bind.
    pub fn forget_bind_groups(&self) {
        self.give_bind_groups_back(BindGroups::default());
    }

    /// Those of the frame before, for one frame alone.
    pub(super) fn take_bind_groups(&self) -> BindGroups {
        std::mem::take(&mut *lock(&self.bind_groups))
    }

    pub(super) fn give_bind_groups_back(&self, groups: BindGroups) {
        let before = std::mem::replace(&mut *lock(&self.bind_groups), groups);
        // Not while the lock is held.
        drop(before);
    }

    /// A set of so many queries for timestamps, where there are any; the number is the same at every call.
    pub(super) fn take_query_set(&self, count: u32) -> Option<wgpu::QuerySet> {
        let kept = || lock(&self.query_sets).pop();
        let new = || {
            self.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("timestamps"),
                ty: wgpu::QueryType::Timestamp,
                count,
            })
        };
        self.has_timestamps().then(|| kept().unwrap_or_else(new))
    }

    /// What is submitted from now on may write it anew.
    pub(super) fn give_query_set_back(&self, set: wgpu::QuerySet) {
        lock(&self.query_sets).push(set);
    }

    /// The compiled entry point of a shader, made at first use, and how it binds what it needs.
    pub(super) fn pipeline(
        &self,
        shader: Shader,
        entry_points: [&'static str; 2],
        constants: &[(&'static str, f64)],
    ) -> (wgpu::ComputePipeline, wgpu::BindGroupLayout) {
        let compile = || {
            let pipeline = self.compile(shader, entry_points[0], constants);
            let layout = pipeline.get_bind_group_layout(0);
            (pipeline, layout)
        };
        lock(&self.pipelines)
            .entry(pipeline_key(shader, entry_points, constants))
            .or_insert_with(compile)
            .clone()
    }

    /// The compiled vertex and fragment stage of a shader, made at first use: triangles of either winding,
    /// each pixel whose centre is covered once, nothing written but to storage.
    pub(super) fn render_pipeline(
        &self,
        shader: Shader,
        entry_points: [&'static str; 2],
        constants: &[(&'static str, f64)],
    ) -> (wgpu::RenderPipeline, wgpu::BindGroupLayout) {
        let compile = || {
            let pipeline = self.compile_stages(shader, entry_points, constants);
            let layout = pipeline.get_bind_group_layout(0);
            (pipeline, layout)
        };
        lock(&self.render_pipelines)
            .entry(pipeline_key(shader, entry_points, constants))
            .or_insert_with(compile)
            .clone()
    }

    fn compile_stages(
        &self,
        shader: Shader,
        [vertex, fragment]: [&str; 2],
        constants: &[(&str, f64)],
    ) -> wgpu::RenderPipeline {
        let module = self.module(shader);
        let compilation_options = wgpu::PipelineCompilationOptions {
            constants,
            ..Default::default()
        };
        self.device
            .create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(&format!("{} {vertex} {fragment}", shader.file)),
                layout: None,
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(vertex),
                    compilation_options: compilation_options.clone(),
                    buffers: &[],
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: None,
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(fragment),
                    compilation_options,
                    targets: &[Some(wgpu::ColorTargetState {
                        format: UNUSED_IMAGE,
                        blend: None,
                        write_mask: wgpu::ColorWrites::empty(),
                    })],
                }),
                multiview_mask: None,
                cache: self.cache_that_grows(),
            })
    }

    pub(super) fn compile(
        &self,
        shader: Shader,
        entry_point: &str,
        constants: &[(&str, f64)],
    ) -> wgpu::ComputePipeline {
        let module = self.module(shader);
        self.device
            .create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
                label: Some(&format!("{} {entry_point}", shader.file)),
                layout: None,
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: wgpu::PipelineCompilationOptions {
                    constants,
                    zero_initialize_workgroup_memory: true,
                },
                cache: self.cache_that_grows(),
            })
    }

    fn cache_that_grows(&self) -> Option<&wgpu::PipelineCache> {
        let known = self.pipeline_cache.as_ref()?;
        known.grew();
        Some(&known.cache)
    }

    /// Keeps what was compiled for the next process.
    pub fn save_pipelines(&self) {
        if let Some(cache) = &self.pipeline_cache {
            cache.save();
        }
    }

    fn module(&self, shader: Shader) -> wgpu::ShaderModule {
        let source = shader.compose();
        #[cfg(test)]
        let source = (self.variant.rewrite)(source);
        let descriptor = wgpu::ShaderModuleDescriptor {
            label: Some(shader.file),
            source: wgpu::ShaderSource::Wgsl(source.into()),
        };
        // Bounds checks and loop counters cost up to 100 times in inner loops; the tests run with them.
        if std::env::var_os("LIXEL_CHECKED_SHADERS").is_some() {
            self.device.create_shader_module(descriptor)
        } else {
            // SAFETY: the shaders are this crate's own; every index is bounded by the length of its
            // array or by what the host wrote, and every loop ends.
            unsafe {
                self.device.create_shader_module_trusted(
                    descriptor,
                    wgpu::ShaderRuntimeChecks::unchecked(),
                )
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_driver_that_fails_with_ray_queries_is_used_without() {
        let wanted = ATOMICS_OF_64_BITS | Features::EXPERIMENTAL_RAY_QUERY;
        let mut asked = Vec::new();
        let mut open = |wanted, works: fn(Features) -> bool| {
            asked.clear();
            let outcome = open_device(wanted, |features| {
                asked.push(features);
                if works(features) { Ok(()) } else { Err(()) }
            });
            (outcome, asked.len())
        };
        let is_plain = |features| features == ATOMICS_OF_64_BITS;
        assert_eq!(open(wanted, |_| true), (Ok((wanted, ())), 1));
        assert_eq!(open(wanted, is_plain), (Ok((ATOMICS_OF_64_BITS, ())), 2));
        assert_eq!(open(wanted, |_| false), (Err(()), 2));
        assert_eq!(open(ATOMICS_OF_64_BITS, |_| false), (Err(()), 1));
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn a_gpu_prefers_ray_queries_and_a_cpu_does_not() {
        let mut gpu = Gpu::new(&adapter("").unwrap()).unwrap();
        gpu.is_cpu = false;
        assert_eq!(gpu.prefers_ray_queries(), gpu.has_ray_queries());
        assert_eq!(gpu.compiles("ray_queries"), gpu.has_ray_queries());
        assert!(gpu.compiles("shadow_rays"));
        gpu.is_cpu = true;
        assert!(!gpu.prefers_ray_queries());
        assert_eq!(gpu.take_error(), Ok(()));
    }

    #[test]
    #[ignore = "runs shaders: LIXEL_DEVICE=gpu"]
    fn a_refusal_in_a_scope_is_no_frame_s() {
        let gpu = Gpu::new(&adapter("").unwrap()).unwrap();
        let refused = gpu.catch_errors(|| {
            Ok(gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: None,
                size: u64::MAX,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }))
        });
        let message = refused.unwrap_err().to_string();
        assert!(message.contains("refused"), "{message}");
        assert_eq!(gpu.take_error(), Ok(()));
        assert_eq!(gpu.catch_errors(|| Ok(7)), Ok(7));
    }
}
