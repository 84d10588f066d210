//! Cascades: the view is cut into slabs of depth, each with a map of its own.
//!
//! Near slabs are thin, so that their texels are small where pixels are. Each map is the box of the
//! receivers in its slab, or of the slab of the view frustum.
//!
//! Fan Zhang, Hanqiu Sun, Leilei Xu, Lee Kit Lun. Parallel-split shadow maps for large-scale virtual
//! environments. VRCIA 2006, for uniform, logarithmic and practical splits; Andrew Lauritzen, Marco
//! Salvi, Aaron Lefohn. Sample distribution shadow maps. I3D 2011, for splits and boxes from the
//! receivers.
//!
//! Parameters: those of every map, and `layers`, `splits`, `weight`, `boxes`, `sample_resolution`, `snap`, `rotation`.
//!
//! Limits: each layer has `resolution` texels along its sides, and is drawn on its own. The faces of a
//! cube around a point are not split.

use super::prelude::*;
use crate::fits::cascades::{Boxes, Slabs, Splits, fit_cascades};

const SPLITS: Choices<Splits> = &[
    ("receivers", Splits::Receivers),
    ("quantiles", Splits::Quantiles),
    ("practical", Splits::Practical),
    ("logarithmic", Splits::Logarithmic),
    ("uniform", Splits::Uniform),
];

const BOXES: Choices<Boxes> = &[("receivers", Boxes::Receivers), ("slabs", Boxes::Slabs)];

const MAX_LAYERS: u32 = 8;

parameters! {
    pub struct Cascades {
        pub map: MapParameters,
        pub layers: u32 = count(Some(4), MAX_LAYERS, "layers"),
        pub splits: Splits = choice(SPLITS, "receivers"),
        /// Of the logarithmic in the practical splits.
        pub weight: f64 = number(Some(0.5), FRACTION, ""),
        pub boxes: Boxes = choice(BOXES, "receivers"),
        pub sample_resolution: u32 = SAMPLE_RESOLUTION,
        pub snap: bool = SNAP,
        pub rotation: Option<f64> = ROTATION,
    }
}

impl ShadowMethod for Cascades {
    const NAME: &'static str = "cascades";
    const TITLE: &'static str = "Cascades";
    const CITATION: &'static str = "Zhang, F., Sun, H., Xu, L., and Lun, L. K. 2006. Parallel-split \
         shadow maps for large-scale virtual environments. VRCIA. Lauritzen, A., Salvi, M., and \
         Lefohn, A. 2011. Sample distribution shadow maps. I3D.";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = fit_cascades(view, self.slabs(), self.map.resolution)?;
        mapped_shadows(view, self.map.settings(), layers)
    }
}

impl Cascades {
    pub fn slabs(&self) -> Slabs {
        Slabs {
            count: self.layers,
            splits: self.splits,
            weight: self.weight,
            boxes: self.boxes,
            sample_resolution: self.sample_resolution,
            snaps: self.snap,
            rotation: self.rotation.into(),
        }
    }
}
