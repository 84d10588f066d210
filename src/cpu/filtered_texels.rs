//! Moments of a map's depths, blurred, and coarser maps of them.

use super::lanes::{dispatch, level};
use super::map::Map;
use super::warp_map::WarpMap;
use crate::lanes::V2;
use crate::map_size::MapSize;
use crate::moments::FilteredMap;
use crate::projection::Projection;
use crate::warp::Warp;
use rayon::prelude::*;
use std::iter;
use std::ops::Range;

/// The moments of a layer.
pub struct FilteredTexels {
    pub filter: FilteredMap,
    pub depths: DepthRange,
    /// The map, and where there are mips those of half the texels along each side, down to one.
    levels: Vec<Level>,
}

/// What depths, in a projection's unit, are on the way from -1 to 1.
#[derive(Clone, Copy)]
pub struct DepthRange {
    middle: f32,
    scale: f32,
}

impl DepthRange {
    fn new(projection: &Projection) -> Self {
        let unit = projection.unit();
        let (near, far) = (projection.near * unit, projection.far * unit);
        // All receivers and casters of a layer may be equally deep.
        let scale = if far > near { 2.0 / (far - near) } else { 0.0 };
        Self {
            middle: (0.5 * (near + far)) as f32,
            scale: scale as f32,
        }
    }

    #[inline(always)]
    pub fn linear(self, depth: f32) -> f32 {
        ((depth - self.middle) * self.scale).clamp(-1.0, 1.0)
    }
}

/// Moments row by row, those of a texel one after the other.
struct Level {
    width: usize,
    height: usize,
    values: Vec<f32>,
}

impl FilteredTexels {
    pub fn new(
        projection: &Projection,
        warp: Option<&WarpMap>,
        map: &Map,
        filter: FilteredMap,
    ) -> Self {
        let depths = DepthRange::new(projection);
        let plain = Level::new(map, depths, filter);
        let patches = Patches::new(projection.size(), warp.map(|map| &map.warp));
        let weights = filter.kernel.weights(filter.blur);
        let mut levels = vec![match weights.len() {
            1 => plain,
            _ => plain.blurred(&patches, &weights, filter.moments.count()),
        }];
        while let Some(next) = filter
            .mips
            .then(|| levels[levels.len() - 1].halved(filter.moments.count()))
            .flatten()
        {
            levels.push(next);
        }
        Self {
            filter,
            depths,
            levels,
        }
    }

    /// What a texel takes while it is blurred.
    pub fn bytes_of_texel(filter: FilteredMap) -> usize {
        2 * filter.moments.count() * size_of::<f32>()
    }

    /// The number of the coarsest map.
    pub fn last_level(&self) -> f32 {
        (self.levels.len() - 1) as f32
    }

    /// Moments at a place of the map, bilinear in two levels and linear between them. In the finest one only texels of the
    /// patch count.
    #[inline(always)]
    pub fn at(&self, place: [f32; 2], patch: [[f32; 2]; 2], level: f32) -> [f32; 4] {
        let count = self.filter.moments.count();
        let fine = level as usize;
        let part = level - fine as f32;
        let halved = |level: usize| place.map(|place| place * 0.5_f32.powi(level as i32));
        let of_fine = self.levels[fine].at(halved(fine), (fine == 0).then_some(patch), count);
        if part == 0.0 {
            return of_fine;
        }
        let of_coarse = self.levels[fine + 1].at(halved(fine + 1), None, count);
        std::array::from_fn(|i| of_fine[i] + part * (of_coarse[i] - of_fine[i]))
    }
}

impl Level {
    fn new(map: &Map, depths: DepthRange, filter: FilteredMap) -> Self {
        let tiling = map.image.tiling;
        let count = filter.moments.count();
        let mut values = vec![0.0; tiling.width * tiling.height * count];
        let rows = values.par_chunks_mut(tiling.width * count).enumerate();
        rows.for_each(|(y, row)| {
            for (x, texel) in row.chunks_exact_mut(count).enumerate() {
                let depth = depths.linear(map.depths[tiling.index(x, y)]);
                texel.copy_from_slice(&filter.moments.of_depth(depth)[..count]);
            }
        });
        Self {
            width: tiling.width,
            height: tiling.height,
            values,
        }
    }

