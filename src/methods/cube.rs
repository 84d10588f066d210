//! Cube shadow maps: six perspective maps around a point light.
//!
//! A face that no receiver falls in is not made, and each of the others is fitted to its own receivers.
//!
//! Chris Brennan's and NVIDIA's cube shadow maps, as in Navrátil's thesis, section 3.3.1.
//!
//! Parameters: those of every map, for each face, and `cut`: `receivers` or `face`, `snap`, and `turned`:
//! whether the cube's axes lie across the scene's edges, not along the world's.
//!
//! Limits: up to six passes over the casters; texels at the corners of a face cover a fifth of the solid
//! angle of those in its middle.

use super::parameters::{SNAP, cut_from};
use super::schema::{Choices, Groups, Rule, flag, word};
use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, View};
use crate::error::Result;
use crate::fits::boxes::{Cut, cut_layers};
use crate::fits::central::turned_cube_faces;
use crate::fits::rotation::cube_off_edges;
use glam::DMat3;

#[derive(Debug, Clone, PartialEq)]
pub struct Cube {
    pub map: MapParameters,
    pub cut: Cut,
    /// Whether its axes lie across the scene's edges, not along the world's.
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
        let layers = fit_cube(view, axes, self.cut, self.map.resolution)?;
        view.shadows(&self.map, layers)
    }
}

/// The faces that receivers fall in, of a cube along `axes`. Submits what was recorded so far.
pub fn fit_cube(view: &mut View, axes: DMat3, cut: Cut, resolution: u32) -> Result<Vec<Fitted>> {
    let position = view.light_position(Cube::NAME)?;
    let faces = turned_cube_faces(position, axes, view.scene.bounds());
    cut_layers(view, faces, cut, resolution)
}
