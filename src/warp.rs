//! Warps as values: the functions of `shaders/warp/grid.wgsl`, read back.

use crate::lanes::{Lane, V2};
use glam::DVec2;

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
        let one = L::from_f64(1.0);
        let cells = L::from_f64((self.boundaries - 1) as f64);
        let place = x.clamp(L::from_f64(0.0), one) * cells;
        let cell = place.floor().min(cells - one);
        let a = L::gather(&self.values, self.boundaries, function, cell);
        let b = L::gather(&self.values, self.boundaries, function, cell + one);
        a + (b - a) * (place - cell)
    }

    #[inline(always)]
    fn function_at<L: Lane>(&self, place: L) -> L {
        let (zero, one) = (L::from_f64(0.0), L::from_f64(1.0));
        let functions = L::from_f64(self.functions as f64);
        (place.clamp(zero, one) * functions)
            .floor()
            .min(functions - one)
    }

    /// Where the warp takes linear map coordinates, and the functions of the row and of the column that do.
    #[inline(always)]
    pub fn warped_from_linear<L: Lane>(&self, uv: V2<L>) -> (V2<L>, V2<L>) {
        let row = self.function_at(uv.y);
        let x = self.value_at(row, uv.x);
        let column = self.function_at(x);
        let first_column = L::from_f64(self.functions as f64);
        let y = self.value_at(first_column + column, uv.y);
        (V2::new(x, y), V2::new(row, column))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::shaders::Shader;
    use crate::twin::{Random, Twin, assert_twins};

    const WGSL: &str = "
fn twin(i: u32) -> array<f32, 4> {
    var warp: Warp;
    warp.functions = vec2<u32>(5u, 5u);
    warp.cells = vec2<u32>(32u, 32u);
    warp.forward = vec2<u32>(0u, 5u * 33u);
    let warped = warped_from_linear(warp, vec2<f32>(inputs[i], inputs[i + 1u]));
    let functions = vec2<f32>(warped.functions);
    return array<f32, 4>(warped.uv.x, warped.uv.y, functions.x, functions.y);
}
";

    impl Twin for Warp {
        fn evaluate<L: Lane>(&self, inputs: &[L]) -> Vec<L> {
            let (uv, functions) = self.warped_from_linear(V2::new(inputs[0], inputs[1]));
            vec![uv.x, uv.y, functions.x, functions.y]
        }
    }

    /// Inside, outside, at boundaries of cells and of functions, and a step beside them; functions have cells
    /// without a width, and steep ones.
    #[test]
    fn the_shader_of_warps_computes_what_rust_does() {
        let mut random = Random(1);
        let values = (0..10).flat_map(|_| {
            let steps: Vec<_> = (0..32)
                .map(|_| [0.0, 1.0, 30.0][random.below(3)] * random.share())
                .collect();
            let total: f64 = steps.iter().sum();
            let sums = steps.iter().scan(0.0, |sum, step| {
                *sum += step / total;
                Some(*sum as f32)
            });
            std::iter::once(0.0).chain(sums).collect::<Vec<_>>()
        });
        let warp = Warp {
            functions: 5,
            boundaries: 33,
            values: values.collect(),
        };
        let mut place = || match random.below(12) {
            0 => random.below(33) as f32 / 32.0,
            1 => (random.below(6) as f32 / 5.0).next_up(),
            2 => random.number(),
            _ => random.share() as f32,
        };
        let cases: Vec<_> = (0..20_000).map(|_| [place(), place()]).collect();
        let source = Shader::new("warp/grid").compose() + WGSL;
        assert_twins(&source, &warp, &cases, &warp.values);
    }

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
