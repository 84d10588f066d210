//! Scene optimized: the light matrix that serves the image's shadow boundaries best.
//!
//! Samples of the image that lie next to a shadow boundary are read back; the matrix minimizes the sum
//! over them of the squared entries of the Jacobian of the image by the map.
//!
//! Hamilton Yu-Ik Chong, Steven J. Gortler. Scene optimized shadow mapping. Harvard University,
//! technical report TR-07-07, 2007. Boundaries are found with a focused map; samples have the exact
//! derivatives of their triangle's plane.
//!
//! Parameters: those of every map, and `samples`, `optimizer`, `sample_resolution`, `margin`,
//! `previous`.
//!
//! Limits: a second map is drawn to find the boundaries, and the CPU waits for the GPU twice (lights
//! that are rendered together share these waits); a shadow that no sample meets may be off the map, and
//! counts as lit.

use super::method::{ShadowMethod, default_method};
use super::parameters::{MARGIN, MapParameters, SAMPLE_RESOLUTION};
use super::schema::{Choices, Groups, Parameters, Rule, Value, parameter, word};
use crate::error::Result;
use crate::fits::hull::MapSize;
use crate::fits::layer::Layer;
use crate::fits::scene_optimized::{
    Optimizer, SampleChoice, Search, chosen_samples, fit_scene_optimized, focused_layers,
};
use crate::gpu::view::{Recorded, View};
use glam::DMat4;
use std::time::Instant;

/// Label of the CPU's time for the search.
pub const LABEL: &str = "fit light matrix (CPU)";

const CHOICES: Choices<SampleChoice> = &[
    ("shadow", SampleChoice::Shadow),
    ("boundary", SampleChoice::Boundary),
    ("facing", SampleChoice::Facing),
];

const OPTIMIZERS: Choices<Optimizer> =
    &[("paper", Optimizer::Paper), ("simplex", Optimizer::Simplex)];

#[derive(Debug, Clone, PartialEq)]
pub struct SceneOptimized {
    pub map: MapParameters,
    samples: SampleChoice,
    optimizer: Optimizer,
    /// Receivers looked at along the longer side of the image.
    pub sample_resolution: u32,
    /// By how much of its size the map is widened.
    pub margin: f64,
    /// Texels of the frame before from the world, reused where a new matrix is not much better.
    pub previous: Option<DMat4>,
}

impl ShadowMethod for SceneOptimized {
    const NAME: &'static str = "scene_optimized";
    const TITLE: &'static str = "Scene optimized";
    const CITATION: &'static str = "Chong, H. Y., and Gortler, S. J. 2007. Scene optimized shadow \
         mapping. Harvard University, TR-07-07.";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        &[
            word("samples", "shadow", Rule::Choice(&CHOICES)),
            word("optimizer", "paper", Rule::Choice(&OPTIMIZERS)),
            SAMPLE_RESOLUTION,
            MARGIN,
            parameter("previous", Rule::Matrix, Value::None, ""),
        ],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            samples: parameters.choice("samples", CHOICES),
            optimizer: parameters.choice("optimizer", OPTIMIZERS),
            sample_resolution: parameters.get("sample_resolution"),
            margin: parameters.get("margin"),
            previous: parameters.get("previous"),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let layers = self.fit(view)?;
        view.shadows(self.map.settings(), layers)
    }
}

impl SceneOptimized {
    /// With the defaults of the other parameters.
    pub fn new(resolution: u32) -> Self {
        let map = MapParameters::new(resolution);
        Self {
            map,
            ..default_method()
        }
    }

    /// The layers; none where nothing faces the light.
    pub fn fit(&self, view: &mut View) -> Result<Vec<Layer>> {
        let image = view.sampled_image(self.sample_resolution)?;
        let samples = &image.receivers;
        let size = MapSize {
            resolution: self.map.resolution,
            margin: self.margin,
        };
        let chosen = match self.samples {
            SampleChoice::Facing => samples.facing_the_light(),
            SampleChoice::Boundary | SampleChoice::Shadow => {
                let focused = focused_layers(view, samples, size);
                if focused.is_empty() {
                    return Ok(vec![]);
                }
                let map = self.map.settings().without_filter();
                let visibility = view.sampled_visibility(&image, map, focused)?;
                chosen_samples(samples, self.samples, &visibility)
            }
        };
        let search = Search {
            optimizer: self.optimizer,
            size,
            previous: self.previous,
        };
        let start = Instant::now();
        let (layers, h) = fit_scene_optimized(view, samples, chosen, search);
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        view.frame().add_time(LABEL, milliseconds);
        view.measure("h", h);
        Ok(layers)
    }
}
