//! Where many small triangles fall into few cells of a light's grid, these cells have a grid of their own, and so do
//! crowded cells of that one (Jevans and Wyvill, "Adaptive voxel subdivision for ray tracing", Graphics Interface 1989).
//!
//! A finer grid is made once receivers were found to fall into its cells, and is kept with the grid that it is in. It
//! holds the triangles of its cells alone, so that all finer grids together take no longer than what they are made of. Its
//! view is another one, which also knows places there better: float32 tells a thousandth of the grid's width from the
//! next, but not what is a thousandth as wide as that.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};

/// Small triangles of a cell from which on it is crowded. So many are looked through in a microsecond; a finer grid
/// takes tens of nanoseconds for each.
pub const MANY_SMALL: usize = 1 << 12;

/// Of how many cells of a grid a crowd is one at most: a grid that is not much finer is not worth its time. Four times along
/// each side.
const LEAST_SHARE: usize = 16;

/// Columns or rows without a crowded cell that are worth two crowds in place of one.
const GAP: usize = 4;

/// Crowds of a grid.
const MOST_CROWDS: usize = 64;

/// Grids in each other: float64 knows what is a hundredth of a hundredth of a hundredth as wide.
pub const MOST_DEPTH: usize = 3;

/// Some columns and rows of cells.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Cells {
    pub columns: Range<usize>,
    pub rows: Range<usize>,
}

/// Cells with a grid of their own.
pub struct Crowd<G> {
    pub cells: Cells,
    is_wanted: AtomicBool,
    grid: OnceLock<Arc<G>>,
}

/// The crowds of a grid, none for most.
pub struct Crowds<G> {
    /// Of each cell the number of its crowd and 1, or 0; empty where there is no crowd.
    of_cells: Vec<u8>,
    pub all: Vec<Crowd<G>>,
}

impl<G> Crowds<G> {
    /// None.
    pub fn none() -> Self {
        Self {
            of_cells: Vec::new(),
            all: Vec::new(),
        }
    }

    /// Around the cells that are crowded of a grid with so many along each side.
    pub fn new(side: usize, is_crowded: impl Fn(usize, usize) -> bool) -> Self {
        let whole = Cells {
            columns: 0..side,
            rows: 0..side,
        };
        let boxes = whole.around_crowded(side * side / LEAST_SHARE, &is_crowded);
        if boxes.is_empty() {
            return Self::none();
        }
        let mut of_cells = vec![0; side * side];
        for (number, cells) in boxes.iter().enumerate() {
            for row in cells.rows.clone() {
                of_cells[row * side..][cells.columns.clone()].fill(number as u8 + 1);
            }
        }
        let crowd = |cells| Crowd {
            cells,
            is_wanted: AtomicBool::new(false),
            grid: OnceLock::new(),
        };
        Self {
            of_cells,
            all: boxes.into_iter().map(crowd).collect(),
        }
    }

    /// The number of a cell's crowd.
    #[inline(always)]
    pub fn of_cell(&self, cell: usize) -> Option<usize> {
        self.of_cells
            .get(cell)
            .and_then(|&number| usize::from(number).checked_sub(1))
    }
}

impl<G> Crowd<G> {
    pub fn want(&self) {
        self.is_wanted.store(true, Ordering::Relaxed);
    }

    pub fn is_wanted(&self) -> bool {
        self.is_wanted.load(Ordering::Relaxed)
    }

    pub fn grid(&self) -> Option<&Arc<G>> {
        self.grid.get()
    }

    /// Keeps a grid, unless there is one.
    pub fn keep(&self, grid: G) {
        let _ = self.grid.set(Arc::new(grid));
    }
}

impl Cells {
    fn count(&self) -> usize {
        self.columns.len() * self.rows.len()
    }

    /// Boxes around the crowded ones, which share no cell.
    fn around_crowded(self, most: usize, is_crowded: &impl Fn(usize, usize) -> bool) -> Vec<Self> {
        let mut open = vec![self];
        let mut found = Vec::new();
        while let Some(cells) = open.pop() {
            let Some((cells, cut)) = cells.shrunk(most, is_crowded) else {
                continue;
            };
            match cut {
                Some(halves) => open.extend(halves),
                None if found.len() < MOST_CROWDS => found.push(cells),
                None => break,
            }
        }
        found
    }

