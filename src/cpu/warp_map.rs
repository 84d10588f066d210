//! Importance to monotone functions, as `shaders/warp_map.wgsl`, which cites where they come from.

use super::importance_map::Words;
use crate::importance::ImportanceMap;
use crate::lanes::{Lane, V2};
use crate::map_size::MapSize;
use crate::warp::{Axis, CountFit, Inverses, Warp, Warping, blur_within};
use rayon::prelude::*;

/// Of the integers that powers of sums are rounded to, as in the shader.
const POWER_UNIT: f32 = 256.0;

/// Columns of cells that a thread takes down all rows at once: a line of the cache is as wide.
const STRIP: usize = 16;

/// The warp of a layer.
pub type CpuWarp = Warping<WarpMap>;

impl CpuWarp {
    /// Linear map coordinates of the centre of a texel.
    #[inline(always)]
    pub fn linear_from_texel<L: Lane>(&self, texel: V2<L>) -> V2<L> {
        match self {
            Self::Functions(WarpMap { warp, inverses }) => warp.linear_from_texel(inverses, texel),
            Self::Samples(samples) => samples.linear_from_texel(texel),
        }
    }
}

/// A warp, and where each of its functions takes on the centres of a map's texels.
pub struct WarpMap {
    pub warp: Warp,
    pub inverses: Inverses,
}

impl WarpMap {
    /// Functions that leave everything where it is. There are no inverses yet.
    pub fn new(functions: u32, cells: u32) -> Self {
        let identity = (0..=cells).map(|i| (f64::from(i) / f64::from(cells)) as f32);
        let identity: Vec<_> = identity.collect();
        Self {
            warp: Warp {
                functions: functions as usize,
                boundaries: cells as usize + 1,
                values: identity.repeat(2 * functions as usize),
            },
            inverses: Inverses::none(),
        }
    }

    /// The values of the functions along an axis.
    fn along(&mut self, axis: Axis) -> &mut [f32] {
        let Warp {
            functions,
            boundaries,
            values,
        } = &mut self.warp;
        let (along_x, along_y) = values.split_at_mut(*functions * *boundaries);
        match axis {
            Axis::X => along_x,
            Axis::Y => along_y,
        }
    }

    /// The functions along one axis from counts of receivers (Milet et al.), as many rows (columns) of cells as the
    /// functions along the other axis have. Each function serves its share of the rows.
    pub fn fit_counts(&mut self, axis: Axis, counts: &ImportanceMap<Words>, fit: CountFit) {
        let cells = counts.cells as usize;
        let weights = gathered(&counts.values, cells, self.warp.functions, fit);
        let boundaries = self.warp.boundaries;
        let functions = self.along(axis).par_chunks_mut(boundaries);
        let pairs = functions.zip(weights.par_chunks(cells));
        pairs.for_each(|(values, weights)| {
            let total: u64 = weights.iter().sum();
            let mut sum = 0;
            for (cell, value) in values.iter_mut().enumerate() {
                let identity = cell as f64 / cells as f64;
                let equalized = match total {
                    0 => identity,
                    _ => {
                        let share = sum as f64 / total as f64;
                        share * (1.0 - fit.even_share) + identity * fit.even_share
                    }
                };
                *value = equalized as f32;
                sum += weights.get(cell).unwrap_or(&0);
            }
            values[cells] = 1.0;
        });
    }

    /// The function along one axis from the maxima of an importance map (Rosen), blurred by a Gaussian of `sigma`
    /// cells.
    pub fn fit_maxima(&mut self, axis: Axis, importance: &ImportanceMap<Words>, sigma: f64) {
        let cells = importance.cells as usize;
        let maxima = maxima(&importance.values, cells, axis);
        let blurred = blurred(&maxima, blur_within(importance.cells, sigma));
        let total: f64 = blurred.iter().sum();
        let mut sum = 0.0;
        for (cell, value) in self.along(axis).iter_mut().enumerate() {
            let identity = cell as f64 / cells as f64;
            *value = (if total > 0.0 { sum / total } else { identity }) as f32;
            sum += blurred.get(cell).unwrap_or(&0.0);
        }
        self.along(axis)[cells] = 1.0;
    }

    /// The inverses, once the functions along both axes are there.
    pub fn finish(&mut self, size: MapSize) {
        self.inverses = self.warp.inverses(size);
    }
}

