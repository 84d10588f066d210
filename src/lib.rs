//! lixel renders hard shadows with research shadow-map methods on the GPU.
//!
//! Three storeys, each knowing nothing of the one above:
//!
//! * **maths** (`scene`, `camera`, `light`, `reference`): float64 on the CPU.
//! * **gpu** and **passes**, with `shaders/`: device, recording, timers; one pass is one file, one
//!   shader, one label and one timer key.
//! * **methods**: one method, one paper, one file.
//!
//! `python` is the door: the only file that names pyo3.

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
pub mod light;
pub mod methods;
pub mod projection;
mod python;
pub mod reference;
pub mod region;
pub mod render;
pub mod scene;
pub mod warp;
