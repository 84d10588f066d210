//! Receivers against what lies across the seams of a torn map: the texels around the nearest one there stand for those
//! that would be beside their own. Corners belong to the patches above and below.

use super::depths::Seen;
use super::{BlockLookup, RowReceivers};
use crate::bias::Rule;
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, mask32x8, splat};
use crate::cpu::rasterize::NONE;
use crate::cpu::warp_map::WarpMap;
use crate::lanes::{Lane, V2};
use crate::projection::Formulas;
use crate::warp::texels_outside;

/// Above, below, left and right.
const SIDES: [(f32, f32); 4] = [(0.0, -1.0), (0.0, 1.0), (-1.0, 0.0), (1.0, 0.0)];

impl<S: Simd> BlockLookup<'_, S> {
    /// Whether some of the texels around those of receivers lie across a seam, beyond their patches.
    #[inline(always)]
    pub(super) fn is_at_seam(
        &self,
        patch: [V2<f32x8<S>>; 2],
        middle: V2<f32x8<S>>,
        on_map: mask32x8<S>,
    ) -> bool {
        let reach = f32::from(self.layer.comparison.reach);
        self.tearing_warp().is_some() && {
            let reach = splat(self.simd, reach);
            let [above, below, left, right] = texels_outside(patch, middle, reach);
            let most = Lane::max(Lane::max(above, below), Lane::max(left, right));
            mask_bits(Lane::less(splat(self.simd, 0.0), most) & on_map) != 0
        }
    }

    #[inline(always)]
    pub(super) fn look_across_seams(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        i: usize,
        seen: &mut Seen,
    ) {
        let reach = i32::from(self.layer.comparison.reach);
        let WarpMap { warp, .. } = self.tearing_warp().expect("it tears the map");
        let zero = splat(self.simd, 0.0);
        let outside = texels_outside(row.patch, row.middle, splat(self.simd, reach as f32));
        let has_patches = warp.has_patches(row.functions);
        let mut previous = [NONE; LANES];
        for (side, &(x, y)) in SIDES.iter().enumerate() {
            let torn = Lane::less(zero, outside[side]) & has_patches[side] & row.on_map;
            let torn = mask_bits(torn);
            for lane in bits(torn) {
                if self.layer.comparison.triangles && seen.known[lane].is_none() {
                    let (known, last) = self.known_texels(i, lane);
                    (seen.known[lane], previous[lane]) = (Some(known), last);
                }
            }
            if torn != 0 {
                let across = Across {
                    side: (x, y),
                    outside: outside[side].into(),
                    torn,
                };
                self.look_across(kind, rule, row, i, &across, (seen, &mut previous));
            }
        }
    }

    #[inline(always)]
    fn look_across(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        i: usize,
        across: &Across,
        (seen, previous): (&mut Seen, &mut [u32; LANES]),
    ) {
        let simd = self.simd;
        let reach = i32::from(self.layer.comparison.reach);
        let (x, y) = across.side;
        let texels = self.layer.texels;
        let WarpMap { warp, .. } = self.tearing_warp().expect("it tears the map");
        let direction = V2::new(splat(simd, x), splat(simd, y));
        let nearest = warp.texel_across(row.linear, row.functions, direction, texels);
        let middle_row: [f32; LANES] = row.middle.y.into();
        let (low, high): ([f32; LANES], [f32; LANES]) =
            (row.patch[0].y.into(), row.patch[1].y.into());
        for step_out in 0..reach {
            for step_along in -reach..=reach {
                let (out, along) = (step_out as f32, step_along as f32);
                let texel = V2::new(
                    nearest.x + (x * out + y.abs() * along),
                    nearest.y + (y * out + x.abs() * along),
                );
                let inside = self.nearest_on_map(texel);
                let is_same = |a: f32x8<S>, b: f32x8<S>| Lane::at_most(a, b) & Lane::at_most(b, a);
                let is_on_map = is_same(texel.x, inside.x) & is_same(texel.y, inside.y);
                let index = self.index(row.on_map, inside);
                let step = self.step_to(row, self.linear_middle(inside));
                let depth = rule.least_lit_depth(kind, &row.plane, &row.bias, step);
                let is_nearer = mask_bits(Lane::less(self.stored(index), depth));
                let is_before = row.plane.is_before_surface(kind, &row.bias, step);
                let is_before = mask_bits(is_before);
                let ids = match self.layer.comparison.triangles {
                    true => self.triangles(index),
                    false => [NONE; LANES],
                };
                for lane in bits(mask_bits(is_on_map) & across.torn) {
                    let outside = across.outside[lane] as i32;
                    if step_out >= outside {
                        continue;
                    }
                    let far = reach + 1 - outside + step_out;
                    let beside_x = x as i32 * far + y.abs() as i32 * step_along;
                    let beside_y = y as i32 * far + x.abs() as i32 * step_along;
                    let row_there = middle_row[lane] + beside_y as f32;
                    let is_corner = y == 0.0 && (row_there < low[lane] || row_there > high[lane]);
                    if is_corner {
                        continue;
                    }
                    let place = (beside_y + reach) * (2 * reach + 1) + beside_x + reach;
                    let bit = 1 << place;
                    if is_before >> lane & 1 != 0 {
                        seen.texels[lane] |= bit;
                        if is_nearer >> lane & 1 != 0 {
                            seen.nearer[lane] |= bit;
                        }
                    }
                    if self.layer.comparison.triangles {
                        let id = ids[lane];
                        let known = seen.known[lane].as_mut().expect("found before");
                        *known |= if id == previous[lane] { bit } else { 0 };
                        previous[lane] = id;
                        self.work.ids[i][place as usize][lane] = id;
                        let is_stranger = id != NONE && id != self.block.ids[i][lane];
                        seen.strangers |= u32::from(is_stranger) << lane;
                    }
                }
            }
        }
    }
}

/// A side of the receivers of a row: those that have a seam there, and how many of the texels around lie beyond it.
struct Across {
    side: (f32, f32),
    outside: [f32; LANES],
    torn: u32,
}