/// The counts of all rows that share a function, averaged over a window of rows twice and to a power: integers, of
/// which a sum in any order is the same.
fn gathered(counts: &[u32], cells: usize, functions: usize, fit: CountFit) -> Vec<u64> {
    let window = fit.window(cells as u32) as usize;
    let served = |function: usize| function * cells / functions..(function + 1) * cells / functions;
    let mut weights = vec![0; functions * cells];
    if window == 0 {
        let of_functions = weights.par_chunks_mut(cells).enumerate();
        of_functions.for_each(|(function, weights)| {
            for row in served(function) {
                for (sum, &count) in weights.iter_mut().zip(&counts[row * cells..]) {
                    *sum += u64::from(count);
                }
            }
            for sum in weights {
                *sum = to_power(*sum, fit.exponent);
            }
        });
        return weights;
    }
    let strips = (0..cells).into_par_iter().step_by(STRIP).map(|first| {
        let width = STRIP.min(cells - first);
        let row = |row: usize| {
            let mut strip = [0; STRIP];
            for (wide, &count) in strip
                .iter_mut()
                .zip(&counts[row * cells + first..][..width])
            {
                *wide = u64::from(count);
            }
            strip
        };
        let rows: Vec<_> = (0..cells).map(row).collect();
        let rows = smoothed(&smoothed(&rows, window), window);
        let share = |function: usize| {
            let sums = rows[served(function)].iter().fold([0; STRIP], plus);
            sums.map(|sum| to_power(sum, fit.exponent))
        };
        (0..functions).map(share).collect::<Vec<_>>()
    });
    let strips: Vec<_> = strips.collect();
    let of_functions = weights.par_chunks_mut(cells).enumerate();
    of_functions.for_each(|(function, weights)| {
        for (weights, strip) in weights.chunks_mut(STRIP).zip(&strips) {
            weights.copy_from_slice(&strip[function][..weights.len()]);
        }
    });
    weights
}

fn plus(sums: [u64; STRIP], row: &[u64; STRIP]) -> [u64; STRIP] {
    std::array::from_fn(|i| sums[i] + row[i])
}

/// Sums over a window that slides over the rows.
fn smoothed(rows: &[[u64; STRIP]], window: usize) -> Vec<[u64; STRIP]> {
    let mut sum = rows.iter().take(window).fold([0; STRIP], plus);
    let slide = |i: usize| {
        if let Some(entering) = rows.get(i + window) {
            sum = plus(sum, entering);
        }
        if i > window {
            let leaving = &rows[i - window - 1];
            sum = std::array::from_fn(|k| sum[k] - leaving[k]);
        }
        sum
    };
    (0..rows.len()).map(slide).collect()
}

fn to_power(sum: u64, exponent: f64) -> u64 {
    if exponent == 1.0 || sum == 0 {
        return sum;
    }
    (POWER_UNIT * (sum as f32).powf(exponent as f32)).round() as u64
}

/// The greatest value of each column, or of each row along y. Positive floats are ordered as their bits are.
fn maxima(importance: &[u32], cells: usize, axis: Axis) -> Vec<f64> {
    let rows = importance.par_chunks(cells);
    let bits: Vec<u32> = match axis {
        Axis::Y => rows
            .map(|row| row.iter().copied().max().unwrap_or(0))
            .collect(),
        Axis::X => rows
            .fold(
                || vec![0; cells],
                |mut greatest, row| {
                    raise(&mut greatest, row);
                    greatest
                },
            )
            .reduce(
                || vec![0; cells],
                |mut a, b| {
                    raise(&mut a, &b);
                    a
                },
            ),
    };
    let values = bits.into_iter().map(|bits| f32::from_bits(bits).into());
    values.collect()
}

fn raise(greatest: &mut [u32], row: &[u32]) {
    for (most, &value) in greatest.iter_mut().zip(row) {
        *most = value.max(*most);
    }
}

fn blurred(maxima: &[f64], sigma: f64) -> Vec<f64> {
    let cells = maxima.len();
    let reach = ((3.0 * sigma).ceil() as usize).min(cells);
    let weights: Vec<_> = (0..=reach)
        .map(|offset| (-0.5 * (offset as f64 / sigma).powi(2)).exp())
        .collect();
    let blur = |cell: usize| {
        let first = cell.saturating_sub(reach);
        let near = &maxima[first..(cell + reach + 1).min(cells)];
        let mut sums = [0.0; 2];
        for (i, value) in near.iter().enumerate() {
            let weight = weights[cell.abs_diff(first + i)];
            sums[0] += weight * value;
            sums[1] += weight;
        }
        sums[0] / sums[1]
    };
    let cells = (0..cells).into_par_iter().with_min_len(64);
    cells.map(blur).collect()
}
