//! Percentage closer filtering: the mean of depth tests in a disc around each receiver.

use super::{BlockLookup, RowReceivers};
use crate::bias::Rule;
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, mask32x8, splat};
use crate::lanes::{Each, Lane, V2, axes_across};
use crate::map_settings::Filter;
use crate::projection::Formulas;
use fearless_simd::prelude::*;

impl<S: Simd> BlockLookup<'_, S> {
    /// The share of the depth tests in a disc that find each receiver lit. What falls off the map says nothing, nor what
    /// lies inside an edge-on surface.
    #[inline(always)]
    pub(super) fn filter(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        i: usize,
        filter: Filter,
    ) {
        let simd = self.simd;
        let (zero, one) = (splat(simd, 0.0), splat(simd, 1.0));
        let centre = self.v2(self.layer.centre);
        let radius = splat(simd, filter.radius as f32);
        let unit = row.from_light / row.from_light.length();
        let [right, up] = axes_across(unit);
        let right = self.layer.space.turned(simd, right * radius);
        let up = self.layer.space.turned(simd, up * radius);
        let (mut tests, mut lit) = (zero, zero);
        let [cosine, sine] = self.turns(filter, i);
        for k in 0..filter.samples {
            let point = point_of_disc(k, filter.samples);
            let weight = splat(simd, filter.weight(point));
            let [x, y] = point.each(|part| splat(simd, part));
            let [x, y] = match filter.is_jittered {
                true => [x * cosine - y * sine, x * sine + y * cosine],
                false => [x, y],
            };
            let (place, mut counts) = match filter.is_unwarped {
                false => {
                    let place = row.place + V2::new(radius * x, radius * y);
                    (place, self.is_on_map(place))
                }
                true => {
                    let q = row.plane.q + right * x + up * y;
                    let place = kind.centred_texel_from_projected(q) + centre;
                    self.warped_place(place)
                }
            };
            let mut texel = self.texel_at(place, counts);
            if !filter.is_unwarped {
                // A patch without a texel may end before the map begins.
                texel = self.nearest_on_map(Self::nearest_in_patch(texel, row.patch));
            }
            // What is off the map is no texel, of no page.
            let asking = row.on_map & counts;
            let (is_before, is_lit) = self.disc_test(kind, rule, row, asking, texel);
            counts &= is_before;
            tests += counts.select(weight, zero);
            lit += (counts & is_lit).select(weight, zero);
        }
        let (is_before, is_lit) = self.disc_test(kind, rule, row, row.on_map, row.middle);
        let has_tests = Lane::less(zero, tests);
        let share = has_tests.select(lit / tests, is_lit.select(one, zero));
        let share: [f32; LANES] = share.into();
        for lane in bits(mask_bits(row.on_map & (has_tests | is_before))) {
            self.lit[i][lane] = share[lane];
        }
    }

    /// Cosines and sines of the angles that the pixels of a row turn the disc by.
    #[inline(always)]
    fn turns(&self, filter: Filter, i: usize) -> [f32x8<S>; 2] {
        let (x, y) = self.pixel;
        let angles: [f32; LANES] =
            std::array::from_fn(|lane| filter.turn([(x + lane) as u32, (y + i) as u32]));
        [f32::cos, f32::sin].map(|part| f32x8::simd_from(self.simd, angles.map(part)))
    }

    /// Where a place of the map before the warp is after it, and whether it is on the map.
    #[inline(always)]
    fn warped_place(&self, place: V2<f32x8<S>>) -> (V2<f32x8<S>>, mask32x8<S>) {
        let is_on_map = self.is_on_map(place);
        let Some(warp) = self.layer.warp else {
            return (place, is_on_map);
        };
        let (zero, size) = (splat(self.simd, 0.0), self.v2(self.layer.size));
        let linear = place.zip(size, |place, size| {
            Lane::select(is_on_map, place, zero) / size
        });
        self.warped(warp, linear, is_on_map)
    }

    /// The texel of a place, where there is one.
    #[inline(always)]
    pub(super) fn texel_at(&self, place: V2<f32x8<S>>, is_there: mask32x8<S>) -> V2<f32x8<S>> {
        let zero = splat(self.simd, 0.0);
        let last = self.v2(self.layer.size - 1.0);
        place.zip(last, |place, last| {
            let whole = Lane::select(is_there, Lane::floor(place), zero);
            Lane::clamp(whole, zero, last)
        })
    }

    /// Whether a texel's ray says anything of the receivers that ask for it, and whether it finds them lit.
    #[inline(always)]
    pub(super) fn disc_test(
        &self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        asking: mask32x8<S>,
        texel: V2<f32x8<S>>,
    ) -> (mask32x8<S>, mask32x8<S>) {
        let step = self.step_to(row, self.linear_middle(texel));
        let depth = rule.least_lit_depth_in_disc(kind, &row.plane, &row.bias, step);
        let is_lit = Lane::at_most(depth, self.stored(self.index(asking, texel)));
        (row.plane.is_before_surface(kind, &row.bias, step), is_lit)
    }
}

/// Point i of a spiral that covers the unit disc evenly (Vogel, "A better way to construct the sunflower head", 1979),
/// with two arms; an odd number has one more in the middle.
fn point_of_disc(i: u32, samples: u32) -> [f32; 2] {
    let odd = samples & 1;
    let pair = (i + odd) / 2;
    let radius = ((2 * pair + 1 - odd) as f32 / samples as f32).sqrt();
    // Half of the golden angle's complement.
    let angle = pair as f32 * 1.941_611;
    let arm = 1.0 - 2.0 * ((i + odd) & 1) as f32;
    [arm * radius * angle.cos(), arm * radius * angle.sin()]
}
