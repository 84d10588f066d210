//! Spot shadow map: one perspective map along the axis of a spot light.
//!
//! A cone too wide for a plane is one paraboloid.
//!
//! Lance Williams. Casting curved shadows on curved surfaces. SIGGRAPH 1978.
//!
//! Parameters: those of every map, and `cut`: `receivers` or `cone`, and `snap`.
//!
//! Limits: texels are spread evenly over the plane, not over what the camera sees.

use super::method::ShadowMethod;
use super::parameters::{MapParameters, SNAP, cut_from};
use super::schema::{Choices, Groups, Parameters, Rule, word};
use crate::error::{Error, Result};
use crate::fits::boxes::Cut;
use crate::fits::layer::Layer;
use crate::fits::spot::fit_spot;
use crate::gpu::view::{Recorded, View};
use crate::light::Light;

#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    pub map: MapParameters,
    pub cut: Cut,
}

const CUTS: Choices<Cut> = &[("receivers", Cut::Receivers), ("cone", Cut::Whole)];

impl ShadowMethod for Spot {
    const NAME: &'static str = "spot";
    const TITLE: &'static str = "Spot shadow map";
    const CITATION: &'static str = "Williams, L. 1978. Casting curved shadows on curved surfaces. \
         SIGGRAPH.";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        &[word("cut", "receivers", Rule::Choice(&CUTS)), SNAP],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            cut: cut_from(parameters, CUTS),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let layers = fit(view, self.cut, self.map.resolution)?;
        view.shadows(self.map.settings(), layers)
    }
}

/// Of a spot light.
pub fn fit(view: &mut View, cut: Cut, resolution: u32) -> Result<Vec<Layer>> {
    let (Light::Spot { position, .. }, Some(cone)) = (view.light, view.light.cone()) else {
        return Err(Error::Value(format!(
            "method \"{}\" needs a spot light, got a {} light",
            Spot::NAME,
            view.light.kind()
        )));
    };
    fit_spot(view, *position, cone, cut, resolution)
}
