//! What a fit may ask about the receivers. Engines answer; fits know no engine.

use super::layer::Layer;
use super::samples::SampledReceivers;
use crate::camera::Camera;
use crate::error::Result;
use crate::light::Light;
use crate::scene::Scene;
use glam::{DVec2, DVec3};

/// What is rendered.
#[derive(Debug, Clone, Copy)]
pub struct Setting<'a> {
    pub scene: &'a Scene,
    pub camera: &'a Camera,
    pub light: &'a Light,
}

/// Which points of the receivers an outline has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutlinePoints {
    /// The farthest ones of each tile of the image, in several directions.
    Extremes,
    /// Those of a regular grid of pixels.
    Samples,
}

/// Least and greatest corner.
pub type Corners = (DVec3, DVec3);

/// Questions about the receivers: the visible points that face the light. An answer may submit what was recorded so
/// far, and wait for it.
pub trait ReceiverQueries<'a> {
    fn setting(&self) -> Setting<'a>;

    /// The box around the receivers of each layer: (x, y) in texels from the projection's axis and depth in world
    /// units. `None` where a layer has no receivers.
    fn bounds(&mut self, layers: &[Layer]) -> Result<Vec<Option<Corners>>>;

    /// Points of the receivers of a layer, in texels from the projection's axis.
    fn outline(&mut self, layer: &Layer, points: OutlinePoints) -> Result<Vec<DVec2>>;

    /// Visible points of about `resolution` pixels along the longer side of the image, whether they are receivers or
    /// not.
    fn samples(&mut self, resolution: u32) -> Result<SampledReceivers>;

    /// Whether a layer without receivers is left out, or made for all that it could hold.
    fn leaves_out_empty_layers(&self) -> bool;

    /// Counts a layer that is left out.
    fn skip_layer(&mut self);
}
