//! Uniform maps: over the whole scene, whatever the camera sees.

use super::boxes::{Cut, cut_layers, rotated_layers, widest_place};
use super::central::fit_square;
use super::layer::Layer;
use super::parallel::fit_box;
use super::receivers::{ReceiverQueries, Setting};
use super::rotation::{Rotation, laid_lengthwise, rotated};
use crate::error::Result;
use crate::geometry::bounds_of;
use crate::map_size::MapSize;
use crate::projection::Projection;
use crate::rounding::BOX_ROUNDING;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// One map over the box of the casters for parallel rays and for a light far away, one over a cone, six faces of a cube
/// around a point.
pub fn fit_scene(setting: Setting, rotation: Rotation, size: MapSize) -> Vec<Layer> {
    if setting.near_position().is_none() {
        let map = fit_casters(setting, &setting.axes_of_scene(rotation), size);
        return vec![Layer::everywhere(map)];
    }
    let whole = |Layer { projection, region }| {
        let widest = 1.001 * widest_place(setting, &projection, &region);
        let projection = fit_square(&projection, widest, projection.far, size);
        Layer { projection, region }
    };
    let layers = rotated_layers(setting, rotation).into_iter();
    layers.map(whole).collect()
}

/// The same, without the faces of a cube that no receiver falls in: what a warp is laid over.
pub fn fit_scene_of_receivers(
    receivers: &mut dyn ReceiverQueries<'_>,
    rotation: Rotation,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    match setting.near_position() {
        None => Ok(fit_scene(setting, rotation, size)),
        Some(_) => {
            let layers = rotated_layers(setting, rotation);
            cut_layers(receivers, layers, Cut::Whole, size)
        }
    }
}

/// One texel over the box of the casters along the rows and columns of another map: what effective resolutions are
/// measured by.
pub fn uniform_along(setting: Setting, map: &Projection) -> Projection {
    let axes = setting.axes_of_scene(Rotation::By(0.0));
    let along = DVec2::new(axes.x_axis.dot(map.x_axis), axes.y_axis.dot(map.x_axis));
    let axes = along
        .try_normalize()
        .map_or(axes.clone(), |along| rotated(&axes, along));
    fit_casters(setting, &axes, MapSize::square(1))
}

/// The map over the box of the casters, with those axes, or turned by a quarter where the box lies across the map.
fn fit_casters(setting: Setting, axes: &Projection, size: MapSize) -> Projection {
    let (low, high) = setting.scene.bounds();
    let vertices = setting.scene.vertices();
    let projected = |&i: &u32| axes.texel_from_point(vertices[i as usize]);
    let chunks = setting.scene.triangles().par_chunks(4096);
    let boxes = chunks.map(|chunk| bounds_of(chunk.as_flattened().iter().map(projected)));
    let bounds = boxes.reduce(
        || (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |a, b| (a.0.min(b.0), a.1.max(b.1)),
    );
    let rounding =
        BOX_ROUNDING * ((high - low).length() + (setting.camera.eye - axes.origin).length());
    let (low, high) = (bounds.0 - rounding, bounds.1 + rounding);
    let sides = (high - low).truncate();
    let (axes, corners) = laid_lengthwise(axes, (low, high), sides, size);
    fit_box(&axes, corners, low.z, size)
}
