//! Trapezoidal shadow map: a trapezoid around what is seen, as the light sees it, becomes the map.
//!
//! Its nearer part, `focus` of its length, gets `line` of the map.
//!
//! Tobias Martin, Tiow-Seng Tan. Anti-aliasing and continuity with trapezoidal shadow maps.
//! Eurographics Symposium on Rendering 2004.
//!
//! Parameters: those of every map, and `fit`, `sample_resolution`, `margin`, `focus`, `line`.
//!
//! Limits: the more the light shines along the view the more the trapezoid is a box; along it the
//! map is the focused one.

use super::prelude::*;
use super::schema::POSITIVE_FRACTION;
use crate::fits::matrix_layers::fit_light_matrices;
use crate::fits::trapezoid::{FocusRule, trapezoidal};

parameters! {
    pub struct Trapezoidal {
        pub map: MapParameters,
        pub fitting: FitParameters,
        /// The nearer part.
        pub focus: f64 = number(Some(0.5), POSITIVE_FRACTION, "of the trapezoid's length"),
        /// What it gets.
        pub line: f64 = number(Some(0.8), POSITIVE_FRACTION, "sides of the map"),
    }
}

impl ShadowMethod for Trapezoidal {
    const NAME: &'static str = "trapezoidal";
    const TITLE: &'static str = "Trapezoidal";
    const CITATION: &'static str = "Martin, T., and Tan, T.-S. 2004. Anti-aliasing and continuity \
         with trapezoidal shadow maps. Eurographics Symposium on Rendering.";

    fn check(&self) -> Result<()> {
        ensure_value!(
            self.line < 1.0,
            "line must be below 1, so that the farther part has a share of the map, got {}",
            self.line
        );
        Ok(())
    }

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = self.fit(view, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl Trapezoidal {
    /// The layers; none where nothing faces the light.
    pub fn fit(&self, view: &mut dyn ReceiverQueries<'_>, size: MapSize) -> Result<Vec<Layer>> {
        let (camera, target) = (view.setting().camera, self.fitting.target(size));
        let rule = FocusRule {
            focus: self.focus,
            line: self.line,
        };
        fit_light_matrices(view, target, |subject| {
            trapezoidal(subject, camera, rule, target.frame)
        })
    }
}
