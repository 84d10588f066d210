//! Blends an importance map with that of the frame before, as `shaders/blend_importance.wgsl`.

use super::cells::filled;
use super::importance_map::{Words, cell_at};
use crate::importance::{ImportanceMap, OldImportance};
use crate::lanes::V2;
use crate::warp::Warp;
use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;

/// Blends the map in place: counts along y, where there is a `warp` whose functions along x say where the old ones
/// belong, or else what is laid out as the map is.
pub fn blend_importance(map: &mut ImportanceMap<Words>, old: OldImportance, warp: Option<&Warp>) {
    let cells = map.cells as usize;
    let matrix = old.old_from_new_cells(map.cells);
    let places = OldPlaces {
        old,
        matrix,
        determinant: matrix.determinant(),
    };
    let (share, unit) = (old.share, map.count_unit);
    let rest = |value: f64| (1.0 - share) * value;
    let rounded = |value: f64| value.round() as u32;
    let blended = |x: usize, y: usize, word: u32| match (unit, warp) {
        (None, _) => {
            let new = f64::from(f32::from_bits(word));
            let old = places.value_and_area(x, y)[0];
            ((rest(new) + share * old) as f32).to_bits()
        }
        (Some(unit), None) => {
            let [old, area] = places.value_and_area(x, y);
            rounded(rest(word.into()) + share * old * area * unit)
        }
        (Some(_), Some(_)) => rounded(rest(word.into())),
    };
    let rows = map.values.par_chunks_mut(cells).enumerate();
    rows.for_each(|(y, row)| {
        for (x, word) in row.iter_mut().enumerate() {
            *word = blended(x, y, *word);
        }
    });
    let (Some(unit), Some(warp)) = (unit, warp) else {
        return;
    };
    let splat = filled(cells * cells, cells, u32::wrapping_add, |counts, y| {
        for x in 0..cells {
            let [old, area] = places.value_and_area(x, y);
            let uv = V2::new(x as f64 + 0.5, y as f64 + 0.5) / cells as f64;
            let column = cell_at(warp.warped_x(uv), map.cells) as usize;
            counts[column * cells + y] += rounded(share * old * area * unit);
        }
    });
    let pairs = map.values.par_iter_mut().zip(&splat).with_min_len(1 << 14);
    pairs.for_each(|(count, old)| *count += old);
}

struct OldPlaces<'a> {
    old: OldImportance<'a>,
    matrix: DMat3,
    determinant: f64,
}

impl OldPlaces<'_> {
    /// The old map's value at the middle of a cell of the new one, and how many old cells a new one covers. What was
    /// not on the old map had no importance.
    fn value_and_area(&self, x: usize, y: usize) -> [f64; 2] {
        let place = self.matrix * DVec3::new(x as f64 + 0.5, y as f64 + 0.5, 1.0);
        let there = place.truncate() / place.z;
        let size = DVec2::new(self.old.columns.into(), self.old.rows.into());
        let is_inside = there.cmpge(DVec2::ZERO).all() && there.cmplt(size).all();
        if place.z <= 0.0 || !is_inside {
            return [0.0; 2];
        }
        // Linear between the middles of cells.
        let corner = (there - 0.5).floor();
        let t = there - 0.5 - corner;
        let row = |dy: f64| {
            let [a, b] = [0.0, 1.0].map(|dx| self.cell(corner + DVec2::new(dx, dy)));
            a + (b - a) * t.x
        };
        let [above, below] = [row(0.0), row(1.0)];
        let area = (self.determinant / place.z.powi(3)).abs();
        [above + (below - above) * t.y, area]
    }

    fn cell(&self, place: DVec2) -> f64 {
        let last = DVec2::new(self.old.columns.into(), self.old.rows.into()) - 1.0;
        let inside = place.clamp(DVec2::ZERO, last);
        let index = inside.y as usize * self.old.columns as usize + inside.x as usize;
        self.old.values[index].into()
    }
}
