//! Plane optimal: on the plane that most receivers lie in, each texel is a pixel.
//!
//! A point's place in the map is where its shadow on the plane is in the image.
//!
//! Hamilton Y. Chong, Steven J. Gortler. A lixel for every pixel. Eurographics Symposium on Rendering
//! 2004, for one plane.
//!
//! Parameters: those of every map, and `fit`, `sample_resolution`, `margin`.
//!
//! Limits: off the plane texels may be of any size, and what the light moves behind the camera's
//! plane on its way to that plane has none: it counts as lit.

use super::prelude::*;
use crate::fits::matrix_layers::fit_light_matrices;
use crate::fits::plane_optimal::{dominant_plane, plane_optimal};

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
        let (camera, target) = (view.setting().camera, self.fitting.target(size));
        let (points, normals) = view.samples(target.sample_resolution)?.seen();
        match dominant_plane(&points, &normals) {
            None => Ok(vec![]),
            Some(plane) => fit_light_matrices(view, target, |subject| {
                plane_optimal(subject, camera, plane, target.extent, target.frame)
            }),
        }
    }
}
