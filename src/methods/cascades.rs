//! Cascades: the view is cut into slabs of depth, each with a map of its own.
//!
//! Near slabs are thin, so that their texels are small where pixels are. Each map is the box of the
//! receivers in its slab.
//!
//! Fan Zhang, Hanqiu Sun, Leilei Xu, Lee Kit Lun. Parallel-split shadow maps for large-scale virtual
//! environments. VRCIA 2006, for uniform, logarithmic and practical splits; Andrew Lauritzen, Marco
//! Salvi, Aaron Lefohn. Sample distribution shadow maps. I3D 2011, for splits and boxes from the
//! receivers.
//!
//! Parameters: those of every map, and `layers`, `splits`, `weight`, `sample_resolution`, `snap`.
//!
//! Limits: each layer has `resolution` texels along its sides, and is drawn on its own. The faces of a
//! cube around a point are not split.

use super::parameters::{SAMPLE_RESOLUTION, SNAP};
use super::schema::{Choices, FRACTION, Groups, Rule, count, number, word};
use super::view::SampledReceivers;
use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, View};
use crate::error::Result;
use crate::fits::boxes::{Cut, cut_layers, layers_of_light};
use crate::fits::snapping::stepped;
use crate::frustum::visible_part;
use crate::region::{HalfSpace, Region};

/// Where the view is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Splits {
    /// Slabs of one thickness, between the camera's planes.
    Uniform,
    /// Each slab so many times as far as the one before, between the camera's planes.
    Logarithmic,
    /// Between the two.
    Practical,
    /// Logarithmic, between the nearest and the farthest receiver that faces the light.
    Receivers,
    /// As many receivers in each.
    Quantiles,
}

const SPLITS: Choices<Splits> = &[
    ("receivers", Splits::Receivers),
    ("quantiles", Splits::Quantiles),
    ("practical", Splits::Practical),
    ("logarithmic", Splits::Logarithmic),
    ("uniform", Splits::Uniform),
];

const MAX_LAYERS: u32 = 8;

#[derive(Debug, Clone, PartialEq)]
pub struct Cascades {
    pub map: MapParameters,
    pub layers: u32,
    splits: Splits,
    /// Of the logarithmic in the practical splits.
    pub weight: f64,
    /// Receivers looked at along the longer side of the image.
    pub sample_resolution: u32,
    /// Whether texels hold still while the receivers move.
    pub snaps: bool,
}

impl ShadowMethod for Cascades {
    const NAME: &'static str = "cascades";
    const TITLE: &'static str = "Cascades";
    const CITATION: &'static str = "Zhang, F., Sun, H., Xu, L., and Lun, L. K. 2006. Parallel-split \
         shadow maps for large-scale virtual environments. VRCIA. Lauritzen, A., Salvi, M., and \
         Lefohn, A. 2011. Sample distribution shadow maps. I3D.";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        &[
            count("layers", Some(4), MAX_LAYERS, "layers"),
            word("splits", "receivers", Rule::Choice(&SPLITS)),
            number("weight", Some(0.5), FRACTION, ""),
            SAMPLE_RESOLUTION,
            SNAP,
        ],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            layers: parameters.get("layers"),
            splits: parameters.choice("splits", SPLITS),
            weight: parameters.get("weight"),
            sample_resolution: parameters.get("sample_resolution"),
            snaps: parameters.get("snap"),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let depths = self.split_depths(view)?;
        let layers = slabs(view, &depths);
        let fitted = cut_layers(
            view,
            layers,
            Cut::to_receivers(self.snaps),
            self.map.resolution,
        )?;
        view.shadows(&self.map, fitted)
    }
}

impl Cascades {
    /// Depths along the viewing direction between one slab and the next, ascending. Submits what was
    /// recorded so far where the receivers are asked.
    fn split_depths(&self, view: &mut View) -> Result<Vec<f64>> {
        let shares = (1..self.layers).map(|i| f64::from(i) / f64::from(self.layers));
        if matches!(self.splits, Splits::Receivers | Splits::Quantiles) {
            let samples = view.sampled_receivers(self.sample_resolution)?;
            let depths = depths_of(&samples);
            let (Some(near), Some(far)) = (depths.first(), depths.last()) else {
                return Ok(vec![]);
            };
            // Slabs that grow in steps.
            let held = |depth: f64| if self.snaps { stepped(depth) } else { depth };
            let quantile = |share: f64| held(depths[(share * depths.len() as f64) as usize]);
            return Ok(if self.splits == Splits::Quantiles {
                shares.map(quantile).collect()
            } else {
                shares
                    .map(|share| logarithmic(held(*near), held(*far), share))
                    .collect()
            });
        }
        let camera = view.camera;
        let corners = visible_part(camera, view.scene.bounds());
        let depths = corners
            .iter()
            .map(|c| (*c - camera.eye).dot(camera.forward));
        let (near, far) = (camera.znear, depths.fold(camera.znear, f64::max));
        let weight = match self.splits {
            Splits::Uniform => 0.0,
            Splits::Logarithmic => 1.0,
            _ => self.weight,
        };
        // Zhang et al., section 3.3.
        let depth = |share: f64| {
            let uniform = near + (far - near) * share;
            weight * logarithmic(near, far, share) + (1.0 - weight) * uniform
        };
        Ok(shares.map(depth).collect())
    }
}

fn logarithmic(near: f64, far: f64, share: f64) -> f64 {
    near * (far / near).powf(share)
}

/// Depths of the samples that face the light, ascending.
fn depths_of(samples: &SampledReceivers) -> Vec<f64> {
    let facing = samples.facing_the_light().into_iter();
    let mut depths: Vec<_> = facing.map(|i| samples.depths[i]).collect();
    depths.sort_unstable_by(f64::total_cmp);
    depths
}

/// The axes of a layer for each slab; the first and the last have no end.
fn slabs(view: &View, depths: &[f64]) -> Vec<Fitted> {
    let layers = layers_of_light(view);
    let [layer] = &layers[..] else {
        return layers;
    };
    let camera = view.camera;
    let plane = |depth: f64, normal| HalfSpace {
        origin: camera.eye + camera.forward * depth,
        normal,
    };
    let slab = |i: usize| {
        let near = i.checked_sub(1).map(|i| plane(depths[i], camera.forward));
        let far = depths.get(i).map(|depth| plane(*depth, -camera.forward));
        Fitted {
            region: Region::new(near.into_iter().chain(far).collect()),
            projection: layer.projection.clone(),
        }
    };
    (0..=depths.len()).map(slab).collect()
}
