//! Perspective shadow map: the light looks at the scene after the camera's perspective.
//!
//! Near things are large there, so they get more texels.
//!
//! Marc Stamminger, George Drettakis. Perspective shadow maps. SIGGRAPH 2002.
//!
//! Parameters: those of every map, and `fit`, `sample_resolution`, `margin`.
//!
//! Limits: a light that shines along the view sees the transformed scene at a grazing angle; the
//! virtual camera then steps back, and what is left of the perspective may be less than enough.

use super::{MapParameters, Parameters, Recorded, ShadowMethod, Value, View};
use crate::error::Result;
use crate::fits::light_fits::perspective;
use crate::fits::matrix_layers::{FitParameters, fitted_layers};

#[derive(Debug, Clone, PartialEq)]
pub struct Perspective {
    pub map: MapParameters,
    pub fit: FitParameters,
}

impl ShadowMethod for Perspective {
    const NAME: &'static str = "psm";
    const TITLE: &'static str = "Perspective shadow map";
    const CITATION: &'static str = "Stamminger, M., and Drettakis, G. 2002. Perspective shadow maps. \
         SIGGRAPH.";

    fn defaults() -> Vec<(&'static str, Value)> {
        let mut defaults = MapParameters::defaults();
        defaults.extend(FitParameters::defaults());
        defaults
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters)?,
            fit: FitParameters::from_parameters(parameters)?,
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let camera = view.camera;
        let layers = fitted_layers(view, self.map.resolution, self.fit, |subject, size| {
            perspective(subject, camera, size)
        })?;
        view.shadows(&self.map, layers)
    }
}
