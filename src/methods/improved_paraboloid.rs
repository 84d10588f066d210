//! Improved paraboloid shadow maps: a paraboloid that looks at what the camera sees, and is cut to it.
//!
//! The view frustum is truncated to the depths of the receivers. A cone from the light holds its eight corners;
//! the paraboloid is turned along the cone's axis and zoomed to its angle, so that one map does where dual
//! paraboloids need two.
//!
//! Juraj Vanek, Jan Navrátil, Adam Herout, Pavel Zemčík. High-quality shadows with improved paraboloid
//! mapping. ISVC 2011, sections 3.1-3.3, Eq. 1-2. The text's maximum of dot products in Eq. 2 is meant as
//! the largest angle. Rasterization is exact here, with no tessellation.
//!
//! Parameters: those of every map, and `cut`: `frustum`, the paper's; `cone`, the smallest square around the axis
//! of the smallest cone of the receivers themselves; `receivers`, their box in the paraboloid whose axis gives
//! them the finest texels, rotated off the scene's edges. The last two go past the paper, and cut also where
//! the light is inside the frustum, its future work.
//!
//! Where two are needed, `splitting` says which way the first looks: `light` or `view`.
//!
//! Limits: with the light inside the truncated frustum, or so near that a hemisphere does not hold the cone,
//! `frustum` falls back to dual paraboloids. `cone`, and `receivers` with the light in the view, do so only
//! where a hemisphere does not hold the receivers, each half cut to its own. The axis that gives the finest
//! texels is one of two hundred, and jumps as the camera moves.

use super::parameters::SPLITTINGS;
use super::prelude::*;
use crate::fits::improved_paraboloid::{Splitting, Zoom, fit_improved_paraboloid};

const ZOOMS: Choices<Zoom> = &[
    ("frustum", Zoom::Frustum),
    ("cone", Zoom::Cone),
    ("receivers", Zoom::Receivers),
];

parameters! {
    pub struct ImprovedParaboloid {
        pub map: MapParameters,
        pub cut: Zoom = choice(ZOOMS, "receivers"),
        pub splitting: Splitting = choice(SPLITTINGS, "light"),
    }
}

impl ShadowMethod for ImprovedParaboloid {
    const NAME: &'static str = "improved_paraboloid";
    const TITLE: &'static str = "Improved paraboloid shadow maps";
    const CITATION: &'static str = "Vanek, J., Navrátil, J., Herout, A., and Zemčík, P. 2011. \
         High-quality shadows with improved paraboloid mapping. ISVC.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = fit_improved_paraboloid(view, self.cut, self.splitting, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}
