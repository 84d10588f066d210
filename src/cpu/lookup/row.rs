//! Where the lookups of a row's receivers begin, as in `shaders/lib/lookup_place.wgsl`, which argues for it.

use super::{BlockLookup, RowReceivers};
use crate::bias::{Plane, Rule};
use crate::cpu::lanes::{LANES, Simd, bits, f32x8, mask_bits, mask32x8, splat};
use crate::cpu::warp_map::WarpMap;
use crate::lanes::{Each, Lane, V2, V3};
use crate::projection::Formulas;
use crate::warp::{Warp, Warping};
use fearless_simd::prelude::*;

impl<S: Simd> BlockLookup<'_, S> {
    /// The receivers of a row.
    #[inline(always)]
    pub(super) fn row(
        &mut self,
        kind: &impl Formulas<f32x8<S>>,
        rule: &Rule<f32x8<S>>,
        i: usize,
    ) -> RowReceivers<S> {
        let (simd, space) = (self.simd, &self.layer.space);
        let point = &self.block.points[i];
        let (normal, covector) = self.normals(i);
        let from_light = self.receivers.rays_of_light(simd, point);
        let q = space.projected(simd, point);
        let plane = Plane {
            q,
            normal: covector,
        };
        let bias = rule.bias_of_receiver(kind, &plane, normal, from_light);
        let own = kind.centred_texel_from_projected(q);
        let (size, centre) = (self.v2(self.layer.size), self.v2(self.layer.centre));
        let (zero, half) = (splat(simd, 0.0), splat(simd, 0.5));
        let mask = mask32x8::from_bitmask(simd, u64::from(self.masks[i]));
        let on_map = self.is_on_map(own + centre) & mask;
        let is_edge_on = bias.is_edge_on & on_map;
        let mut start = own + centre;
        let mut outward = V2::splat(zero);
        if mask_bits(is_edge_on) != 0 {
            // Off the surface by what rounding may hide, and by half a texel: then the middle of the texel is outside.
            outward = kind.height_slope(covector, q);
            let aside = space.turned(simd, normal * splat(simd, self.layer.margin));
            let beside = kind.centred_texel_from_projected(q + aside) + centre;
            start = start.zip(beside, |at, beside| Lane::select(is_edge_on, beside, at));
        }
        let last = size.map(|size| size - splat(simd, 1.0));
        let mut row = RowReceivers {
            plane,
            bias,
            from_light,
            own,
            place: start,
            middle: start,
            linear: start.zip(size, |start, size| start / size),
            functions: V2::splat(zero),
            patch: [V2::splat(zero), last],
            on_map,
        };
        match self.layer.warp {
            None => {}
            Some(Warping::Functions(WarpMap { warp, .. })) => {
                let (warped, functions) = warp.warped_from_linear(row.linear);
                row.place = warped.zip(size, |warped, size| warped * size);
                row.functions = functions;
                if warp.functions > 1 {
                    row.patch = self.patch_of(warp, functions, mask);
                }
            }
            Some(Warping::Samples(samples)) => {
                let (place, is_there, cells) = self.sampled_place(samples, row.linear, on_map);
                row.place = place;
                row.on_map &= is_there;
                outward = self.outward_after(samples, &cells, is_edge_on, outward);
            }
        }
        row.place = row.place.zip(outward, |place, outward| {
            place + Lane::select(is_edge_on, outward.sign() * half, zero)
        });
        let whole = row
            .place
            .map(|place| Lane::select(row.on_map, Lane::floor(place), zero));
        let within = Self::nearest_in_patch(whole, row.patch);
        row.middle = self.nearest_on_map(within);
        if self.layer.comparison.reach == 0 {
            self.ask_across(&mut row, whole - within);
        }
        row
    }

    /// The patches that receivers lie in. Neighbours mostly lie in the same ones.
    #[inline(always)]
    pub(super) fn patch_of(
        &mut self,
        warp: &Warp,
        functions: V2<f32x8<S>>,
        mask: mask32x8<S>,
    ) -> [V2<f32x8<S>>; 2] {
        if let Some((known, patch)) = self.patch {
            let is_known = functions.x.simd_eq(known.x) & functions.y.simd_eq(known.y);
            if mask_bits(mask & !is_known) == 0 {
                return patch;
            }
        }
        let patch = warp.patch_of(functions, self.layer.texels);
        self.patch = Some((functions, patch));
        patch
    }

    /// Alone, a texel may lie on the inner side of an edge-on surface: then the one across the seam is asked.
    #[inline(always)]
    fn ask_across(&self, row: &mut RowReceivers<S>, outside: V2<f32x8<S>>) {
        let Some(WarpMap { warp, .. }) = self.tearing_warp() else {
            return;
        };
        let zero = splat(self.simd, 0.0);
        let is_outside = |v: f32x8<S>| Lane::less(zero, Lane::abs(v));
        let along_x = is_outside(outside.x);
        let is_torn_off = (along_x | is_outside(outside.y)) & row.bias.is_edge_on & row.on_map;
        if mask_bits(is_torn_off) == 0 {
            return;
        }
        let side = V2::new(
            outside.x.sign(),
            Lane::select(along_x, zero, outside.y.sign()),
        );
        let texels = self.layer.texels;
        let across = warp.texel_across(row.linear, row.functions, side, texels);
        let across = self.nearest_on_map(across);
        row.middle = row.middle.zip(across, |middle, across| {
            Lane::select(is_torn_off, across, middle)
        });
    }

    /// Of the planes of a row's receivers: unit normals in the world, and as covectors.
    #[inline(always)]
    pub(super) fn normals(&mut self, i: usize) -> (V3<f32x8<S>>, V3<f32x8<S>>) {
        let simd = self.simd;
        let (receivers, space) = (self.receivers, &self.layer.space);
        let normals = &mut *self.normals;
        let mut find = |triangle: u32| {
            *normals.get(triangle, || {
                let normal = receivers.lit_normal(triangle);
                let (world, turned) = (normal.as_vec3(), space.covector(normal));
                [world.x, world.y, world.z, turned.x, turned.y, turned.z]
            })
        };
        let ids = &self.block.ids[i];
        if self.block.is_one[i] {
            let [x, y, z, u, v, w] = find(ids[0]).each(|value| splat(simd, value));
            return (V3::new(x, y, z), V3::new(u, v, w));
        }
        let mut columns = [[1.0; LANES]; 6];
        for lane in bits(self.masks[i]) {
            for (column, value) in columns.iter_mut().zip(find(ids[lane])) {
                column[lane] = value;
            }
        }
        let [x, y, z, u, v, w] = columns.each(|column| f32x8::simd_from(simd, column));
        (V3::new(x, y, z), V3::new(u, v, w))
    }
}
