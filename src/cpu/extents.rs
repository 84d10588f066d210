//! How far receivers reach in a view of the light.

use super::lanes::{Simd, dispatch, f32x8, level, mask32x8};
use super::receivers::{
    BlockPlaces, BlockReceivers, KnownPlanes, Receivers, ViewFromEye, masks_of_views,
};
use super::tiles::BLOCK;
use fearless_simd::prelude::*;
use rayon::prelude::*;

/// The row of each block whose receivers are samples of all.
const SAMPLED_ROW: usize = 3;

/// The extents of some receivers in each view: of a row of every block, or of every so many blocks along each axis.
pub fn sampled_extents(receivers: &Receivers, seen: &[ViewFromEye], spacing: usize) -> Vec<Extent> {
    let step = spacing * BLOCK;
    let rows = receivers.image.tiling.height.div_ceil(step);
    extents_of_jobs(seen.len(), rows, |i, extents| {
        dispatch!(level(), simd => extents_of_rows(simd, receivers, seen, (i * step, step), extents));
    })
}

#[inline(always)]
fn extents_of_rows<S: Simd>(
    simd: S,
    receivers: &Receivers,
    seen: &[ViewFromEye],
    (y, step): (usize, usize),
    extents: &mut [Extent],
) {
    let mut known = KnownPlanes::default();
    let mut block = BlockReceivers::none(simd);
    let mut places = BlockPlaces::none(simd);
    let row = SAMPLED_ROW.min(receivers.image.tiling.height - y - 1);
    for x in (0..receivers.image.tiling.width).step_by(step) {
        if receivers.block(simd, (x, y), row..row + 1, &mut known, &mut block) {
            let masks = masks_of_views(simd, receivers.light_at, &block, seen.len());
            add_extents(simd, seen, &block, &masks, &mut places, extents);
        }
    }
}

/// Adds the receivers of a block that each view sees to its extent.
#[inline(always)]
pub fn add_extents<S: Simd>(
    simd: S,
    views: &[ViewFromEye],
    block: &BlockReceivers<S>,
    masks: &[[u32; BLOCK]],
    places: &mut BlockPlaces<S>,
    extents: &mut [Extent],
) {
    for ((view, mask), extent) in views.iter().zip(masks).zip(extents) {
        if *mask != [0; BLOCK] {
            view.places(simd, block, mask, places);
            extent.add(simd, places, mask);
        }
    }
}

/// The extents in so many views of what jobs find, each on its own.
pub fn extents_of_jobs(
    views: usize,
    jobs: usize,
    find: impl Fn(usize, &mut [Extent]) + Sync + Send,
) -> Vec<Extent> {
    let none = || vec![Extent::EMPTY; views];
    let of_job = |job: usize| {
        let mut extents = none();
        find(job, &mut extents);
        extents
    };
    let both =
        |a: Vec<Extent>, b: Vec<Extent>| a.into_iter().zip(b).map(|(a, b)| a.and(b)).collect();
    (0..jobs).into_par_iter().map(of_job).reduce(none, both)
}

/// Least and greatest place of receivers, and how near they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    pub low: [f32; 3],
    pub high: [f32; 3],
}

impl Extent {
    pub const EMPTY: Self = Self {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    pub fn is_empty(&self) -> bool {
        self.low[0] > self.high[0]
    }

    /// The part that is in both.
    pub fn common(self, other: Self) -> Self {
        let both = Self {
            low: std::array::from_fn(|i| self.low[i].max(other.low[i])),
            high: std::array::from_fn(|i| self.high[i].min(other.high[i])),
        };
        let is_empty = both.low[0] > both.high[0] || both.low[1] > both.high[1];
        if is_empty { Self::EMPTY } else { both }
    }

    pub fn widened(self, by: f32) -> Self {
        Self {
            low: self.low.map(|low| low - by),
            high: self.high.map(|high| high + by),
        }
    }

    pub fn and(self, other: Self) -> Self {
        Self {
            low: std::array::from_fn(|i| self.low[i].min(other.low[i])),
            high: std::array::from_fn(|i| self.high[i].max(other.high[i])),
        }
    }

    #[inline(always)]
    pub fn add<S: Simd>(&mut self, simd: S, places: &BlockPlaces<S>, masks: &[u32; BLOCK]) {
        let mut low = [f32x8::simd_from(simd, f32::INFINITY); 3];
        let mut high = [f32x8::simd_from(simd, f32::NEG_INFINITY); 3];
        for (i, &mask) in masks.iter().enumerate() {
            if mask == 0 {
                continue;
            }
            let mask = mask32x8::from_bitmask(simd, u64::from(mask));
            let values = [places.u[i], places.v[i], places.nearness[i]];
            for k in 0..3 {
                low[k] = mask.select(low[k].min(values[k]), low[k]);
                high[k] = mask.select(high[k].max(values[k]), high[k]);
            }
        }
        for k in 0..3 {
            self.low[k] = self.low[k].min(low[k].reduce_min());
            self.high[k] = self.high[k].max(high[k].reduce_max());
        }
    }
}
