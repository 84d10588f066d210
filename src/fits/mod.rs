//! Fits: from receivers to the layers of a shadow map.

pub mod boxes;
pub mod central;
pub mod light_fits;
pub mod light_matrix;
pub mod matrix_layers;
pub mod parallel;
pub mod rotation;
pub mod snapping;
