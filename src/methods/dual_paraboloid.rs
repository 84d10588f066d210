//! Dual-paraboloid shadow maps: two maps around a point light, back to back.
//!
//! Each holds the half of space that a paraboloid reflects. Rasterization is exact, so that triangles need no
//! tessellation.
//!
//! Stefan Brabec, Thomas Annen, Hans-Peter Seidel. Shadow mapping for hemispherical and omnidirectional
//! light sources. Computer Graphics International, 2002; Navrátil's thesis, section 3.3.2.
//!
//! Parameters: those of every map, for each half, and `cut`: `hemisphere` or `receivers`, and `snap`.
//!
//! Limits: the texels in the middle cover four times the solid angle of those at the rim.

use super::parameters::{SNAP, cut_from};
use super::schema::{Choices, Groups, Rule, word};
use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, View};
use crate::error::Result;
use crate::fits::boxes::{Cut, cut_layers};
use crate::fits::central::hemispheres;
use glam::DVec3;

#[derive(Debug, Clone, PartialEq)]
pub struct DualParaboloid {
    pub map: MapParameters,
    pub cut: Cut,
}

const CUTS: Choices<Cut> = &[("hemisphere", Cut::Whole), ("receivers", Cut::Receivers)];

impl ShadowMethod for DualParaboloid {
    const NAME: &'static str = "dual_paraboloid";
    const TITLE: &'static str = "Dual-paraboloid shadow maps";
    const CITATION: &'static str = "Brabec, S., Annen, T., and Seidel, H.-P. 2002. Shadow \
         mapping for hemispherical and omnidirectional light sources. Computer Graphics International.";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        &[word("cut", "hemisphere", Rule::Choice(&CUTS)), SNAP],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            cut: cut_from(parameters, CUTS),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let layers = fit_dual_paraboloid(view, self.cut, self.map.resolution)?;
        view.shadows(&self.map, layers)
    }
}

/// The halves that receivers fall in; the first one looks along the light's axis, or down where it has none.
/// Submits what was recorded so far.
pub fn fit_dual_paraboloid(view: &mut View, cut: Cut, resolution: u32) -> Result<Vec<Fitted>> {
    let position = view.light_position(DualParaboloid::NAME)?;
    let halves = halves_of_light(view, position);
    cut_layers(view, halves, cut, resolution)
}

/// The halves of space around a light's position, along its axis.
pub fn halves_of_light(view: &View, position: DVec3) -> Vec<Fitted> {
    let axis = view.light.cone().map_or(DVec3::NEG_Y, |cone| cone.axis);
    hemispheres(position, axis, view.scene.bounds())
}
