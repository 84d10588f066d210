//! Receivers' own rays against the triangles that the texels around them hold.

use super::{BlockLookup, OFF_MAP};
use crate::cpu::candidates::{Candidates, PlacedBlock};
use crate::cpu::lanes::{Simd, bits, mask_bits, mask32x8, u32x8};
use crate::cpu::map::MapView;
use crate::cpu::rasterize::NONE;
use crate::cpu::receivers::masks_of_views;
use crate::cpu::tiles::BLOCK;
use fearless_simd::prelude::*;

impl<S: Simd> BlockLookup<'_, S> {
    /// Tests receivers against the triangles that the texels around each hold, and darkens those that are hit.
    #[inline(always)]
    pub(super) fn test_triangles(&mut self, left: &[u32; BLOCK]) {
        self.collect_candidates(left);
        if self.work.candidates.is_empty() {
            return;
        }
        let count = self.layer.seen.len();
        let masks = masks_of_views(self.simd, self.receivers.light_at, self.block, count);
        let candidates = std::mem::take(&mut self.work.candidates);
        for (view, mask) in masks.iter().enumerate().take(count) {
            let asking = std::array::from_fn(|i| left[i] & mask[i]);
            if asking == [0; BLOCK] {
                continue;
            }
            self.layer.seen[view].places(self.simd, self.block, &asking, &mut self.work.places);
            let seen = PlacedBlock {
                block: self.block,
                places: &self.work.places,
                pixel: self.pixel,
            };
            let MapView { view, places } = &self.layer.map.views[view];
            let tests = Candidates {
                receivers: self.receivers,
                view,
                vertices: places,
            };
            let around = |i, id| self.around(i, id);
            let (shadowed, _) = tests.shadowed(self.simd, seen, &candidates, &asking, around);
            for (i, shadowed) in shadowed.into_iter().enumerate() {
                self.answer(i, shadowed, 0.0);
            }
        }
        self.work.candidates = candidates;
    }

    /// Lists the triangles around the receivers that are left, each once or nearly so.
    #[inline(always)]
    fn collect_candidates(&mut self, left: &[u32; BLOCK]) {
        let simd = self.simd;
        let side = self.layer.comparison.side();
        let off = u32x8::simd_from(simd, OFF_MAP);
        let mut listed = [NONE; 64];
        self.work.candidates.clear();
        for i in (0..BLOCK).filter(|&i| left[i] != 0) {
            let left_above = if i == 0 { 0 } else { left[i - 1] };
            let above = i.saturating_sub(1);
            let own = u32x8::simd_from(simd, self.block.ids[i]);
            let own_above = u32x8::simd_from(simd, self.block.ids[above]);
            let has_above = mask32x8::from_bitmask(simd, u64::from(left_above));
            let mut previous = own;
            for k in 0..side * side {
                let found = u32x8::simd_from(simd, self.work.ids[i][k]);
                let of_above = u32x8::simd_from(simd, self.work.ids[above][k]);
                let is_listed = has_above & found.simd_eq(of_above) & !found.simd_eq(own_above);
                let is_known = found.simd_eq(own) | found.simd_eq(previous) | is_listed;
                let is_new = !(is_known | found.simd_ge(off));
                let ids = found.to_array();
                previous = found;
                for lane in bits(mask_bits(is_new) & left[i]) {
                    let id = ids[lane];
                    let place = &mut listed[id as usize % 64];
                    if *place != id {
                        *place = id;
                        self.work.candidates.push(id);
                    }
                }
            }
        }
    }

    /// The receivers of a row that have a triangle in the texels around.
    #[inline(always)]
    fn around(&self, i: usize, id: u32) -> u32 {
        let simd = self.simd;
        let side = self.layer.comparison.side();
        let id = u32x8::simd_from(simd, id);
        let mut holds = mask32x8::from_bitmask(simd, 0);
        for ids in &self.work.ids[i][..side * side] {
            holds |= u32x8::simd_from(simd, *ids).simd_eq(id);
        }
        mask_bits(holds)
    }
}
