//! Eight float32 numbers as what formulas are written for.

use super::lanes::{LANES, Simd, f32x8, mask32x8, splat};
use crate::lanes::Lane;
use fearless_simd::SimdFrom;

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
    fn gather(table: &[f32], width: usize, row: Self, column: Self) -> Self {
        let (rows, columns): ([f32; LANES], [f32; LANES]) = (row.into(), column.into());
        let mut values = [0.0; LANES];
        for (i, value) in values.iter_mut().enumerate() {
            // A lane that nobody asks for may be anywhere.
            let place = rows[i] as usize * width + columns[i] as usize;
            *value = table[place.min(table.len() - 1)];
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
