//! Non-orthogonal texture warping: a warp of its own for each row and each column, which spreads the
//! receivers evenly over the texels.
//!
//! Receivers are counted in the cells of a map fitted to them. The prefix sums of a row are its
//! function: they equalize the histogram of the row. The receivers are then counted again where the
//! rows' functions put them, and each column gets its function in the same way.
//!
//! Tomáš Milet, Jan Navrátil, Pavel Zemčík. An improved non-orthogonal texture warping for better
//! shadow rendering. WSCG 2015, Eq. 1-6; Navrátil's thesis, chapter 5. Rasterization is exact here.
//!
//! Parameters: those of every map, and `fit`, `importance_resolution`, `smoothing`.
//!
//! Limits: memory and time of the analysis grow with the square of `importance_resolution`.

use super::fit::Fit;
use super::{MapParameters, Parameters, Plan, Recorded, ShadowMethod, Value, View};
use crate::error::Result;
use crate::passes::importance_map::Importance;
use crate::passes::warp_map::{Axis, WarpMap};

#[derive(Debug, Clone, PartialEq)]
pub struct NonOrthogonalWarp {
    pub map: MapParameters,
    pub fit: Fit,
    /// Functions along each axis, and cells of each.
    pub importance_resolution: u32,
    /// Standard deviation of the smoothing among functions, in functions.
    pub smoothing: f64,
}

impl ShadowMethod for NonOrthogonalWarp {
    const NAME: &'static str = "notw";
    const TITLE: &'static str = "Non-orthogonal texture warping";
    const CITATION: &'static str = "Milet, T., Navrátil, J., and Zemčík, P. 2015. An improved \
         non-orthogonal texture warping for better shadow rendering. WSCG.";

    fn defaults() -> Vec<(&'static str, Value)> {
        let mut defaults = MapParameters::defaults();
        defaults.extend([
            (Fit::NAME, Fit::default_value()),
            ("importance_resolution", Value::Int(512)),
            ("smoothing", Value::None),
        ]);
        defaults
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let importance_resolution = parameters.take_resolution("importance_resolution")?;
        // Measured on three scenes: a sixteenth and an eighth of the functions leave about as many wrong
        // pixels in total; a sixty-fourth leaves a third more.
        let smoothing = parameters.take_optional("smoothing")?;
        Ok(Self {
            map: MapParameters::from_parameters(parameters)?,
            fit: parameters.take_choice(Fit::NAME, Fit::CHOICES)?,
            importance_resolution,
            smoothing: smoothing.unwrap_or(f64::from(importance_resolution) / 16.0),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let resolution = self.map.resolution;
        let functions = self.importance_resolution;
        let mut plans = Vec::new();
        for fitted in self.fit.fit(view, resolution)? {
            let warp = WarpMap::new(view.frame(), functions, functions, resolution)?;
            let mut importance = None;
            for axis in [Axis::X, Axis::Y] {
                let counted = match axis {
                    Axis::X => Importance::CountAlongX { functions },
                    Axis::Y => Importance::CountAlongY { functions },
                };
                let counts = view.importance_map(&fitted, functions, counted, Some(&warp))?;
                let frame = view.frame();
                warp.fit_counts(frame, axis, resolution, &counts.buffer, self.smoothing)?;
                importance.get_or_insert(counts);
            }
            warp.finish(view.frame(), resolution);
            plans.push(Plan {
                fitted,
                warp: Some(warp),
                importance,
            });
        }
        view.shadows(&self.map, plans)
    }
}
