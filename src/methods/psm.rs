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

use super::method::ShadowMethod;
use super::parameters::{FitParameters, MapParameters};
use super::schema::{Groups, Parameters};
use crate::error::Result;
use crate::fits::matrix_layers::fit_light_matrices;
use crate::fits::psm::perspective;
use crate::gpu::view::{Recorded, View};

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

    const PARAMETERS: Groups = &[MapParameters::PARAMETERS, FitParameters::PARAMETERS];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            fit: FitParameters::from_parameters(parameters),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let (camera, size) = (view.camera, self.fit.size(self.map.resolution));
        let (extent, samples) = (self.fit.extent, self.fit.sample_resolution);
        let layers = fit_light_matrices(view, extent, samples, size, |subject| {
            perspective(subject, camera, size)
        })?;
        view.shadows(self.map.settings(), layers)
    }
}
