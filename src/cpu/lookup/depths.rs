//! Receivers against the depths of the texels around them.

use super::{BlockLookup, OFF_MAP, RowReceivers};
use crate::bias::Rule;
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, mask32x8, splat, u32x8};
use crate::cpu::rasterize::NONE;
use crate::cpu::warp_map::WarpMap;
use crate::lanes::{Lane, V2};
use crate::map_settings::Comparison;
use crate::neighbourhood::Around;
use crate::projection::Formulas;
use crate::warp::{AROUND, Warping};
use fearless_simd::prelude::*;

/// Of the texels around each receiver of a row, a bit for each.
#[derive(Default)]
pub(super) struct Seen {
    /// That are on the map and before the receiver's surface.
    pub texels: [u32; LANES],
    /// Of these, that hold something before the receiver's plane.
    pub nearer: [u32; LANES],
    /// That hold a triangle which was seen before, where that is known.
    pub known: [Option<u32>; LANES],
    /// The receivers that have another triangle than their own around them.
    pub strangers: u32,
}

impl<S: Simd> BlockLookup<'_, S> {
    /// Depths of the texels around, and which receivers of the row are still to be tested against the triangles there.
    #[inline(always)]
    pub(super) fn compare(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        i: usize,
    ) -> u32 {
        let comparison = self.layer.comparison;
        let reach = usize::from(comparison.reach);
        let is_at_seam = self.is_at_seam(row.patch, row.middle, row.on_map);
        let Some(mut seen) = self.look_around(kind, rule, row, i, is_at_seam) else {
            return 0;
        };
        if is_at_seam {
            self.look_across_seams(kind, rule, row, i, &mut seen);
        }
        let settled = match self.layer.knows_own {
            true => mask_bits(row.on_map & !row.bias.is_edge_on) & !seen.strangers,
            false => 0,
        };
        self.answer(i, settled, 1.0);
        let aside = row.place - row.middle - V2::splat(splat(self.simd, 0.5));
        let (x, y): ([f32; LANES], [f32; LANES]) = (aside.x.into(), aside.y.into());
        let mut left = 0;
        for lane in bits(mask_bits(row.on_map) & !settled) {
            let (texels, nearer) = (seen.texels[lane], seen.nearer[lane]);
            if texels == 0 && comparison.depths {
                // The triangles in them may still stand before it.
                left |= 1 << lane;
                continue;
            }
            let is_behind = comparison.depths && nearer != 0 && {
                let known = seen.known[lane].unwrap_or_else(|| self.known_texels(i, lane).0);
                let around = Around {
                    reach,
                    texels,
                    nearer,
                    known,
                };
                around.is_behind([x[lane], y[lane]])
            };
            self.lit[i][lane] = f32::from(u8::from(!is_behind));
            left |= u32::from(!is_behind) << lane;
        }
        left & seen.strangers
    }

    /// What lies around receivers, unless it says the same of all of them, which are then answered.
    #[inline(always)]
    fn look_around(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        i: usize,
        is_at_seam: bool,
    ) -> Option<Seen> {
        let Comparison {
            triangles,
            depths,
            reach,
            ..
        } = self.layer.comparison;
        let on_map = mask_bits(row.on_map);
        let may_agree = triangles && !is_at_seam;
        let asks_depth = may_agree && depths && !self.has_own_triangle(row, i);
        let middles = asks_depth.then(
            #[inline(always)]
            || self.columns_and_rows(row),
        );
        let may_be_dark = middles.as_ref().is_some_and(
            #[inline(always)]
            |middles| {
                let own = usize::from(reach) * (self.layer.comparison.side() + 1);
                let step = self.step_to(row, self.middle_around(row, middles, own));
                let depth = rule.least_lit_depth(kind, &row.plane, &row.bias, step);
                let index = self.index(row.on_map, row.middle);
                let is_nearer = Lane::less(self.stored(index), depth);
                mask_bits(row.on_map & !is_nearer) == 0
            },
        );
        let mut strangers = 0;
        if triangles && !may_be_dark {
            strangers = self.triangles_beside(row, i);
            let has_open = on_map & (strangers | mask_bits(row.bias.is_edge_on)) != 0;
            if may_agree && self.layer.knows_own && !has_open {
                // No depth speaks against a receiver that has its own triangle all around.
                self.answer(i, on_map, 1.0);
                return None;
            }
        }
        let seen = match depths {
            true => {
                let middles = match middles {
                    Some(middles) => middles,
                    None => self.columns_and_rows(row),
                };
                self.look_beside(kind, rule, row, &middles)
            }
            false => Seen::default(),
        };
        if may_be_dark {
            if bits(on_map)
                .all(|lane| seen.texels[lane] == seen.nearer[lane] && seen.texels[lane] != 0)
            {
                self.answer(i, on_map, 0.0);
                return None;
            }
            strangers = self.triangles_beside(row, i);
        }
        Some(Seen { strangers, ..seen })
    }

    /// Whether a receiver's own texel holds its own triangle, where that is known not to be before it.
    #[inline(always)]
    fn has_own_triangle(&self, row: &RowReceivers<S>, i: usize) -> bool {
        self.layer.knows_own && {
            let held = self.triangles(self.index(row.on_map, row.middle));
            let held = u32x8::simd_from(self.simd, held);
            let own = u32x8::simd_from(self.simd, self.block.ids[i]);
            mask_bits(held.simd_eq(own) & row.on_map) != 0
        }
    }

    #[inline(always)]
    pub(super) fn answer(&mut self, i: usize, receivers: u32, answer: f32) {
        for lane in bits(receivers) {
            self.lit[i][lane] = answer;
        }
    }

    /// Lists the triangles of the receivers' own texels and of those beside them that are of the same patch; the receivers
    /// that have another than their own there.
    #[inline(always)]
    fn triangles_beside(&mut self, row: &RowReceivers<S>, i: usize) -> u32 {
        let simd = self.simd;
        let own = u32x8::simd_from(simd, self.block.ids[i]);
        let off = u32x8::simd_from(simd, OFF_MAP);
        let side = self.layer.comparison.side();
        let mut strangers = 0;
        for k in 0..side * side {
            let (index, is_beside) = self.texel_beside(row, k);
            let found = u32x8::simd_from(simd, self.triangles(index));
            let found = is_beside.select(found, off);
            self.work.ids[i][k] = found.into();
            strangers |= mask_bits(!(found.simd_eq(own) | found.simd_ge(off)));
        }
        strangers
    }

    /// Where one of the texels around is in the map's memory, and whose it is: on the map, and not across a seam.
    #[inline(always)]
    fn texel_beside(&self, row: &RowReceivers<S>, k: usize) -> ([u32; LANES], mask32x8<S>) {
        let side = self.layer.comparison.side();
        let [low, high] = row.patch;
        let texel = self.texel_around(row, k);
        let is_beside = match 2 * k + 1 == side * side {
            true => mask32x8::from_bitmask(self.simd, 0xff),
            false => is_within(texel.x, low.x, high.x) & is_within(texel.y, low.y, high.y),
        };
        (
            self.index(row.on_map, self.nearest_on_map(texel)),
            is_beside,
        )
    }

    /// One of the texels around, which may be beside the map.
    #[inline(always)]
    fn texel_around(&self, row: &RowReceivers<S>, k: usize) -> V2<f32x8<S>> {
        let side = self.layer.comparison.side();
        let reach = f32::from(self.layer.comparison.reach);
        V2::new(
            row.middle.x + ((k % side) as f32 - reach),
            row.middle.y + ((k / side) as f32 - reach),
        )
    }

    /// The texel of the map that is nearest to one.
    #[inline(always)]
    pub(super) fn nearest_on_map(&self, texel: V2<f32x8<S>>) -> V2<f32x8<S>> {
        let (zero, last) = (splat(self.simd, 0.0), self.v2(self.layer.size - 1.0));
        texel.zip(last, |texel, last| Lane::clamp(texel, zero, last))
    }

    /// The texel of a patch that is nearest to one.
    #[inline(always)]
    pub(super) fn nearest_in_patch(
        texel: V2<f32x8<S>>,
        [low, high]: [V2<f32x8<S>>; 2],
    ) -> V2<f32x8<S>> {
        V2::new(
            Lane::clamp(texel.x, low.x, high.x),
            Lane::clamp(texel.y, low.y, high.y),
        )
    }

    /// The middles of the columns and rows around the receivers' own texels before the warp, in texels.
    #[inline(always)]
    fn columns_and_rows(&self, row: &RowReceivers<S>) -> [V2<f32x8<S>>; AROUND] {
        let layer = self.layer;
        let reach = layer.comparison.reach;
        let mut middles = [row.middle; AROUND];
        let functions = layer.warp.and_then(Warping::functions);
        if let Some(WarpMap { warp, inverses }) = functions {
            middles = warp.linear_around(inverses, row.middle, reach.into());
        }
        let (size, side) = (self.v2(layer.size), layer.comparison.side());
        for (i, middle) in middles.iter_mut().enumerate().take(side) {
            *middle = match functions {
                Some(_) => middle.zip(size, |v, size| v * size),
                None => middle.map(|texel| texel + (i as f32 - f32::from(reach)) + 0.5),
            };
        }
        middles
    }

    /// The middle of one of the texels around before the warp, in texels.
    #[inline(always)]
    fn middle_around(
        &self,
        row: &RowReceivers<S>,
        middles: &[V2<f32x8<S>>; AROUND],
        k: usize,
    ) -> V2<f32x8<S>> {
        let side = self.layer.comparison.side();
        match self.layer.warp {
            // Its texels do not lie in columns and rows before the warp.
            Some(Warping::Samples(_)) => {
                self.linear_middle(self.nearest_on_map(self.texel_around(row, k)))
            }
            _ => V2::new(middles[k % side].x, middles[k / side].y),
        }
    }

    /// The receivers' own texels and those beside them that are of the same patch.
    #[inline(always)]
    fn look_beside(
        &self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        middles: &[V2<f32x8<S>>; AROUND],
    ) -> Seen {
        let simd = self.simd;
        let side = self.layer.comparison.side();
        let empty = u32x8::simd_from(simd, 0);
        let (mut texels, mut nearer) = (empty, empty);
        for k in 0..side * side {
            let (index, is_beside) = self.texel_beside(row, k);
            let step = self.step_to(row, self.middle_around(row, middles, k));
            let depth = rule.least_lit_depth(kind, &row.plane, &row.bias, step);
            let is_nearer = Lane::less(self.stored(index), depth);
            let is_before = row.plane.is_before_surface(kind, &row.bias, step);
            let counts = is_beside & row.on_map & is_before;
            let bit = u32x8::simd_from(simd, 1 << k);
            texels |= counts.select(bit, empty);
            nearer |= (counts & is_nearer).select(bit, empty);
        }
        let has_triangles = self.layer.comparison.triangles;
        Seen {
            texels: texels.into(),
            nearer: nearer.into(),
            known: [(!has_triangles).then_some(u32::MAX); LANES],
            ..Seen::default()
        }
    }

    /// See `known_texels`.
    #[inline(always)]
    pub(super) fn known_texels(&self, i: usize, lane: usize) -> (u32, u32) {
        let side = self.layer.comparison.side();
        known_texels(side, |place| self.work.ids[i][place][lane])
    }
}

