//! Which engine carries a frame out: the CPU's own, or the GPU's on one of the adapters.

use crate::cpu;
use crate::error::{Error, Result};
use crate::gpu::{self, AdapterDescription, Gpu};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Names the device where the caller does not.
const VARIABLE: &str = "LIXEL_DEVICE";

/// What the name of a device must be.
pub const DEVICE_RULE: &str = "device must be 'cpu', 'gpu' or a part of the name of an adapter";

#[derive(Clone)]
pub enum Engine {
    Cpu,
    Gpu(Arc<Gpu>),
}

impl Engine {
    /// By the name of a device, of the environment's where none is given. Without any: a hardware GPU, else the CPU.
    pub fn choose(device: Option<&str>) -> Result<Self> {
        if let Some(name) = device.or(named_by_environment().as_deref()) {
            return Self::named(name);
        }
        match hardware() {
            Ok(true) => Ok(Self::Gpu(gpu::gpu("")?)),
            Ok(false) | Err(_) => Ok(Self::Cpu),
        }
    }

    fn named(name: &str) -> Result<Self> {
        match name.to_lowercase().as_str() {
            "cpu" => Ok(Self::Cpu),
            "gpu" => Ok(Self::Gpu(gpu::gpu("")?)),
            "" => Err(Error::Value(format!("{DEVICE_RULE}, got ''"))),
            name => match gpu::gpu(name) {
                Err(Error::Value(reason)) => Err(Error::Value(format!(
                    "{DEVICE_RULE}, got '{name}': {reason}"
                ))),
                outcome => outcome.map(Self::Gpu),
            },
        }
    }

    /// Name, type, backend and driver.
    pub fn description(&self) -> AdapterDescription {
        match self {
            Self::Gpu(gpu) => gpu.adapter.clone(),
            Self::Cpu => {
                let cpu::Description {
                    processor,
                    lanes,
                    threads,
                } = cpu::description();
                let plural = if threads == 1 { "" } else { "s" };
                let version = env!("CARGO_PKG_VERSION");
                AdapterDescription {
                    name: processor.to_string(),
                    kind: "Cpu engine".to_string(),
                    backend: "lixel".to_string(),
                    driver: format!("{version}, {lanes} lanes, {threads} thread{plural}"),
                }
            }
        }
    }
}

/// The device that the environment names.
pub fn named_by_environment() -> Option<String> {
    let name = std::env::var(VARIABLE).ok();
    name.filter(|name| !name.is_empty())
}

static HARDWARE: OnceLock<std::result::Result<bool, String>> = OnceLock::new();

/// Whether there is a GPU, or what keeps it from use; it is not asked again.
fn hardware() -> &'static std::result::Result<bool, String> {
    HARDWARE.get_or_init(|| match gpu::has_hardware() {
        true => gpu::gpu("")
            .map(|_| true)
            .map_err(|error| error.to_string()),
        false => Ok(false),
    })
}

/// Why the CPU renders in place of a GPU that there is. It is said once.
pub fn reason_for_cpu() -> Option<String> {
    static IS_SAID: AtomicBool = AtomicBool::new(false);
    let reason = HARDWARE.get()?.as_ref().err()?;
    let is_new = !IS_SAID.swap(true, Ordering::Relaxed);
    is_new.then(|| format!("the CPU engine renders: {reason}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pass_of_both_engines_has_one_label() {
        // What the GPU engine does in no pass of its own.
        let own = ["light grid"];
        for label in cpu::LABELS {
            let is_shared = gpu::passes::LABELS.contains(label);
            assert_ne!(is_shared, own.contains(label), "{label}");
        }
    }
}
