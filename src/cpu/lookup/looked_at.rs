//! Which texels of a map without a warp receivers look at, without a look.

use super::{BlockLookup, Formula};
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, splat};
use crate::cpu::receiver_tiles::ReceiverTiles;
use crate::cpu::tiles::BLOCK;
use crate::lanes::{Lane, V2};
use crate::map_size::MapSize;
use crate::projection::Formulas;
use fearless_simd::prelude::*;

/// Blocks of the map that a block of receivers is taken to look at together, along each axis: if they look at more, each
/// is asked on its own.
const FEW_BLOCKS: usize = 4;

impl<S: Simd> BlockLookup<'_, S> {
    /// Marks what the receivers of a block look at.
    #[inline(always)]
    pub(super) fn mark_block<F: Formulas<f32x8<S>>>(
        &mut self,
        (kind, rule): Formula<'_, S, F>,
        tiles: &ReceiverTiles,
    ) {
        let simd = self.simd;
        let nothing = V2::splat(splat(simd, 0.0));
        let (mut middles, mut asking) = ([nothing; BLOCK], [0; BLOCK]);
        let mut low = V2::splat(splat(simd, f32::INFINITY));
        let mut high = nothing;
        for i in self.rows() {
            let row = self.row(kind, rule, i);
            let keep = |new: f32x8<S>, old: f32x8<S>| Lane::select(row.on_map, new, old);
            low = row.middle.zip(low, |at, low| keep(Lane::min(at, low), low));
            high = row
                .middle
                .zip(high, |at, high| keep(Lane::max(at, high), high));
            (middles[i], asking[i]) = (row.middle, mask_bits(row.on_map));
        }
        if asking == [0; BLOCK] {
            return;
        }
        let low = [low.x.reduce_min(), low.y.reduce_min()];
        let high = [high.x.reduce_max(), high.y.reduce_max()];
        let (first, last) = self.reached(low, high);
        if (0..2).all(|k| last[k] / BLOCK - first[k] / BLOCK < FEW_BLOCKS) {
            return tiles.add(first, last);
        }
        for (middle, asking) in middles.into_iter().zip(asking) {
            self.mark_each(tiles, middle, asking);
        }
    }

    /// Marks the texels around those of some receivers.
    #[inline(always)]
    fn mark_each(&self, tiles: &ReceiverTiles, texel: V2<f32x8<S>>, asking: u32) {
        let (x, y): ([f32; LANES], [f32; LANES]) = (texel.x.into(), texel.y.into());
        for lane in bits(asking) {
            let texel = [x[lane], y[lane]];
            let (first, last) = self.reached(texel, texel);
            tiles.add(first, last);
        }
    }

    /// First and last column and row of the texels around some, as far as the map goes.
    #[inline(always)]
    pub(super) fn reached(&self, low: [f32; 2], high: [f32; 2]) -> ([usize; 2], [usize; 2]) {
        let reach = f32::from(self.layer.comparison.reach);
        let MapSize { width, height } = self.layer.texels;
        let last = [width, height].map(|size| size as usize - 1);
        (
            // What is below nothing becomes nothing.
            std::array::from_fn(|k| ((low[k] - reach) as usize).min(last[k])),
            std::array::from_fn(|k| ((high[k] + reach) as usize).min(last[k])),
        )
    }
}
