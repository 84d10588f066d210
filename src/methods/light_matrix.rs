//! Light matrices that somebody gives, one for each layer of the map.
//!
//! Parameters: those of every map, and `matrix`, `regions`.
//!
//! Limits: a receiver beside all maps is lit.

use super::prelude::*;
use crate::fits::given::{GivenLayers, fit_given};
use glam::{DMat4, DVec4};
use std::sync::Arc;

parameters! {
    pub struct LightMatrix {
        pub map: MapParameters,
        pub matrix: Arc<[DMat4]> = optional(Rule::Matrices),
        pub regions: Option<Arc<[Vec<DVec4>]>> = optional(Rule::Regions),
    }
}

impl ShadowMethod for LightMatrix {
    const NAME: &'static str = "light_matrix";
    const TITLE: &'static str = "Light matrix that is given";
    const CITATION: &'static str = "";
    const IS_GIVEN: bool = true;

    fn check(&self) -> Result<()> {
        let (layers, regions) = (self.matrix.len(), self.regions.as_ref());
        let given = regions.map_or(layers, |regions| regions.len());
        ensure_value!(
            given == layers,
            "regions must be as many as matrices, {layers}, got {given}"
        );
        Ok(())
    }

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = fit_given(view, &self.layers(), self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl LightMatrix {
    pub fn layers(&self) -> GivenLayers {
        GivenLayers {
            matrices: self.matrix.clone(),
            regions: self.regions.clone(),
        }
    }
}
