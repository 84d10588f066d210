//! Uniform maps: over the whole scene, whatever the camera sees.

use super::boxes::{layers_of_light, widest_place};
use super::central::fit_square;
use super::layer::Layer;
use super::parallel::{axes_at, fit_box};
use super::receivers::Setting;
use super::rotation::parallel_off_edges;
use crate::geometry::bounds_of;
use crate::projection::Projection;
use crate::rounding::BOX_ROUNDING;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

/// One map over the box of the casters for parallel rays, one over a cone, six faces of a cube around a point.
pub fn fit_scene(setting: Setting, resolution: u32) -> Vec<Layer> {
    let Setting {
        scene,
        camera,
        light,
    } = setting;
    if light.position().is_none() {
        let direction = -light.vector_from_point(camera.eye);
        let map = fit_uniform(scene, camera.eye, direction, resolution);
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
pub fn fit_uniform(scene: &Scene, eye: DVec3, direction: DVec3, resolution: u32) -> Projection {
    let (low, high) = scene.bounds();
    let axes = parallel_off_edges(scene, axes_at(0.5 * low + 0.5 * high, direction));
    let vertices = scene.vertices();
    let projected = |&i: &u32| axes.projected_from_point(vertices[i as usize]);
    let chunks = scene.triangles().par_chunks(4096);
    let boxes = chunks.map(|chunk| bounds_of(chunk.as_flattened().iter().map(projected)));
    let bounds = boxes.reduce(
        || (DVec3::INFINITY, DVec3::NEG_INFINITY),
        |a, b| (a.0.min(b.0), a.1.max(b.1)),
    );
    let rounding = BOX_ROUNDING * ((high - low).length() + (eye - axes.origin).length());
    let (low, high) = (bounds.0 - rounding, bounds.1 + rounding);
    fit_box(&axes, (low, high), low.z, resolution)
}
