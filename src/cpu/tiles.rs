//! Images in tiles, so that what a thread works on stays in its cache.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Pixels along each side of a tile, and of the blocks that it is made of.
pub const TILE: usize = 64;
pub const BLOCK: usize = 8;

/// Blocks along each side of a tile.
pub const BLOCKS: usize = TILE / BLOCK;

/// Pixels of a tile.
pub const TILE_PIXELS: usize = TILE * TILE;

/// How an image lies in tiles: one after the other, each row by row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tiling {
    pub width: usize,
    pub height: usize,
    pub columns: usize,
    pub rows: usize,
}

impl Tiling {
    pub fn new(width: usize, height: usize) -> Self {
        let (columns, rows) = (width.div_ceil(TILE), height.div_ceil(TILE));
        Self {
            width,
            height,
            columns,
            rows,
        }
    }

    pub fn tiles(&self) -> usize {
        self.columns * self.rows
    }

    /// Where a pixel lies among those of all tiles.
    #[inline(always)]
    pub fn index(&self, x: usize, y: usize) -> usize {
        let tile = y / TILE * self.columns + x / TILE;
        tile * TILE_PIXELS + y % TILE * TILE + x % TILE
    }

    /// What lies in tiles, row by row.
    pub fn row_by_row<T: Copy>(&self, tiled: &[T]) -> Vec<T> {
        let mut rows = Vec::with_capacity(self.width * self.height);
        for y in 0..self.height {
            for x in (0..self.width).step_by(TILE) {
                let first = self.index(x, y);
                rows.extend_from_slice(&tiled[first..first + TILE.min(self.width - x)]);
            }
        }
        rows
    }

    /// The first pixel of a tile.
    pub fn corner(&self, tile: usize) -> (usize, usize) {
        (tile % self.columns * TILE, tile / self.columns * TILE)
    }

    /// The first pixel of each block of a tile.
    pub fn blocks(self, tile: usize) -> impl Iterator<Item = (usize, usize)> {
        let (x, y) = self.corner(tile);
        let columns = x..self.width.min(x + TILE);
        let rows = (y..self.height.min(y + TILE)).step_by(BLOCK);
        rows.flat_map(move |y| columns.clone().step_by(BLOCK).map(move |x| (x, y)))
    }
}

/// Cuts an image that lies row by row into its tiles: of each the pieces of its rows.
pub fn cut<T>(image: &mut [T], tiling: Tiling) -> Vec<Vec<&mut [T]>> {
    let mut tiles: Vec<_> = (0..tiling.tiles())
        .map(|_| Vec::with_capacity(TILE))
        .collect();
    for (y, row) in image.chunks_mut(tiling.width).enumerate() {
        let first = y / TILE * tiling.columns;
        for (tile, piece) in tiles[first..].iter_mut().zip(row.chunks_mut(TILE)) {
            tile.push(piece);
        }
    }
    tiles
}

/// Gives the numbers below `count` to all threads, one at a time; each thread has its own state.
pub fn share_jobs<T: Send>(states: &mut [T], count: usize, work: impl Fn(&mut T, usize) + Sync) {
    let next = AtomicUsize::new(0);
    let (next, work) = (&next, &work);
    rayon::scope(|scope| {
        for state in states {
            scope.spawn(move |_| {
                loop {
                    let job = next.fetch_add(1, Ordering::Relaxed);
                    if job >= count {
                        break;
                    }
                    work(state, job);
                }
            });
        }
    });
}