    /// Blurred along rows, then along columns, within each patch.
    fn blurred(self, patches: &Patches, weights: &[f32], count: usize) -> Self {
        let stride = self.width * count;
        let mut along_rows = vec![0.0; self.values.len()];
        let rows = along_rows.par_chunks_mut(stride);
        rows.zip(self.values.par_chunks(stride))
            .for_each(|(out, row)| {
                for columns in &patches.columns {
                    blur_along(out, row, columns, weights, count);
                }
            });
        let mut values = self.values;
        let rows = values.par_chunks_mut(stride).enumerate();
        rows.for_each(|(y, out)| {
            for (columns, rows) in patches.columns.iter().zip(&patches.rows) {
                let rows = rows.iter().find(|rows| rows.contains(&y));
                let rows = rows.expect("patches cover the map");
                let columns = columns.start * count..columns.end * count;
                blur_across(&mut out[columns.clone()], y, rows, weights, |y| {
                    &along_rows[y * stride..][columns.clone()]
                });
            }
        });
        Self { values, ..self }
    }

    /// Of each two by two texels the mean; `None` of a single texel.
    fn halved(&self, count: usize) -> Option<Self> {
        if self.width == 1 && self.height == 1 {
            return None;
        }
        let (width, height) = (self.width.div_ceil(2), self.height.div_ceil(2));
        let mut values = vec![0.0; width * height * count];
        let rows = values.par_chunks_mut(width * count).enumerate();
        rows.for_each(|(y, row)| {
            for (x, texel) in row.chunks_exact_mut(count).enumerate() {
                // At an odd end a texel stands for two.
                let (right, below) = (
                    (2 * x + 1).min(self.width - 1),
                    (2 * y + 1).min(self.height - 1),
                );
                let four = [
                    (2 * x, 2 * y),
                    (right, 2 * y),
                    (2 * x, below),
                    (right, below),
                ];
                let four = four.map(|(x, y)| &self.values[(y * self.width + x) * count..][..count]);
                for (i, moment) in texel.iter_mut().enumerate() {
                    *moment = 0.25 * ((four[0][i] + four[1][i]) + (four[2][i] + four[3][i]));
                }
            }
        });
        Some(Self {
            width,
            height,
            values,
        })
    }

    #[inline(always)]
    fn at(&self, place: [f32; 2], patch: Option<[[f32; 2]; 2]>, count: usize) -> [f32; 4] {
        let last = [self.width - 1, self.height - 1].map(|last| last as f32);
        let [low, high] = patch.unwrap_or([[0.0; 2], last]);
        // From the middle of the first of four texels, and what is left to the place.
        let texels: [[usize; 2]; 2] = std::array::from_fn(|axis| {
            let first = (place[axis] - 0.5).floor();
            [first, first + 1.0].map(|texel| {
                let within = texel.max(low[axis]).min(high[axis]);
                within.max(0.0).min(last[axis]) as usize
            })
        });
        let part = place.map(|place| place - 0.5 - (place - 0.5).floor());
        let [[left, right], [above, below]] = texels;
        let texel = |x: usize, y: usize| &self.values[(y * self.width + x) * count..][..count];
        let four = [
            (texel(left, above), (1.0 - part[0]) * (1.0 - part[1])),
            (texel(right, above), part[0] * (1.0 - part[1])),
            (texel(left, below), (1.0 - part[0]) * part[1]),
            (texel(right, below), part[0] * part[1]),
        ];
        let mut moments = [0.0; 4];
        for (texel, weight) in four {
            for (moment, value) in moments.iter_mut().zip(texel) {
                *moment += weight * value;
            }
        }
        moments
    }
}

/// The parts of a map that texels side by side lie side by side in: bands of columns, and rows of each.
struct Patches {
    columns: Vec<Range<usize>>,
    rows: Vec<Vec<Range<usize>>>,
}

