//! Where places of a map are after its warp, of eight receivers at once.

use super::BlockLookup;
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, mask32x8};
use crate::cpu::warp_map::{CpuWarp, WarpMap};
use crate::lanes::V2;
use crate::warp::Warping;
use crate::warp::samples::SampledWarp;
use fearless_simd::prelude::*;
use glam::DVec2;

/// Of a table, the cells that places are in.
pub(super) type Cells = [[usize; 2]; LANES];

impl<S: Simd> BlockLookup<'_, S> {
    /// Of some places before the warp, from 0 to 1, the texels after it, and which of them are on the map; not numbers
    /// where a table does not reach.
    #[inline(always)]
    pub(super) fn warped(
        &self,
        warp: &CpuWarp,
        linear: V2<f32x8<S>>,
        asked: mask32x8<S>,
    ) -> (V2<f32x8<S>>, mask32x8<S>) {
        match warp {
            Warping::Functions(WarpMap { warp, .. }) => {
                let (warped, _) = warp.warped_from_linear(linear);
                let size = self.v2(self.layer.size);
                (warped.zip(size, |warped, size| warped * size), asked)
            }
            Warping::Samples(samples) => {
                let (place, is_there, _) = self.sampled_place(samples, linear, asked);
                (place, is_there)
            }
        }
    }

    /// The same by a table, and the cells of the table.
    #[inline(always)]
    pub(super) fn sampled_place(
        &self,
        samples: &SampledWarp,
        linear: V2<f32x8<S>>,
        asked: mask32x8<S>,
    ) -> (V2<f32x8<S>>, mask32x8<S>, Cells) {
        let places: [[f32; LANES]; 2] = [linear.x.into(), linear.y.into()];
        let found = samples.warped_from_linear(places, mask_bits(asked));
        let mut warped = [[f32::NAN; LANES]; 2];
        let mut cells = [[0; 2]; LANES];
        for (lane, there) in found.into_iter().enumerate() {
            if let Some(([x, y], cell)) = there {
                (warped[0][lane], warped[1][lane], cells[lane]) = (x, y, cell);
            }
        }
        let [x, y] = warped.map(|warped| f32x8::simd_from(self.simd, warped));
        let place = V2::new(x, y).zip(self.v2(self.layer.size), |warped, size| warped * size);
        (place, asked & self.is_on_map(place), cells)
    }

    /// A direction in which edge-on surfaces fall off, after the warp of a table.
    #[inline(always)]
    pub(super) fn outward_after(
        &self,
        samples: &SampledWarp,
        cells: &Cells,
        is_edge_on: mask32x8<S>,
        outward: V2<f32x8<S>>,
    ) -> V2<f32x8<S>> {
        let [x, y]: [[f32; LANES]; 2] = [outward.x.into(), outward.y.into()];
        let mut turned = [[0.0; LANES]; 2];
        for lane in bits(mask_bits(is_edge_on)) {
            let before = DVec2::new(x[lane].into(), y[lane].into());
            let after = samples.gradient_after(cells[lane], before).as_vec2();
            (turned[0][lane], turned[1][lane]) = (after.x, after.y);
        }
        let [x, y] = turned.map(|part| f32x8::simd_from(self.simd, part));
        V2::new(x, y)
    }
}
