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

use super::parameters::FitParameters;
use super::schema::Groups;
use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, View, default_method};
use crate::error::Result;
use crate::fits::light_fits::light_space_perspective;
use crate::fits::matrix_layers::fitted_layers;

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
        view.shadows(&self.map, layers)
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

    /// The layers; none where nothing faces the light. Submits what was recorded so far.
    pub fn fit(&self, view: &mut View) -> Result<Vec<Fitted>> {
        let camera = view.camera;
        fitted_layers(view, self.map.resolution, self.fit, |subject, size| {
            light_space_perspective(subject, camera, size)
        })
    }
}
