//! Uniform maps: over the whole scene, whatever the camera sees.

use super::boxes::{layers_of_light, widest_place};
use super::central::fit_square;
use super::layer::Layer;
use super::parallel::fit_box;
use super::receivers::Setting;
use crate::geometry::bounds_of;
use crate::projection::Projection;
use crate::rounding::BOX_ROUNDING;
use glam::DVec3;
use rayon::prelude::*;

/// One map over the box of the casters for parallel rays and for a light far away, one over a cone, six faces of a cube
/// around a point.
pub fn fit_scene(setting: Setting, resolution: u32) -> Vec<Layer> {
    if setting.near_position().is_none() {
        let map = fit_uniform(setting, resolution);
        return vec![Layer::everywhere(map)];
    }
    let whole = |Layer { projection, region }| {
        let widest = 1.001 * widest_place(setting, &projection, &region);
        let projection = fit_square(&projection, widest, projection.far, resolution);
        Layer { projection, region }
    };
    layers_of_light(setting).into_iter().map(whole).collect()
}

/// The map over the box of the casters: also what effective resolutions are measured by.
pub fn fit_uniform(setting: Setting, resolution: u32) -> Projection {
    let (low, high) = setting.scene.bounds();
    let axes = setting.axes_of_scene();
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
    fit_box(&axes, (low, high), low.z, resolution)
}
