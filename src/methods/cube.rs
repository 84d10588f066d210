//! Cube shadow maps: six perspective maps around a point light.
//!
//! A face that no receiver falls in is not made, and each of the others is fitted to its own receivers. Of a light far
//! away one face would hold all, and one map that looks at the scene does.
//!
//! Chris Brennan's and NVIDIA's cube shadow maps, as in Navrátil's thesis, section 3.3.1.
//!
//! Parameters: those of every map, for each face, and `cut`: `receivers` or `face`, `snap`, and `turned`:
//! whether the cube is rotated off the scene's edges, or its axes are the world's.
//!
//! Limits: up to six passes over the casters; texels at the corners of a face cover a fifth of the solid
//! angle of those in its middle.

use super::prelude::*;
use crate::fits::boxes::layers_around;
use crate::fits::central::turned_cube_faces;
use crate::fits::rotation::cube_off_edges;
use glam::DMat3;

const CUTS: Choices<Cut> = &[("receivers", Cut::Receivers), ("face", Cut::Whole)];

parameters! {
    pub struct Cube {
        pub map: MapParameters,
        pub cut: Cut = choice(CUTS, "receivers"),
        pub snap: bool = SNAP,
        /// Whether it is rotated off the scene's edges; else its axes are the world's.
        pub turned: bool = flag(false),
    }
}

impl ShadowMethod for Cube {
    const NAME: &'static str = "cube";
    const TITLE: &'static str = "Cube shadow maps";
    const CITATION: &'static str = "Navrátil, J. Doctoral thesis, Brno University of Technology, \
         section 3.3.1.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let axes = match self.turned {
            true => cube_off_edges(view.setting().scene),
            false => DMat3::IDENTITY,
        };
        let cut = self.cut.snapped_where(self.snap);
        let layers = fit(view, axes, cut, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

/// Of a light with a position, the only one that has a cube.
pub fn fit(
    view: &mut dyn ReceiverQueries<'_>,
    axes: DMat3,
    cut: Cut,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let setting = view.setting();
    position_of(setting.light, Cube::NAME)?;
    let faces = layers_around(setting, |position| {
        let scene = setting.scene.bounds();
        Ok(turned_cube_faces(position, axes, scene))
    })?;
    cut_layers(view, faces, cut, size)
}
