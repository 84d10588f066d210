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

use super::parameters::{MARGIN, SAMPLE_RESOLUTION};
use super::schema::{Choices, Groups, Rule, Value, parameter, word};
use super::view::SampledReceivers;
use super::{
    Fitted, MapParameters, Parameters, Plan, Recorded, ShadowMethod, View, default_method,
};
use crate::error::Result;
use crate::fits::light_fits::focused;
use crate::fits::light_matrix::{LightMatrix, MapSize, Sample, descend, optimize};
use crate::fits::matrix_layers::{Part, parts_of_receivers, projection};
use glam::{DMat4, DVec3};
use std::time::Instant;

/// Label of the CPU's time.
/// The search for the matrix.
pub const LABEL: &str = "fit light matrix (CPU)";

/// Which samples the map holds, and is optimized for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Choice {
    /// Next to a shadow boundary, as in the paper.
    Boundary,
    /// Those, and whatever is in shadow.
    Shadow,
    /// Whatever faces the light.
    Facing,
}

const CHOICES: Choices<Choice> = &[
    ("shadow", Choice::Shadow),
    ("boundary", Choice::Boundary),
    ("facing", Choice::Facing),
];

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Optimizer {
    /// The paper's search along the negative gradient.
    Paper,
    /// A downhill simplex from what that finds.
    Simplex,
}

const OPTIMIZERS: Choices<Optimizer> =
    &[("paper", Optimizer::Paper), ("simplex", Optimizer::Simplex)];

#[derive(Debug, Clone, PartialEq)]
pub struct SceneOptimized {
    pub map: MapParameters,
    samples: Choice,
    optimizer: Optimizer,
    /// Receivers looked at along the longer side of the image.
    pub sample_resolution: u32,
    /// By how much of its size the map is widened.
    pub margin: f64,
    /// Texels of the frame before from the world, kept where a new matrix is not much better.
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
        view.shadows(&self.map, layers)
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

    /// The layers; none where nothing faces the light. Submits what was recorded so far.
    pub fn fit(&self, view: &mut View) -> Result<Vec<Fitted>> {
        let samples = view.sampled_receivers(self.sample_resolution)?;
        let facing = samples.facing_the_light();
        let chosen = match self.samples {
            Choice::Facing => facing,
            Choice::Boundary | Choice::Shadow => {
                let focused = self.focused_layers(view, &samples, &facing);
                if focused.is_empty() {
                    return Ok(vec![]);
                }
                let plans = focused.into_iter().map(Plan::from).collect();
                let visibility =
                    view.sampled_visibility(&samples, &self.map.without_filter(), plans)?;
                self.chosen(&samples, facing, &visibility)
            }
        };
        let parts = parts_of_receivers(view, &samples, chosen);
        let start = Instant::now();
        let resolution = self.map.resolution;
        let mut h = 0.0;
        let mut layers = Vec::new();
        for part in &parts {
            let own = self.samples_of(view, part, &samples);
            let Some(matrix) = self.matrix(part, &own, parts.len() == 1) else {
                continue;
            };
            h += matrix.h(&own);
            layers.push(Fitted {
                projection: projection(view, &part.subject, &matrix, resolution),
                region: part.region.clone(),
            });
        }
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        view.frame().add_time(LABEL, milliseconds);
        view.measure("h", h);
        Ok(layers)
    }

    fn size(&self) -> MapSize {
        MapSize {
            texels: f64::from(self.map.resolution),
            margin: self.margin,
        }
    }

    /// What boundaries are found with.
    fn focused_layers(
        &self,
        view: &mut View,
        samples: &SampledReceivers,
        facing: &[usize],
    ) -> Vec<Fitted> {
        let parts = parts_of_receivers(view, samples, facing.to_vec());
        let layers = parts.into_iter().filter_map(|part| {
            let matrix = focused(&part.subject, self.size())?;
            Some(Fitted {
                projection: projection(view, &part.subject, &matrix, self.map.resolution),
                region: part.region,
            })
        });
        layers.collect()
    }

    /// The samples that the map is for; all that face the light where there is no shadow.
    fn chosen(
        &self,
        samples: &SampledReceivers,
        facing: Vec<usize>,
        visibility: &[f32],
    ) -> Vec<usize> {
        let is_chosen = |&i: &usize| {
            let is_dark = visibility[i] == 0.0;
            let at_boundary = samples
                .neighbours(i)
                .any(|j| samples.is_facing(j) && visibility[j] != visibility[i]);
            at_boundary || (is_dark && self.samples == Choice::Shadow)
        };
        let chosen: Vec<_> = facing.iter().copied().filter(is_chosen).collect();
        if chosen.is_empty() { facing } else { chosen }
    }

    /// What h is summed over: some of the part's samples with derivatives to rely on.
    fn samples_of(&self, view: &View, part: &Part, samples: &SampledReceivers) -> Vec<Sample> {
        let is_smooth = |i: &&usize| samples.is_smooth(**i) && !is_grazed(view, samples, **i);
        let smooth: Vec<_> = part.samples.iter().filter(is_smooth).collect();
        let all: Vec<_> = part.samples.iter().collect();
        let usable = if smooth.is_empty() { all } else { smooth };
        let step = usable.len().div_ceil(MAX_SAMPLES).max(1);
        let spread = usable.into_iter().step_by(step);
        spread
            .map(|&i| {
                let (point, normal) = (samples.points[i], samples.normals[i]);
                Sample::new(&part.subject.rays, view.camera, point, normal)
            })
            .collect()
    }

    fn matrix(&self, part: &Part, own: &[Sample], is_only: bool) -> Option<LightMatrix> {
        let (hull, size) = (&part.subject.hull, self.size());
        let mut best = optimize(DVec3::Z, hull, own, size)?;
        if self.optimizer == Optimizer::Simplex {
            best = descend(best, hull, own, size);
        }
        let previous = self.previous.filter(|_| is_only).and_then(|previous| {
            let rows = [0, 1, 3].map(|row| previous.row(row));
            let [x, y, w] = part.subject.rays.covectors(rows);
            // Scale and shift anew, so that it holds every sample.
            hull.fit_box([x, y].map(|row| row / w.length()), w.normalize(), size)
        });
        // Section 2.3, step 5.
        let is_kept = |previous: &LightMatrix| {
            best.median_badness(own) >= SUFFICIENT * previous.median_badness(own)
        };
        previous.filter(is_kept).or(Some(best))
    }
}

/// Whether a sample's surface is nearly edge-on to the light: one such sample weighs as much as all the
/// others in h, though nothing is seen there. Measured over 14 lights on objects on a floor: without
/// these the map leaves 9 % fewer wrong pixels.
fn is_grazed(view: &View, samples: &SampledReceivers, index: usize) -> bool {
    let to_light = view.light.vector_from_point(samples.points[index]);
    samples.normals[index].dot(to_light) < LEAST_COSINE * to_light.length()
}

/// About three degrees.
const LEAST_COSINE: f64 = 0.05;

/// More samples take longer and change the matrix little.
const MAX_SAMPLES: usize = 400;

/// The median of a new matrix must be below this share of the old one's.
const SUFFICIENT: f64 = 0.8;
