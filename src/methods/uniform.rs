//! Uniform shadow map: one map over the box of the casters.
//!
//! The texels are spread evenly over the whole scene, whatever the camera sees of it; around a point over
//! the six faces of a cube, within a cone over the cone.
//!
//! Lance Williams. Casting curved shadows on curved surfaces. SIGGRAPH 1978.
//!
//! Parameters: those of every map.
//!
//! Limits: a large scene leaves few texels to what is in view.

use super::schema::Groups;
use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, View};
use crate::error::Result;
use crate::fits::central::{cone_layer, cube_faces, fit_square};
use crate::fits::parallel::{axes_at, bounds_of, fit_box};
use crate::fits::rotation::parallel_off_edges;
use crate::gpu::passes::receivers;
use crate::projection::Projection;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;

#[derive(Debug, Clone, PartialEq)]
pub struct Uniform {
    pub map: MapParameters,
}

impl ShadowMethod for Uniform {
    const NAME: &'static str = "uniform";
    const TITLE: &'static str = "Uniform";
    const CITATION: &'static str =
        "Williams, L. 1978. Casting curved shadows on curved surfaces. SIGGRAPH.";

    const PARAMETERS: Groups = &[MapParameters::PARAMETERS];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        let map = MapParameters::from_parameters(parameters);
        Ok(Self { map })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let resolution = self.map.resolution;
        let (scene, light) = (view.scene, view.light);
        let layers = match (light.position(), light.cone()) {
            (None, _) => {
                let direction = -light.vector_from_point(view.camera.eye);
                let projection = fit_uniform(scene, view.camera.eye, direction, resolution);
                vec![Fitted::everywhere(projection)]
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
        };
        view.skip(receivers::LABEL);

        view.shadows(&self.map, layers)
    }
}

/// The layer with its whole plane in the map.
fn whole(layer: Fitted, widest: f64, resolution: u32) -> Fitted {
    let axes = &layer.projection;
    Fitted {
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
