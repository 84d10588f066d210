//! Boxes around what falls in one cell of the light's grid, row by row, against those of triangles.

use super::lanes::{EPSILON, Simd, f32x8, mask_bits, mask32x8, splat};
use super::light_grid::{Group, meets_range};
use super::tiles::BLOCK;
use fearless_simd::prelude::*;

/// Of the rows of a block: boxes, and how near each is where it is farthest. So many roundings may be in that.
pub struct RowBoxes<const ROUNDINGS: u8> {
    low_u: [f32; BLOCK],
    high_u: [f32; BLOCK],
    low_v: [f32; BLOCK],
    high_v: [f32; BLOCK],
    farthest: [f32; BLOCK],
    /// Of all: the box, and the farthest with what rounding may do to it.
    pub sides: [f32; 4],
    pub limit: f32,
}

impl<const ROUNDINGS: u8> RowBoxes<ROUNDINGS> {
    const SLACK: f32 = ROUNDINGS as f32 * EPSILON;

    pub const EMPTY: Self = Self {
        low_u: [f32::INFINITY; BLOCK],
        high_u: [f32::NEG_INFINITY; BLOCK],
        low_v: [f32::INFINITY; BLOCK],
        high_v: [f32::NEG_INFINITY; BLOCK],
        farthest: [f32::INFINITY; BLOCK],
        sides: [0.0; 4],
        limit: 0.0,
    };

    /// Least and greatest column, least and greatest row of what a row has, and the farthest.
    #[inline(always)]
    pub fn set(&mut self, row: usize, sides: [f32; 4], farthest: f32) {
        [
            self.low_u[row],
            self.high_u[row],
            self.low_v[row],
            self.high_v[row],
        ] = sides;
        self.farthest[row] = farthest;
    }

    /// What is left of a row; the box stays.
    #[inline(always)]
    pub fn set_farthest(&mut self, row: usize, farthest: f32) {
        self.farthest[row] = farthest;
    }

    #[inline(always)]
    pub fn set_sides<S: Simd>(&mut self, simd: S) {
        self.sides = [
            f32x8::simd_from(simd, self.low_u).reduce_min(),
            f32x8::simd_from(simd, self.high_u).reduce_max(),
            f32x8::simd_from(simd, self.low_v).reduce_min(),
            f32x8::simd_from(simd, self.high_v).reduce_max(),
        ];
    }

    #[inline(always)]
    pub fn set_limit(&mut self) {
        let mut farthest = f32::INFINITY;
        for of_row in self.farthest {
            farthest = farthest.min(of_row);
        }
        self.limit = farthest - farthest.abs() * Self::SLACK;
    }

    /// The box around all, relative to an origin.
    #[inline(always)]
    pub fn sides_from(&self, [u, v]: [f32; 2]) -> [f32; 4] {
        let [low_u, high_u, low_v, high_v] = self.sides;
        [low_u - u, high_u - u, low_v - v, high_v - v]
    }

    /// The rows that a triangle of a group may shadow.
    #[inline(always)]
    pub fn rows<S: Simd>(&self, simd: S, group: &Group, lane: usize) -> u32 {
        let (u0, u1) = (group.low_u[lane], group.high_u[lane]);
        let (v0, v1) = (group.low_v[lane], group.high_v[lane]);
        let along_u = meets_range(simd, &self.low_u, &self.high_u, u0, u1);
        let along_v = meets_range(simd, &self.low_v, &self.high_v, v0, v1);
        let farthest = f32x8::simd_from(simd, self.farthest);
        let limit = farthest - farthest.abs() * Self::SLACK;
        let is_nearer = limit.simd_lt(splat(simd, group.nearest[lane]));
        mask_bits((along_u & along_v) & is_nearer)
    }
}

/// The least of some of eight values.
#[inline(always)]
pub fn least_within<S: Simd>(simd: S, values: f32x8<S>, within: u32) -> f32 {
    let mask = mask32x8::from_bitmask(simd, u64::from(within));
    mask.select(values, splat(simd, f32::INFINITY)).reduce_min()
}
