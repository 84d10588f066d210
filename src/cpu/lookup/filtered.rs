//! Receivers against the moments of filtered maps.

use super::{BlockLookup, RowReceivers};
use crate::bias::Rule;
use crate::camera::Rays;
use crate::cpu::filtered_texels::FilteredTexels;
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, narrow, splat};
use crate::lanes::{Each, V2, V3};
use crate::projection::Formulas;
use fearless_simd::prelude::*;
use glam::DVec3;

impl<S: Simd> BlockLookup<'_, S> {
    /// How much the moments around each receiver say is lit.
    #[inline(always)]
    pub(super) fn look_at_moments(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        row: &RowReceivers<S>,
        i: usize,
        texels: &FilteredTexels,
    ) {
        let simd = self.simd;
        let filter = texels.filter;
        let here = V2::splat(splat(simd, 0.0));
        let depth = rule.least_lit_depth(kind, &row.plane, &row.bias, here);
        let depth: [f32; LANES] = depth.into();
        let levels = match filter.mips {
            true => self
                .levels(kind, row, i)
                .map(|level| level.min(texels.last_level())),
            false => [0.0; LANES],
        };
        let place = [row.place.x, row.place.y].each(<[f32; LANES]>::from);
        let patch = row
            .patch
            .each(|end| [end.x, end.y].each(<[f32; LANES]>::from));
        let (mut moments, mut receivers) = ([[0.0; LANES]; 4], [[0.0; LANES]; 4]);
        for lane in bits(mask_bits(row.on_map)) {
            let ends = patch.map(|end| end.map(|of_axis| of_axis[lane]));
            let around = texels.at(place.map(|of_axis| of_axis[lane]), ends, levels[lane]);
            let receiver = filter
                .moments
                .of_receiver(texels.depths.linear(depth[lane]));
            for k in 0..4 {
                moments[k][lane] = around[k];
                receivers[k][lane] = receiver[k];
            }
        }
        let [moments, receivers] = [moments, receivers]
            .each(|columns| columns.each(|column| f32x8::simd_from(simd, column)));
        let share = filter.moments.lit_share(moments, receivers);
        let share: [f32; LANES] = filter.without_bleeding(share).into();
        for lane in bits(mask_bits(row.on_map)) {
            self.lit[i][lane] = share[lane];
        }
    }

    /// The levels whose texels are as wide as what the receivers' pixels see, where that is widest.
    #[inline(always)]
    fn levels(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        row: &RowReceivers<S>,
        i: usize,
    ) -> [f32; LANES] {
        let simd = self.simd;
        let camera = self.receivers.camera;
        let (normal, _) = self.normals(i);
        let [x, y, z] = [0, 1, 2].each(|axis| narrow(self.block.points[i][axis]));
        let from_eye = V3::new(x, y, z);
        let vector = |v: DVec3| {
            let [x, y, z] = v.as_vec3().to_array().each(|part| splat(simd, part));
            V3::new(x, y, z)
        };
        let forward = vector(camera.forward);
        let (ray, distance) = match camera.rays {
            Rays::Perspective => (from_eye, from_eye.dot(forward)),
            Rays::Orthographic => (forward, splat(simd, 1.0)),
        };
        let start = self.place_of(kind, row, row.plane.q);
        let mut widest = splat(simd, 0.0);
        for step in [camera.right / camera.focal.x, camera.up / camera.focal.y] {
            // To the next pixel, and on along its ray to the receiver's plane.
            let across = vector(step) * distance;
            let on_plane = across - ray * (normal.dot(across) / normal.dot(ray));
            let q = row.plane.q + self.layer.space.turned(simd, on_plane);
            widest = (self.place_of(kind, row, q) - start).length().max(widest);
        }
        let widest: [f32; LANES] = widest.into();
        // Not a number where a pixel sees the plane from its edge.
        widest.map(|texels| texels.log2().max(0.0))
    }

    /// Where points are in the map, after its warp.
    #[inline(always)]
    fn place_of(
        &self,
        kind: &impl Formulas<f32x8<S>>,
        row: &RowReceivers<S>,
        q: V3<f32x8<S>>,
    ) -> V2<f32x8<S>> {
        let place = kind.centred_texel_from_projected(q) + self.v2(self.layer.centre);
        let Some(warp) = self.layer.warp else {
            return place;
        };
        let size = self.v2(self.layer.size);
        let linear = place.zip(size, |place, size| place / size);
        self.warped(warp, linear, row.on_map).0
    }
}
