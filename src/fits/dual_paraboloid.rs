//! Dual paraboloids: the halves of space around a point that receivers fall in.

use super::boxes::{Cut, cut_layers};
use super::central::hemispheres;
use super::layer::Layer;
use super::receivers::{ReceiverQueries, Setting};
use crate::error::Result;
use glam::DVec3;

pub fn fit_dual_paraboloid(
    receivers: &mut dyn ReceiverQueries<'_>,
    position: DVec3,
    cut: Cut,
    resolution: u32,
) -> Result<Vec<Layer>> {
    let halves = halves_of_light(receivers.setting(), position);
    cut_layers(receivers, halves, cut, resolution)
}

/// The halves of space around a light's position; the first one looks along the light's axis, or down where it has
/// none.
pub fn halves_of_light(setting: Setting, position: DVec3) -> Vec<Layer> {
    let axis = setting.light.cone().map_or(DVec3::NEG_Y, |cone| cone.axis);
    hemispheres(position, axis, setting.scene.bounds())
}
