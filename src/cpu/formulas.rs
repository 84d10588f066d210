//! Eight numbers of float32, or of float64, as what formulas are written for.

use super::lanes::{LANES, Simd, columns, f32x8, f64x4, f64x8, mask32x8, mask64x8};
use crate::lanes::{Each, Lane};
use fearless_simd::prelude::*;

macro_rules! eight_lanes {
    (
        $eight:ident of $scalar:ident, $mask:ident, $splat:ident, $sqrt:ident, $abs:ident, $min:ident, $max:ident,
        $floor:ident, $less:ident, $at_most:ident, $select:ident, $gather:ident $(, $gather_two:ident, $gather_four:ident)?
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

            $(
                #[inline(always)]
                fn gather_two(table: &[f32], width: usize, row: Self, column: Self) -> [Self; 2] {
                    $gather_two(table, width, row, column)
                }

                #[inline(always)]
                fn gather_four(table: &[f32], width: usize, row: Self, column: Self) -> [Self; 4] {
                    $gather_four(table, width, row, column)
                }
            )?

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
    simd_le_f32x8, select_f32x8, gathered, gathered_two, gathered_four
);
eight_lanes!(
    f64x8 of f64, mask64x8, splat_f64x8, sqrt_f64x8, abs_f64x8, min_f64x8, max_f64x8, floor_f64x8, simd_lt_f64x8,
    simd_le_f64x8, select_f64x8, gathered64
);

/// Where values lie in a table, each with those that follow it: so many.
#[inline(always)]
fn places<S: Simd>(
    (table, width): (&[f32], usize),
    row: f32x8<S>,
    column: f32x8<S>,
    count: usize,
) -> [u32; LANES] {
    let simd = row.simd;
    let (rows, columns) = (simd.cvt_u32_f32x8(row), simd.cvt_u32_f32x8(column));
    let first_of_row = simd.mul_u32x8(rows, simd.splat_u32x8(width as u32));
    // A lane that nobody asks for may be anywhere.
    let last = simd.splat_u32x8((table.len() - count) as u32);
    simd.min_u32x8(simd.add_u32x8(first_of_row, columns), last)
        .into()
}

#[inline(always)]
fn gathered<S: Simd>(table: &[f32], width: usize, row: f32x8<S>, column: f32x8<S>) -> f32x8<S> {
    let places = places((table, width), row, column, 1);
    let mut values = [0.0; LANES];
    for (value, place) in values.iter_mut().zip(places) {
        *value = table[place as usize];
    }
    f32x8::simd_from(row.simd, values)
}

/// Those of a table from a place on.
#[inline(always)]
fn several<const N: usize>(table: &[f32], place: u32) -> &[f32; N] {
    let first = place as usize;
    let several = table[first..first + N].first_chunk();
    several.expect("as many")
}

/// A pair is read as one number, of as many bits.
#[inline(always)]
fn gathered_two<S: Simd>(
    table: &[f32],
    width: usize,
    row: f32x8<S>,
    column: f32x8<S>,
) -> [f32x8<S>; 2] {
    let places = places((table, width), row, column, 2);
    let mut pairs = [0.0; LANES];
    for (pair, place) in pairs.iter_mut().zip(places) {
        *pair = bytemuck::cast::<[f32; 2], f64>(*several(table, place));
    }
    let [a, b, c, d, e, f, g, h] = pairs;
    let low: f32x8<S> = f64x4::simd_from(row.simd, [a, b, c, d]).bitcast();
    let high: f32x8<S> = f64x4::simd_from(row.simd, [e, f, g, h]).bitcast();
    [low.unzip_low(high), low.unzip_high(high)]
}

#[inline(always)]
fn gathered_four<S: Simd>(
    table: &[f32],
    width: usize,
    row: f32x8<S>,
    column: f32x8<S>,
) -> [f32x8<S>; 4] {
    let [a, b, c, d, e, f, g, h] = places((table, width), row, column, 4);
    let [a, b, c, d] = [a, b, c, d].each(|place| several(table, place));
    let [e, f, g, h] = [e, f, g, h].each(|place| several(table, place));
    columns(row.simd, [a, b, c, d, e, f, g, h])
}

fn gathered64<S: Simd>(table: &[f32], width: usize, row: f64x8<S>, column: f64x8<S>) -> f64x8<S> {
    let (rows, columns): ([f64; LANES], [f64; LANES]) = (row.into(), column.into());
    let value = |i: usize| {
        let place = rows[i] as usize * width + columns[i] as usize;
        f64::from(table[place.min(table.len() - 1)])
    };
    f64x8::simd_from(row.simd, std::array::from_fn(value))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cpu::lanes::{dispatch, level, splat};
    use crate::twin::Random;

    #[test]
    fn values_that_are_read_together_are_those_that_are_read_alone() {
        let mut random = Random(1);
        let (rows, width) = (3, 7);
        let table: Vec<_> = (0..rows * width).map(|_| random.number()).collect();
        for count in [2, 4] {
            for _ in 0..200 {
                let row: [f32; LANES] = std::array::from_fn(|_| random.below(rows) as f32);
                let last = width + 1 - count;
                let column: [f32; LANES] = std::array::from_fn(|_| random.below(last) as f32);
                let found =
                    dispatch!(level(), simd => gathered_all(simd, &table, width, row, column));
                for lane in 0..LANES {
                    let first = row[lane] as usize * width + column[lane] as usize;
                    let of_lane = found.each_ref().map(|values| values[lane]);
                    assert_eq!(of_lane[..2], table[first..first + 2]);
                    if count == 4 {
                        assert_eq!(of_lane[2..], table[first..first + 4]);
                    }
                }
            }
        }
    }

    /// Two that are read together, and four.
    #[inline(always)]
    fn gathered_all<S: Simd>(
        simd: S,
        table: &[f32],
        width: usize,
        row: [f32; LANES],
        column: [f32; LANES],
    ) -> [[f32; LANES]; 6] {
        let (row, column) = (f32x8::simd_from(simd, row), f32x8::simd_from(simd, column));
        let [a, b] = Lane::gather_two(table, width, row, column);
        let [c, d, e, f] = Lane::gather_four(table, width, row, column);
        // Who asks for what is beyond the table gets something of it.
        let beyond = splat(simd, 1e6);
        let _: [f32x8<S>; 2] = Lane::gather_two(table, width, beyond, column);
        let _: [f32x8<S>; 4] = Lane::gather_four(table, width, beyond, column);
        [a, b, c, d, e, f].map(|values| values.to_array())
    }
}
