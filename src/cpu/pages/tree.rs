//! Pages that are to be drawn, as a tree: what no page lies in is left out at once.

use super::table::PageTable;
use crate::cpu::bins::DrawnTiles;
use crate::cpu::tiles::{TILE, Tiling};
use glam::DVec2;

/// A square of places at each level, twice as wide at the one before; the first is that of the pages.
pub struct PageTree<'a> {
    table: &'a PageTable,
    /// Tiles of the whole map.
    tiling: Tiling,
    /// Of each level the places along a side, and which of them hold a page.
    levels: Vec<(u32, Vec<bool>)>,
}

impl<'a> PageTree<'a> {
    /// Of those pages of a table that are to be drawn.
    pub fn new(table: &'a PageTable, tiling: Tiling, is_drawn: &[bool]) -> Self {
        let drawn = || {
            table
                .pages
                .iter()
                .zip(is_drawn)
                .filter(|(_, drawn)| **drawn)
        };
        let mut levels = Vec::new();
        for level in 0.. {
            let side = table.grid.columns.div_ceil(1 << level);
            let mut holds = vec![false; side.pow(2) as usize];
            for ([x, y], _) in drawn() {
                holds[((y >> level) * side + (x >> level)) as usize] = true;
            }
            levels.push((side, holds));
            if side == 1 {
                break;
            }
        }
        Self {
            table,
            tiling,
            levels,
        }
    }

    fn holds(&self, level: usize, [x, y]: [u32; 2]) -> bool {
        let (side, holds) = &self.levels[level];
        x < *side && y < *side && holds[(y * side + x) as usize]
    }

    /// The bins of a page begin here.
    fn first_bin(&self, page: [u32; 2]) -> Option<usize> {
        let slot = self.table.slot(page).filter(|_| self.holds(0, page))?;
        Some(slot * self.table.grid.tiles())
    }

    /// Gives the bins of the tiles below a place that lie in a box and may be touched.
    fn descend(
        &self,
        (level, place): (usize, [u32; 2]),
        sides: [usize; 4],
        touches: &impl Fn(DVec2, f64) -> bool,
        found: &mut impl FnMut(usize),
    ) {
        let along = self.table.grid.tiles_along();
        let width = along << level;
        let first = place.map(|place| place as usize * width);
        let [x0, x1, y0, y1] = sides;
        let overlaps =
            first[0] <= x1 && x0 < first[0] + width && first[1] <= y1 && y0 < first[1] + width;
        let is_touched = || touches(corner(first), (width * TILE) as f64);
        if !(overlaps && self.holds(level, place) && is_touched()) {
            return;
        }
        if level > 0 {
            for child in 0..4 {
                let child = [2 * place[0] + child % 2, 2 * place[1] + child / 2];
                self.descend((level - 1, child), sides, touches, found);
            }
            return;
        }
        let bins = self.first_bin(place).expect("it holds a page");
        for y in first[1].max(y0)..(first[1] + along).min(y1 + 1) {
            for x in first[0].max(x0)..(first[0] + along).min(x1 + 1) {
                if touches(corner([x, y]), TILE as f64) {
                    found(bins + (y - first[1]) * along + x - first[0]);
                }
            }
        }
    }
}

/// The first texel of a tile.
fn corner(tile: [usize; 2]) -> DVec2 {
    DVec2::new((tile[0] * TILE) as f64, (tile[1] * TILE) as f64)
}

impl DrawnTiles for PageTree<'_> {
    fn bins(&self) -> usize {
        self.table.pages.len() * self.table.grid.tiles()
    }

    fn bin(&self, tile: usize) -> Option<usize> {
        let along = self.table.grid.tiles_along();
        let (x, y) = (tile % self.tiling.columns, tile / self.tiling.columns);
        let first = self.first_bin([(x / along) as u32, (y / along) as u32])?;
        Some(first + y % along * along + x % along)
    }

    fn each_in(
        &self,
        sides: [usize; 4],
        touches: &impl Fn(DVec2, f64) -> bool,
        mut found: impl FnMut(usize),
    ) {
        let root = (self.levels.len() - 1, [0, 0]);
        self.descend(root, sides, touches, &mut found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::paging::grid::PageGrid;
    use crate::twin::Random;
    use std::collections::BTreeSet;

    #[test]
    fn the_tiles_of_a_box_are_those_of_its_pages() {
        let mut random = Random(5);
        for round in 0..60 {
            let page_size = [64, 128, 256][round % 3];
            let side = 64 + (random.share() * 3000.0) as u32;
            let grid = PageGrid::new(side, page_size);
            let tiling = Tiling::new(side as usize, side as usize);
            let all = (0..grid.columns.pow(2)).map(|i| [i % grid.columns, i / grid.columns]);
            let pages: Vec<_> = all.filter(|_| random.share() < 0.3).collect();
            let is_drawn: Vec<_> = pages.iter().map(|_| random.share() < 0.8).collect();
            let table = PageTable::new(grid, pages.clone());
            let tree = PageTree::new(&table, tiling, &is_drawn);
            let mut any = || (random.share() * tiling.columns as f64) as usize;
            let ([a, b], [c, d]) = ([any(), any()], [any(), any()]);
            let sides = [a.min(b), a.max(b), c.min(d), c.max(d)];
            let mut found = Vec::new();
            let is_left_out = |corner: DVec2, side: f64| corner.x + side <= 500.0;
            tree.each_in(sides, &|corner, side| !is_left_out(corner, side), |bin| {
                found.push(bin);
            });
            let along = grid.tiles_along();
            let mut expected = BTreeSet::new();
            for (slot, (page, _)) in pages
                .iter()
                .zip(&is_drawn)
                .enumerate()
                .filter(|(_, p)| *p.1)
            {
                for i in 0..grid.tiles() {
                    let x = page[0] as usize * along + i % along;
                    let y = page[1] as usize * along + i / along;
                    let is_in =
                        (sides[0]..=sides[1]).contains(&x) && (sides[2]..=sides[3]).contains(&y);
                    if is_in && (x + 1) * TILE > 500 {
                        expected.insert(slot * grid.tiles() + i);
                        assert_eq!(
                            tree.bin(y * tiling.columns + x),
                            Some(slot * grid.tiles() + i)
                        );
                    }
                }
            }
            assert_eq!(found.len(), expected.len());
            assert_eq!(found.into_iter().collect::<BTreeSet<_>>(), expected);
        }
    }
}
