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

use super::prelude::*;
use crate::fits::lispsm::light_space_perspective;
use crate::fits::matrix_layers::fit_light_matrices;

parameters! {
    pub struct LightSpacePerspective {
        pub map: MapParameters,
        pub fitting: FitParameters,
    }
}

impl ShadowMethod for LightSpacePerspective {
    const NAME: &'static str = "lispsm";
    const TITLE: &'static str = "Light space perspective";
    const CITATION: &'static str = "Wimmer, M., Scherzer, D., and Purgathofer, W. 2004. Light space \
         perspective shadow maps. Eurographics Symposium on Rendering.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = self.fit(view, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl LightSpacePerspective {
    /// The layers; none where nothing faces the light.
    pub fn fit(&self, view: &mut dyn ReceiverQueries<'_>, size: MapSize) -> Result<Vec<Layer>> {
        let (camera, target) = (view.setting().camera, self.fitting.target(size));
        fit_light_matrices(view, target, |subject| {
            light_space_perspective(subject, camera, target.frame)
        })
    }
}
