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

use super::prelude::*;
use crate::fits::matrix_layers::fit_light_matrices;
use crate::fits::psm::perspective;

parameters! {
    pub struct Perspective {
        pub map: MapParameters,
        pub fitting: FitParameters,
    }
}

impl ShadowMethod for Perspective {
    const NAME: &'static str = "psm";
    const TITLE: &'static str = "Perspective shadow map";
    const CITATION: &'static str = "Stamminger, M., and Drettakis, G. 2002. Perspective shadow maps. \
         SIGGRAPH.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = self.fit(view, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl Perspective {
    /// The layers; none where nothing faces the light.
    pub fn fit(&self, view: &mut dyn ReceiverQueries<'_>, size: MapSize) -> Result<Vec<Layer>> {
        let (camera, target) = (view.setting().camera, self.fitting.target(size));
        fit_light_matrices(view, target, |subject| {
            perspective(subject, camera, target.frame)
        })
    }
}
