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
//! `importance_resolution`, `blur`.
//!
//! Limits: what is important in one row makes all columns that it spans important in every row.

use super::fit::{Fit, fit_from};
use super::importance::{Analysis, DIRECTIONS, Direction};
use super::method::ShadowMethod;
use super::parameters::MapParameters;
use super::schema::{Groups, NON_NEGATIVE, Parameters, Rule, number, word};
use super::warps::rectilinear;
use crate::error::{Result, ensure_value};
use crate::fits::layer::Layer;
use crate::gpu::passes::importance_map::Importance;
use crate::gpu::view::{Recorded, View};

const FUNCTIONS: &[&str] = &[
    "desired_view",
    "distance",
    "normal",
    "shadow_edge",
    "boundary",
];

#[derive(Debug, Clone, PartialEq)]
pub struct RectilinearWarp {
    pub map: MapParameters,
    pub fit: Fit,
    /// Whether texels hold still while the receivers move, before they are warped.
    pub snaps: bool,
    pub analysis: Analysis,
    pub direction: Direction,
    /// Cells along each side of the importance map.
    pub importance_resolution: u32,
    /// Standard deviation of the blur, in cells.
    pub blur: f64,
}

impl ShadowMethod for RectilinearWarp {
    const NAME: &'static str = "rtw";
    const TITLE: &'static str = "Rectilinear texture warping";
    const CITATION: &'static str = "Rosen, P. 2012. Rectilinear texture warping for fast adaptive \
         shadow mapping. I3D.";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        &[word("importance", "distance", Rule::Product(FUNCTIONS))],
        Analysis::PARAMETERS,
        &[
            word("analysis", "backward", Rule::Choice(&DIRECTIONS)),
            number("blur", Some(3.0), NON_NEGATIVE, "cells"),
        ],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        let (fit, snaps) = fit_from(parameters)?;
        let method = Self {
            map: MapParameters::from_parameters(parameters),
            fit,
            snaps,
            analysis: Analysis::from_parameters(parameters),
            direction: parameters.choice("analysis", DIRECTIONS),
            importance_resolution: parameters.get("importance_resolution"),
            blur: parameters.get("blur"),
        };
        let Analysis {
            shadow_edge,
            boundary,
            pixel_weights,
            ..
        } = &method.analysis;
        match method.direction {
            Direction::Backward => {
                ensure_value!(
                    !shadow_edge,
                    "analysis must be 'forward' or 'hybrid' for the importance 'shadow_edge', got \
                     'backward'"
                );
            }
            Direction::Forward => {
                ensure_value!(
                    !boundary && pixel_weights.is_none(),
                    "analysis must be 'backward' or 'hybrid' for 'boundary' and pixel_weights, got \
                     'forward'"
                );
            }
            Direction::Hybrid => {}
        }
        Ok(method)
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let (map, cells) = (self.map.settings(), self.importance_resolution);
        let layers = self.fit.fit(view, self.snaps, self.map.resolution)?;
        let prepared = self.analysis.prepare(view, map, &layers)?;
        let mut warped = Vec::new();
        for layer in layers {
            let importance = |view: &mut View, layer: &Layer| {
                let analysed = self.analysis.look(view, layer, self.direction)?;
                let factors = self.analysis.factors(&prepared, analysed.as_ref());
                let importance = match (self.direction, &analysed) {
                    (Direction::Forward, Some(analysed)) => {
                        view.forward_importance(analysed, cells, factors)?
                    }
                    _ => view.importance_map(layer, cells, Importance::Maximum, factors, None)?,
                };
                self.analysis.blend(view, layer, &importance, None)?;
                Ok(importance)
            };
            warped.push(rectilinear(view, layer, cells, self.blur, importance)?);
        }
        view.shadows(map, warped)
    }
}
