//! Uniform shadow map: one map over the box of the casters.
//!
//! The texels are spread evenly over the whole scene, whatever the camera sees of it; around a point over
//! the six faces of a cube, within a cone over the cone.
//!
//! Lance Williams. Casting curved shadows on curved surfaces. SIGGRAPH 1978.
//!
//! Parameters: those of every map, and `rotation`.
//!
//! Limits: a large scene leaves few texels to what is in view.

use super::prelude::*;
use crate::fits::uniform::fit_scene;
use crate::gpu::passes::receivers;

parameters! {
    pub struct Uniform {
        pub map: MapParameters,
        pub rotation: Option<f64> = ROTATION,
    }
}

impl ShadowMethod for Uniform {
    const NAME: &'static str = "uniform";
    const TITLE: &'static str = "Uniform";
    const CITATION: &'static str =
        "Williams, L. 1978. Casting curved shadows on curved surfaces. SIGGRAPH.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = fit_scene(view.setting(), self.rotation.into(), self.map.resolution);
        view.skip(receivers::LABEL);
        mapped_shadows(view, self.map.settings(), layers)
    }
}
