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

use super::parameters::FitParameters;
use super::schema::Groups;
use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, View};
use crate::error::Result;
use crate::fits::light_fits::{PlaneFrame, dominant_plane, plane_optimal};
use crate::fits::matrix_layers::{Fit, fitted_layers};

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
        let camera = view.camera;
        let samples = view.sampled_receivers(self.fit.sample_resolution)?;
        let (points, normals) = samples.seen();
        let Some(plane) = dominant_plane(&points, &normals) else {
            return view.shadows(&self.map, Vec::<Fitted>::new());
        };
        let frame = match self.fit.fit {
            Fit::Frustum => PlaneFrame::Image,
            Fit::Receivers => PlaneFrame::Points,
        };
        let layers = fitted_layers(view, self.map.resolution, self.fit, |subject, size| {
            plane_optimal(subject, camera, plane, frame, size)
        })?;
        view.shadows(&self.map, layers)
    }
}
