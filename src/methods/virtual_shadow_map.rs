//! Virtual shadow maps: a map far larger than memory, in pages, of which only those are drawn that receivers look at.
//!
//! Each receiver looks into the level whose texels are no wider than its pixel is on the surface. So texels are where
//! pixels are, whatever the scene, and there is no split to choose and no warp to fit.
//!
//! Aaron Lefohn, Shubhabrata Sengupta, John Owens. Resolution-matched shadow maps. ACM Transactions on Graphics 26(4),
//! 2007; Markus Giegl, Michael Wimmer. Queried virtual shadow maps. I3D 2007, for levels in powers of two and a bound on
//! memory.
//!
//! Parameters: those of every map, where `resolution` is that of the finest level; `page_size`, `pages`, `level_bias`, and
//! `cut`: `receivers` or `scene`.
//!
//! Limits: where more pages are asked for than may be stored, all receivers look into coarser levels. Each level is a pass
//! over the casters. Straight rasterization has no pages, and only the CPU engine keeps those of the frame before.

use super::parameters::TexelParameters;
use super::prelude::*;
use super::schema::{Least, MAX_RESOLUTION, map_size};
use crate::fits::pages::{PagesOver, fit_pages};
use crate::map_settings::{Comparison, Rasterization};
use crate::paging::{MIN_PAGE_SIZE, Paging};

const CUTS: Choices<PagesOver> = &[
    ("receivers", PagesOver::Receivers),
    ("scene", PagesOver::Scene),
];

const MAX_PAGE_SIZE: u32 = 4096;

/// There are no more in the finest level of one map.
const MAX_PAGES: u32 = (MAX_RESOLUTION / MIN_PAGE_SIZE).pow(2);

const FINITE: Rule = Rule::Number {
    least: Least::Any,
    max: f64::INFINITY,
};

parameters! {
    pub struct VirtualShadowMap {
        /// Of the finest level, which is a square.
        pub resolution: MapSize = map_size(16384, MAX_RESOLUTION, "texels"),
        pub texels: TexelParameters,
        pub page_size: u32 = count(Some(128), MAX_PAGE_SIZE, "texels"),
        pub pages: u32 = count(Some(4096), MAX_PAGES, "pages"),
        /// Levels by which each receiver's is coarser than the one that matches its pixel.
        pub level_bias: f64 = number(Some(0.0), FINITE, "levels"),
        pub cut: PagesOver = choice(CUTS, "receivers"),
    }
}

impl ShadowMethod for VirtualShadowMap {
    const NAME: &'static str = "virtual";
    const TITLE: &'static str = "Virtual shadow map";
    const CITATION: &'static str = "Lefohn, A. E., Sengupta, S., and Owens, J. D. 2007. \
         Resolution-matched shadow maps. ACM Transactions on Graphics 26(4). Giegl, M., and Wimmer, M. \
         2007. Queried virtual shadow maps. I3D.";

    fn check(&self) -> Result<()> {
        ensure_value!(
            self.resolution.is_square(),
            "resolution must be one whole number of texels with method '{}', whose pages are squares and whose levels \
             follow from the area of a texel, got ({}, {})",
            Self::NAME,
            self.resolution.width,
            self.resolution.height
        );
        ensure_value!(
            self.page_size.is_power_of_two() && self.page_size >= MIN_PAGE_SIZE,
            "page_size must be a power of two from {MIN_PAGE_SIZE} to {MAX_PAGE_SIZE}, got {}",
            self.page_size
        );
        ensure_value!(
            self.texels.rasterization == Rasterization::Exact,
            "rasterization must be 'exact' with method '{}', got 'linear'",
            Self::NAME
        );
        let Comparison {
            moments,
            is_revectorized,
            ..
        } = self.texels.lookup;
        ensure_value!(
            moments.is_none() && !is_revectorized,
            "lookup must be a depth test, triangles or a lixel.Pcf with method '{}', got one that looks at texels which \
             no receiver asks for",
            Self::NAME
        );
        Ok(())
    }

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        let maps = fit_pages(view, self.cut, self.resolution.width)?;
        ensure_value!(
            maps.len() <= self.pages as usize,
            "pages must be at least {}, one for each map of the light, got {}",
            maps.len(),
            self.pages
        );
        let paging = Paging {
            page_size: self.page_size,
            max_pages: self.pages,
            level_bias: self.level_bias,
            keeps: self.cut == PagesOver::Scene,
        };
        view.paged_shadows(self.texels.settings(), maps, paging)
    }
}
