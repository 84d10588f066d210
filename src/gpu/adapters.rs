//! The adapters of this machine, and which of them is used.

use crate::error::{Error, Result};
use wgpu::{Backends, DeviceType, DownlevelFlags, Features};

/// What the shaders cannot do without; those of fragments and vertices are for shadow volumes.
const REQUIRED_FLAGS: DownlevelFlags = DownlevelFlags::COMPUTE_SHADERS
    .union(DownlevelFlags::INDIRECT_EXECUTION)
    .union(DownlevelFlags::VERTEX_STORAGE)
    .union(DownlevelFlags::FRAGMENT_WRITABLE_STORAGE);

/// Of all stages of all shaders.
pub(super) const MAX_STORAGE_BUFFERS: u32 = 10;

/// With them the nearest (depth, triangle) of a texel is one 64-bit maximum; without, the casters are walked twice.
pub(super) const ATOMICS_OF_64_BITS: Features =
    Features::SHADER_INT64.union(Features::SHADER_INT64_ATOMIC_MIN_MAX);

/// What is used where it is there: atomics of 64 bits, times of passes, reading results without a copy, and ray
/// queries.
const USED_FEATURES: Features = ATOMICS_OF_64_BITS
    .union(Features::TIMESTAMP_QUERY)
    .union(Features::MAPPABLE_PRIMARY_BUFFERS)
    .union(Features::EXPERIMENTAL_RAY_QUERY)
    .union(Features::PIPELINE_CACHE);

const HOW_TO_INSTALL: &str = "install a Vulkan driver: that of your GPU, or, without a GPU, lavapipe \
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
    AdapterReport {
        adapter: describe(&adapter.get_info()),
        missing_features: missing(adapter),
        used_features: names(used_features(adapter).unwrap_or_default()),
        limits: adapter.limits(),
    }
}

pub(super) fn names(features: Features) -> Vec<String> {
    features
        .iter_names()
        .map(|(name, _)| name.to_string())
        .collect()
}

/// What the adapter has of them, but for those that the environment leaves out.
pub(super) fn used_features(adapter: &wgpu::Adapter) -> Result<Features> {
    let shares_memory = matches!(
        adapter.get_info().device_type,
        DeviceType::Cpu | DeviceType::IntegratedGpu
    );
    let mut wanted = USED_FEATURES - left_out()?;
    // Across a bus, reading storage in place is slower than a copy.
    wanted.set(
        Features::MAPPABLE_PRIMARY_BUFFERS,
        shares_memory && wanted.contains(Features::MAPPABLE_PRIMARY_BUFFERS),
    );
    let used = wanted & adapter.features();
    // One of the two alone serves nothing.
    match used.contains(ATOMICS_OF_64_BITS) {
        true => Ok(used),
        false => Ok(used - ATOMICS_OF_64_BITS),
    }
}

/// Features to do without, as on a device that lacks them: their names, with commas between.
const WITHOUT: &str = "LIXEL_WITHOUT";

fn left_out() -> Result<Features> {
    let names = std::env::var(WITHOUT).unwrap_or_default();
    let names = names
        .split(',')
        .map(str::trim)
        .filter(|name| !name.is_empty());
    let mut features = Features::empty();
    for name in names {
        let feature = USED_FEATURES.iter_names().find(|(known, _)| *known == name);
        let Some((_, feature)) = feature else {
            let known = self::names(USED_FEATURES).join(", ");
            return Err(Error::Value(format!(
                "{WITHOUT} must name some of {known}, got {name}"
            )));
        };
        features |= feature;
    }
    Ok(features)
}

/// What WebGPU asks of every adapter, and more buffers in a shader.
fn required_limits() -> wgpu::Limits {
    wgpu::Limits {
        max_storage_buffers_per_shader_stage: MAX_STORAGE_BUFFERS,
        ..wgpu::Limits::default()
    }
}

/// What the shaders cannot do without and the adapter lacks, in words.
pub(super) fn missing(adapter: &wgpu::Adapter) -> Vec<String> {
    let flags = adapter.get_downlevel_capabilities().flags;
    missing_of(flags, &adapter.limits())
}

