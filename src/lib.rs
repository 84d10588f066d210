//! lixel renders hard shadows with research shadow-map methods on the GPU.
//!
//! Storeys, each knowing nothing of the ones below it in this list:
//!
//! * the world (`scene`, `camera`, `light`, `reference` and geometry): validated input in float64, and the
//!   ray-cast reference.
//! * `projection` and `warp`: maps between the world and the texels of a shadow map.
//! * `fits`: from receivers to the layers of a shadow map.
//! * `gpu` with its `passes`, and `shaders/`: one pass is one file, one label and one key of `timings`.
//! * `methods`: one method, one paper, one file.
//! * `python`: the only file that names pyo3.

pub mod aliasing;
pub mod bvh;
pub mod camera;
pub mod edge_directions;
pub mod edges;
pub mod error;
pub mod fits;
pub mod frustum;
pub mod geometry;
pub mod gpu;
pub mod lanes;
pub mod light;
pub mod methods;
pub mod projection;
mod python;
pub mod reference;
pub mod region;
pub mod render;
pub mod rounding;
pub mod scene;
#[cfg(test)]
mod twin;
pub mod warp;
