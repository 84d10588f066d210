//! Dual-paraboloid shadow maps: two maps around a point light, back to back.
//!
//! Each holds the half of space that a paraboloid reflects; a light far away has one map of what it lights. Rasterization is exact, so that triangles need no
//! tessellation.
//!
//! Stefan Brabec, Thomas Annen, Hans-Peter Seidel. Shadow mapping for hemispherical and omnidirectional
//! light sources. Computer Graphics International, 2002; Navrátil's thesis, section 3.3.2.
//!
//! Parameters: those of every map, for each half, and `cut`: `hemisphere` or `receivers`, `splitting`: `light`
//! or `view`, which way the first half looks, and `snap`.
//!
//! Limits: the texels in the middle cover four times the solid angle of those at the rim.

use super::parameters::SPLITTINGS;
use super::prelude::*;
use crate::fits::boxes::layers_around;
use crate::fits::improved_paraboloid::{Splitting, split_halves};

const CUTS: Choices<Cut> = &[("hemisphere", Cut::Whole), ("receivers", Cut::Receivers)];

parameters! {
    pub struct DualParaboloid {
        pub map: MapParameters,
        pub cut: Cut = choice(CUTS, "hemisphere"),
        pub splitting: Splitting = choice(SPLITTINGS, "light"),
        pub snap: bool = SNAP,
    }
}

impl ShadowMethod for DualParaboloid {
    const NAME: &'static str = "dual_paraboloid";
    const TITLE: &'static str = "Dual-paraboloid shadow maps";
    const CITATION: &'static str = "Brabec, S., Annen, T., and Seidel, H.-P. 2002. Shadow \
         mapping for hemispherical and omnidirectional light sources. Computer Graphics International.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let cut = self.cut.snapped_where(self.snap);
        let layers = fit(view, cut, self.splitting, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

/// Of a light with a position, the only one that has halves.
pub fn fit(
    view: &mut dyn ReceiverQueries<'_>,
    cut: Cut,
    splitting: Splitting,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let setting = view.setting();
    position_of(setting.light, DualParaboloid::NAME)?;
    let halves = layers_around(setting, |position| split_halves(view, position, splitting))?;
    cut_layers(view, halves, cut, size)
}
