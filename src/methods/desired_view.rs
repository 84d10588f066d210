//! Desired view: one map over the box of the receivers that the camera sees and the light can reach.
//!
//! A parallel reduction over the visibility buffer finds the box; what is not seen takes no texel.
//!
//! Stefan Brabec, Thomas Annen, Hans-Peter Seidel. Practical shadow mapping. Journal of Graphics
//! Tools 7(4), 2002, section 3. It is the "desired view" of Paul Rosen. Rectilinear texture warping
//! for fast adaptive shadow mapping. I3D 2012, section 5.
//!
//! Parameters: those of every map, and `snap`.
//!
//! Limits: texels are spread evenly over the view; near receivers get no more than far ones.

use super::method::ShadowMethod;
use super::parameters::{MapParameters, SNAP};
use super::schema::{Groups, Parameters};
use crate::error::Result;
use crate::fits::boxes::{Cut, Turn, fit_boxes};
use crate::gpu::view::{Recorded, View};

#[derive(Debug, Clone, PartialEq)]
pub struct DesiredView {
    pub map: MapParameters,
    /// Whether texels hold still while the receivers move.
    pub snaps: bool,
}

impl ShadowMethod for DesiredView {
    const NAME: &'static str = "desired_view";
    const TITLE: &'static str = "Desired view";
    const CITATION: &'static str = "Brabec, S., Annen, T., and Seidel, H.-P. 2002. Practical shadow \
         mapping. Journal of Graphics Tools 7(4).";

    const PARAMETERS: Groups = &[MapParameters::PARAMETERS, &[SNAP]];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            snaps: parameters.get("snap"),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let cut = Cut::to_receivers(self.snaps);
        let layers = fit_boxes(view, Turn::Still, cut, self.map.resolution)?;
        view.shadows(self.map.settings(), layers)
    }
}
