//! How many pixels a warp with straight edges leaves wrong, by an estimate: the smoothing of its functions is chosen by it.

use super::Warp;
use glam::DVec2;
use rayon::prelude::*;

/// Standard deviations that are tried, as shares of the cells.
pub const SHARES: [f64; 5] = [1.0 / 64.0, 1.0 / 32.0, 1.0 / 16.0, 1.0 / 8.0, 1.0 / 4.0];

/// Of a level function all but a thousandth.
const LEAST_SLOPE: f64 = 1e-3;

/// The wrong pixels among receivers at some places of a map, from 0 to 1, but for a factor: how wide a texel is for each
/// of them in pixels, as many of `counts` share its cell and the functions have those slopes there; times one and the
/// texels from its place that the middle of a straight line is taken which is as long as a cell, of one along the rows or
/// one along the columns. The map has so many `texels` along its rows and columns.
pub fn estimate(warp: &Warp, counts: &[u32], places: &[DVec2], texels: DVec2) -> f64 {
    let cells = warp.boundaries - 1;
    let at = |place: DVec2| {
        let inside = place.clamp(DVec2::ZERO, DVec2::ONE);
        DVec2::from(warp.warped_from_linear(inside.into()).0)
    };
    let cell_of = |place: f64| ((place * cells as f64) as usize).min(cells - 1);
    let error_at = |place: &DVec2| {
        let middle = at(*place);
        let (mut missed, mut stretched) = (0.0, 1.0);
        for axis in [DVec2::X, DVec2::Y] {
            let step = axis * (0.5 / cells as f64);
            let [before, after] = [at(place - step), at(place + step)];
            let miss = (texels * ((before + after) / 2.0 - middle)).length();
            missed = miss.max(missed);
            let slope = cells as f64 * (after - before).dot(axis);
            stretched *= slope.max(LEAST_SLOPE);
        }
        let count = counts[cell_of(place.y) * cells + cell_of(place.x)];
        (f64::from(count) / stretched).sqrt() * (1.0 + missed)
    };
    // One after the other, so that every number of threads has the same sum.
    let errors: Vec<f64> = places.par_iter().map(error_at).collect();
    errors.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two cells along each axis; the left one takes `half` of the map.
    fn bent(half: f32) -> Warp {
        Warp {
            functions: 1,
            boundaries: 3,
            values: vec![0.0, half, 1.0, 0.0, 0.5, 1.0],
        }
    }

    #[test]
    fn texels_are_as_wide_as_counts_and_slopes_have_them() {
        let place = DVec2::new(0.25, 0.75);
        let of =
            |half, count| estimate(&bent(half), &[0, 0, count, 0], &[place], DVec2::splat(8.0));
        assert!((of(0.5, 9) - 3.0).abs() < 1e-6);
        // Half as wide, a slope of 1.5 in the place of 1.
        assert!((of(0.75, 9) - 3.0 / 1.5f64.sqrt()).abs() < 1e-6);
        // A level function counts as a thousandth of its slope.
        assert!((of(0.0, 9) - 3.0 * 1000f64.sqrt()).abs() < 1e-2);
    }

    #[test]
    fn lines_over_a_bend_miss_their_middle() {
        // The ends of a line of half the map around the bend are at 0.375 and 0.875, its middle is at 0.75.
        let at_bend = estimate(
            &bent(0.75),
            &[0, 4, 0, 0],
            &[DVec2::new(0.5, 0.25)],
            DVec2::splat(8.0),
        );
        let missed = 8.0 * (0.75 - 0.625);
        assert!((at_bend - 2.0 * (1.0 + missed)).abs() < 1e-6, "{at_bend}");
    }
}
