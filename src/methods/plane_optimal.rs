//! Plane optimal: on one plane, that of most light, each texel is a pixel.
//!
//! A point's place in the map is where its shadow on the plane is in the image.
//!
//! Hamilton Y. Chong, Steven J. Gortler. A lixel for every pixel. Eurographics Symposium on Rendering
//! 2004, for one plane.
//!
//! Parameters: those of every map, and `fit`, `sample_resolution`, `margin`.
//!
//! Limits: off the plane texels may be of any size. What the light moves to before the nearest point of the plane that is
//! seen, or behind the camera, has no place in such a map: it has a focused map of its own with `fit="receivers"`, and
//! counts as lit with `fit="frustum"`, as published, where the plane is that of most pixels.

use super::prelude::*;
use crate::fits::matrix_layers::Extent;
use crate::fits::plane_optimal::{dominant_plane, plane_layers};

parameters! {
    pub struct PlaneOptimal {
        pub map: MapParameters,
        pub fitting: FitParameters,
    }
}

impl ShadowMethod for PlaneOptimal {
    const NAME: &'static str = "plane_optimal";
    const TITLE: &'static str = "Plane optimal";
    const CITATION: &'static str = "Chong, H. Y., and Gortler, S. J. 2004. A lixel for every pixel. \
         Eurographics Symposium on Rendering.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = self.fit(view, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl PlaneOptimal {
    /// The layers; none where nothing is seen, or nothing faces the light.
    pub fn fit(&self, view: &mut dyn ReceiverQueries<'_>, size: MapSize) -> Result<Vec<Layer>> {
        let (light, target) = (view.setting().light, self.fitting.target(size));
        let samples = view.samples(target.sample_resolution)?;
        let surfaces = match target.extent {
            // One that the sun sees edge-on may have most of the pixels, but a map that is even on it has no room for
            // anything else.
            Extent::Receivers => samples.lit_surfaces(light),
            Extent::Frustum => samples.seen_surfaces(),
        };
        match dominant_plane(&surfaces) {
            None => Ok(vec![]),
            Some(plane) => plane_layers(view, target, plane),
        }
    }
}
