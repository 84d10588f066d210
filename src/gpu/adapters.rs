//! The adapters of this machine, and which of them is used.

use crate::error::{Error, Result};
use wgpu::{Backends, DeviceType, Features};

/// What the shaders cannot do without: the nearest (depth, triangle) of a texel is one 64-bit maximum.
pub(super) const REQUIRED_FEATURES: Features =
    Features::SHADER_INT64.union(Features::SHADER_INT64_ATOMIC_MIN_MAX);

/// What is used where it is there: times of passes, reading results without a copy, and ray queries.
const OPTIONAL_FEATURES: Features = Features::TIMESTAMP_QUERY
    .union(Features::MAPPABLE_PRIMARY_BUFFERS)
    .union(Features::EXPERIMENTAL_RAY_QUERY);

pub const HOW_TO_INSTALL: &str = "install a Vulkan driver: that of your GPU, or, without a GPU, lavapipe \
     (Debian and Ubuntu: apt-get install mesa-vulkan-drivers libvulkan1)";

/// Name, type, backend and driver of an adapter: part of every result.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct AdapterDescription {
    pub name: String,
    pub kind: String,
    pub backend: String,
    pub driver: String,
}

/// An adapter and what it can do, for `lixel info`.
#[derive(Debug, Clone)]
pub struct AdapterReport {
    pub adapter: AdapterDescription,
    pub missing_features: Vec<String>,
    pub used_features: Vec<String>,
    pub limits: wgpu::Limits,
}

fn instance() -> wgpu::Instance {
    let mut descriptor = wgpu::InstanceDescriptor::new_without_display_handle();
    descriptor.backends = Backends::VULKAN | Backends::METAL | Backends::DX12;
    // The validation layers are for lixel's own tests; indirect arguments are written by our shaders.
    descriptor.flags = if cfg!(debug_assertions) {
        wgpu::InstanceFlags::debugging()
    } else {
        wgpu::InstanceFlags::empty()
    };
    wgpu::Instance::new(descriptor.with_env())
}

/// Every adapter of this machine, the one that would be used first.
pub fn adapters() -> Vec<AdapterReport> {
    ranked_adapters().iter().map(report).collect()
}

fn report(adapter: &wgpu::Adapter) -> AdapterReport {
    let features = adapter.features();
    AdapterReport {
        adapter: describe(&adapter.get_info()),
        missing_features: names(REQUIRED_FEATURES - features),
        used_features: names((REQUIRED_FEATURES | used_features(adapter)) & features),
        limits: adapter.limits(),
    }
}

pub(super) fn names(features: Features) -> Vec<String> {
    features
        .iter_names()
        .map(|(name, _)| name.to_string())
        .collect()
}

pub(super) fn used_features(adapter: &wgpu::Adapter) -> Features {
    let shares_memory = matches!(
        adapter.get_info().device_type,
        DeviceType::Cpu | DeviceType::IntegratedGpu
    );
    let mut wanted = REQUIRED_FEATURES | OPTIONAL_FEATURES;
    // Across a bus, reading storage in place is slower than a copy.
    wanted.set(Features::MAPPABLE_PRIMARY_BUFFERS, shares_memory);
    wanted & adapter.features()
}

pub(super) fn describe(info: &wgpu::AdapterInfo) -> AdapterDescription {
    AdapterDescription {
        name: info.name.clone(),
        kind: format!("{:?}", info.device_type),
        backend: info.backend.to_string(),
        driver: format!("{} {}", info.driver, info.driver_info)
            .trim()
            .to_string(),
    }
}

/// Narrows the choice of an adapter where none is named: a part of its name, any case.
const VARIABLE: &str = "WGPU_ADAPTER_NAME";

/// The best adapter of those that have some text in their name, in any case; without a text, of those that
/// the environment leaves.
pub(super) fn adapter(name: &str) -> Result<wgpu::Adapter> {
    if name.is_empty() {
        let narrowed = std::env::var(VARIABLE);
        let narrowed_to = narrowed.as_deref().unwrap_or_default();
        let mut adapters = ranked_adapters().into_iter();
        let found = adapters.find(|adapter| has_name(adapter, narrowed_to));
        return found.ok_or_else(|| {
            Error::Device(match &narrowed {
                Ok(name) => format!(
                    "no GPU adapter has {name:?} in its name (environment variable {VARIABLE})"
                ),
                Err(_) => format!("no GPU adapter found; {HOW_TO_INSTALL}"),
            })
        });
    }
    let adapters = ranked_adapters();
    let known: Vec<_> = adapters.iter().map(|a| a.get_info().name).collect();
    let mut adapters = adapters.into_iter();
    adapters
        .find(|adapter| has_name(adapter, name))
        .ok_or_else(|| {
            let known = match known.is_empty() {
                true => "there is none".to_string(),
                false => format!("there are {}", known.join(", ")),
            };
            Error::Value(format!("no adapter is called so; {known}"))
        })
}

fn has_name(adapter: &wgpu::Adapter, part: &str) -> bool {
    let name = adapter.get_info().name.to_lowercase();
    name.contains(&part.to_lowercase())
}

/// Whether the best adapter is no software driver, and has what the shaders need.
pub fn has_hardware() -> bool {
    adapter("").is_ok_and(|adapter| {
        let kind = adapter.get_info().device_type;
        let is_software = matches!(kind, DeviceType::Cpu | DeviceType::Other);
        !is_software && adapter.features().contains(REQUIRED_FEATURES)
    })
}

/// Vulkan before other backends, discrete GPUs before integrated ones before software.
fn ranked_adapters() -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance().enumerate_adapters(Backends::all()));
    adapters.sort_by_key(|adapter| {
        let info = adapter.get_info();
        let is_usable = adapter.features().contains(REQUIRED_FEATURES);
        let kind = match info.device_type {
            DeviceType::DiscreteGpu => 0,
            DeviceType::IntegratedGpu => 1,
            DeviceType::VirtualGpu => 2,
            DeviceType::Cpu => 3,
            DeviceType::Other => 4,
        };
        (!is_usable, kind, info.backend != wgpu::Backend::Vulkan)
    });
    adapters
}
