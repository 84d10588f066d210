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

use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, Value, View};
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

impl ShadowMethod for Cube {
    const NAME: &'static str = "cube";
    const TITLE: &'static str = "Cube shadow maps";
    const CITATION: &'static str = "Navrátil, J. Doctoral thesis, Brno University of Technology, \
         section 3.3.1.";

    fn defaults() -> Vec<(&'static str, Value)> {
        let mut defaults = MapParameters::defaults();
        defaults.push((Cut::NAME, Value::Text("receivers".to_string())));
        defaults.push((Cut::SNAP, Value::Bool(false)));
        defaults.push(("turned", Value::Bool(false)));
        defaults
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let map = MapParameters::from_parameters(parameters)?;
        let cut = Cut::take(
            parameters,
            &[("receivers", Cut::Receivers), ("face", Cut::Whole)],
        )?;
        let is_turned = parameters.take_flag("turned")?;
        Ok(Self {
            map,
            cut,
            is_turned,
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
