//! Rectilinear texture warping: one warp for all rows and one for all columns, from importance.
//!
//! Each cell of a map of importance takes the greatest importance of the receivers in it; the maxima of
//! rows and columns, blurred, say how much of the map they get.
//!
//! Paul Rosen. Rectilinear texture warping for fast adaptive shadow mapping. I3D 2012. Backward
//! analysis (section 4.1), functions of sections 5.1, 5.2 and 5.4, warp maps of section 4.2, Eq. 1.
//! Rasterization is exact here, not with the straight edges of section 6.1.
//!
//! Parameters: those of every map, and `fit`, `importance`, `importance_resolution`, `blur`, `normal_bonus`.
//!
//! Limits: what is important in one row makes all columns that it spans important in every row.

use super::fit::Fit;
use super::{MapParameters, Parameters, Plan, Recorded, ShadowMethod, Value, View};
use crate::error::Result;
use crate::passes::importance_map::{Factors, Importance};
use crate::passes::warp_map::{Axis, WarpMap};

#[derive(Debug, Clone, PartialEq)]
pub struct RectilinearWarp {
    pub map: MapParameters,
    pub fit: Fit,
    pub factors: Factors,
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

    fn defaults() -> Vec<(&'static str, Value)> {
        let mut defaults = MapParameters::defaults();
        defaults.extend([
            ("importance", Value::Text("distance".to_string())),
            (Fit::NAME, Fit::default_value()),
            ("importance_resolution", Value::Int(512)),
            ("blur", Value::Float(3.0)),
            ("normal_bonus", Value::Float(2.0)),
        ]);
        defaults
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let normal_bonus = parameters.take_non_negative("normal_bonus")?;
        let factors = |distance, uses_normal: bool| Factors {
            distance,
            normal: uses_normal.then_some(normal_bonus),
        };
        Ok(Self {
            map: MapParameters::from_parameters(parameters)?,
            fit: parameters.take_choice(Fit::NAME, Fit::CHOICES)?,
            factors: parameters.take_choice(
                "importance",
                &[
                    ("desired_view", factors(false, false)),
                    ("distance", factors(true, false)),
                    ("normal", factors(false, true)),
                    ("distance*normal", factors(true, true)),
                ],
            )?,
            importance_resolution: parameters.take_resolution("importance_resolution")?,
            blur: parameters.take_non_negative("blur")?,
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let resolution = self.map.resolution;
        let cells = self.importance_resolution;
        let mut plans = Vec::new();
        for fitted in self.fit.fit(view, resolution)? {
            let warp = WarpMap::new(view.frame(), 1, cells, resolution)?;
            let importance = Importance::Maximum(self.factors);
            let importance = view.importance_map(&fitted, cells, importance, None)?;
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
