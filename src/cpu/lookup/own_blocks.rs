//! Blocks of one triangle, which all texels around hold, too: nothing there stands before it, so its receivers are lit. It
//! is what `depths` says of each row, found for the block at once; and where the light's rays run along the triangle, which
//! has some width in the map nevertheless, it is more than depths say.

use super::looked_at::TexelBox;
use super::{BlockLookup, Purpose};
use crate::cpu::lanes::{Simd, f32x8, mask_bits, mask32x8, splat};
use crate::cpu::rasterize::Image;
use crate::cpu::tiles::{BLOCK, TILE};
use crate::cpu::warp_map::WarpMap;
use crate::lanes::{Lane, V2};
use crate::projection::Formulas;
use crate::warp::Warping;
use fearless_simd::prelude::*;

impl<S: Simd> BlockLookup<'_, S> {
    /// Answers the block if it is one of these, and tells whether it was.
    #[inline(always)]
    pub(super) fn is_of_own<F: Formulas<f32x8<S>>>(&mut self, kind: &F) -> bool {
        let Some(id) = self.only_triangle() else {
            return false;
        };
        let simd = self.simd;
        let (size, centre) = (self.v2(self.layer.size), self.v2(self.layer.centre));
        let whole = [V2::splat(splat(simd, 0.0)), self.v2(self.layer.size - 1.0)];
        let mut texels = TexelBox::empty(simd);
        let mut answered = [0; BLOCK];
        for i in self.rows() {
            let point = &self.block.points[i];
            let q = self.layer.space.projected(simd, point);
            let mut place = kind.centred_texel_from_projected(q) + centre;
            let mask = mask32x8::from_bitmask(simd, u64::from(self.masks[i]));
            let on_map = self.is_on_map(place) & mask;
            let mut patch = whole;
            if let Some(Warping::Functions(WarpMap { warp, .. })) = self.layer.warp {
                let linear = place.zip(size, |place, size| place / size);
                let (warped, functions) = warp.warped_from_linear(linear);
                place = warped.zip(size, |warped, size| warped * size);
                if warp.functions > 1 {
                    patch = self.patch_of(warp, functions, mask);
                }
            }
            let within = Self::nearest_in_patch(place.map(Lane::floor), patch);
            let texel = self.nearest_on_map(within);
            if self.is_at_seam(patch, texel, on_map) {
                return false;
            }
            texels.add(texel, on_map);
            answered[i] = mask_bits(on_map);
        }
        if answered == [0; BLOCK] {
            return false;
        }
        let (first, last) = self.reached(&texels);
        let is_of_own = self.layer.map.image.has_only(id, first, last);
        if is_of_own {
            for (i, receivers) in answered.into_iter().enumerate() {
                self.answer(i, receivers, 1.0);
            }
        }
        is_of_own
    }

    /// What all receivers of the block are on, where texels that hold it say nothing against them.
    #[inline(always)]
    fn only_triangle(&self) -> Option<u32> {
        let layer = self.layer;
        // Through a table places are found one at a time, which the rows would do again.
        let is_table = matches!(layer.warp, Some(Warping::Samples(_)));
        let is_asked = matches!(layer.purpose, Purpose::Look) && layer.map.pages.is_none();
        if !layer.knows_own || is_table || !is_asked {
            return None;
        }
        let mut rows = self.rows();
        let id = self.block.ids[rows.next()?][0];
        let is_only = |i: usize| self.block.is_one[i] && self.block.ids[i][0] == id;
        self.rows().all(is_only).then_some(id)
    }
}

impl Image {
    /// Whether all pixels from a first to a last column and row show one triangle.
    #[inline(always)]
    fn has_only(&self, id: u32, [x0, y0]: [usize; 2], [x1, y1]: [usize; 2]) -> bool {
        (y0..=y1).all(|y| {
            let mut x = x0;
            let mut others = 0;
            while x <= x1 {
                let end = (x / TILE * TILE + TILE).min(x1 + 1);
                let first = self.tiling.index(x, y);
                let held = &self.triangles[first..first + end - x];
                others |= held.iter().fold(0, |others, held| others | (held ^ id));
                x = end;
            }
            others == 0
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::tiles::{TILE_PIXELS, Tiling};
    use crate::twin::Random;

    #[test]
    fn a_rectangle_shows_one_triangle_only_where_each_pixel_does() {
        let mut random = Random(11);
        let tiling = Tiling::new(150, 100);
        let mut found = [0; 2];
        for _ in 0..400 {
            let mut triangles = vec![7; tiling.tiles() * TILE_PIXELS];
            let other = [random.below(150), random.below(100)];
            triangles[tiling.index(other[0], other[1])] = 8;
            let image = Image { tiling, triangles };
            // Around the other one, beside it by a pixel, or across tiles.
            let first = [0, 1].map(|k| other[k].saturating_sub(random.below(80)));
            let sizes = [150, 100];
            let last = [0, 1].map(|k| (first[k] + random.below(80)).min(sizes[k] - 1));
            let is_within = (0..2).all(|k| first[k] <= other[k] && other[k] <= last[k]);
            assert_eq!(
                image.has_only(7, first, last),
                !is_within,
                "{first:?} {other:?} {last:?}"
            );
            assert!(!image.has_only(9, first, last));
            found[usize::from(is_within)] += 1;
        }
        assert!(found.iter().all(|&count| count > 50), "{found:?}");
    }
}
