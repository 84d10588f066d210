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
//! Parameters: those of every map and of the analysis (importance.rs), and `fit`, `snap`, `rotation`,
//! `importance_resolution`, `function_count`, `smoothing`, `exponent`, `even_share`.
//!
//! Limits: memory and time of the analysis grow with the square of `importance_resolution`.

use super::importance::{Analysis, AnalysisParameters, Direction, Functions};
use super::prelude::*;
use super::smoothing::{SMOOTHING, Smoothing, automatic};
use super::warps::functions_of_counts;
use crate::gpu::passes::rasterize::max_bands;
use crate::importance::Importance;
use crate::map_settings::Rasterization;
use crate::verbs::WarpedLayer;
use crate::warp::{Axis, CountFit, MAX_CELLS};

/// Functions along each axis where none are asked for, and rasterization is exact.
const FUNCTION_COUNT: u32 = 16;

const FUNCTIONS: &[&str] = &["count", "normal", "shadow_edge", "boundary"];

parameters! {
    pub struct NonOrthogonalWarp {
        pub map: MapParameters,
        pub importance: Functions = word("count", Rule::Product(FUNCTIONS)),
        pub given: AnalysisParameters,
        /// Along each axis.
        pub function_count: Option<u32> = count(None, MAX_CELLS, "functions"),
        pub smoothing: Option<Smoothing> = SMOOTHING,
        pub exponent: f64 = number(Some(0.5), FRACTION, ""),
        pub even_share: f64 = number(Some(0.1), FRACTION, ""),
    }
}

impl ShadowMethod for NonOrthogonalWarp {
    const NAME: &'static str = "notw";
    const TITLE: &'static str = "Non-orthogonal texture warping";
    const CITATION: &'static str = "Milet, T., Navrátil, J., and Zemčík, P. 2015. An improved \
         non-orthogonal texture warping for better shadow rendering. WSCG.";

    fn check(&self) -> Result<()> {
        let (cells, functions) = (self.cells(), self.functions());
        ensure_value!(
            functions <= cells,
            "function_count must be at most importance_resolution, {cells}, got {functions}"
        );
        let size = self.map.resolution;
        let most = max_bands(size.width, size.height);
        ensure_value!(
            self.map.texels.rasterization != Rasterization::Exact || functions <= most,
            "function_count must be at most {most} with a map of {size} texels, got {functions}"
        );
        ensure_value!(
            self.smoothing != Some(Smoothing::Automatic)
                || self.map.texels.rasterization != Rasterization::Exact,
            "rasterization must be 'linear' with smoothing='automatic', got 'exact', which needs no smoothing"
        );
        self.given.maps.check()
    }

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let (map, cells) = (self.map.settings(), self.cells());
        let layers = self.given.maps.layers(view, self.map.resolution)?;
        let analysis = Analysis::new(self.importance, &self.given, view, map, &layers)?;
        let unit = analysis.count_unit(view.setting().camera.pixel_count());
        // Counts are of receivers; shadow edges are seen from the light.
        let direction = if self.importance.shadow_edge {
            Direction::Hybrid
        } else {
            Direction::Backward
        };
        let seen = layers
            .iter()
            .map(|layer| analysis.look(view, layer, direction))
            .collect::<Result<Vec<_>>>()?;
        let functions_of = |view: &mut V, layer: &Layer, i: usize, smoothing: f64| {
            let factors = analysis.factors(&seen[i]);
            let counts = |view: &mut V, layer: &Layer, axis: Axis, warp: &V::Warp| {
                let counted = Importance::Count { along: axis, unit };
                let mut counts = view.importance_map(layer, cells, counted, factors, Some(warp))?;
                let along_x = (axis == Axis::Y).then_some(warp);
                analysis.blend(view, layer, &mut counts, along_x)?;
                Ok(counts)
            };
            let (sizes, fit) = ([self.functions(), cells], self.fit_of_counts(smoothing));
            functions_of_counts(view, layer, sizes, fit, counts)
        };
        let smoothing = match self.smoothing {
            Some(Smoothing::Cells(cells)) => cells,
            Some(Smoothing::Automatic) => automatic(view, &layers, cells, |view, layer, i, of| {
                Ok(functions_of(view, layer, i, of)?.0)
            })?,
            None => self.smoothing_of_size(),
        };
        let mut warped = Vec::new();
        for (i, layer) in layers.iter().enumerate() {
            let (mut warp, importance) = functions_of(view, layer, i, smoothing)?;
            view.finish_warp(&mut warp, layer.projection.size());
            warped.push(WarpedLayer {
                layer: layer.clone(),
                warp: Some(warp),
                importance,
            });
        }
        view.shadows(map, warped)
    }
}

impl NonOrthogonalWarp {
    /// Along each side of the map of counts.
    fn cells(&self) -> u32 {
        self.given.cells(self.map.resolution)
    }

    /// Functions along each axis.
    fn functions(&self) -> u32 {
        let cells = self.cells();
        let most = match self.map.texels.rasterization {
            Rasterization::Exact => FUNCTION_COUNT,
            // Straight edges come near the warp's only where neighbouring functions are alike.
            Rasterization::Linear { .. } => cells,
        };
        self.function_count.unwrap_or(most.min(cells))
    }

    /// In cells, where none is asked for.
    fn smoothing_of_size(&self) -> f64 {
        let cells = f64::from(self.cells());
        // Rows that share a function are averaged already.
        (cells / 32.0 - cells / f64::from(self.functions())).max(0.0)
    }

    fn fit_of_counts(&self, smoothing: f64) -> CountFit {
        CountFit {
            smoothing,
            exponent: self.exponent,
            even_share: self.even_share,
        }
    }
}
