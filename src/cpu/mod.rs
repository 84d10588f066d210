//! The CPU engine: tiles, lanes of SIMD, and all threads; no driver.

mod bins;
#[cfg(test)]
mod bounds;
mod caster_tests;
pub mod exact;
mod formulas;
mod frame;
pub mod lanes;
mod light_grid;
mod light_space;
mod processor;
mod queries;
pub mod rasterize;
mod receivers;
mod shadow_rays;
mod shapes;
mod tiles;
mod verbs;
mod view;

pub use frame::{Description, Frame, KeptParts, LABELS, Recorded, description};

#[cfg(test)]
mod tests;
