//! Warps as values: the functions of `shaders/warp/grid.wgsl`, read back.

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
    /// The value at `x` of a function, and its slope there.
    fn value_and_slope(&self, function: usize, x: f64) -> (f64, f64) {
        let cells = self.boundaries - 1;
        let place = x.clamp(0.0, 1.0) * cells as f64;
        let cell = (place as usize).min(cells - 1);
        let first = function * self.boundaries + cell;
        let (a, b) = (
            f64::from(self.values[first]),
            f64::from(self.values[first + 1]),
        );
        (a + (b - a) * (place - cell as f64), (b - a) * cells as f64)
    }

    fn function_at(&self, place: f64) -> usize {
        ((place.clamp(0.0, 1.0) * self.functions as f64) as usize).min(self.functions - 1)
    }

    /// How much the warp widens along each axis at linear map coordinates.
    pub fn scale(&self, uv: DVec2) -> DVec2 {
        let (x, along_x) = self.value_and_slope(self.function_at(uv.y), uv.x);
        let column = self.functions + self.function_at(x);
        DVec2::new(along_x, self.value_and_slope(column, uv.y).1)
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
