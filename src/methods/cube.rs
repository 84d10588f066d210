//! Cube shadow maps: six perspective maps around a point light.
//!
//! A face that no receiver falls in is not made, and each of the others is fitted to its own receivers.
//!
//! Chris Brennan's and NVIDIA's cube shadow maps, as in Navrátil's thesis, section 3.3.1.
//!
//! Parameters: those of every map, for each face, and `cut`: `receivers` or `face`, `snap`, and `turned`:
//! whether the cube is rotated off the scene's edges, or its axes are the world's.
//!
//! Limits: up to six passes over the casters; texels at the corners of a face cover a fifth of the solid
//! angle of those in its middle.

use super::method::ShadowMethod;
use super::parameters::{MapParameters, SNAP, cut_from, position_of};
use super::schema::{Choices, Groups, Parameters, Rule, flag, word};
use crate::error::Result;
use crate::fits::boxes::Cut;
use crate::fits::cube::fit_cube;
use crate::fits::layer::Layer;
use crate::fits::rotation::cube_off_edges;
use crate::gpu::view::{Recorded, View};
use glam::DMat3;

#[derive(Debug, Clone, PartialEq)]
pub struct Cube {
    pub map: MapParameters,
    pub cut: Cut,
    /// Whether it is rotated off the scene's edges; else its axes are the world's.
    pub is_turned: bool,
}

const CUTS: Choices<Cut> = &[("receivers", Cut::Receivers), ("face", Cut::Whole)];

impl ShadowMethod for Cube {
    const NAME: &'static str = "cube";
    const TITLE: &'static str = "Cube shadow maps";
    const CITATION: &'static str = "Navrátil, J. Doctoral thesis, Brno University of Technology, \
         section 3.3.1.";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        &[
            word("cut", "receivers", Rule::Choice(&CUTS)),
            SNAP,
            flag("turned", false),
        ],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            cut: cut_from(parameters, CUTS),
            is_turned: parameters.get("turned"),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let axes = if self.is_turned {
            cube_off_edges(view.scene)
        } else {
            DMat3::IDENTITY
        };
        let layers = fit(view, axes, self.cut, self.map.resolution)?;
        view.shadows(self.map.settings(), layers)
    }
}

/// Of a light with a position, the only one that has a cube.
pub fn fit(view: &mut View, axes: DMat3, cut: Cut, resolution: u32) -> Result<Vec<Layer>> {
    let position = position_of(view.light, Cube::NAME)?;
    fit_cube(view, position, axes, cut, resolution)
}
