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
        let a = L::gather(&self.values, self.boundaries, function, cell);
        let b = L::gather(&self.values, self.boundaries, function, cell + one);
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

    /// Where each function takes on the centres of a map's texels, those along x and those along y: as `invert` in
    /// `shaders/warp_map.wgsl`.
    pub fn inverses(&self, size: MapSize) -> [Vec<f32>; 2] {
        let (along_x, along_y) = self.values.split_at(self.functions * self.boundaries);
        let inverses = |(values, axis)| self.inverses_along(values, size.along(axis) as usize);
        [(along_x, Axis::X), (along_y, Axis::Y)].map(inverses)
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
            (0..texels).map(place_of).collect::<Vec<_>>()
        };
        functions.flat_map_iter(inverse).collect()
    }

    /// Linear map coordinates of the centre of a texel, by the table of `inverses`.
    #[inline(always)]
    pub fn linear_from_texel<L: Lane>(
        &self,
        inverses: &[Vec<f32>; 2],
        size: MapSize,
        texel: V2<L>,
    ) -> V2<L> {
        let (functions, y) = self.functions_and_y(inverses, size, texel);
        V2::new(inverse_at(inverses, Axis::X, size, functions.x, texel.x), y)
    }

    /// The functions of a row and of a column that take a place to the centre of a texel.
    #[inline(always)]
    pub fn functions_of_texel<L: Lane>(
        &self,
        inverses: &[Vec<f32>; 2],
        size: MapSize,
        texel: V2<L>,
    ) -> V2<L> {
        self.functions_and_y(inverses, size, texel).0
    }

    /// The same, and the second coordinate of that place.
    #[inline(always)]
    fn functions_and_y<L: Lane>(
        &self,
        inverses: &[Vec<f32>; 2],
        size: MapSize,
        texel: V2<L>,
    ) -> (V2<L>, L) {
        let columns = texel.x.constant(f64::from(size.width));
        let column = self.function_at((texel.x + texel.x.constant(0.5)) / columns);
        let y = inverse_at(inverses, Axis::Y, size, column, texel.y);
        (V2::new(self.function_at(y), column), y)
    }

    /// What two functions take to the centre of a texel.
    #[inline(always)]
    pub fn linear_by_functions<L: Lane>(
        &self,
        inverses: &[Vec<f32>; 2],
        size: MapSize,
        functions: V2<L>,
        texel: V2<L>,
    ) -> V2<L> {
        let x = inverse_at(inverses, Axis::X, size, functions.x, texel.x);
        let y = inverse_at(inverses, Axis::Y, size, functions.y, texel.y);
        V2::new(x, y)
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

/// Where a function along an axis takes on the centre of a texel.
#[inline(always)]
fn inverse_at<L: Lane>(
    inverses: &[Vec<f32>; 2],
    axis: Axis,
    size: MapSize,
    function: L,
    texel: L,
) -> L {
    L::gather(
        &inverses[axis as usize],
        size.along(axis) as usize,
        function,
        texel,
    )
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
