//! Uniform maps: over the whole scene, whatever the camera sees.

use super::central::{cone_layer, cube_faces, fit_square};
use super::layer::Layer;
use super::parallel::{axes_at, bounds_of, fit_box};
use super::receivers::Setting;
use super::rotation::parallel_off_edges;
use crate::projection::Projection;
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
    match (light.position(), light.cone()) {
        (None, _) => {
            let direction = -light.vector_from_point(camera.eye);
            let projection = fit_uniform(scene, camera.eye, direction, resolution);
            vec![Layer::everywhere(projection)]
        }
        (Some(position), Some(cone)) => {
            let layer = cone_layer(position, cone, scene.bounds());
            let radius = layer.projection.kind.plane_radius(cone.cosine.acos());
            vec![whole(layer, 1.001 * radius, resolution)]
        }
        (Some(position), None) => {
            let faces = cube_faces(position, scene.bounds()).into_iter();
            faces.map(|face| whole(face, 1.001, resolution)).collect()
        }
    }
}

/// The layer with its whole plane in the map.
fn whole(layer: Layer, widest: f64, resolution: u32) -> Layer {
    let axes = &layer.projection;
    Layer {
        projection: fit_square(axes, widest, axes.far, resolution),
        region: layer.region,
    }
}

/// The map over the box of the casters: also what effective resolutions are measured by.
pub fn fit_uniform(scene: &Scene, eye: DVec3, direction: DVec3, resolution: u32) -> Projection {
    let (low, high) = scene.bounds();
    let axes = parallel_off_edges(scene, axes_at(0.5 * low + 0.5 * high, direction));
    let vertices = scene.vertices();
    let bounds = scene
        .triangles()
        .par_chunks(4096)
        .map(|triangles| {
            bounds_of(
                triangles
                    .iter()
                    .flatten()
                    .map(|&i| axes.projected_from_point(vertices[i as usize])),
            )
        })
        .reduce(
            || (DVec3::INFINITY, DVec3::NEG_INFINITY),
            |a, b| (a.0.min(b.0), a.1.max(b.1)),
        );
    let rounding = f64::from(f32::EPSILON) * ((high - low).length() + (eye - axes.origin).length());
    let (low, high) = (bounds.0 - rounding, bounds.1 + rounding);
    fit_box(&axes, (low, high), low.z, resolution)
}
