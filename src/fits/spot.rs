//! Spot maps: one map along the axis of a cone of light.

use super::boxes::{Cut, cut_layers};
use super::central::cone_layer;
use super::layer::Layer;
use super::receivers::ReceiverQueries;
use crate::error::Result;
use crate::light::Cone;
use glam::DVec3;

pub fn fit_spot(
    receivers: &mut dyn ReceiverQueries<'_>,
    position: DVec3,
    cone: Cone,
    cut: Cut,
    resolution: u32,
) -> Result<Vec<Layer>> {
    let layer = cone_layer(position, cone, receivers.setting().scene.bounds());
    cut_layers(receivers, vec![layer], cut, resolution)
}
