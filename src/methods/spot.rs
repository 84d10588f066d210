//! Spot shadow map: one perspective map along the axis of a spot light.
//!
//! A cone too wide for a plane is one paraboloid.
//!
//! Lance Williams. Casting curved shadows on curved surfaces. SIGGRAPH 1978.
//!
//! Parameters: those of every map, and `cut`: `receivers` or `cone`, and `snap`.
//!
//! Limits: texels are spread evenly over the plane, not over what the camera sees.

use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, Value, View};
use crate::error::{Error, Result};
use crate::fits::boxes::{Cut, cut_layers};
use crate::fits::central::cone_layer;
use crate::light::Light;

#[derive(Debug, Clone, PartialEq)]
pub struct Spot {
    pub map: MapParameters,
    pub cut: Cut,
}

impl ShadowMethod for Spot {
    const NAME: &'static str = "spot";
    const TITLE: &'static str = "Spot shadow map";
    const CITATION: &'static str = "Williams, L. 1978. Casting curved shadows on curved surfaces. \
         SIGGRAPH.";

    fn defaults() -> Vec<(&'static str, Value)> {
        let mut defaults = MapParameters::defaults();
        defaults.push((Cut::NAME, Value::Text("receivers".to_string())));
        defaults.push((Cut::SNAP, Value::Bool(false)));
        defaults
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let map = MapParameters::from_parameters(parameters)?;
        let cut = Cut::take(
            parameters,
            &[("receivers", Cut::Receivers), ("cone", Cut::Whole)],
        )?;
        Ok(Self { map, cut })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let layers = fit_spot(view, self.cut, self.map.resolution)?;
        view.shadows(&self.map, layers)
    }
}

/// The map along the light's axis. Submits what was recorded so far.
pub fn fit_spot(view: &mut View, cut: Cut, resolution: u32) -> Result<Vec<Fitted>> {
    let (Light::Spot { position, .. }, Some(cone)) = (view.light, view.light.cone()) else {
        return Err(Error::Value(format!(
            "method \"{}\" needs a spot light, got a {} light",
            Spot::NAME,
            view.light.kind()
        )));
    };
    let layer = cone_layer(*position, cone, view.scene.bounds());
    cut_layers(view, vec![layer], cut, resolution)
}