fn missing_of(flags: DownlevelFlags, limits: &wgpu::Limits) -> Vec<String> {
    let flags = (REQUIRED_FLAGS - flags).iter_names();
    let mut missing: Vec<_> = flags.map(|(name, _)| name.to_string()).collect();
    required_limits().check_limits_with_fail_fn(limits, false, |name, wanted, allowed| {
        missing.push(format!("{name} of {wanted} (it has {allowed})"));
    });
    missing
}

pub(super) fn lacks(adapter: &AdapterDescription, missing: &[String]) -> Error {
    unusable(adapter, &format!("lacks {}", missing.join(", ")))
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

/// Whether there is an adapter that is no software driver, of those that the environment leaves.
pub fn has_hardware() -> bool {
    adapter("").is_ok_and(|adapter| !is_software(adapter.get_info().device_type))
}

fn is_software(kind: DeviceType) -> bool {
    matches!(kind, DeviceType::Cpu | DeviceType::Other)
}

fn ranked_adapters() -> Vec<wgpu::Adapter> {
    let mut adapters = pollster::block_on(instance().enumerate_adapters(Backends::all()));
    adapters.sort_by_key(|adapter| {
        let info = adapter.get_info();
        rank(info.device_type, info.backend, missing(adapter).is_empty())
    });
    adapters
}

/// Hardware before software, so that a software driver stands in for a GPU only where there is none or where it is
/// named; then what lacks nothing, discrete GPUs, and Vulkan.
fn rank(kind: DeviceType, backend: wgpu::Backend, lacks_nothing: bool) -> impl Ord {
    let order = match kind {
        DeviceType::DiscreteGpu => 0,
        DeviceType::IntegratedGpu => 1,
        DeviceType::VirtualGpu => 2,
        DeviceType::Cpu => 3,
        DeviceType::Other => 4,
    };
    let is_vulkan = backend == wgpu::Backend::Vulkan;
    (is_software(kind), !lacks_nothing, order, !is_vulkan)
}

/// What to tell of an adapter that lacks something, or that gives no device.
pub(super) fn unusable(adapter: &AdapterDescription, what: &str) -> Error {
    let AdapterDescription { name, driver, .. } = adapter;
    Error::Device(format!(
        "the adapter {name} ({driver}) {what}; a newer driver may help, device='cpu' does without a GPU"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use wgpu::Backend::{Dx12, Metal, Vulkan};

    #[test]
    fn software_stands_in_for_no_gpu() {
        let in_order = [
            (DeviceType::DiscreteGpu, Vulkan, true),
            (DeviceType::DiscreteGpu, Dx12, true),
            (DeviceType::IntegratedGpu, Metal, true),
            (DeviceType::VirtualGpu, Vulkan, true),
            (DeviceType::DiscreteGpu, Vulkan, false),
            (DeviceType::IntegratedGpu, Vulkan, false),
            (DeviceType::Cpu, Vulkan, true),
            (DeviceType::Other, Vulkan, true),
            (DeviceType::Cpu, Vulkan, false),
        ];
        let mut found = in_order;
        found.reverse();
        found.sort_by_key(|&(kind, backend, lacks_nothing)| rank(kind, backend, lacks_nothing));
        assert_eq!(found, in_order);
    }

    #[test]
    fn what_an_adapter_lacks_is_named() {
        let weak = wgpu::Limits {
            max_storage_buffers_per_shader_stage: 8,
            max_texture_dimension_2d: 4096,
            ..required_limits()
        };
        let flags = DownlevelFlags::all() - DownlevelFlags::FRAGMENT_WRITABLE_STORAGE;
        let lacking = missing_of(flags, &weak);
        assert_eq!(
            lacking,
            [
                "FRAGMENT_WRITABLE_STORAGE",
                "max_texture_dimension_2d of 8192 (it has 4096)",
                "max_storage_buffers_per_shader_stage of 10 (it has 8)",
            ]
        );
        assert!(missing_of(DownlevelFlags::all(), &required_limits()).is_empty());
        let adapter = AdapterDescription {
            name: "Iris".to_string(),
            driver: "its own".to_string(),
            ..AdapterDescription::default()
        };
        let message = lacks(&adapter, &lacking).to_string();
        assert!(
            message.starts_with("the adapter Iris (its own) lacks FRAGMENT_"),
            "{message}"
        );
        assert!(!message.contains("install"), "{message}");
    }
}
