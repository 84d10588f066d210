//! Tables of places in the plane: what makes one a warp.

use glam::DVec2;
use rayon::prelude::*;
use std::sync::Arc;

/// Along each side, at most: as many as a map has texels.
pub const MAX_SAMPLES: usize = 32768;

/// Samples by which a table slips sideways between two neighbours, beyond what the steps before and after do, where it
/// is torn.
const TORN: f64 = 4.0;

/// Boxes along each side of the plane in which pieces of a border are compared, at most.
const MOST_BOXES: usize = 256;

/// Places (x, y), row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    pub columns: usize,
    pub rows: usize,
    pub values: Arc<[f32]>,
}

impl Table {
    pub fn at(&self, column: usize, row: usize) -> DVec2 {
        let first = 2 * (row * self.columns + column);
        DVec2::new(self.values[first].into(), self.values[first + 1].into())
    }

    /// The same with one more sample on all sides, a step beyond the border.
    pub fn with_ring(&self) -> Self {
        // The nearest sample, and as far inside as one of the ring is outside.
        let nearest = |i: usize, count: usize| i.clamp(1, count) - 1;
        let inside = |i: usize, count: usize| match i {
            0 => 1,
            i if i > count => count - 2,
            i => i - 1,
        };
        let (columns, rows) = (self.columns, self.rows);
        let samples = (0..rows + 2).into_par_iter().flat_map_iter(|y| {
            (0..columns + 2).flat_map(move |x| {
                let nearest = self.at(nearest(x, columns), nearest(y, rows));
                let inside = self.at(inside(x, columns), inside(y, rows));
                (2.0 * nearest - inside).as_vec2().to_array()
            })
        });
        Self {
            columns: self.columns + 2,
            rows: self.rows + 2,
            values: samples.collect::<Vec<_>>().into(),
        }
    }

    /// 1, or -1 of a mirror image, as most cells are.
    pub fn turn(&self) -> f64 {
        let rows = (0..self.rows - 1).into_par_iter();
        let mirrored = rows.map(|y| {
            let cells = (0..self.columns - 1).filter(|&x| self.areas(x, y)[0] < 0.0);
            cells.count()
        });
        match 2 * mirrored.sum::<usize>() > (self.rows - 1) * (self.columns - 1) {
            true => -1.0,
            false => 1.0,
        }
    }

    /// Twice those of the two triangles of a cell.
    fn areas(&self, x: usize, y: usize) -> [f64; 2] {
        let [a, b] = [0, 1].map(|i| self.at(x + i, y));
        let [c, d] = [0, 1].map(|i| self.at(x + i, y + 1));
        [(b - a).perp_dot(c - a), (c - d).perp_dot(b - d)]
    }

    /// What makes the table no warp, in words.
    pub fn fault(&self) -> Option<String> {
        let wrong = self.find(0, |x, y| {
            let place = self.at(x, y);
            !(DVec2::ZERO.cmple(place).all() && place.cmple(DVec2::ONE).all())
        });
        if let Some([x, y]) = wrong {
            let place = self.at(x, y);
            return Some(format!("({}, {}) at {}", place.x, place.y, named([x, y])));
        }
        let turn = self.turn();
        let is_folded = |x, y| !self.areas(x, y).iter().all(|area| area * turn > 0.0);
        if let Some(cell) = self.find(1, is_folded) {
            return Some(format!("a fold at {}", named(cell)));
        }
        if let Some(cell) = self.find(1, |x, y| self.is_torn(x, y)) {
            return Some(format!("a tear at {}", named(cell)));
        }
        let [a, b] = self.crossing()?.map(named);
        Some(format!("a border that meets itself at {a} and {b}"))
    }

    /// The first place, row by row, of which something holds; not of so many columns and rows at the end.
    fn find(&self, but: usize, holds: impl Fn(usize, usize) -> bool + Sync) -> Option<[usize; 2]> {
        let rows = (0..self.rows - but).into_par_iter();
        rows.find_map_first(|y| {
            let column = (0..self.columns - but).find(|&x| holds(x, y))?;
            Some([column, y])
        })
    }

