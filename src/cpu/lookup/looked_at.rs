//! Which texels of a map without a warp receivers look at, without a look.

use super::{BlockLookup, Formula};
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, mask32x8, splat};
use crate::cpu::receiver_tiles::ReceiverTiles;
use crate::cpu::tiles::BLOCK;
use crate::lanes::{Lane, V2};
use crate::map_size::MapSize;
use crate::projection::Formulas;
use fearless_simd::prelude::*;

/// Blocks of the map that a block of receivers is taken to look at together, along each axis: if they look at more, each
/// is asked on its own.
const FEW_BLOCKS: usize = 4;

/// Least and greatest of the texels of receivers, lane by lane.
pub(super) struct TexelBox<S: Simd> {
    low: V2<f32x8<S>>,
    high: V2<f32x8<S>>,
}

impl<S: Simd> TexelBox<S> {
    #[inline(always)]
    pub(super) fn empty(simd: S) -> Self {
        Self {
            low: V2::splat(splat(simd, f32::INFINITY)),
            high: V2::splat(splat(simd, 0.0)),
        }
    }

    #[inline(always)]
    pub(super) fn add(&mut self, texel: V2<f32x8<S>>, on_map: mask32x8<S>) {
        let keep = |new, old| Lane::select(on_map, new, old);
        self.low = texel.zip(self.low, |at, low| keep(Lane::min(at, low), low));
        self.high = texel.zip(self.high, |at, high| keep(Lane::max(at, high), high));
    }
}

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
        let mut texels = TexelBox::empty(simd);
        for i in self.rows() {
            let row = self.row(kind, rule, i);
            texels.add(row.middle, row.on_map);
            (middles[i], asking[i]) = (row.middle, mask_bits(row.on_map));
        }
        if asking == [0; BLOCK] {
            return;
        }
        let (first, last) = self.reached(&texels);
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
            let (first, last) = self.between(texel, texel);
            tiles.add(first, last);
        }
    }

    /// First and last column and row of the texels around those of receivers, as far as the map goes.
    #[inline(always)]
    pub(super) fn reached(&self, TexelBox { low, high }: &TexelBox<S>) -> ([usize; 2], [usize; 2]) {
        self.between(
            [low.x.reduce_min(), low.y.reduce_min()],
            [high.x.reduce_max(), high.y.reduce_max()],
        )
    }

    #[inline(always)]
    fn between(&self, low: [f32; 2], high: [f32; 2]) -> ([usize; 2], [usize; 2]) {
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
