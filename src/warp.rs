//! Warps as values: the functions of `shaders/warp/grid.wgsl`, read back, and tables of samples.

pub mod samples;
pub mod smoothing;
pub mod tables;

use crate::lanes::{Each, Lane, V2};
pub use crate::map_size::Axis;
use crate::map_size::MapSize;
use glam::{DMat2, DVec2};
use rayon::prelude::*;
use samples::SampledWarp;
use std::ops::Range;

/// Loops over the cells of a function, and over the texels after them, stay below 65,535 iterations in a shader.
pub const MAX_CELLS: u32 = 16384;

/// How functions follow from counts of receivers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CountFit {
    /// Standard deviation, in rows of counts, of about a Gaussian among them.
    pub smoothing: f64,
    /// The power of a count that a cell is worth.
    pub exponent: f64,
    /// Part of the map, in [0, 1], that is shared out evenly.
    pub even_share: f64,
}

impl CountFit {
    /// Of so many rows, those on each side that are averaged, twice over.
    pub fn window(&self, rows: u32) -> u32 {
        let sigma = self.smoothing;
        // Two windows of 2 h + 1 have the variance ((2 h + 1)^2 - 1) / 6.
        let window = ((6.0 * sigma * sigma + 1.0).sqrt() - 1.0) / 2.0;
        (window.round() as u32).min(rows)
    }
}

/// The standard deviation of a blur of maxima, in cells: no blur is a narrow one, and none is wider than the map.
pub fn blur_within(cells: u32, sigma: f64) -> f64 {
    sigma.clamp(1e-3, f64::from(cells))
}

/// What says where the rays of a map's texels are before its warp: functions, in the form that an engine has them, or a
/// table.
pub enum Warping<Functions> {
    Functions(Functions),
    Samples(SampledWarp),
}

impl<F> Warping<F> {
    pub fn functions(&self) -> Option<&F> {
        match self {
            Self::Functions(functions) => Some(functions),
            Self::Samples(_) => None,
        }
    }

    pub fn map_functions<G>(self, change: impl FnOnce(F) -> G) -> Warping<G> {
        match self {
            Self::Functions(functions) => Warping::Functions(change(functions)),
            Self::Samples(samples) => Warping::Samples(samples),
        }
    }
}

impl Warping<Warp> {
    /// At linear map coordinates, the steps from a texel to the next before the warp, along rows and columns, in texels,
    /// times how much the warp widens along each. Not numbers where the map has no texel.
    pub fn steps(&self, uv: DVec2) -> (DMat2, DVec2) {
        match self {
            Self::Functions(warp) => (DMat2::IDENTITY, warp.scale(uv)),
            Self::Samples(samples) => (samples.steps(uv).unwrap_or(DMat2::NAN), DVec2::ONE),
        }
    }

    /// How much it widens along rows and columns where it widens most.
    pub fn greatest_scale(&self) -> DVec2 {
        match self {
            Self::Functions(warp) => warp.greatest_scale(),
            Self::Samples(samples) => samples.greatest_scale(),
        }
    }
}

/// Monotone functions along x, one for each band of rows, and along y, one for each band of columns,
/// linear between the boundaries of cells. Coordinates are in [0, 1].
#[derive(Debug, Clone, PartialEq)]
pub struct Warp {
    /// Functions along each axis.
    pub functions: usize,
    /// Boundaries of each function: one more than its cells.
    pub boundaries: usize,
    /// Values at the boundaries: those along x, then those along y.
    pub values: Vec<f32>,
}

impl Warp {
    /// The value at `x` of a function, counted through those along x and then those along y.
    #[inline(always)]
    fn value_at<L: Lane>(&self, function: L, x: L) -> L {
        let one = x.constant(1.0);
        let cells = x.constant((self.boundaries - 1) as f64);
        let place = x.clamp(x.constant(0.0), one) * cells;
        let cell = place.floor().min(cells - one);
        let [a, b] = L::gather_two(&self.values, self.boundaries, function, cell);
        a + (b - a) * (place - cell)
    }

    /// A function along y, counted through those along x.
    #[inline(always)]
    fn along_y<L: Lane>(&self, column: L) -> L {
        column.constant(self.functions as f64) + column
    }

