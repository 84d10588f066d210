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

use super::method::ShadowMethod;
use super::parameters::{FitParameters, MapParameters, SNAP};
use super::schema::{Groups, Parameters};
use crate::error::Result;
use crate::fits::focused::focused;
use crate::fits::matrix_layers::{fit_light_matrices, still_layers};
use crate::gpu::view::{Recorded, View};

#[derive(Debug, Clone, PartialEq)]
pub struct Focused {
    pub map: MapParameters,
    pub fit: FitParameters,
    /// Whether texels hold still while the view moves; then the rectangle is not turned.
    pub snaps: bool,
}

impl ShadowMethod for Focused {
    const NAME: &'static str = "focused";
    const TITLE: &'static str = "Focused";
    const CITATION: &'static str = "Brabec, S., Annen, T., and Seidel, H.-P. 2002. Practical shadow \
         mapping. Journal of Graphics Tools 7(4).";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        FitParameters::PARAMETERS,
        &[SNAP],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            fit: FitParameters::from_parameters(parameters),
            snaps: parameters.get("snap"),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let size = self.fit.size(self.map.resolution);
        let (extent, samples) = (self.fit.extent, self.fit.sample_resolution);
        let layers = if self.snaps {
            still_layers(view, extent, samples, size)?
        } else {
            fit_light_matrices(view, extent, samples, size, |subject| {
                focused(subject, size)
            })?
        };
        view.shadows(self.map.settings(), layers)
    }
}
