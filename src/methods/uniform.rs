//! Uniform shadow map: one map over the box of the casters.
//!
//! The texels are spread evenly over the whole scene, whatever the camera sees of it.
//!
//! Lance Williams. Casting curved shadows on curved surfaces. SIGGRAPH 1978.
//!
//! Parameters: those of every map.
//!
//! Limits: a large scene leaves few texels to what is in view.

use super::parallel_fit::{axes_at, bounds_of, fit_box};
use super::{MapParameters, Parameters, Recorded, ShadowMethod, Value, View};
use crate::error::Result;
use crate::light::Light;
use crate::passes::receivers;
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

    fn defaults() -> Vec<(&'static str, Value)> {
        MapParameters::defaults()
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let map = MapParameters::from_parameters(parameters)?;
        Ok(Self { map })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let Light::Directional { direction } = *view.light;
        let projection = fit_uniform(view.scene, view.camera.eye, direction, self.map.resolution);
        view.skip(receivers::LABEL);

        view.shadows(&self.map, projection, None, None)
    }
}

/// The map over the box of the casters: also what effective resolutions are measured by.
pub fn fit_uniform(scene: &Scene, eye: DVec3, direction: DVec3, resolution: u32) -> Projection {
    let (low, high) = scene.bounds();
    let axes = axes_at(0.5 * low + 0.5 * high, direction);
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
    fit_box(&axes, bounds, bounds.0.z, resolution, rounding)
}
