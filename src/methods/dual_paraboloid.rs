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

use super::method::ShadowMethod;
use super::parameters::{MapParameters, SNAP, cut_from, position_of};
use super::schema::{Choices, Groups, Parameters, Rule, word};
use crate::error::Result;
use crate::fits::boxes::Cut;
use crate::fits::dual_paraboloid::fit_dual_paraboloid;
use crate::fits::layer::Layer;
use crate::gpu::view::{Recorded, View};

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
        let layers = fit(view, self.cut, self.map.resolution)?;
        view.shadows(self.map.settings(), layers)
    }
}

/// Of a light with a position, the only one that has halves.
pub fn fit(view: &mut View, cut: Cut, resolution: u32) -> Result<Vec<Layer>> {
    let position = position_of(view.light, DualParaboloid::NAME)?;
    fit_dual_paraboloid(view, position, cut, resolution)
}
