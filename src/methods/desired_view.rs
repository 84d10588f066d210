//! Desired view: one map over the box of the receivers that the camera sees and the light can reach.
//!
//! A parallel reduction over the visibility buffer finds the box; what is not seen takes no texel.
//!
//! Stefan Brabec, Thomas Annen, Hans-Peter Seidel. Practical shadow mapping. Journal of Graphics
//! Tools 7(4), 2002, section 3. It is the "desired view" of Paul Rosen. Rectilinear texture warping
//! for fast adaptive shadow mapping. I3D 2012, section 5.
//!
//! Parameters: those of every map, and `snap`, `rotation`.
//!
//! Limits: texels are spread evenly over the view; near receivers get no more than far ones.

use super::prelude::*;

parameters! {
    pub struct DesiredView {
        pub map: MapParameters,
        pub snap: bool = SNAP,
        pub rotation: Option<f64> = ROTATION,
    }
}

impl ShadowMethod for DesiredView {
    const NAME: &'static str = "desired_view";
    const TITLE: &'static str = "Desired view";
    const CITATION: &'static str = "Brabec, S., Annen, T., and Seidel, H.-P. 2002. Practical shadow \
         mapping. Journal of Graphics Tools 7(4).";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let cut = Cut::Receivers.snapped_where(self.snap);
        let turn = Turn::Still(self.rotation.into());
        let layers = fit_boxes(view, turn, cut, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}
