//! Eight numbers of float32, or of float64, as what formulas are written for.

use super::lanes::{LANES, Simd, f32x8, f64x8, mask32x8, mask64x8};
use crate::lanes::Lane;
use fearless_simd::SimdFrom;

macro_rules! eight_lanes {
    (
        $eight:ident of $scalar:ident, $mask:ident, $splat:ident, $sqrt:ident, $abs:ident, $min:ident, $max:ident,
        $floor:ident, $less:ident, $at_most:ident, $select:ident, $gather:ident
    ) => {
        impl<S: Simd> Lane for $eight<S> {
            type Mask = $mask<S>;

            #[inline(always)]
            fn constant(self, value: f64) -> Self {
                self.simd.$splat(value as $scalar)
            }

            #[inline(always)]
            fn sqrt(self) -> Self {
                self.simd.$sqrt(self)
            }

            #[inline(always)]
            fn abs(self) -> Self {
                self.simd.$abs(self)
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                self.simd.$min(self, other)
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                self.simd.$max(self, other)
            }

            #[inline(always)]
            fn floor(self) -> Self {
                self.simd.$floor(self)
            }

            #[inline(always)]
            fn exp(self) -> Self {
                let values: [$scalar; LANES] = self.into();
                Self::simd_from(self.simd, values.map($scalar::exp))
            }

            #[inline(always)]
            fn ln(self) -> Self {
                let values: [$scalar; LANES] = self.into();
                Self::simd_from(self.simd, values.map($scalar::ln))
            }

            #[inline(always)]
            fn gather(table: &[f32], width: usize, row: Self, column: Self) -> Self {
                $gather(table, width, row, column)
            }

            #[inline(always)]
            fn less(self, other: Self) -> Self::Mask {
                self.simd.$less(self, other)
            }

            #[inline(always)]
            fn at_most(self, other: Self) -> Self::Mask {
                self.simd.$at_most(self, other)
            }

            #[inline(always)]
            fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
                yes.simd.$select(mask, yes, no)
            }
        }
    };
}

eight_lanes!(
    f32x8 of f32, mask32x8, splat_f32x8, sqrt_f32x8, abs_f32x8, min_f32x8, max_f32x8, floor_f32x8, simd_lt_f32x8,
    simd_le_f32x8, select_f32x8, gathered
);
eight_lanes!(
    f64x8 of f64, mask64x8, splat_f64x8, sqrt_f64x8, abs_f64x8, min_f64x8, max_f64x8, floor_f64x8, simd_lt_f64x8,
    simd_le_f64x8, select_f64x8, gathered64
);

#[inline(always)]
fn gathered<S: Simd>(table: &[f32], width: usize, row: f32x8<S>, column: f32x8<S>) -> f32x8<S> {
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

fn gathered64<S: Simd>(table: &[f32], width: usize, row: f64x8<S>, column: f64x8<S>) -> f64x8<S> {
    let (rows, columns): ([f64; LANES], [f64; LANES]) = (row.into(), column.into());
    let value = |i: usize| {
        let place = rows[i] as usize * width + columns[i] as usize;
        f64::from(table[place.min(table.len() - 1)])
    };
    f64x8::simd_from(row.simd, std::array::from_fn(value))
}
