//! Eight float32 numbers as what formulas are written for.

use super::lanes::{LANES, Simd, f32x8, mask32x8, splat};
use crate::lanes::Lane;
use fearless_simd::SimdFrom;

#[inline(always)]
fn lane_by_lane<S: Simd>(numbers: f32x8<S>, function: impl Fn(f32) -> f32) -> f32x8<S> {
    let values: [f32; LANES] = numbers.into();
    f32x8::simd_from(numbers.simd, values.map(function))
}

impl<S: Simd> Lane for f32x8<S> {
    type Mask = mask32x8<S>;

    #[inline(always)]
    fn constant(self, value: f64) -> Self {
        splat(self.simd, value as f32)
    }

    #[inline(always)]
    fn sqrt(self) -> Self {
        self.simd.sqrt_f32x8(self)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        self.simd.abs_f32x8(self)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.simd.min_f32x8(self, other)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.simd.max_f32x8(self, other)
    }

    #[inline(always)]
    fn floor(self) -> Self {
        self.simd.floor_f32x8(self)
    }

    #[inline(always)]
    fn exp(self) -> Self {
        lane_by_lane(self, f32::exp)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        lane_by_lane(self, f32::ln)
    }

    #[inline(always)]
    fn gather(table: &[f32], width: usize, row: Self, column: Self) -> Self {
        let simd = row.simd;
        let (rows, columns) = (simd.cvt_u32_f32x8(row), simd.cvt_u32_f32x8(column));
        let first_of_row = simd.mul_u32x8(rows, simd.splat_u32x8(width as u32));
        // A lane that nobody asks for may be anywhere.
        let last = simd.splat_u32x8(table.len() as u32 - 1);
        let places = simd.min_u32x8(simd.add_u32x8(first_of_row, columns), last);
        let places: [u32; LANES] = places.into();
        let mut values = [0.0; LANES];
        for (value, place) in values.iter_mut().zip(places) {
            *value = table[place as usize];
        }
        f32x8::simd_from(row.simd, values)
    }

    #[inline(always)]
    fn less(self, other: Self) -> Self::Mask {
        self.simd.simd_lt_f32x8(self, other)
    }

    #[inline(always)]
    fn at_most(self, other: Self) -> Self::Mask {
        self.simd.simd_le_f32x8(self, other)
    }

    #[inline(always)]
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
        yes.simd.select_f32x8(mask, yes, no)
    }
}