    #[inline(always)]
    fn function_at<L: Lane>(&self, place: L) -> L {
        let (zero, one) = (place.constant(0.0), place.constant(1.0));
        if self.functions == 1 {
            // So that nobody waits for the place.
            return zero;
        }
        let functions = place.constant(self.functions as f64);
        (place.clamp(zero, one) * functions)
            .floor()
            .min(functions - one)
    }

    /// Where the functions along x take linear map coordinates.
    #[inline(always)]
    pub fn warped_x<L: Lane>(&self, uv: V2<L>) -> L {
        self.value_at(self.function_at(uv.y), uv.x)
    }

    /// Where the warp takes linear map coordinates, and the functions of the row and of the column that do.
    #[inline(always)]
    pub fn warped_from_linear<L: Lane>(&self, uv: V2<L>) -> (V2<L>, V2<L>) {
        let row = self.function_at(uv.y);
        let x = self.value_at(row, uv.x);
        let column = self.function_at(x);
        let y = self.value_at(self.along_y(column), uv.y);
        (V2::new(x, y), V2::new(row, column))
    }

    /// Where each function takes on the centres of a map's texels: as `invert` in `shaders/warp_map.wgsl`.
    pub fn inverses(&self, size: MapSize) -> Inverses {
        let (along_x, along_y) = self.values.split_at(self.functions * self.boundaries);
        let inverses = |(values, axis)| self.inverses_along(values, size.along(axis) as usize);
        Inverses {
            size,
            places: [(along_x, Axis::X), (along_y, Axis::Y)].map(inverses),
        }
    }

    fn inverses_along(&self, values: &[f32], texels: usize) -> Vec<f32> {
        let cells = self.boundaries - 1;
        let functions = values.par_chunks_exact(self.boundaries);
        let inverse = |function: &[f32]| {
            let mut cell = 0;
            let place_of = |texel: usize| {
                let value = (texel as f32 + 0.5) / texels as f32;
                while function[cell + 1] < value && cell + 1 < cells {
                    cell += 1;
                }
                let [a, b] = [function[cell], function[cell + 1]];
                let part = ((value - a) / (b - a).max(1e-30)).clamp(0.0, 1.0);
                (cell as f32 + part) / cells as f32
            };
            let places: Vec<_> = (0..texels).map(place_of).collect();
            let [first, last] = [places[0], places[texels - 1]].map(|end| [end; BORDER]);
            [&first[..], &places, &last].concat()
        };
        functions.flat_map_iter(inverse).collect()
    }

    /// Linear map coordinates of the centre of a texel.
    #[inline(always)]
    pub fn linear_from_texel<L: Lane>(&self, inverses: &Inverses, texel: V2<L>) -> V2<L> {
        let column = self.function_of_column(inverses, texel.x);
        let y = inverses.at(Axis::Y, column, texel.y);
        let row = self.function_at(y);
        V2::new(inverses.at(Axis::X, row, texel.x), y)
    }

    /// What the two functions that take a place to the centre of a texel take to those of the columns and rows around it,
    /// from `reach` before it on. What is beside the map counts as its border.
    #[inline(always)]
    pub fn linear_around<L: Lane>(
        &self,
        inverses: &Inverses,
        texel: V2<L>,
        reach: usize,
    ) -> [V2<L>; AROUND] {
        let column = self.function_of_column(inverses, texel.x);
        let y = inverses.around(Axis::Y, column, texel.y, reach);
        let row = self.function_at(y[reach]);
        let x = inverses.around(Axis::X, row, texel.x, reach);
        std::array::from_fn(
            #[inline(always)]
            |i| V2::new(x[i], y[i]),
        )
    }

    /// The function along y that all of some columns of texels have; `None` where they have several, or are not all on
    /// the map.
    pub fn function_of_columns(&self, inverses: &Inverses, columns: Range<usize>) -> Option<f32> {
        let ends = [columns.start, columns.end - 1];
        let [first, last] = ends.map(|x| self.function_of_column(inverses, x as f32));
        let is_on_map = columns.end <= inverses.size.width as usize;
        (is_on_map && first == last).then_some(first)
    }

