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

use super::method::ShadowMethod;
use super::parameters::{FitParameters, MapParameters};
use super::schema::{Groups, Parameters};
use crate::error::Result;
use crate::fits::layer::Layer;
use crate::fits::matrix_layers::fit_light_matrices;
use crate::fits::plane_optimal::{dominant_plane, plane_optimal};
use crate::fits::receivers::ReceiverQueries;
use crate::gpu::view::{Recorded, View};

#[derive(Debug, Clone, PartialEq)]
pub struct PlaneOptimal {
    pub map: MapParameters,
    pub fit: FitParameters,
}

impl ShadowMethod for PlaneOptimal {
    const NAME: &'static str = "plane_optimal";
    const TITLE: &'static str = "Plane optimal";
    const CITATION: &'static str = "Chong, H. Y., and Gortler, S. J. 2004. A lixel for every pixel. \
         Eurographics Symposium on Rendering.";

    const PARAMETERS: Groups = &[MapParameters::PARAMETERS, FitParameters::PARAMETERS];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            fit: FitParameters::from_parameters(parameters),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let (camera, size) = (view.camera, self.fit.size(self.map.resolution));
        let FitParameters {
            extent,
            sample_resolution,
            ..
        } = self.fit;
        let (points, normals) = view.samples(sample_resolution)?.seen();
        let Some(plane) = dominant_plane(&points, &normals) else {
            return view.shadows(self.map.settings(), Vec::<Layer>::new());
        };
        let layers = fit_light_matrices(view, extent, sample_resolution, size, |subject| {
            plane_optimal(subject, camera, plane, extent, size)
        })?;
        view.shadows(self.map.settings(), layers)
    }
}