/// The texels around a receiver, so many on each side, that hold a triangle which follows itself along the row, or begins the
/// row before: it is wider than a texel, or higher. And the triangle that was seen last.
#[inline(always)]
fn known_texels(side: usize, triangle_at: impl Fn(usize) -> u32) -> (u32, u32) {
    let mut known = 0;
    let (mut previous, mut first_of_row) = (NONE, NONE);
    for y in 0..side {
        let above = first_of_row;
        for x in 0..side {
            let place = y * side + x;
            let id = triangle_at(place);
            if id == OFF_MAP {
                continue;
            }
            known |= u32::from(id == previous || id == above) << place;
            previous = id;
            if x == 0 {
                first_of_row = id;
            }
        }
    }
    (known, previous)
}

#[inline(always)]
fn is_within<S: Simd>(texel: f32x8<S>, low: f32x8<S>, high: f32x8<S>) -> mask32x8<S> {
    Lane::at_most(low, texel) & Lane::at_most(texel, high)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known(texels: [u32; 9]) -> u32 {
        known_texels(3, |place| texels[place]).0
    }

    #[test]
    fn a_triangle_of_several_texels_is_known_whichever_way_it_reaches() {
        // Along rows, along columns, and each of one texel.
        assert_eq!(known([1, 1, 1, 2, 2, 2, 3, 3, 3]), 0b110_110_110);
        assert_eq!(known([1, 2, 3, 1, 2, 3, 1, 2, 3]), 0b001_001_000);
        assert_eq!(known([1, 2, 3, 4, 5, 6, 7, 8, 9]), 0);
        // From the end of a row to the next, and aslant.
        assert_eq!(known([1, 2, 3, 3, 5, 6, 7, 8, 9]), 0b000_001_000);
        assert_eq!(known([1, 2, 3, 4, 1, 6, 7, 8, 4]), 0b100_010_000);
    }

    #[test]
    fn texels_beside_the_map_hold_no_triangle_that_is_known() {
        let off = OFF_MAP;
        assert_eq!(known([off, off, off, 1, off, 1, 1, 2, 3]), 0b001_100_000);
        assert_eq!(known_texels(3, |_| off), (0, NONE));
    }
}
