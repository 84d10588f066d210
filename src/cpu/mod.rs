//! The CPU engine: tiles, lanes of SIMD, and all threads; no driver.

mod bins;
#[cfg(test)]
mod bounds;
mod caster_tests;
pub mod exact;
mod frame;
pub mod lanes;
mod light_grid;
mod processor;
pub mod rasterize;
mod receivers;
mod shadow_rays;
mod shapes;
mod tiles;
mod view;

pub use frame::{Description, Frame, KeptParts, LABELS, description};
pub use view::View;

#[cfg(test)]
mod tests;
