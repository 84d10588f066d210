//! Eight float32 numbers at once.

use fearless_simd::prelude::*;

pub use crate::instructions::level;
pub use fearless_simd::{
    Simd, dispatch, f32x4, f32x8, f32x16, f64x4, f64x8, mask32x8, mask64x8, u32x8, u32x16,
};

/// Numbers in a vector.
pub const LANES: usize = 8;

/// What each float32 operation rounds, as a share of its result.
pub const EPSILON: f32 = 0.5 * f32::EPSILON;

/// The numbers from 0 on.
#[inline(always)]
pub fn numbers<S: Simd>(simd: S) -> f32x8<S> {
    f32x8::simd_from(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0])
}

macro_rules! columns {
    ($(#[$doc:meta])* $columns:ident, $transposed:ident: $scalar:ty, $four:ident, $eight:ident) => {
        $(#[$doc])*
        #[inline(always)]
        pub fn $columns<S: Simd>(simd: S, rows: [&[$scalar; 4]; LANES]) -> [$eight<S>; 4] {
            let low = $transposed(simd, [rows[0], rows[1], rows[2], rows[3]]);
            let high = $transposed(simd, [rows[4], rows[5], rows[6], rows[7]]);
            [
                low[0].combine(high[0]),
                low[1].combine(high[1]),
                low[2].combine(high[2]),
                low[3].combine(high[3]),
            ]
        }

        #[inline(always)]
        fn $transposed<S: Simd>(simd: S, [a, b, c, d]: [&[$scalar; 4]; 4]) -> [$four<S>; 4] {
            let (a, b) = ($four::simd_from(simd, *a), $four::simd_from(simd, *b));
            let (c, d) = ($four::simd_from(simd, *c), $four::simd_from(simd, *d));
            let (ac_low, ac_high) = (a.zip_low(c), a.zip_high(c));
            let (bd_low, bd_high) = (b.zip_low(d), b.zip_high(d));
            [
                ac_low.zip_low(bd_low),
                ac_low.zip_high(bd_low),
                ac_high.zip_low(bd_high),
                ac_high.zip_high(bd_high),
            ]
        }
    };
}

columns! {
    /// Eight rows of four numbers as four columns of eight.
    columns, transposed: f32, f32x4, f32x8
}
columns! {
    /// The same of float64.
    columns64, transposed64: f64, f64x4, f64x8
}

/// References to eight rows.
#[inline(always)]
pub fn each_row<T>([a, b, c, d, e, f, g, h]: &[T; LANES]) -> [&T; LANES] {
    [a, b, c, d, e, f, g, h]
}

/// Of whole numbers from 0 on, what they index.
#[inline(always)]
pub fn indices<S: Simd>(simd: S, numbers: f32x8<S>) -> [u32; LANES] {
    simd.cvt_i32_f32x8(numbers).bitcast::<u32x8<S>>().to_array()
}

/// The numbers of the bits that are set.
#[derive(Debug, Clone, Copy)]
pub struct Bits(u32);

#[inline(always)]
pub fn bits(mask: u32) -> Bits {
    Bits(mask)
}

impl Iterator for Bits {
    type Item = usize;

    #[inline(always)]
    fn next(&mut self) -> Option<usize> {
        if self.0 == 0 {
            return None;
        }
        let bit = self.0.trailing_zeros() as usize;
        self.0 &= self.0 - 1;
        Some(bit)
    }
}

#[inline(always)]
pub fn mask_bits<S: Simd>(mask: mask32x8<S>) -> u32 {
    mask.to_bitmask() as u32
}

#[inline(always)]
pub fn splat<S: Simd>(simd: S, value: f32) -> f32x8<S> {
    f32x8::simd_from(simd, value)
}

/// Rounded to float32.
#[inline(always)]
pub fn narrow<S: Simd>(v: f64x8<S>) -> f32x8<S> {
    let (low, high) = v.split();
    low.narrow(high)
}

#[inline(always)]
pub fn least<S: Simd>([a, b, c]: [f32x8<S>; 3]) -> f32x8<S> {
    a.min(b).min(c)
}

#[inline(always)]
pub fn greatest<S: Simd>([a, b, c]: [f32x8<S>; 3]) -> f32x8<S> {
    a.max(b).max(c)
}

#[inline]
pub fn least_of(values: &[f32]) -> f32 {
    values.iter().copied().fold(f32::INFINITY, f32::min)
}

#[inline]
pub fn greatest_of(values: &[f32]) -> f32 {
    values.iter().copied().fold(f32::NEG_INFINITY, f32::max)
}