impl Patches {
    fn new(size: MapSize, warp: Option<&Warp>) -> Self {
        let Some(warp) = warp.filter(|warp| warp.functions > 1) else {
            let whole = |texels: u32| iter::once(0..texels as usize).collect();
            return Self {
                columns: whole(size.width),
                rows: vec![whole(size.height)],
            };
        };
        let patch = |row: usize, column: usize| {
            let functions = V2::new(row as f32, column as f32);
            let [low, high] = warp.patch_of(functions, size);
            let range = |low: f32, high: f32| low as usize..(high + 1.0) as usize;
            [range(low.x, high.x), range(low.y, high.y)]
        };
        let bands = 0..warp.functions;
        let rows_of = |column| {
            let rows = bands.clone().map(|row| {
                let [_, rows] = patch(row, column);
                rows
            });
            rows.collect()
        };
        Self {
            columns: bands
                .clone()
                .map(|column| patch(0, column)[0].clone())
                .collect(),
            rows: bands.clone().map(rows_of).collect(),
        }
    }
}

/// The weights of the texels around one that are within a range, as a share of those of all.
fn share_within(place: usize, range: &Range<usize>, weights: &[f32]) -> f32 {
    let before = (place - range.start).min(weights.len() - 1);
    let after = (range.end - 1 - place).min(weights.len() - 1);
    if before + 1 == weights.len() && after + 1 == weights.len() {
        return 1.0;
    }
    let sides = weights[1..=before].iter().chain(&weights[1..=after]);
    weights[0] + sides.sum::<f32>()
}

/// Blurs the texels of a row within a range of its columns.
fn blur_along(out: &mut [f32], row: &[f32], columns: &Range<usize>, weights: &[f32], count: usize) {
    let Range { start, end } = *columns;
    for (offset, &weight) in weights.iter().enumerate().take(end - start) {
        let (near, far) = (
            start * count..(end - offset) * count,
            (start + offset) * count..end * count,
        );
        add(&mut out[near.clone()], &row[far.clone()], weight);
        if offset > 0 {
            add(&mut out[far], &row[near], weight);
        }
    }
    for x in columns.clone() {
        let share = share_within(x, columns, weights);
        if share != 1.0 {
            out[x * count..][..count]
                .iter_mut()
                .for_each(|v| *v /= share);
        }
    }
}

/// Blurs a piece of a row over the rows around it within a range.
fn blur_across<'a>(
    out: &mut [f32],
    y: usize,
    rows: &Range<usize>,
    weights: &[f32],
    row: impl Fn(usize) -> &'a [f32],
) {
    out.fill(0.0);
    for (offset, &weight) in weights.iter().enumerate() {
        if y >= rows.start + offset {
            add(out, row(y - offset), weight);
        }
        if offset > 0 && y + offset < rows.end {
            add(out, row(y + offset), weight);
        }
    }
    let share = share_within(y, rows, weights);
    if share != 1.0 {
        out.iter_mut().for_each(|v| *v /= share);
    }
}

fn add(out: &mut [f32], values: &[f32], weight: f32) {
    dispatch!(level(), _simd => add_in_lanes(out, values, weight));
}

/// Written so that the compiler finds the lanes.
#[inline(always)]
fn add_in_lanes(out: &mut [f32], values: &[f32], weight: f32) {
    for (out, value) in out.iter_mut().zip(values) {
        *out += weight * value;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coarser_map_has_the_means_of_four_texels() {
        let values = [[1.0, 2.0, 4.0], [8.0, 16.0, 32.0], [64.0, 128.0, 256.0]];
        let level = Level {
            width: 3,
            height: 3,
            values: values.concat(),
        };
        let half = level.halved(1).unwrap();
        // At an odd end a texel stands for two.
        let expected = [27.0 / 4.0, 72.0 / 4.0, 384.0 / 4.0, 256.0];
        assert_eq!((half.width, half.height), (2, 2));
        assert_eq!(half.values, expected);
        let mean = expected.iter().sum::<f32>() / 4.0;
        assert_eq!(half.halved(1).unwrap().values, [mean]);
        assert!(half.halved(1).unwrap().halved(1).is_none());
    }
}