    /// Cut down to what is crowded, and in two where there is a gap or they are many.
    fn shrunk(
        &self,
        most: usize,
        is_crowded: &impl Fn(usize, usize) -> bool,
    ) -> Option<(Self, Option<[Self; 2]>)> {
        let has_column = |column: &usize| self.rows.clone().any(|row| is_crowded(*column, row));
        let has_row = |row: &usize| self.columns.clone().any(|column| is_crowded(column, *row));
        let columns: Vec<_> = self.columns.clone().filter(has_column).collect();
        let rows: Vec<_> = self.rows.clone().filter(has_row).collect();
        let around = |of: &[usize]| Some(*of.first()?..of.last()? + 1);
        let cells = Self {
            columns: around(&columns)?,
            rows: around(&rows)?,
        };
        let halves = |range: &Range<usize>, at: usize| [range.start..at, at..range.end];
        let in_columns = |at: usize| {
            halves(&cells.columns, at).map(|columns| Self {
                columns,
                rows: cells.rows.clone(),
            })
        };
        let in_rows = |at: usize| {
            halves(&cells.rows, at).map(|rows| Self {
                columns: cells.columns.clone(),
                rows,
            })
        };
        let middle = |range: &Range<usize>| (range.start + range.end) / 2;
        let cut = match (gap(&columns), gap(&rows)) {
            (Some(at), _) => Some(in_columns(at)),
            (_, Some(at)) => Some(in_rows(at)),
            _ if cells.count() <= most => None,
            _ if cells.columns.len() >= cells.rows.len() => {
                Some(in_columns(middle(&cells.columns)))
            }
            _ => Some(in_rows(middle(&cells.rows))),
        };
        Some((cells, cut))
    }
}

/// The number after the first gap of some width between numbers that rise.
fn gap(numbers: &[usize]) -> Option<usize> {
    let gap = numbers.windows(2).find(|pair| pair[1] > pair[0] + GAP);
    gap.map(|pair| pair[1])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::twin::Random;

    const SIDE: usize = 128;

    #[test]
    fn crowds_hold_each_crowded_cell_once_and_are_not_wide() {
        let mut random = Random(5);
        for round in 0..60 {
            let mut is_crowded = vec![false; SIDE * SIDE];
            // Some rectangles, some cells by themselves, or all.
            for _ in 0..round % 7 {
                let start: [usize; 2] = std::array::from_fn(|_| random.below(SIDE));
                let most = if round % 2 == 0 { 3 } else { 90 };
                let end = start.map(|start| SIDE.min(start + 1 + random.below(most)));
                for row in start[1]..end[1] {
                    is_crowded[row * SIDE..][start[0]..end[0]].fill(true);
                }
            }
            if round == 6 {
                is_crowded.fill(true);
            }
            let crowds = Crowds::<()>::new(SIDE, |column, row| is_crowded[row * SIDE + column]);
            for (cell, is_crowded) in is_crowded.iter().enumerate() {
                let (column, row) = (cell % SIDE, cell / SIDE);
                let holds = |crowd: &Crowd<()>| {
                    crowd.cells.columns.contains(&column) && crowd.cells.rows.contains(&row)
                };
                let holding: Vec<_> = (0..crowds.all.len())
                    .filter(|&i| holds(&crowds.all[i]))
                    .collect();
                let number = crowds.of_cell(cell);
                assert_eq!(
                    holding,
                    Vec::from_iter(number),
                    "round {round}, cell {cell}"
                );
                assert!(
                    !is_crowded || number.is_some(),
                    "round {round}, cell {cell}"
                );
            }
            assert!(
                crowds
                    .all
                    .iter()
                    .all(|crowd| crowd.cells.count() <= SIDE * SIDE / LEAST_SHARE)
            );
        }
        assert!(Crowds::<()>::new(SIDE, |_, _| false).of_cells.is_empty());
    }

    #[test]
    fn a_gap_parts_crowds() {
        // Few enough for one crowd, but for the gaps between them.
        let blocks = [(3..5, 7..8), (90..92, 7..8), (3..4, 20..22)];
        let is_crowded = |column: usize, row: usize| {
            let mut blocks = blocks.iter();
            blocks.any(|(columns, rows)| columns.contains(&column) && rows.contains(&row))
        };
        let crowds = Crowds::<()>::new(SIDE, is_crowded);
        let mut found: Vec<_> = crowds.all.into_iter().map(|crowd| crowd.cells).collect();
        found.sort_by_key(|cells| (cells.rows.start, cells.columns.start));
        let expected = blocks.map(|(columns, rows)| Cells { columns, rows });
        assert_eq!(found, expected);
        // A narrower one is no gap.
        let crowds = Crowds::<()>::new(SIDE, |column, row| {
            row == 9 && [3, 3 + GAP].contains(&column)
        });
        assert_eq!(crowds.all.len(), 1);
    }

    #[test]
    fn there_are_not_too_many_crowds() {
        let crowds = Crowds::<()>::new(SIDE, |column, row| column % 9 == 0 && row % 9 == 0);
        assert_eq!(crowds.all.len(), MOST_CROWDS);
    }
}
