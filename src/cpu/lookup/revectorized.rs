//! Receivers against shadow edges that run straight where those of the texels are stairs, twin of `lit_by_silhouette`
//! in `shaders/lookup.wgsl`.

use super::{BlockLookup, RowReceivers};
use crate::bias::Rule;
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, mask32x8, splat};
use crate::lanes::{Each, Lane, V2};
use crate::map_settings::MAX_RUN;
use crate::projection::Formulas;
use fearless_simd::prelude::*;

/// From a texel to the one beside it: left, right, above and below.
const SIDES: [(f32, f32); 4] = [(-1.0, 0.0), (1.0, 0.0), (0.0, -1.0), (0.0, 1.0)];

/// The receivers' own texels.
struct Own<S: Simd> {
    is_lit: mask32x8<S>,
    /// Where the receivers are in them, from 0 to 1.
    within: V2<f32x8<S>>,
}

/// Of an edge between texels, what lies to one side of the receivers.
struct End<S: Simd> {
    /// Texels along which it goes on.
    length: f32x8<S>,
    /// How far the straight edge ends in the receivers' own side: half a texel, or less than nothing.
    inside: f32x8<S>,
}

impl<S: Simd> BlockLookup<'_, S> {
    /// The depth tests in the receivers' own texels, but for what lies beyond the straight edge.
    #[inline(always)]
    pub(super) fn revectorize(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        i: usize,
    ) {
        let simd = self.simd;
        let (zero, one, half) = (splat(simd, 0.0), splat(simd, 1.0), splat(simd, 0.5));
        let (is_before, is_lit) = self.disc_test(kind, rule, row, row.on_map, row.middle);
        let within = (row.place - row.middle).map(|part| Lane::clamp(part, zero, one));
        let own = Own { is_lit, within };
        let mut is_beyond = mask32x8::from_bitmask(simd, 0);
        for side in SIDES {
            let across = V2::new(splat(simd, side.0), splat(simd, side.1));
            let beside = row.middle + across;
            let has_edge = self.differs(kind, rule, row, &own, beside) & row.on_map;
            if mask_bits(has_edge) == 0 {
                continue;
            }
            let along = V2::new(Lane::abs(across.y), Lane::abs(across.x));
            let [before, after] = [-one, one].each(
                #[inline(always)]
                |step| self.end_of_edge(kind, rule, row, &own, has_edge, (across, along * step)),
            );
            let place = before.length + own.within.dot(along);
            // -1 at one end of the edge, 1 at the other.
            let relative = place * splat(simd, 2.0) / (before.length + after.length + one) - one;
            let inside = Lane::select(Lane::less(relative, zero), before.inside, after.inside)
                * Lane::abs(relative);
            let from_middle = (own.within - V2::splat(half)).dot(across);
            is_beyond |= has_edge & Lane::less(half - from_middle, inside);
        }
        let lit: [f32; LANES] = (is_lit ^ is_beyond).select(one, zero).into();
        for lane in bits(mask_bits(row.on_map & is_before)) {
            self.lit[i][lane] = lit[lane];
        }
    }

    /// Which texels answer otherwise than the receivers' own. What is off the map or another patch's says nothing.
    #[inline(always)]
    fn differs(
        &self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        own: &Own<S>,
        texel: V2<f32x8<S>>,
    ) -> mask32x8<S> {
        let there = self.within_patch(row, texel);
        let texel = self.texel_at(texel, there);
        let (is_before, is_lit) = self.disc_test(kind, rule, row, row.on_map, texel);
        there & is_before & (is_lit ^ own.is_lit)
    }

    #[inline(always)]
    fn within_patch(&self, row: &RowReceivers<S>, texel: V2<f32x8<S>>) -> mask32x8<S> {
        let [low, high] = row.patch;
        let (zero, last) = (splat(self.simd, 0.0), self.v2(self.layer.size - 1.0));
        let (low, high) = (
            low.map(|low| Lane::max(low, zero)),
            high.zip(last, Lane::min),
        );
        let is_within = |v, low, high| Lane::at_most(low, v) & Lane::at_most(v, high);
        is_within(texel.x, low.x, high.x) & is_within(texel.y, low.y, high.y)
    }

    /// Follows an edge to one side: it goes on as long as texels answer as the receivers' own and those across
    /// otherwise. Where one of the two changes, the straight edge crosses the middle of the next side of a texel.
    #[inline(always)]
    fn end_of_edge(
        &self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        own: &Own<S>,
        has_edge: mask32x8<S>,
        (across, step): (V2<f32x8<S>>, V2<f32x8<S>>),
    ) -> End<S> {
        let (zero, half) = (splat(self.simd, 0.0), splat(self.simd, 0.5));
        let mut end = End {
            length: zero,
            inside: zero,
        };
        let mut goes_on = has_edge;
        for count in 1..=MAX_RUN {
            let texel = row.middle + step * splat(self.simd, count as f32);
            let is_there = self.within_patch(row, texel) & self.within_patch(row, texel + across);
            goes_on &= is_there;
            if mask_bits(goes_on) == 0 {
                break;
            }
            let here = self.differs(kind, rule, row, own, texel);
            let beside = self.differs(kind, rule, row, own, texel + across);
            end.inside = (goes_on & here & beside).select(half, end.inside);
            end.inside = (goes_on & !here & !beside).select(-half, end.inside);
            goes_on &= !here & beside;
            end.length = goes_on.select(splat(self.simd, count as f32), end.length);
        }
        end
    }
}
