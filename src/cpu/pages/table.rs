//! Which pages of a map are asked for, and where those that are stored lie.

use crate::cpu::lanes::{LANES, bits};
use crate::cpu::tiles::{TILE, TILE_PIXELS};
use crate::paging::grid::{ABSENT, PageGrid};
use std::sync::atomic::{AtomicBool, Ordering};

impl PageGrid {
    /// Tiles along each side of a page.
    pub fn tiles_along(&self) -> usize {
        self.page_size() as usize / TILE
    }

    /// Tiles of a page.
    pub fn tiles(&self) -> usize {
        self.tiles_along().pow(2)
    }
}

/// Pages that a pass over the receivers asks for.
pub struct Requests {
    pub grid: PageGrid,
    is_asked: Vec<AtomicBool>,
}

impl Requests {
    pub fn new(grid: PageGrid) -> Self {
        let none = || AtomicBool::new(false);
        Self {
            grid,
            is_asked: std::iter::repeat_with(none).take(grid.count()).collect(),
        }
    }

    /// Asks for the texels of some of eight receivers.
    #[inline(always)]
    pub fn ask(&self, asking: u32, x: [u32; LANES], y: [u32; LANES]) {
        for lane in bits(asking) {
            let is_asked = &self.is_asked[self.grid.page_of(x[lane], y[lane])];
            // A line that nobody writes to stays in the caches of all.
            if !is_asked.load(Ordering::Relaxed) {
                is_asked.store(true, Ordering::Relaxed);
            }
        }
    }

    /// Columns and rows of those that are asked for, row by row.
    pub fn pages(&self) -> Vec<[u32; 2]> {
        let all = self.is_asked.iter();
        self.grid
            .places(all.map(|is_asked| is_asked.load(Ordering::Relaxed)))
    }
}

/// Where the texels of the pages lie that a map has.
#[derive(Debug)]
pub struct PageTable {
    pub grid: PageGrid,
    /// Columns and rows of the pages, in the order in which they are stored.
    pub pages: Vec<[u32; 2]>,
    /// Of each page of the whole map the place among those that are stored, `ABSENT` if it is not.
    slots: Vec<u32>,
}

impl PageTable {
    pub fn new(grid: PageGrid, pages: Vec<[u32; 2]>) -> Self {
        let slots = grid.slots(&pages);
        Self { grid, pages, slots }
    }

    /// Where a page is stored.
    pub fn slot(&self, [x, y]: [u32; 2]) -> Option<usize> {
        let slot = self.slots[(y * self.grid.columns + x) as usize];
        (slot != ABSENT).then_some(slot as usize)
    }

    /// Where the texels of some of eight receivers are stored; those of the others are any.
    #[inline(always)]
    pub fn indices(&self, asking: u32, x: [u32; LANES], y: [u32; LANES]) -> [u32; LANES] {
        let mut indices = [0; LANES];
        for lane in bits(asking) {
            indices[lane] = self.index(x[lane], y[lane]);
        }
        indices
    }

    #[inline(always)]
    fn index(&self, x: u32, y: u32) -> u32 {
        let slot = self.slots[self.grid.page_of(x, y)];
        debug_assert_ne!(slot, ABSENT, "a texel of a page that nobody asked for");
        let last = self.grid.page_size() - 1;
        let (x, y) = (x & last, y & last);
        let (tile, within) = (TILE.ilog2(), TILE as u32 - 1);
        let tiles = (y >> tile << (self.grid.shift - tile)) + (x >> tile);
        (slot << (2 * self.grid.shift))
            + tiles * TILE_PIXELS as u32
            + ((y & within) << tile)
            + (x & within)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_texel_of_every_page_has_a_place_of_its_own() {
        for page_size in [64, 128, 256] {
            let grid = PageGrid::new(3 * page_size, page_size);
            let pages = vec![[1, 0], [0, 2], [2, 2]];
            let table = PageTable::new(grid, pages.clone());
            let mut places = BTreeSet::new();
            for (slot, [column, row]) in pages.into_iter().enumerate() {
                for i in 0..page_size.pow(2) {
                    let (x, y) = (i % page_size, i / page_size);
                    let index = table.index(column * page_size + x, row * page_size + y);
                    assert_eq!(index / page_size.pow(2), slot as u32);
                    places.insert(index);
                }
            }
            assert_eq!(places.len() as u32, 3 * page_size.pow(2));
            assert_eq!(table.slot([0, 0]), None);
        }
    }

    #[test]
    fn pages_are_asked_for_by_their_texels() {
        let requests = Requests::new(PageGrid::new(1000, 128));
        let x = [0, 127, 128, 129, 999, 999, 3, 4];
        let y = [0, 127, 0, 400, 999, 0, 500, 600];
        requests.ask(0b0101_1111, x, y);
        assert_eq!(
            requests.pages(),
            [[0, 0], [1, 0], [1, 3], [0, 3], [7, 7]]
                .into_iter()
                .map(|[x, y]| [y, x])
                .collect::<BTreeSet<_>>()
                .into_iter()
                .map(|[y, x]| [x, y])
                .collect::<Vec<_>>()
        );
    }
}
