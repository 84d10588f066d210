//! The GPU engine: the device, the recording of a frame, and the passes.

pub mod acceleration;
pub mod adapters;
mod bind_groups;
pub mod device;
mod gathering;
pub mod kernel;
mod mask_tables;
pub mod passes;
mod pipeline_cache;
pub mod pool;
pub mod projection_uniform;
pub mod recording;
pub mod scene_tables;
pub mod shader_struct;
pub mod shaders;
mod tables;
#[cfg(test)]
mod translations;
mod uniforms;
pub mod unsure;
pub mod view;

pub use adapters::{AdapterDescription, adapters, has_hardware};
pub use device::{Gpu, gpu, opened};
pub use wgpu::Limits;
