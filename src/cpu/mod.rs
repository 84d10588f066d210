//! The CPU engine: tiles, lanes of SIMD, and all threads; no driver.

mod bins;
mod blend_importance;
mod boundary;
#[cfg(test)]
mod bounds;
mod candidates;
mod caster_tests;
mod cells;
mod crowds;
mod depth_image;
pub mod exact;
mod extents;
mod filtered_texels;
mod finer_grids;
mod formulas;
mod forward_importance;
mod frame;
mod holes;
mod importance_map;
mod known;
pub mod lanes;
mod light_grid;
mod light_grids;
mod light_space;
mod linear_map;
mod lookup;
mod map;
mod pages;
pub mod points;
mod processor;
mod queries;
pub mod rasterize;
mod ray_bins;
mod rays;
mod receiver_tiles;
mod receivers;
mod row_boxes;
pub mod samples;
mod shadow_edge;
mod shadow_rays;
mod shadow_volumes;
mod shapes;
mod tessellate;
mod texels;
mod tile_rays;
mod tiles;
mod verbs;
mod view;
mod volume_faces;
mod warp_map;

pub use frame::{Description, Frame, KeptParts, LABELS, Recorded, description};

#[cfg(test)]
mod tests;
