//! Minimal shadow frustum: one map over the smallest rectangle that holds the receivers.
//!
//! As the desired view, and turned around the light's direction: the convex hull of the receivers, its
//! smallest rectangle by rotating calipers, then the box in the rectangle's axes.
//!
//! M. Stamminger, G. Drettakis. Perspective shadow maps. SIGGRAPH 2002, and its extension by rotating
//! calipers: T. Milet, J. Navrátil, P. Zemčík. An improved non-orthogonal texture warping for better
//! shadow rendering. WSCG 2015, section 3.2 ("MIN-SM"). In float64 here.
//!
//! Parameters: those of every map.
//!
//! Limits: where the receivers' box is hardly smaller for being turned, little is won.

use super::prelude::*;

parameters! {
    pub struct MinimalShadowMap {
        pub map: MapParameters,
    }
}

impl ShadowMethod for MinimalShadowMap {
    const NAME: &'static str = "min_sm";
    const TITLE: &'static str = "Minimal shadow frustum";
    const CITATION: &'static str = "Milet, T., Navrátil, J., and Zemčík, P. 2015. An improved \
         non-orthogonal texture warping for better shadow rendering. WSCG, section 3.2.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let turn = Turn::SmallestRectangle;
        let layers = fit_boxes(view, turn, Cut::Receivers, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}
