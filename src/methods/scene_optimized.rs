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
//! `previous`, `previous_age`, `every`, `boundaries`.
//!
//! Limits: a second map is drawn to find the boundaries, and the CPU waits for the GPU twice (lights
//! that are rendered together share these waits); a shadow that no sample meets may be off the map, and
//! counts as lit.

use super::prelude::*;
use crate::fits::hull::MapFrame;
use crate::fits::matrix_layers::{parts_of_frustum, parts_of_receivers};
use crate::fits::samples::SampledReceivers;
use crate::fits::scene_optimized::{
    Optimizer, SampleChoice, Search, chosen_samples, fit_scene_optimized, focused_layers,
    kept_layers,
};
use glam::DMat4;
use std::time::Instant;

/// Label of the CPU's time for the search.
pub const LABEL: &str = "fit light matrix (CPU)";

/// Of the frames that have a matrix, this one included.
const AGE: &str = "matrix_age";

const CHOICES: Choices<SampleChoice> = &[
    ("shadow", SampleChoice::Shadow),
    ("boundary", SampleChoice::Boundary),
    ("facing", SampleChoice::Facing),
];

const OPTIMIZERS: Choices<Optimizer> =
    &[("paper", Optimizer::Paper), ("simplex", Optimizer::Simplex)];

/// Whose map the boundaries are found with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boundaries {
    Focused,
    Previous,
}

const BOUNDARIES: Choices<Boundaries> = &[
    ("focused", Boundaries::Focused),
    ("previous", Boundaries::Previous),
];

/// Frames that a matrix may be kept for.
const MAX_FRAMES: u32 = 1000;

parameters! {
    pub struct SceneOptimized {
        pub map: MapParameters,
        pub samples: SampleChoice = choice(CHOICES, "shadow"),
        pub optimizer: Optimizer = choice(OPTIMIZERS, "paper"),
        pub sample_resolution: u32 = SAMPLE_RESOLUTION,
        pub margin: f64 = MARGIN,
        /// Texels of the frame before from the world, reused where a new matrix is not much better.
        pub previous: Option<DMat4> = optional(Rule::Matrix),
        /// Frames that had it.
        pub previous_age: Option<u32> = count(None, MAX_FRAMES, "frames"),
        /// Frames from one search to the next (section 2.4).
        pub every: u32 = count(Some(1), MAX_FRAMES, "frames"),
        pub boundaries: Boundaries = choice(BOUNDARIES, "focused"),
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
    pub fn fit(&self, view: &mut dyn FitQueries<'_>, size: MapSize) -> Result<Vec<Layer>> {
        if let Some((layers, age)) = self.kept(view, size) {
            view.measure(AGE, f64::from(age));
            return Ok(layers);
        }
        view.measure(AGE, 1.0);
        let samples = &view.samples(self.sample_resolution)?;
        let frame = MapFrame {
            size,
            margin: self.margin,
        };
        let chosen = match self.samples {
            SampleChoice::Facing => samples.facing_the_light(),
            SampleChoice::Boundary | SampleChoice::Shadow => {
                let first = self.first_layers(view, samples, frame);
                if first.is_empty() {
                    return Ok(vec![]);
                }
                let map = self.map.settings().without_filter();
                let visibility = view.sampled_visibility(samples, map, first)?;
                chosen_samples(samples, self.samples, &visibility)
            }
        };
        let search = Search {
            optimizer: self.optimizer,
            frame,
            previous: self.previous,
        };
        let start = Instant::now();
        let (layers, h) = fit_scene_optimized(view, samples, chosen, search);
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        view.add_time(LABEL, milliseconds);
        view.measure("h", h);
        Ok(layers)
    }

    /// The layer of the frame before, and the frames that have it, where it is not time for a search.
    fn kept(&self, view: &mut dyn FitQueries<'_>, size: MapSize) -> Option<(Vec<Layer>, u32)> {
        let (previous, age) = (self.previous?, self.previous_age?);
        if age >= self.every {
            return None;
        }
        let setting = view.setting();
        let layers = kept_layers(setting, parts_of_frustum(setting), previous, size);
        (!layers.is_empty()).then_some((layers, age + 1))
    }

    /// What the boundaries are found with.
    fn first_layers(
        &self,
        view: &mut dyn FitQueries<'_>,
        samples: &SampledReceivers,
        frame: MapFrame,
    ) -> Vec<Layer> {
        let kept = match (self.boundaries, self.previous) {
            (Boundaries::Previous, Some(previous)) => {
                let parts = parts_of_receivers(view, samples, samples.facing_the_light());
                kept_layers(view.setting(), parts, previous, frame.size)
            }
            _ => vec![],
        };
        match kept.is_empty() {
            true => focused_layers(view, samples, frame),
            false => kept,
        }
    }
}
