//! Light space perspective shadow map: texels narrow along the view as the pixels do.
//!
//! A perspective across the light, whose apex lies the optimal distance before what is seen.
//!
//! Michael Wimmer, Daniel Scherzer, Werner Purgathofer. Light space perspective shadow maps.
//! Eurographics Symposium on Rendering 2004.
//!
//! Parameters: those of every map, and `fit`, `sample_resolution`, `margin`.
//!
//! Limits: the more the light shines along the view the less there is to gain; along it the map is
//! the focused one.

use super::method::{ShadowMethod, default_method};
use super::parameters::{FitParameters, MapParameters};
use super::schema::{Groups, Parameters};
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::fits::lispsm::light_space_perspective;
use crate::fits::matrix_layers::fit_light_matrices;
use crate::gpu::view::{Recorded, View};

#[derive(Debug, Clone, PartialEq)]
pub struct LightSpacePerspective {
    pub map: MapParameters,
    pub fit: FitParameters,
}

impl ShadowMethod for LightSpacePerspective {
    const NAME: &'static str = "lispsm";
    const TITLE: &'static str = "Light space perspective";
    const CITATION: &'static str = "Wimmer, M., Scherzer, D., and Purgathofer, W. 2004. Light space \
         perspective shadow maps. Eurographics Symposium on Rendering.";

    const PARAMETERS: Groups = &[MapParameters::PARAMETERS, FitParameters::PARAMETERS];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            fit: FitParameters::from_parameters(parameters),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let layers = self.fit(view)?;
        view.shadows(self.map.settings(), layers)
    }
}

impl LightSpacePerspective {
    /// With the defaults of the other parameters.
    pub fn new(resolution: u32) -> Self {
        let map = MapParameters::new(resolution);
        Self {
            map,
            ..default_method()
        }
    }

    /// The layers; none where nothing faces the light.
    pub fn fit(&self, view: &mut View) -> Result<Vec<Layer>> {
        let (camera, size) = (view.camera, self.fit.size(self.map.resolution));
        let FitParameters {
            extent,
            sample_resolution,
            ..
        } = self.fit;
        fit_light_matrices(view, extent, sample_resolution, size, |subject| {
            light_space_perspective(subject, camera, size)
        })
    }
}
