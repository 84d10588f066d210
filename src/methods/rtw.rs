//! Rectilinear texture warping: one warp for all rows and one for all columns, from importance.
//!
//! Each cell of a map of importance takes the greatest importance of the receivers in it; the maxima of
//! rows and columns, blurred, say how much of the map they get.
//!
//! Paul Rosen. Rectilinear texture warping for fast adaptive shadow mapping. I3D 2012. Forward,
//! backward and hybrid analysis (section 4.1), the functions of section 5, warp maps of section 4.2, Eq. 1.
//! Rasterization is exact here, not with the straight edges of section 6.1.
//!
//! Parameters: those of every map and of the analysis (importance.rs), and `analysis`, `fit`, `snap`,
//! `importance_resolution`, `blur`.
//!
//! Limits: what is important in one row makes all columns that it spans important in every row.

use super::importance::{Analysis, DIRECTIONS, Direction, fit_from};
use super::schema::{Groups, NON_NEGATIVE, Rule, number, word};
use super::{MapParameters, Parameters, Plan, Recorded, ShadowMethod, View};
use crate::error::{Result, ensure_value};
use crate::fits::boxes::Fit;
use crate::gpu::passes::importance_map::Importance;
use crate::gpu::passes::warp_map::{Axis, WarpMap};

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
        let resolution = self.map.resolution;
        let cells = self.importance_resolution;
        let mut plans = Vec::new();
        let layers = self.fit.fit(view, self.snaps, resolution)?;
        let prepared = self.analysis.prepare(view, &self.map, &layers)?;
        for fitted in layers {
            let warp = WarpMap::new(view.frame(), 1, cells, resolution)?;
            let analysed = self.analysis.look(view, &fitted, self.direction)?;
            let factors = self.analysis.factors(&prepared, analysed.as_ref());
            let importance = match (self.direction, &analysed) {
                (Direction::Forward, Some(analysed)) => {
                    view.forward_importance(analysed, cells, factors)?
                }
                _ => view.importance_map(&fitted, cells, Importance::Maximum, factors, None)?,
            };
            self.analysis.blend(view, &fitted, &importance, None)?;
            let frame = view.frame();
            for axis in [Axis::X, Axis::Y] {
                warp.fit_maxima(frame, axis, resolution, &importance.buffer, self.blur)?;
            }
            warp.finish(frame, resolution);
            plans.push(Plan {
                fitted,
                warp: Some(warp),
                importance: Some(importance),
            });
        }
        view.shadows(&self.map, plans)
    }
}
