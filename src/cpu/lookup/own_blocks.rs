//! Blocks of one triangle, which all texels around hold, too: nothing there stands before it, so its receivers are lit. It
//! is what `depths` says of each row, found for the block at once.

use super::{BlockLookup, Purpose};
use crate::bias::is_edge_on;
use crate::cpu::lanes::{Simd, f32x8, mask_bits, mask32x8, splat};
use crate::cpu::rasterize::Image;
use crate::cpu::tiles::{BLOCK, TILE};
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
        let (mut low, mut high) = (
            V2::splat(splat(simd, f32::INFINITY)),
            V2::splat(splat(simd, 0.0)),
        );
        let mut answered = [0; BLOCK];
        for i in self.rows() {
            let point = &self.block.points[i];
            let q = self.layer.space.projected(simd, point);
            let mut place = kind.centred_texel_from_projected(q) + centre;
            let mask = mask32x8::from_bitmask(simd, u64::from(self.masks[i]));
            let on_map = self.is_on_map(place) & mask;
            let (normal, _) = self.normals(i);
            let from_light = self.receivers.rays_of_light(simd, point);
            if mask_bits(is_edge_on(normal, from_light) & on_map) != 0 {
                return false;
            }
            if let Some(Warping::Functions(map)) = self.layer.warp {
                let linear = place.zip(size, |place, size| place / size);
                let (warped, _) = map.warp.warped_from_linear(linear);
                place = warped.zip(size, |warped, size| warped * size);
            }
            let keep = |new, old| Lane::select(on_map, new, old);
            let texel = self.nearest_on_map(place.map(Lane::floor));
            low = texel.zip(low, |at, low| keep(Lane::min(at, low), low));
            high = texel.zip(high, |at, high| keep(Lane::max(at, high), high));
            answered[i] = mask_bits(on_map);
        }
        if answered == [0; BLOCK] {
            return false;
        }
        let (first, last) = self.reached(
            [low.x.reduce_min(), low.y.reduce_min()],
            [high.x.reduce_max(), high.y.reduce_max()],
        );
        let is_of_own = self.layer.map.image.has_only(id, first, last);
        if is_of_own {
            for (i, receivers) in answered.into_iter().enumerate() {
                self.answer(i, receivers, 1.0);
            }
        }
        is_of_own
    }

    /// What all receivers of the block are on, where texels that hold it say nothing against them and those around lie side
    /// by side.
    #[inline(always)]
    fn only_triangle(&self) -> Option<u32> {
        let layer = self.layer;
        let is_torn = match layer.warp {
            None => false,
            Some(Warping::Functions(_)) => self.tearing_warp().is_some(),
            Some(Warping::Samples(_)) => true,
        };
        let is_asked = matches!(layer.purpose, Purpose::Look) && layer.map.pages.is_none();
        if !layer.knows_own || is_torn || !is_asked {
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
