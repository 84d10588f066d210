//! Spot shadow map: one perspective map along the axis of a spot light.
//!
//! A cone too wide for a plane is one paraboloid.
//!
//! Lance Williams. Casting curved shadows on curved surfaces. SIGGRAPH 1978.
//!
//! Parameters: those of every map, and `cut`: `receivers` or `cone`, and `snap`.
//!
//! Limits: texels are spread evenly over the plane, not over what the camera sees.

use super::prelude::*;
use crate::fits::boxes::layers_of_light;
use crate::light::Light;

const CUTS: Choices<Cut> = &[("receivers", Cut::Receivers), ("cone", Cut::Whole)];

parameters! {
    pub struct Spot {
        pub map: MapParameters,
        pub cut: Cut = choice(CUTS, "receivers"),
        pub snap: bool = SNAP,
    }
}

impl ShadowMethod for Spot {
    const NAME: &'static str = "spot";
    const TITLE: &'static str = "Spot shadow map";
    const CITATION: &'static str = "Williams, L. 1978. Casting curved shadows on curved surfaces. \
         SIGGRAPH.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let cut = self.cut.snapped_where(self.snap);
        let layers = fit(view, cut, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

/// Of a spot light.
pub fn fit(view: &mut dyn ReceiverQueries<'_>, cut: Cut, size: MapSize) -> Result<Vec<Layer>> {
    let setting = view.setting();
    ensure_value!(
        matches!(setting.light, Light::Spot { .. }),
        "method \"{}\" needs a spot light, got a {} light",
        Spot::NAME,
        setting.light.kind()
    );
    let layers = layers_of_light(setting);
    cut_layers(view, layers, cut, size)
}
