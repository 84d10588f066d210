//! The receivers of a block against a list of triangles that may stand before them, whoever made the list.

use super::bins::{eights, ids_at, triangles_of};
use super::caster_tests::own_lanes;
use super::holes::Holes;
use super::lanes::{EPSILON, LANES, Simd, bits, mask_bits, mask32x8, splat};
use super::rasterize::NONE;
use super::receivers::{BlockPlaces, BlockReceivers, Receivers};
use super::shapes::{Corners, Shapes};
use super::tiles::BLOCK;
use super::view::{Nearness, Place, View};
use fearless_simd::prelude::*;
use glam::DVec2;

/// What the light sees: receivers, and the corners of triangles.
#[derive(Clone, Copy)]
pub struct Candidates<'a> {
    pub receivers: &'a Receivers<'a>,
    pub view: &'a View,
    /// Of the scene's vertices in the view.
    pub vertices: &'a [Place],
}

/// The receivers of a block, and where a view sees them.
#[derive(Clone, Copy)]
pub struct PlacedBlock<'a, S: Simd> {
    pub block: &'a BlockReceivers<S>,
    pub places: &'a BlockPlaces<S>,
    /// The block's first pixel.
    pub pixel: (usize, usize),
}

/// The box of receivers in a view, relative to one of them, and the farthest.
struct Beam {
    origin: [f32; 2],
    sides: [f32; 4],
    /// No receiver is farther from the origin along an axis.
    reach: f32,
    farthest: f32,
}

impl Candidates<'_> {
    /// The receivers among some that triangles shadow, row by row, and the last triangle that did, or `NONE`. `may_shadow`
    /// gives those of a row that ask for a triangle; a receiver's own never shadows it.
    #[inline(always)]
    pub fn shadowed<S: Simd>(
        &self,
        simd: S,
        seen: PlacedBlock<S>,
        triangles: &[u32],
        asking: &[u32; BLOCK],
        may_shadow: impl Fn(usize, u32) -> u32,
    ) -> ([u32; BLOCK], u32) {
        let mut left = *asking;
        if self.view.nearness == Nearness::Inverse {
            // What lies behind the light has a place, mirrored, but no triangle before it.
            for (left, &nearness) in left.iter_mut().zip(&seen.places.nearness) {
                *left &= mask_bits(splat(simd, 0.0).simd_lt(nearness));
            }
        }
        let before = left;
        let Some(beam) = Beam::of(simd, seen.places, &left) else {
            return ([0; BLOCK], NONE);
        };
        let rounding = self.view.rounding();
        let mut last = NONE;
        for (numbers, count) in eights(0..triangles.len()) {
            let ids = ids_at(triangles, numbers);
            let corners =
                Corners::new(simd, self.vertices, triangles_of(self.receivers.scene, ids));
            let wide = corners.wide(simd, self.view) & ((1 << count) - 1);
            let corners = corners.relative_to(beam.origin);
            let mut shapes = Shapes::new(simd, &corners, rounding, beam.reach);
            let mut met = (1 << count) - 1;
            for lane in bits(wide) {
                let origin = DVec2::from(beam.origin.map(f64::from));
                let (view, side) = ((self.view, self.receivers.scene), f64::from(beam.reach));
                if !shapes.set_wide(lane, view, ids[lane], origin, side, rounding) {
                    met &= !(1 << lane);
                }
            }
            for lane in bits(met & shapes.may_hide(simd, beam.sides, beam.farthest)) {
                let shape = (&shapes, lane, ids[lane]);
                if self.test_triangle(simd, seen, shape, beam.origin, &mut left, &may_shadow) {
                    last = ids[lane];
                }
            }
            if left == [0; BLOCK] {
                break;
            }
        }
        (std::array::from_fn(|i| before[i] & !left[i]), last)
    }

    /// Whether it shadows one.
    #[inline(always)]
    fn test_triangle<S: Simd>(
        &self,
        simd: S,
        seen: PlacedBlock<S>,
        (shapes, lane, id): (&Shapes, usize, u32),
        origin: [f32; 2],
        left: &mut [u32; BLOCK],
        may_shadow: &impl Fn(usize, u32) -> u32,
    ) -> bool {
        let mut has_shadowed = false;
        let scene = self.receivers.scene;
        let holes = Holes::new(self.view, scene, id, DVec2::from(origin.map(f64::from)));
        // Two rows at once.
        for i in (0..BLOCK).step_by(2) {
            let of_pair = left[i] | left[i + 1] << LANES;
            if of_pair == 0 {
                continue;
            }
            let BlockPlaces { u, v, nearness } = seen.places;
            let (u, v) = (u[i].combine(u[i + 1]), v[i].combine(v[i + 1]));
            let nearness = nearness[i].combine(nearness[i + 1]);
            let (u, v) = (u - origin[0], v - origin[1]);
            let (hit, maybe) = shapes.test(simd, lane, u, v, nearness);
            let candidates = (hit | maybe) & of_pair;
            if candidates == 0 {
                continue;
            }
            let ids = &seen.block.ids.as_flattened()[i * LANES..][..2 * LANES];
            let asking = may_shadow(i, id) | may_shadow(i + 1, id) << LANES;
            let asking = asking & !own_lanes(simd, ids, id);
            let (hit, candidates) = match &holes {
                None => (hit, candidates),
                Some(holes) => {
                    let places = (&u.to_array()[..], &v.to_array()[..]);
                    let within = candidates & asking;
                    holes.sort((hit & within, within), places, self.view.rounding())
                }
            };
            for k in bits(candidates & asking) {
                let (row, j) = (i + k / LANES, k % LANES);
                let at = (seen.pixel.0 + j, seen.pixel.1 + row);
                let is_hit = hit >> k & 1 != 0 || self.receivers.ray(at, ids[k]).is_shadowed_by(id);
                if is_hit {
                    left[row] &= !(1 << j);
                    has_shadowed = true;
                }
            }
        }
        has_shadowed
    }
}

impl Beam {
    #[inline(always)]
    fn of<S: Simd>(simd: S, places: &BlockPlaces<S>, left: &[u32; BLOCK]) -> Option<Self> {
        let row = (0..BLOCK).find(|&i| left[i] != 0)?;
        let lane = left[row].trailing_zeros() as usize;
        let origin = [places.u[row][lane], places.v[row][lane]];
        let zero = splat(simd, 0.0);
        let [mut low_u, mut high_u, mut low_v, mut high_v] = [zero; 4];
        let mut farthest = splat(simd, f32::INFINITY);
        for (i, &left) in left.iter().enumerate() {
            let mask = mask32x8::from_bitmask(simd, u64::from(left));
            let u = mask.select(places.u[i] - origin[0], zero);
            let v = mask.select(places.v[i] - origin[1], zero);
            (low_u, high_u) = (low_u.min(u), high_u.max(u));
            (low_v, high_v) = (low_v.min(v), high_v.max(v));
            farthest = mask.select(farthest.min(places.nearness[i]), farthest);
        }
        let sides = [
            low_u.reduce_min(),
            high_u.reduce_max(),
            low_v.reduce_min(),
            high_v.reduce_max(),
        ];
        let [low_u, high_u, low_v, high_v] = sides;
        let farthest = farthest.reduce_min();
        Some(Self {
            origin,
            sides,
            reach: high_u.max(-low_u).max(high_v).max(-low_v),
            farthest: farthest - farthest.abs() * (4.0 * EPSILON),
        })
    }
}
