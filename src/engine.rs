//! Which engine carries a frame out: the CPU's own, or the GPU's on one of the adapters.

use crate::error::{Error, Result};
use crate::gpu::{self, AdapterDescription, Gpu, HOW_TO_INSTALL};
use crate::{cpu, methods};
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
    /// By the name of a device, of the environment's where none is given. Without any: a hardware GPU; else the
    /// CPU, if the method has a form there; else a software driver.
    pub fn choose(device: Option<&str>, method: &methods::Description) -> Result<Self> {
        let variable = std::env::var(VARIABLE).ok();
        if let Some(name) = device.or(variable.as_deref().filter(|name| !name.is_empty())) {
            return Self::named(name, method);
        }
        if has_hardware() {
            return Ok(Self::Gpu(gpu::gpu("")?));
        }
        if method.is_on_cpu {
            return Ok(Self::Cpu);
        }
        match gpu::gpu("") {
            Ok(gpu) => Ok(Self::Gpu(gpu)),
            Err(Error::Device(reason)) => Err(Error::Device(format!(
                "{}, and {reason}",
                is_missing(method)
            ))),
            Err(other) => Err(other),
        }
    }

    fn named(name: &str, method: &methods::Description) -> Result<Self> {
        match name.to_lowercase().as_str() {
            "cpu" if method.is_on_cpu => Ok(Self::Cpu),
            "cpu" => Err(Error::Device(format!(
                "{}; take device='gpu', which needs a driver: {HOW_TO_INSTALL}",
                is_missing(method)
            ))),
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

fn is_missing(method: &methods::Description) -> String {
    format!(
        "method '{}' has no form on the CPU engine yet",
        method.schema.name
    )
}

/// Whether there is a GPU that gives a device; it is not asked again.
fn has_hardware() -> bool {
    static HAS_HARDWARE: OnceLock<bool> = OnceLock::new();
    *HAS_HARDWARE.get_or_init(|| gpu::has_hardware() && gpu::gpu("").is_ok())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::methods::Method;

    #[test]
    fn a_pass_of_both_engines_has_one_label() {
        for label in cpu::LABELS {
            assert!(gpu::passes::LABELS.contains(label), "{label}");
        }
    }

    #[test]
    fn what_the_cpu_engine_has_not_is_refused_in_words() {
        let choose = |method| Engine::choose(Some("cpu"), &Method::description(method).unwrap());
        assert!(matches!(choose("exact"), Ok(Engine::Cpu)));
        let Err(Error::Device(reason)) = choose("uniform") else {
            panic!("uniform has a form on the CPU engine: take another method");
        };
        assert!(reason.starts_with("method 'uniform' has no form on the CPU engine yet"));
        assert!(reason.ends_with(HOW_TO_INSTALL));
    }
}
