//! Focused: the smallest rectangle in the light's plane that holds what the camera may see.
//!
//! Frustum limiting of Stefan Brabec, Thomas Annen, Hans-Peter Seidel. Practical shadow mapping.
//! Journal of Graphics Tools 7(4), 2002; with the smallest rectangle in any orientation as "focused" of
//! Hamilton Yu-Ik Chong, Steven J. Gortler. Scene optimized shadow mapping. Harvard TR-07-07, 2007,
//! section 3.
//!
//! Parameters: those of every map, and `fit`, `sample_resolution`, `margin`, `snap`.
//!
//! Limits: texels are spread evenly over the view; near receivers get no more than far ones.

use super::prelude::*;
use crate::fits::matrix_layers::{fit_light_matrices, still_layers};

parameters! {
    pub struct Focused {
        pub map: MapParameters,
        pub fitting: FitParameters,
        /// Then the rectangle is not turned.
        pub snap: bool = SNAP,
    }
}

impl ShadowMethod for Focused {
    const NAME: &'static str = "focused";
    const TITLE: &'static str = "Focused";
    const CITATION: &'static str = "Brabec, S., Annen, T., and Seidel, H.-P. 2002. Practical shadow \
         mapping. Journal of Graphics Tools 7(4).";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = self.fit(view, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl Focused {
    /// The layers; none where nothing faces the light.
    pub fn fit(&self, view: &mut dyn ReceiverQueries<'_>, size: MapSize) -> Result<Vec<Layer>> {
        let target = self.fitting.target(size);
        match self.snap {
            true => still_layers(view, target),
            false => fit_light_matrices(view, target, |subject| subject.focused(target.frame)),
        }
    }
}
