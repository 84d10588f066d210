//! Fits: from receivers to the layers of a shadow map, in float64. A fit knows no method and no engine: it asks about
//! the receivers through [`receivers::ReceiverQueries`], and takes numbers.

pub mod boxes;
pub mod cascades;
pub mod central;
#[cfg(test)]
mod fixtures;
pub mod given;
pub mod hull;
pub mod improved_paraboloid;
pub mod layer;
pub mod light_matrix;
pub mod light_rays;
pub mod lispsm;
pub mod log_perspective;
pub mod matrix_layers;
pub mod optimizer;
pub mod pages;
pub mod parallel;
pub mod plane_optimal;
pub mod psm;
pub mod receivers;
pub mod rotation;
pub mod samples;
pub mod scene_optimized;
pub mod snapping;
pub mod source;
pub mod subject;
pub mod trapezoid;
pub mod uniform;
pub mod view_across;