    /// Linear map coordinates of the centres of `N` texels of a row, from one on, that have that function along y: those
    /// along x, and the one along y that is the same for all.
    #[inline(always)]
    pub fn linear_from_row<'a, const N: usize>(
        &self,
        inverses: &'a Inverses,
        column: f32,
        [x, y]: [usize; 2],
    ) -> (&'a [f32; N], f32) {
        let place = inverses.at(Axis::Y, column, y as f32);
        let row = self.function_at(place) as usize;
        let first = row * inverses.width(Axis::X) + BORDER + x;
        let of_row = inverses.places[Axis::X as usize][first..].first_chunk();
        (of_row.expect("they are on the map"), place)
    }

    /// The function along y of a column of texels.
    #[inline(always)]
    fn function_of_column<L: Lane>(&self, inverses: &Inverses, x: L) -> L {
        let columns = x.constant(f64::from(inverses.size.width));
        self.function_at((x + x.constant(0.5)) / columns)
    }

    /// The first and the last texel of the patch of two functions, those of a row and of a column: between patches
    /// the map is torn. It may be empty.
    #[inline(always)]
    pub fn patch_of<L: Lane>(&self, functions: V2<L>, size: MapSize) -> [V2<L>; 2] {
        let one = functions.x.constant(1.0);
        let count = functions.x.constant(self.functions as f64);
        let column = self.along_y(functions.y);
        let low = self.value_at(column, functions.x / count);
        let high = self.value_at(column, (functions.x + one) / count);
        let (left, right) = (functions.y / count, (functions.y + one) / count);
        let MapSize { width, height } = size;
        let first = V2::new(first_centre(left, width), first_centre(low, height));
        let end = V2::new(first_centre(right, width), first_centre(high, height));
        [first, end - V2::splat(one)]
    }

    /// Whether there are patches above, below, left and right of that of two functions.
    #[inline(always)]
    pub fn has_patches<L: Lane>(&self, functions: V2<L>) -> [L::Mask; 4] {
        let (zero, last) = (
            functions.x.constant(0.0),
            functions.x.constant(self.functions as f64 - 1.0),
        );
        let [row, column] = [functions.x, functions.y].each(|f| [zero.less(f), f.less(last)]);
        [row[0], row[1], column[0], column[1]]
    }

    /// The texel beside a place that is nearest to it across the seam on that side of its patch; `functions` are
    /// the place's, `side` points to the patch there along an axis.
    #[inline(always)]
    pub fn texel_across<L: Lane>(
        &self,
        linear: V2<L>,
        functions: V2<L>,
        side: V2<L>,
        size: MapSize,
    ) -> V2<L> {
        let zero = linear.x.constant(0.0);
        let count = linear.x.constant(self.functions as f64);
        let edge = |function: L, side: L| (function + side.max(zero)) / count;
        let is_along_y = zero.less(side.y.abs());
        let along_y = self.value_at(functions.x + side.y, linear.x);
        let x = L::select(is_along_y, along_y, edge(functions.y, side.x));
        let column = L::select(is_along_y, self.function_at(x), functions.y + side.x);
        let y = L::select(is_along_y, edge(functions.x, side.y), linear.y);
        let y = self.value_at(self.along_y(column), y);
        let inside = |place: L, texels: u32| (place * place.constant(f64::from(texels))).floor();
        let across = |place: L, side: L, texels: u32| first_centre(place, texels) + side.min(zero);
        let MapSize { width, height } = size;
        V2::new(
            L::select(is_along_y, inside(x, width), across(x, side.x, width)),
            L::select(is_along_y, across(y, side.y, height), inside(y, height)),
        )
    }

    /// The slope of a function at `x`.
    fn slope_at(&self, function: f64, x: f64) -> f64 {
        let cells = self.boundaries - 1;
        let cell = ((x.clamp(0.0, 1.0) * cells as f64) as usize).min(cells - 1);
        let first = function as usize * self.boundaries + cell;
        let [a, b] = [0, 1].map(|i| f64::from(self.values[first + i]));
        (b - a) * cells as f64
    }

    /// How much the warp widens along each axis at linear map coordinates.
    pub fn scale(&self, uv: DVec2) -> DVec2 {
        let (_, functions) = self.warped_from_linear(uv.into());
        let column = self.functions as f64 + functions.y;
        DVec2::new(
            self.slope_at(functions.x, uv.x),
            self.slope_at(column, uv.y),
        )
    }

    /// How much it widens along each axis where it widens most.
    pub fn greatest_scale(&self) -> DVec2 {
        let cells = (self.boundaries - 1) as f64;
        let steepest = |values: &[f32]| {
            let slopes = values
                .chunks_exact(self.boundaries)
                .flat_map(|function| function.windows(2).map(|pair| f64::from(pair[1] - pair[0])));
            slopes.fold(0.0, f64::max) * cells
        };
        let (along_x, along_y) = self.values.split_at(self.functions * self.boundaries);
        DVec2::new(steepest(along_x), steepest(along_y))
    }
}

