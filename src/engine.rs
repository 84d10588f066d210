//! Which engine carries a frame out: the CPU's own, or the GPU's on one of the adapters.

use crate::cpu;
use crate::error::{Error, Result};
use crate::gpu::{self, AdapterDescription, Gpu};
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
        let variable = std::env::var(VARIABLE).ok();
        if let Some(name) = device.or(variable.as_deref().filter(|name| !name.is_empty())) {
            return Self::named(name);
        }
        match has_hardware() {
            true => Ok(Self::Gpu(gpu::gpu("")?)),
            false => Ok(Self::Cpu),
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

/// Whether there is a GPU that gives a device; it is not asked again.
fn has_hardware() -> bool {
    static HAS_HARDWARE: OnceLock<bool> = OnceLock::new();
    *HAS_HARDWARE.get_or_init(|| gpu::has_hardware() && gpu::gpu("").is_ok())
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
