//! A warp whose functions somebody gives, over the maps of a fit.
//!
//! Parameters: those of every map, and `functions`, `fit`, `snap`, `rotation`.
//!
//! Limits: the functions are for what the fit made when they were found; they do not follow the receivers.

use super::fit::WarpedMaps;
use super::prelude::*;
use super::schema::WarpFunctions;
use crate::gpu::passes::rasterize::max_bands;
use crate::map_settings::Rasterization;
use crate::verbs::WarpedLayer;

parameters! {
    pub struct GivenWarp {
        pub map: MapParameters,
        pub functions: Option<WarpFunctions> = optional(Rule::Functions),
        pub maps: WarpedMaps,
    }
}

impl ShadowMethod for GivenWarp {
    const NAME: &'static str = "given_warp";
    const TITLE: &'static str = "Warp that is given";
    const CITATION: &'static str = "";
    const IS_GIVEN: bool = true;

    fn check(&self) -> Result<()> {
        let resolution = self.map.resolution;
        let most = max_bands(resolution, resolution) as usize;
        let count = self.functions.as_ref().map_or(0, |given| given.functions);
        ensure_value!(
            self.map.texels.rasterization != Rasterization::Exact || count <= most,
            "functions must be at most {most} along each axis with a map of {resolution} texels, got {count}"
        );
        self.maps.check()
    }

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let resolution = self.map.resolution;
        let layers = self.maps.layers(view, resolution)?;
        let Some(given) = &self.functions else {
            return mapped_shadows(view, self.map.settings(), layers);
        };
        let count = given.layers.unwrap_or(layers.len());
        ensure_value!(
            layers.is_empty() || count == layers.len(),
            "functions must be of one layer, or of as many as the fit makes here, {}, got {count}",
            layers.len()
        );
        let (functions, cells) = (given.functions as u32, given.boundaries as u32 - 1);
        let size = 2 * given.functions * given.boundaries;
        let values = given.values.chunks_exact(size).cycle();
        let mut warped = Vec::new();
        for (layer, values) in layers.into_iter().zip(values) {
            let mut warp = view.warp(functions, cells, resolution)?;
            view.set_functions(&mut warp, values);
            view.finish_warp(&mut warp, resolution);
            warped.push(WarpedLayer {
                warp: Some(warp),
                ..LayerOf::<V>::from(layer)
            });
        }
        view.shadows(self.map.settings(), warped)
    }
}
