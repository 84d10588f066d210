//! Desired view: one map over the box of the receivers that the camera sees and the light can reach.
//!
//! A parallel reduction over the visibility buffer finds the box; what is not seen takes no texel.
//!
//! Stefan Brabec, Thomas Annen, Hans-Peter Seidel. Practical shadow mapping. Journal of Graphics
//! Tools 7(4), 2002, section 3. It is the "desired view" of Paul Rosen. Rectilinear texture warping
//! for fast adaptive shadow mapping. I3D 2012, section 5.
//!
//! Parameters: those of every map.
//!
//! Limits: texels are spread evenly over the view; near receivers get no more than far ones.

use super::fit::Fit;
use super::parallel_fit::{fit_box, projected_box};
use super::{MapParameters, Parameters, Recorded, ShadowMethod, Value, View};
use crate::error::Result;
use crate::projection::Projection;

#[derive(Debug, Clone, PartialEq)]
pub struct DesiredView {
    pub map: MapParameters,
}

impl ShadowMethod for DesiredView {
    const NAME: &'static str = "desired_view";
    const TITLE: &'static str = "Desired view";
    const CITATION: &'static str = "Brabec, S., Annen, T., and Seidel, H.-P. 2002. Practical shadow \
         mapping. Journal of Graphics Tools 7(4).";

    fn defaults() -> Vec<(&'static str, Value)> {
        MapParameters::defaults()
    }

    fn from_parameters(parameters: &mut Parameters) -> Result<Self> {
        let map = MapParameters::from_parameters(parameters)?;
        Ok(Self { map })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let Some(projection) = Fit::DesiredView.fit(view, self.map.resolution)? else {
            return view.all_in_shadow();
        };
        view.shadows(&self.map, projection, None, None)
    }
}

/// The map over the box, in the axes, of the receivers that face the light, `None` where there are
/// none. Submits what was recorded so far.
pub fn fit_receivers(
    view: &mut View,
    axes: &Projection,
    resolution: u32,
) -> Result<Option<Projection>> {
    let Some((low, high)) = view.receiver_bounds(axes)? else {
        return Ok(None);
    };
    let casters = projected_box(axes, view.scene.bounds());
    // How far a receiver may lie outside the box that float32 found: the box is relative to the eye.
    let rounding = 4.0 * f64::from(f32::EPSILON) * low.abs().max(high.abs()).length();
    let bounds = (low, high);
    Ok(Some(fit_box(
        axes,
        bounds,
        casters.0.z,
        resolution,
        rounding,
    )))
}
