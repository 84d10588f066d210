//! Rectilinear texture warping: one warp for all rows and one for all columns, from importance.
//!
//! Each cell of a map of importance takes the greatest importance of the receivers in it; the maxima of
//! rows and columns, blurred, are the shares of the map that they get.
//!
//! Paul Rosen. Rectilinear texture warping for fast adaptive shadow mapping. I3D 2012. Forward,
//! backward and hybrid analysis (section 4.1), the functions of section 5, warp maps of section 4.2, Eq. 1.
//! Rasterization is exact here, not with the straight edges of section 6.1.
//!
//! Parameters: those of every map and of the analysis (importance.rs), and `analysis`, `fit`, `snap`,
//! `rotation`, `importance_resolution`, `blur`.
//!
//! Limits: what is important in one row makes all columns that it spans important in every row.

use super::importance::{Analysis, AnalysisParameters, DIRECTIONS, Direction, Functions};
use super::prelude::*;
use super::warps::rectilinear;
use crate::importance::Importance;

const FUNCTIONS: &[&str] = &[
    "desired_view",
    "distance",
    "normal",
    "shadow_edge",
    "boundary",
];

parameters! {
    pub struct RectilinearWarp {
        pub map: MapParameters,
        pub importance: Functions = word("distance", Rule::Product(FUNCTIONS)),
        pub given: AnalysisParameters,
        pub analysis: Direction = choice(DIRECTIONS, "backward"),
        /// Standard deviation of the blur.
        pub blur: f64 = number(Some(3.0), NON_NEGATIVE, "cells"),
    }
}

impl ShadowMethod for RectilinearWarp {
    const NAME: &'static str = "rtw";
    const TITLE: &'static str = "Rectilinear texture warping";
    const CITATION: &'static str = "Rosen, P. 2012. Rectilinear texture warping for fast adaptive \
         shadow mapping. I3D.";

    fn check(&self) -> Result<()> {
        self.given.maps.check()?;
        ensure_value!(
            self.analysis != Direction::Backward || !self.importance.shadow_edge,
            "analysis must be 'forward' or 'hybrid' for the importance 'shadow_edge', got 'backward'"
        );
        let weighs_pixels = self.importance.boundary || self.given.pixel_weights.is_some();
        ensure_value!(
            self.analysis != Direction::Forward || !weighs_pixels,
            "analysis must be 'backward' or 'hybrid' for 'boundary' and pixel_weights, got 'forward'"
        );
        Ok(())
    }

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let map = self.map.settings();
        let cells = self.given.cells(self.map.resolution);
        let layers = self.given.maps.layers(view, self.map.resolution)?;
        let analysis = Analysis::new(self.importance, &self.given, view, map, &layers)?;
        let mut warped = Vec::new();
        for layer in layers {
            let importance = |view: &mut V, layer: &Layer| {
                let seen = analysis.look(view, layer, self.analysis)?;
                let factors = analysis.factors(&seen);
                let mut importance = match (self.analysis, &seen.analysed) {
                    (Direction::Forward, Some(analysed)) => {
                        view.forward_importance(analysed, cells, factors)?
                    }
                    _ => view.importance_map(layer, cells, Importance::Maximum, factors, None)?,
                };
                analysis.blend(view, layer, &mut importance, None)?;
                Ok(importance)
            };
            warped.push(rectilinear(view, layer, cells, self.blur, importance)?);
        }
        view.shadows(map, warped)
    }
}
