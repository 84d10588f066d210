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

use super::prelude::*;
use crate::fits::hull::MapSize;
use crate::fits::scene_optimized::{
    Optimizer, SampleChoice, Search, chosen_samples, fit_scene_optimized, focused_layers,
};
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

parameters! {
    pub struct SceneOptimized {
        pub map: MapParameters,
        pub samples: SampleChoice = choice(CHOICES, "shadow"),
        pub optimizer: Optimizer = choice(OPTIMIZERS, "paper"),
        pub sample_resolution: u32 = SAMPLE_RESOLUTION,
        pub margin: f64 = MARGIN,
        /// Texels of the frame before from the world, reused where a new matrix is not much better.
        pub previous: Option<DMat4> = optional(Rule::Matrix),
    }
}

impl ShadowMethod for SceneOptimized {
    const NAME: &'static str = "scene_optimized";
    const TITLE: &'static str = "Scene optimized";
    const CITATION: &'static str = "Chong, H. Y., and Gortler, S. J. 2007. Scene optimized shadow \
         mapping. Harvard University, TR-07-07.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = self.fit(view, self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl SceneOptimized {
    /// The layers; none where nothing faces the light.
    pub fn fit(&self, view: &mut dyn FitQueries<'_>, resolution: u32) -> Result<Vec<Layer>> {
        let samples = &view.samples(self.sample_resolution)?;
        let size = MapSize {
            resolution,
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
                let visibility = view.sampled_visibility(samples, map, focused)?;
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
        view.add_time(LABEL, milliseconds);
        view.measure("h", h);
        Ok(layers)
    }
}
