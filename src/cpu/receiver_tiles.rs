//! The tiles of a map that receivers look at, and which blocks of them: the rest need not be drawn. They are found by the
//! lookup's own steps, which then look at nothing, so that no texel is missed. Twin of `shaders/receiver_tiles.wgsl`.

use super::bins::DrawnTiles;
use super::tiles::{BLOCK, BLOCKS, TILE, Tiling};
use crate::map_size::MapSize;
use glam::DVec2;
use std::sync::atomic::{AtomicU64, Ordering};

/// A tile's blocks, a bit each, row by row.
pub const ALL_BLOCKS: u64 = u64::MAX;

/// The first block of each row.
const EACH_ROW: u64 = 0x0101_0101_0101_0101;

const _: () = assert!(BLOCKS * BLOCKS == ALL_BLOCKS.count_ones() as usize);

/// Of each tile of a map the blocks that are looked at.
pub struct ReceiverTiles {
    tiling: Tiling,
    blocks: Vec<AtomicU64>,
}

impl ReceiverTiles {
    pub fn new(size: MapSize) -> Self {
        let tiling = Tiling::new(size.width as usize, size.height as usize);
        let none = || AtomicU64::new(0);
        Self {
            tiling,
            blocks: std::iter::repeat_with(none).take(tiling.tiles()).collect(),
        }
    }

    pub fn blocks(&self, tile: usize) -> u64 {
        self.blocks[tile].load(Ordering::Relaxed)
    }

    /// How many tiles are not looked at.
    pub fn skipped(&self) -> usize {
        let tiles = 0..self.tiling.tiles();
        tiles.filter(|&tile| self.blocks(tile) == 0).count()
    }

    /// Adds the blocks of the texels from a first to a last column and row.
    #[inline(always)]
    pub fn add(&self, first: [usize; 2], last: [usize; 2]) {
        let ([x0, y0], [x1, y1]) = (first.map(|i| i / BLOCK), last.map(|i| i / BLOCK));
        for row in y0 / BLOCKS..=y1 / BLOCKS {
            let (first, last) = between(y0, y1, row * BLOCKS);
            let rows =
                (ALL_BLOCKS << (first * BLOCKS)) & (ALL_BLOCKS >> ((BLOCKS - 1 - last) * BLOCKS));
            for column in x0 / BLOCKS..=x1 / BLOCKS {
                let (first, last) = between(x0, x1, column * BLOCKS);
                let of_row = (0xff << first) & (0xff >> (BLOCKS - 1 - last));
                let blocks = rows & (of_row * EACH_ROW);
                let known = &self.blocks[row * self.tiling.columns + column];
                // A line that nobody writes to stays in the caches of all.
                if blocks & !known.load(Ordering::Relaxed) != 0 {
                    known.fetch_or(blocks, Ordering::Relaxed);
                }
            }
        }
    }
}

/// Which of the eight numbers from `start` on lie between `first` and `last`: the first and the last that does.
#[inline(always)]
fn between(first: usize, last: usize, start: usize) -> (usize, usize) {
    (first.saturating_sub(start), (last - start).min(BLOCKS - 1))
}

impl DrawnTiles for ReceiverTiles {
    fn bins(&self) -> usize {
        self.tiling.tiles()
    }

    #[inline(always)]
    fn bin(&self, tile: usize) -> Option<usize> {
        (self.blocks(tile) != 0).then_some(tile)
    }

    #[inline(always)]
    fn each_in(
        &self,
        sides: [usize; 4],
        touches: &impl Fn(DVec2, f64) -> bool,
        found: impl FnMut(usize),
    ) {
        let touches = |corner: DVec2, side: f64| {
            let [column, row] = (corner / TILE as f64).to_array().map(|i| i as usize);
            self.blocks(row * self.tiling.columns + column) != 0 && touches(corner, side)
        };
        self.tiling.each_in(sides, &touches, found);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_of_texels_are_added_in_every_tile_that_they_lie_in() {
        let size = MapSize {
            width: 200,
            height: 130,
        };
        for (first, last) in [
            ([0, 0], [0, 0]),
            ([63, 63], [64, 64]),
            ([10, 60], [199, 129]),
            ([100, 7], [100, 8]),
            ([0, 0], [199, 129]),
        ] {
            let tiles = ReceiverTiles::new(size);
            tiles.add(first, last);
            for tile in 0..tiles.bins() {
                let (x, y) = tiles.tiling.corner(tile);
                for block in 0..BLOCKS * BLOCKS {
                    let (x, y) = (x + block % BLOCKS * BLOCK, y + block / BLOCKS * BLOCK);
                    let is_within = |begin: usize, first: usize, last: usize| {
                        begin <= last && first < begin + BLOCK
                    };
                    let expected =
                        is_within(x, first[0], last[0]) && is_within(y, first[1], last[1]);
                    assert_eq!(tiles.blocks(tile) >> block & 1 != 0, expected, "{x} {y}");
                }
            }
        }
    }
}
