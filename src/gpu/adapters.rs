//! The adapters of this machine, and which of them is used.

use wgpu::{Backends, DeviceType, Features};

/// What the shaders cannot do without: the nearest (depth, triangle) of a texel is one 64-bit maximum.
pub(super) const REQUIRED_FEATURES: Features =
    Features::SHADER_INT64.union(Features::SHADER_INT64_ATOMIC_MIN_MAX);

/// What is used where it is there: times of passes, reading results without a copy, and ray queries.
const OPTIONAL_FEATURES: Features = Features::TIMESTAMP_QUERY
    .union(Features::MAPPABLE_PRIMARY_BUFFERS)
    .union(Features::EXPERIMENTAL_RAY_QUERY);

pub(super) const HOW_TO_INSTALL: &str = "install a Vulkan driver: that of your GPU, or, without a GPU, lavapipe \
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

/// Vulkan before other backends, discrete GPUs before integrated ones before software. The
/// environment variable WGPU_ADAPTER_NAME (a part of the name, any case) narrows the choice.
pub(super) fn ranked_adapters() -> Vec<wgpu::Adapter> {
    let wanted = std::env::var("WGPU_ADAPTER_NAME").map(|name| name.to_lowercase());
    let mut adapters: Vec<_> = pollster::block_on(instance().enumerate_adapters(Backends::all()))
        .into_iter()
        .filter(|adapter| {
            let name = adapter.get_info().name.to_lowercase();
            wanted.as_ref().map_or(true, |wanted| name.contains(wanted))
        })
        .collect();
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
