//! Receivers' own rays against the triangles that the texels around them hold.

use super::{BlockLookup, OFF_MAP};
use crate::cpu::bins::{eights, ids_at, triangles_of};
use crate::cpu::caster_tests::masks_of_views;
use crate::cpu::holes::Holes;
use crate::cpu::lanes::{LANES, Simd, bits, mask_bits, mask32x8, splat, u32x8};
use crate::cpu::map::MapView;
use crate::cpu::rasterize::NONE;
use crate::cpu::receivers::BlockPlaces;
use crate::cpu::shapes::{Corners, Shapes};
use crate::cpu::tiles::BLOCK;
use crate::cpu::view::{Nearness, View};
use fearless_simd::prelude::*;
use glam::DVec2;

impl<S: Simd> BlockLookup<'_, S> {
    /// Tests receivers against the triangles that the texels around each hold, and darkens those that are hit.
    #[inline(always)]
    pub(super) fn test_triangles(&mut self, left: &mut [u32; BLOCK]) {
        self.collect_candidates(left);
        if self.work.candidates.is_empty() {
            return;
        }
        let count = self.layer.seen.len();
        let masks = masks_of_views(self.simd, self.receivers.light_at, self.block, count);
        let candidates = std::mem::take(&mut self.work.candidates);
        for (view, mask) in masks.iter().enumerate().take(count) {
            let mut left_of_view = std::array::from_fn(|i| left[i] & mask[i]);
            if left_of_view != [0; BLOCK] {
                self.test_in_view(view, &candidates, &mut left_of_view);
            }
        }
        self.work.candidates = candidates;
    }

    #[inline(always)]
    fn test_in_view(&mut self, view: usize, candidates: &[u32], left: &mut [u32; BLOCK]) {
        let simd = self.simd;
        let scene = self.receivers.scene;
        let MapView { view: seen, places } = &self.layer.map.views[view];
        self.layer.seen[view].places(simd, self.block, left, &mut self.work.places);
        if seen.nearness == Nearness::Inverse {
            // What lies behind the light has a place, mirrored, but no triangle before it.
            for (left, &nearness) in left.iter_mut().zip(&self.work.places.nearness) {
                *left &= mask_bits(splat(simd, 0.0).simd_lt(nearness));
            }
        }
        let Some(row) = (0..BLOCK).find(|&i| left[i] != 0) else {
            return;
        };
        let lane = left[row].trailing_zeros() as usize;
        let (u, v) = (&self.work.places.u, &self.work.places.v);
        let origin = [u[row][lane], v[row][lane]];
        let side = self.reach_of_receivers(left, origin);
        let rounding = seen.rounding();
        for (numbers, count) in eights(0..candidates.len()) {
            let ids = ids_at(candidates, numbers);
            let corners = Corners::new(simd, places, triangles_of(scene, ids));
            let wide = corners.wide(simd, seen);
            let corners = corners.relative_to(origin);
            let mut shapes = Shapes::new(simd, &corners, rounding, side);
            for (lane, &id) in ids.iter().enumerate().take(count) {
                if wide >> lane & 1 != 0 {
                    let origin = DVec2::from(origin.map(f64::from));
                    let (seen, side) = ((seen, scene), f64::from(side));
                    if !shapes.set_wide(lane, seen, id, origin, side, rounding) {
                        continue;
                    }
                }
                self.test_triangle((&shapes, lane), (seen, id), origin, left);
            }
        }
    }

    /// How far receivers lie from the origin along an axis, at most: those of a block may be anywhere in the map.
    #[inline(always)]
    fn reach_of_receivers(&self, left: &[u32; BLOCK], origin: [f32; 2]) -> f32 {
        let simd = self.simd;
        let places = &self.work.places;
        let mut most = splat(simd, 0.0);
        for (i, &left) in left.iter().enumerate() {
            let mask = mask32x8::from_bitmask(simd, u64::from(left));
            let (u, v) = (
                (places.u[i] - origin[0]).abs(),
                (places.v[i] - origin[1]).abs(),
            );
            most = mask.select(most.max(u).max(v), most);
        }
        most.reduce_max()
    }

    /// Lists the triangles around the receivers that are left, each once or nearly so.
    #[inline(always)]
    fn collect_candidates(&mut self, left: &[u32; BLOCK]) {
        let simd = self.simd;
        let side = self.layer.comparison.side();
        let off = u32x8::simd_from(simd, OFF_MAP);
        let mut listed = [NONE; 64];
        self.work.candidates.clear();
        for (i, &left) in left.iter().enumerate() {
            if left == 0 {
                continue;
            }
            let own = u32x8::simd_from(simd, self.block.ids[i]);
            let mut previous = own;
            for ids in &self.work.ids[i][..side * side] {
                let found = u32x8::simd_from(simd, *ids);
                let is_new = !(found.simd_eq(own) | found.simd_eq(previous) | found.simd_ge(off));
                previous = found;
                for lane in bits(mask_bits(is_new) & left) {
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

    #[inline(always)]
    fn test_triangle(
        &mut self,
        (shapes, lane): (&Shapes, usize),
        (seen, id): (&View, u32),
        origin: [f32; 2],
        left: &mut [u32; BLOCK],
    ) {
        let scene = self.receivers.scene;
        let middle = DVec2::from(origin.map(f64::from));
        let holes = Holes::new(seen, scene, id, middle);
        // Two rows at once.
        for i in (0..BLOCK).step_by(2) {
            let of_pair = left[i] | left[i + 1] << LANES;
            if of_pair == 0 {
                continue;
            }
            let BlockPlaces { u, v, nearness } = &self.work.places;
            let (u, v) = (u[i].combine(u[i + 1]), v[i].combine(v[i + 1]));
            let nearness = nearness[i].combine(nearness[i + 1]);
            let (u, v) = (u - origin[0], v - origin[1]);
            let (hit, maybe) = shapes.test(self.simd, lane, u, v, nearness);
            let candidates = (hit | maybe) & of_pair;
            if candidates == 0 {
                continue;
            }
            let around = self.around(i, id) | self.around(i + 1, id) << LANES;
            let (hit, candidates) = match &holes {
                None => (hit, candidates),
                Some(holes) => {
                    let places = (&u.to_array()[..], &v.to_array()[..]);
                    let within = candidates & around;
                    holes.sort((hit & within, within), places, seen.rounding())
                }
            };
            for k in bits(candidates & around) {
                let (row, j) = (i + k / LANES, k % LANES);
                let at = (self.pixel.0 + j, self.pixel.1 + row);
                let own = self.block.ids[row][j];
                let is_hit = hit >> k & 1 != 0 || self.receivers.ray(at, own).is_shadowed_by(id);
                if is_hit {
                    self.lit[row][j] = 0.0;
                    left[row] &= !(1 << j);
                }
            }
        }
    }

    /// The receivers of a row that do not lie on a triangle, but have it in the texels around.
    #[inline(always)]
    fn around(&self, i: usize, id: u32) -> u32 {
        let simd = self.simd;
        let side = self.layer.comparison.side();
        let id = u32x8::simd_from(simd, id);
        let mut holds = mask32x8::from_bitmask(simd, 0);
        for ids in &self.work.ids[i][..side * side] {
            holds |= u32x8::simd_from(simd, *ids).simd_eq(id);
        }
        let own = u32x8::simd_from(simd, self.block.ids[i]).simd_eq(id);
        mask_bits(holds & !own)
    }
}