    /// Whether the plane slips sideways between a sample and the next of its row, or of its column.
    fn is_torn(&self, x: usize, y: usize) -> bool {
        let along_row = |i: usize, j: usize| self.at(i, j);
        let along_column = |i: usize, j: usize| self.at(j, i);
        slips(along_row, [x, y], self.columns) || slips(along_column, [y, x], self.rows)
    }

    /// The outermost samples, around the table, with their columns and rows.
    fn border(&self) -> Vec<([usize; 2], DVec2)> {
        let (right, low) = (self.columns - 1, self.rows - 1);
        let top = (0..right).map(|x| [x, 0]);
        let down = (0..low).map(|y| [right, y]);
        let bottom = (1..=right).rev().map(|x| [x, low]);
        let up = (1..=low).rev().map(|y| [0, y]);
        let around = top.chain(down).chain(bottom).chain(up);
        around.map(|[x, y]| ([x, y], self.at(x, y))).collect()
    }

    /// Two samples where pieces of the border meet that are no neighbours.
    fn crossing(&self) -> Option<[[usize; 2]; 2]> {
        let border = self.border();
        let count = border.len();
        let boxes = (count / 4).clamp(1, MOST_BOXES);
        let ends = |i: usize| [border[i].1, border[(i + 1) % count].1];
        let mut listed = vec![vec![]; boxes * boxes];
        for i in 0..count {
            let [a, b] = ends(i);
            let box_of = |place: f64| ((place * boxes as f64) as usize).min(boxes - 1);
            let (low, high) = (a.min(b), a.max(b));
            for y in box_of(low.y)..=box_of(high.y) {
                for x in box_of(low.x)..=box_of(high.x) {
                    listed[y * boxes + x].push(i);
                }
            }
        }
        let meeting = |list: &Vec<usize>| {
            let pairs = list.iter().enumerate().flat_map(|(k, &i)| {
                let rest = list[k + 1..].iter();
                rest.map(move |&j| [i, j])
            });
            let apart = |i: usize, j: usize| j - i > 1 && (i + count - j) > 1;
            pairs
                .filter(|&[i, j]| apart(i, j))
                .find(|&[i, j]| meet(ends(i), ends(j)))
        };
        let found = listed.par_iter().find_map_first(meeting)?;
        Some(found.map(|i| border[i].0))
    }
}

/// Whether a table slips sideways from place i to the next, along its row j of so many.
fn slips(at: impl Fn(usize, usize) -> DVec2, [i, j]: [usize; 2], count: usize) -> bool {
    if i == 0 || i + 2 >= count {
        return false;
    }
    let step = |i: usize| at(i + 1, j) - at(i, j);
    let (before, here, after) = (step(i - 1), step(i), step(i + 1));
    let down = [i, i + 1].map(|i| at(i, j + 1) - at(i, j));
    let down = match down[0].length() < down[1].length() {
        true => down[1],
        false => down[0],
    };
    let along = before + after;
    let sideways = |v: DVec2| (along.perp_dot(v) / along.perp_dot(down)).abs();
    let slip = sideways(here);
    slip > TORN && slip > 2.0 * sideways(before - after)
}

/// Whether two pieces of a line meet.
fn meet([a, b]: [DVec2; 2], [c, d]: [DVec2; 2]) -> bool {
    let overlap = a.min(b).cmple(c.max(d)).all() && c.min(d).cmple(a.max(b)).all();
    let parts = |[a, b]: [DVec2; 2], c: DVec2, d: DVec2| {
        let side = |p: DVec2| (b - a).perp_dot(p - a);
        side(c) * side(d) <= 0.0
    };
    overlap && parts([a, b], c, d) && parts([c, d], a, b)
}

fn named([x, y]: [usize; 2]) -> String {
    format!("row {y}, column {x}")
}
