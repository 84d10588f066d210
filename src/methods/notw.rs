//! Non-orthogonal texture warping: a warp of its own for each row and each column, which spreads the
//! receivers evenly over the texels.
//!
//! Receivers are counted in the cells of a map fitted to them. The prefix sums of a row are its
//! function: they equalize the histogram of the row. The receivers are then counted again where the
//! rows' functions put them, and each column gets its function in the same way.
//!
//! Beyond the paper, rows share functions. Where two functions meet the map is torn: texels side by side are
//! of places far apart, and the lookup goes on at the nearest texel across the tear (lib/seams.wgsl). A cell is
//! worth a power of its count, and a part of each function is the identity. Of `n` pixels that share `s` of the
//! texels, from `n s^(-1/2)` (depth tests) to `n / s` (triangles) are wrong along edges; their sum, for a sum of
//! `s` that is given, is least where `s` is in proportion to `n^(2/3)` or `n^(1/2)`. Equal counts take too much
//! from what is thinly covered.
//!
//! Tomáš Milet, Jan Navrátil, Pavel Zemčík. An improved non-orthogonal texture warping for better
//! shadow rendering. WSCG 2015, Eq. 1-6; Navrátil's thesis, chapter 4. Rasterization is exact here.
//!
//! Parameters: those of every map and of the analysis (importance.rs), and `fit`, `snap`,
//! `importance_resolution`, `function_count`, `smoothing`, `exponent`, `even_share`.
//!
//! Limits: memory and time of the analysis grow with the square of `importance_resolution`.

use super::fit::{Fit, fit_from};
use super::importance::{Analysis, Direction};
use super::method::ShadowMethod;
use super::parameters::MapParameters;
use super::schema::{FRACTION, Groups, NON_NEGATIVE, Parameters, Rule, count, number, word};
use super::warps::non_orthogonal;
use crate::error::{Result, ensure_value};
use crate::fits::layer::Layer;
use crate::gpu::passes::importance_map::Importance;
use crate::gpu::passes::rasterize::{Rasterization, max_bands};
use crate::gpu::passes::warp_map::{Axis, CountFit, MAX_CELLS, WarpMap};
use crate::gpu::view::{Recorded, View};

/// Functions along each axis where none are asked for, and rasterization is exact.
const FUNCTION_COUNT: u32 = 16;

const FUNCTIONS: &[&str] = &["count", "normal", "shadow_edge", "boundary"];

#[derive(Debug, Clone, PartialEq)]
pub struct NonOrthogonalWarp {
    pub map: MapParameters,
    pub fit: Fit,
    /// Whether texels hold still while the receivers move, before they are warped.
    pub snaps: bool,
    /// Cells along each side, and of each function.
    pub importance_resolution: u32,
    /// Functions along each axis.
    pub function_count: u32,
    pub analysis: Analysis,
    pub fit_of_counts: CountFit,
}

impl ShadowMethod for NonOrthogonalWarp {
    const NAME: &'static str = "notw";
    const TITLE: &'static str = "Non-orthogonal texture warping";
    const CITATION: &'static str = "Milet, T., Navrátil, J., and Zemčík, P. 2015. An improved \
         non-orthogonal texture warping for better shadow rendering. WSCG.";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        &[word("importance", "count", Rule::Product(FUNCTIONS))],
        Analysis::PARAMETERS,
        &[
            count("function_count", None, MAX_CELLS, "functions"),
            number("smoothing", None, NON_NEGATIVE, "cells"),
            number("exponent", Some(0.5), FRACTION, ""),
            number("even_share", Some(0.1), FRACTION, ""),
        ],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        let map = MapParameters::from_parameters(parameters);
        let importance_resolution: u32 = parameters.get("importance_resolution");
        let most = match map.rasterization {
            Rasterization::Exact => FUNCTION_COUNT,
            // Straight edges come near the warp's only where neighbouring functions are alike.
            Rasterization::Linear { .. } => importance_resolution,
        };
        let function_count: Option<u32> = parameters.get("function_count");
        let function_count = function_count.unwrap_or(most.min(importance_resolution));
        ensure_value!(
            function_count <= importance_resolution,
            "function_count must be at most importance_resolution, {importance_resolution}, \
             got {function_count}"
        );
        if map.rasterization == Rasterization::Exact {
            let (resolution, most) = (map.resolution, max_bands(map.resolution, map.resolution));
            ensure_value!(
                function_count <= most,
                "function_count must be at most {most} with a map of {resolution} texels, got \
                 {function_count}"
            );
        }
        let smoothing: Option<f64> = parameters.get("smoothing");
        // Rows that share a function are averaged already.
        let rows_of_function = f64::from(importance_resolution) / f64::from(function_count);
        let width = f64::from(importance_resolution) / 32.0 - rows_of_function;
        let (fit, snaps) = fit_from(parameters)?;
        Ok(Self {
            map,
            analysis: Analysis::from_parameters(parameters),
            fit,
            snaps,
            importance_resolution,
            function_count,
            fit_of_counts: CountFit {
                smoothing: smoothing.unwrap_or(width.max(0.0)),
                exponent: parameters.get("exponent"),
                even_share: parameters.get("even_share"),
            },
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let (map, cells) = (self.map.settings(), self.importance_resolution);
        let layers = self.fit.fit(view, self.snaps, self.map.resolution)?;
        let prepared = self.analysis.prepare(view, map, &layers)?;
        let unit = self.analysis.count_unit(view.camera.pixel_count());
        // Counts are of receivers; shadow edges are seen from the light.
        let direction = if self.analysis.shadow_edge {
            Direction::Hybrid
        } else {
            Direction::Backward
        };
        let mut warped = Vec::new();
        for layer in layers {
            let analysed = self.analysis.look(view, &layer, direction)?;
            let factors = self.analysis.factors(&prepared, analysed.as_ref());
            let counts = |view: &mut View, layer: &Layer, axis: Axis, warp: &WarpMap| {
                let counted = Importance::Count { along: axis, unit };
                let counts = view.importance_map(layer, cells, counted, factors, Some(warp))?;
                let along_x = (axis == Axis::Y).then_some(warp);
                self.analysis.blend(view, layer, &counts, along_x)?;
                Ok(counts)
            };
            let functions = [self.function_count, cells];
            warped.push(non_orthogonal(
                view,
                layer,
                functions,
                self.fit_of_counts,
                counts,
            )?);
        }
        view.shadows(map, warped)
    }
}
