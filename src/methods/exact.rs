//! Exact: an irregular z-buffer. No pixel is wrong, and nothing is reused between frames, so that geometry
//! may move.
//!
//! A shadow map settles most receivers that are in shadow: the triangle in their texel meets their own
//! light ray. The others are listed in the texels of the light's grid that they fall in; each caster is
//! tested against the receivers in the texels that it may touch, in each receiver's own light ray. Where
//! many receivers share a texel the lists grow long; a warp spreads them evenly.
//!
//! The CPU engine turns this round: there the triangles are listed in the cells of the light's grid, and each
//! receiver is tested against those in its cell, which has a finer grid where many small triangles are in it.
//! Neither parameter plays a part in that.
//!
//! Gregory Johnson, Juhyun Lee, Christopher Burns, William Mark. The irregular Z-buffer: hardware
//! acceleration for irregular data structures. ACM TOG 24(4), 2005. Timo Aila, Samuli Laine. Alias-free
//! shadow maps. EGSR 2004. The warps are those of `notw` and `rtw`.
//!
//! Parameters: `resolution`, `warp`.
//!
//! Limits: time grows with the casters whose bound holds receivers, whether they shadow them or not.

use super::prelude::*;
use super::warps::{non_orthogonal, rectilinear};
use crate::fits::boxes::fit_straight_boxes;
use crate::gpu::passes::light_grid::{GRID_TILE, LARGEST_RESOLUTION};
use crate::importance::{Factors, Importance};
use crate::warp::CountFit;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Warp {
    None,
    Rectilinear,
    NonOrthogonal,
}

/// Functions of a warp along each axis, and cells of each: fewer than a shadow map's, because a fine
/// warp makes the bounds of casters wide.
const CELLS: u32 = 128;

const WARPS: Choices<Warp> = &[
    ("none", Warp::None),
    ("rtw", Warp::Rectilinear),
    ("notw", Warp::NonOrthogonal),
];

parameters! {
    pub struct Exact {
        /// Texels along each side of the grid; `None` for about two texels to a receiver.
        pub resolution: Option<u32> = count(None, LARGEST_RESOLUTION, "texels"),
        /// Measured on two scenes of 260,000 triangles: the warps shorten the longest list to a fifth, but
        /// casters' bounds grow, and frames take 1.2 to 2.2 times as long.
        pub warp: Warp = choice(WARPS, "none"),
    }
}

impl ShadowMethod for Exact {
    const NAME: &'static str = "exact";
    const TITLE: &'static str = "Exact (irregular z-buffer)";
    const CITATION: &'static str = "Johnson, G., Lee, J., Burns, C., and Mark, W. 2005. The \
         irregular Z-buffer. ACM Transactions on Graphics 24(4).";

    fn record<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<V::Recorded> {
        view.exact(|view| {
            let layers = self.fit(view)?.into_iter();
            let warped = layers.map(|layer| match self.warp {
                Warp::None => Ok(LayerOf::<V>::from(layer)),
                Warp::Rectilinear => by_distance(view, layer),
                Warp::NonOrthogonal => by_count(view, layer),
            });
            warped.collect()
        })
    }
}

/// Texels along each side of a grid whose size follows from the receivers, at least.
const FEWEST_TEXELS: u32 = 64;

/// Standard deviation of the blur of `rtw`, in cells.
const RTW_BLUR: f64 = 3.0;

impl Exact {
    /// The desired view's layers, but all of them with straight edges: a cone that is too wide for one
    /// perspective takes faces of a cube.
    fn fit<'a, V: Verbs<'a>>(&self, view: &mut V) -> Result<Vec<Layer>> {
        let layers = fit_straight_boxes(view, MapSize::square(FEWEST_TEXELS))?;
        let resolution = self.resolution.unwrap_or_else(|| {
            let receivers = f64::from(view.facing_count()) / layers.len().max(1) as f64;
            let side = ((2.0 * receivers).sqrt() as u32).next_multiple_of(GRID_TILE);
            side.clamp(FEWEST_TEXELS, LARGEST_RESOLUTION)
        });
        let layers = layers.iter();
        Ok(layers
            .map(|layer| layer.with_resolution(resolution))
            .collect())
    }
}

fn by_distance<'a, V: Verbs<'a>>(view: &mut V, layer: Layer) -> Result<LayerOf<'a, V>> {
    rectilinear(view, layer, CELLS, RTW_BLUR, |view, layer| {
        let factors = Factors {
            distance: true,
            ..Factors::NONE
        };
        view.importance_map(layer, CELLS, Importance::Maximum, factors, None)
    })
}

fn by_count<'a, V: Verbs<'a>>(view: &mut V, layer: Layer) -> Result<LayerOf<'a, V>> {
    let fit = CountFit {
        smoothing: f64::from(CELLS) / 16.0,
        exponent: 1.0,
        even_share: 0.0,
    };
    non_orthogonal(view, layer, [CELLS; 2], fit, |view, layer, along, warp| {
        let counted = Importance::Count { along, unit: 1.0 };
        view.importance_map(layer, CELLS, counted, Factors::NONE, Some(warp))
    })
}
