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

use super::method::ShadowMethod;
use super::parameters::{MapParameters, SAMPLE_RESOLUTION, SNAP};
use super::schema::{Choices, FRACTION, Groups, Parameters, Rule, count, number, word};
use crate::error::Result;
use crate::fits::cascades::{Slabs, Splits, fit_cascades};
use crate::gpu::view::{Recorded, View};

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
        let slabs = Slabs {
            count: self.layers,
            splits: self.splits,
            weight: self.weight,
            sample_resolution: self.sample_resolution,
            snaps: self.snaps,
        };
        let layers = fit_cascades(view, slabs, self.map.resolution)?;
        view.shadows(self.map.settings(), layers)
    }
}
