//! A warp whose functions or samples somebody gives, over the maps of a fit.
//!
//! Parameters: those of every map, and `functions` or `samples`, `fit`, `snap`, `rotation`.
//!
//! Limits: the warp is for what the fit made when it was found; it does not follow the receivers. The GPU engine has no
//! warps by samples, nor has straight rasterization.

use super::arrays::{WarpFunctions, WarpSamples};
use super::fit::WarpedMaps;
use super::prelude::*;
use crate::gpu::passes::rasterize::max_bands;
use crate::map_settings::Rasterization;
use crate::verbs::WarpedLayer;

parameters! {
    pub struct GivenWarp {
        pub map: MapParameters,
        pub functions: Option<WarpFunctions> = optional(Rule::Functions),
        pub samples: Option<WarpSamples> = optional(Rule::Samples),
        pub maps: WarpedMaps,
    }
}

impl ShadowMethod for GivenWarp {
    const NAME: &'static str = "given_warp";
    const TITLE: &'static str = "Warp that is given";
    const CITATION: &'static str = "";
    const IS_GIVEN: bool = true;

    fn is_on_gpu(&self) -> bool {
        self.samples.is_none()
    }

    fn check(&self) -> Result<()> {
        let size = self.map.resolution;
        let most = max_bands(size.width, size.height) as usize;
        let count = self.functions.as_ref().map_or(0, |given| given.functions);
        let is_exact = self.map.texels.rasterization == Rasterization::Exact;
        ensure_value!(
            !is_exact || count <= most,
            "functions must be at most {most} along each axis with a map of {size} texels, got {count}"
        );
        ensure_value!(
            self.functions.is_none() || self.samples.is_none(),
            "functions and samples must not both be given"
        );
        ensure_value!(
            is_exact || self.samples.is_none(),
            "rasterization must be 'exact' with samples, between which no edge is straight, got 'linear'"
        );
        self.maps.check()
    }

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let layers = self.maps.layers(view, self.map.resolution)?;
        let (name, count) = match (&self.functions, &self.samples) {
            (Some(functions), _) => ("functions", functions.layers),
            (_, Some(samples)) => ("samples", samples.layers()),
            _ => return mapped_shadows(view, self.map.settings(), layers),
        };
        ensure_value!(
            layers.is_empty() || count.is_none_or(|count| count == layers.len()),
            "{name} must be of one layer, or of as many as the fit makes here, {}, got {}",
            layers.len(),
            count.unwrap_or(1)
        );
        let mut warped = Vec::new();
        for (i, layer) in layers.into_iter().enumerate() {
            warped.push(WarpedLayer {
                warp: Some(self.warp(view, i)?),
                ..LayerOf::<V>::from(layer)
            });
        }
        view.shadows(self.map.settings(), warped)
    }
}

impl GivenWarp {
    /// That of a layer.
    fn warp<'a, V: Verbs<'a>>(&self, view: &mut V, layer: usize) -> Result<V::Warp> {
        let texels = self.map.resolution;
        if let Some(samples) = &self.samples {
            let tables = &samples.tables;
            return view.sampled_warp(&tables[layer % tables.len()], texels);
        }
        let given = self.functions.as_ref().expect("one of the two is given");
        let mut warp = view.warp(given.functions as u32, given.boundaries as u32 - 1, texels)?;
        let size = 2 * given.functions * given.boundaries;
        let mut values = given.values.chunks_exact(size).cycle();
        view.set_functions(&mut warp, values.nth(layer).expect("one layer at least"));
        view.finish_warp(&mut warp, texels);
        Ok(warp)
    }
}
