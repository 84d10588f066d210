//! lixel renders hard shadows with research shadow-map methods, on the GPU or on the CPU alone.
//!
//! Storeys, each knowing nothing of the ones below it in this list:
//!
//! * the world (`scene`, `camera`, `light`, `reference` and geometry): validated input in float64, and the
//!   ray-cast reference.
//! * `projection` and `warp`: maps between the world and the texels of a shadow map.
//! * `fits`: from receivers to the layers of a shadow map.
//! * engines: `gpu` with its `passes`, and `shaders/`: one pass is one file, one label and one key of `timings`;
//!   `cpu`, which needs no driver. Neither knows the other.
//! * `methods`: one method, one paper, one file.
//! * `python`: the only file that names pyo3.

// What only tests call is public: formulas that shaders compute, for every scalar.
mod aliasing;
pub mod bias;
mod bvh;
mod camera;
pub mod cpu;
mod edge_directions;
mod edges;
mod engine;
mod error;
mod fits;
mod frustum;
mod geometry;
mod gpu;
mod importance;
mod instructions;
mod lanes;
mod light;
mod lock;
mod map_settings;
pub mod map_size;
mod masks;
mod methods;
mod moments;
mod neighbourhood;
mod occlusion;
mod paging;
pub mod projection;
mod python;
mod reference;
mod region;
mod render;
mod rounding;
mod scene;
#[cfg(test)]
mod shadow_ray;
mod sides;
mod stats;
mod threads;
#[cfg(test)]
mod twin;
mod verbs;
pub mod warp;
