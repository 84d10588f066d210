//! Cube maps: the faces of a cube around a point that receivers fall in.

use super::boxes::{Cut, cut_layers};
use super::central::turned_cube_faces;
use super::layer::Layer;
use super::receivers::ReceiverQueries;
use crate::error::Result;
use glam::{DMat3, DVec3};

/// The axes of the cube are the columns of `axes`.
pub fn fit_cube(
    receivers: &mut dyn ReceiverQueries<'_>,
    position: DVec3,
    axes: DMat3,
    cut: Cut,
    resolution: u32,
) -> Result<Vec<Layer>> {
    let faces = turned_cube_faces(position, axes, receivers.setting().scene.bounds());
    cut_layers(receivers, faces, cut, resolution)
}