/// Where each function of a warp takes on the centres of a map's texels.
pub struct Inverses {
    size: MapSize,
    /// Those along x and those along y, function by function. Beside the map there are [`BORDER`] more on each side.
    places: [Vec<f32>; 2],
}

/// Texels on each side of a map that have the place of the one at its border.
const BORDER: usize = 2;

/// Columns or rows around a texel, at most.
pub const AROUND: usize = 2 * BORDER + 1;

impl Inverses {
    /// Before there are any.
    pub fn none() -> Self {
        Self {
            size: MapSize {
                width: 0,
                height: 0,
            },
            places: [vec![], vec![]],
        }
    }

    /// Of the places of a function.
    fn width(&self, axis: Axis) -> usize {
        self.size.along(axis) as usize + 2 * BORDER
    }

    /// Where a function along an axis takes on the centre of a texel.
    #[inline(always)]
    fn at<L: Lane>(&self, axis: Axis, function: L, texel: L) -> L {
        let column = texel + texel.constant(BORDER as f64);
        L::gather(
            &self.places[axis as usize],
            self.width(axis),
            function,
            column,
        )
    }

    /// The same of the texels from `reach` before one on, at most [`BORDER`]: those after as many behind it are any.
    #[inline(always)]
    fn around<L: Lane>(&self, axis: Axis, function: L, texel: L, reach: usize) -> [L; AROUND] {
        if reach == 0 {
            return [self.at(axis, function, texel); AROUND];
        }
        let (table, width) = (&self.places[axis as usize], self.width(axis));
        let first = texel + texel.constant(BORDER as f64 - reach as f64);
        let [a, b, c, d] = L::gather_four(table, width, function, first);
        let last = match 2 * reach + 1 == AROUND {
            true => L::gather(table, width, function, first + first.constant(4.0)),
            false => d,
        };
        [a, b, c, d, last]
    }

    /// Those of the map's own texels, as the shader has them.
    #[cfg(test)]
    pub fn on_map(&self) -> [Vec<f32>; 2] {
        [Axis::X, Axis::Y].map(|axis| {
            let functions = self.places[axis as usize].chunks_exact(self.width(axis));
            let on_map = functions.map(|function| &function[BORDER..function.len() - BORDER]);
            on_map.collect::<Vec<_>>().concat()
        })
    }
}

/// The first texel whose centre is not before a place.
#[inline(always)]
fn first_centre<L: Lane>(place: L, texels: u32) -> L {
    let size = place.constant(f64::from(texels));
    -(place.constant(0.5) - place * size).floor()
}

/// How many of the texels up to `reach` from one lie beyond its patch, above, below, left and right of it.
#[inline(always)]
pub fn texels_outside<L: Lane>([low, high]: [V2<L>; 2], middle: V2<L>, reach: L) -> [L; 4] {
    let reaches = V2::splat(reach);
    let before = low - (middle - reaches);
    let after = middle + reaches - high;
    [before.y, after.y, before.x, after.x].each(|count| count.min(reach))
}

#[cfg(test)]
mod twins;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_is_the_slope_of_the_functions() {
        // Two rows, identity and twice as wide on the left; columns are identities.
        let warp = Warp {
            functions: 2,
            boundaries: 3,
            values: vec![0.0, 0.5, 1.0, 0.0, 0.8, 1.0, 0.0, 0.5, 1.0, 0.0, 0.5, 1.0],
        };
        assert!((warp.scale(DVec2::new(0.2, 0.2)) - DVec2::ONE).length() < 1e-6);
        assert!((warp.scale(DVec2::new(0.2, 0.7)) - DVec2::new(1.6, 1.0)).length() < 1e-6);
        assert!((warp.scale(DVec2::new(0.7, 0.7)) - DVec2::new(0.4, 1.0)).length() < 1e-6);
        assert!((warp.greatest_scale() - DVec2::new(1.6, 1.0)).length() < 1e-6);
    }
}
