//! Which pixels see one triangle wherever a sample is, before any is drawn.
//!
//! Of the triangles that surely cover a pixel's square the nearest is kept; the pixel is whole where all others that may
//! touch it are farther. The same is done for planes in the tiles of hierarchical depth buffers (Greene, Kass and
//! Miller, "Hierarchical Z-buffer visibility", SIGGRAPH 1993), which keep the farthest depth only.

use super::super::bins::Bins;
use super::super::lanes::bits;
use super::super::lanes::{LANES, Simd, f32x8, least, least_of, mask_bits, mask32x8, splat, u32x8};
use super::super::rasterize::{NONE, Painter};
use super::super::tiles::{BLOCK, BLOCKS, TILE, TILE_PIXELS};
use super::squares::{Listed, SetUp, Squares, each_triangle};
use fearless_simd::prelude::*;

/// What is known of the pixels of a tile.
pub struct TileCover {
    /// The triangle of each whole pixel; of the others what is about at the centre.
    pub ids: [u32; TILE_PIXELS],
    /// No sample sees anything farther; nothing is known where it is `NEG_INFINITY`.
    pub low: [f32; TILE_PIXELS],
    /// The pixels of each row that see one triangle, and those that may see several.
    pub whole: [u64; TILE],
    pub mixed: [u64; TILE],
    /// Triangles that some sample may see.
    pub near: Vec<u32>,
    pub wide: Vec<u32>,
}

impl TileCover {
    pub fn drawn(&self) -> Listed<'_> {
        Listed {
            near: &self.near,
            wide: &self.wide,
        }
    }
}

/// A tile in the making.
struct Covering {
    ids: [u32; TILE_PIXELS],
    /// How near what is at the centre is.
    at_centre: [f32; TILE_PIXELS],
    /// Between which nearness the nearest triangle is that covers the pixel.
    low: [f32; TILE_PIXELS],
    high: [f32; TILE_PIXELS],
    /// The nearest of all others that touch it.
    other: [f32; TILE_PIXELS],
    /// The least of `low` in each block.
    farthest: [f32; BLOCKS * BLOCKS],
}

/// Finds what is known of a tile.
#[inline(always)]
pub fn cover_tile<S: Simd>(simd: S, painter: &Painter, bins: &Bins, tile: usize) -> Box<TileCover> {
    let corner = painter.tiling.corner(tile);
    let mut covering = Box::new(Covering {
        ids: [NONE; TILE_PIXELS],
        at_centre: [f32::NEG_INFINITY; TILE_PIXELS],
        low: [f32::NEG_INFINITY; TILE_PIXELS],
        high: [f32::NEG_INFINITY; TILE_PIXELS],
        other: [f32::NEG_INFINITY; TILE_PIXELS],
        farthest: [f32::NEG_INFINITY; BLOCKS * BLOCKS],
    });
    // What lies beside the image is never seen.
    let width = (painter.tiling.width - corner.0).min(TILE);
    let height = (painter.tiling.height - corner.1).min(TILE);
    for (y, row) in covering.low.chunks_exact_mut(TILE).enumerate() {
        let first = if y < height { width } else { 0 };
        row[first..].fill(f32::INFINITY);
    }
    for block in 0..BLOCKS * BLOCKS {
        covering.find_farthest(block % BLOCKS, block / BLOCKS);
    }
    let (mut near, mut wide) = (Vec::new(), Vec::new());
    for of_thread in bins {
        let listed = Listed::from(&of_thread[tile]);
        each_triangle(
            simd,
            painter,
            corner,
            &listed,
            #[inline(always)]
            |set_up| {
                let has_holes = painter.scene.mask_of(set_up.id).is_some();
                if covering.add(simd, &set_up, painter.view.seen, has_holes) {
                    let list = if set_up.is_wide { &mut wide } else { &mut near };
                    list.push(set_up.id);
                }
            },
        );
    }
    covering.finished((width, height), near, wide)
}

impl Covering {
    /// Adds a triangle, and tells whether some sample may see it.
    #[inline(always)]
    fn add<S: Simd>(&mut self, simd: S, set_up: &SetUp, seen: (f64, f64), has_holes: bool) -> bool {
        let [x0, x1, y0, y1] = set_up.pixels;
        let (bx0, bx1, by0, by1) = (x0 / BLOCK, x1 / BLOCK, y0 / BLOCK, y1 / BLOCK);
        let columns = (0xff << bx0) & (0xff >> (BLOCKS - 1 - bx1));
        let is_small = bx1 - bx0 + by1 - by0 <= 1;
        let squares = Squares::new(simd, set_up, seen);
        let mut may_be_seen = false;
        for by in by0..=by1 {
            let rows = y0.max(by * BLOCK)..y1.min(by * BLOCK + BLOCK - 1) + 1;
            let farthest = f32x8::from_slice(simd, &self.farthest[by * BLOCKS..(by + 1) * BLOCKS]);
            let (mut blocks, mut nearest) = (columns, squares.high);
            if !is_small {
                let row = (by * BLOCK) as f32;
                let found = set_up.shapes.blocks(simd, set_up.lane, row, BLOCK as f32);
                (blocks, nearest) = (blocks & found.touched, found.nearest.max(squares.low));
            }
            blocks &= mask_bits(farthest.simd_le(nearest + squares.rounding * 2.0));
            for bx in bits(blocks) {
                let mut has_covered = false;
                for row in rows.clone() {
                    let [touches, covers] =
                        self.add_to_row(simd, &squares, set_up.id, (bx, row), has_holes);
                    may_be_seen |= touches;
                    has_covered |= covers;
                }
                if has_covered {
                    self.find_farthest(bx, by);
                }
            }
        }
        may_be_seen
    }

    /// Whether it may be seen in eight pixels, and whether it is the nearest that covers one.
    #[inline(always)]
    fn add_to_row<S: Simd>(
        &mut self,
        simd: S,
        squares: &Squares<S>,
        id: u32,
        (bx, row): (usize, usize),
        has_holes: bool,
    ) -> [bool; 2] {
        let found = squares.at(simd, bx, row);
        let place = row * TILE + bx * BLOCK;
        let at = place..place + LANES;
        let low = f32x8::from_slice(simd, &self.low[at.clone()]);
        let mask = |bits: u32| mask32x8::from_bitmask(simd, u64::from(bits));
        let touches = found.touched & mask_bits(low.simd_le(found.high));
        if touches == 0 {
            return [false; 2];
        }
        let covers = if has_holes { 0 } else { found.covered };
        let wins = touches & covers & mask_bits(low.simd_lt(found.low));
        let none = splat(simd, f32::NEG_INFINITY);
        let high = f32x8::from_slice(simd, &self.high[at.clone()]);
        let other = f32x8::from_slice(simd, &self.other[at.clone()]);
        let beside = mask(wins).select(high, mask(touches).select(found.high, none));
        other.max(beside).store_slice(&mut self.other[at.clone()]);
        if wins != 0 {
            let won = mask(wins);
            won.select(found.low, low)
                .store_slice(&mut self.low[at.clone()]);
            won.select(found.high, high)
                .store_slice(&mut self.high[at.clone()]);
        }
        // About what a single sample would see: receivers for the grids to be fitted to.
        let plane = found.plane.max(squares.low).min(squares.high);
        let nearest = f32x8::from_slice(simd, &self.at_centre[at.clone()]);
        let is_at_centre =
            splat(simd, 0.0).simd_le(least(found.edges)) & nearest.simd_lt(plane) & mask(touches);
        is_at_centre
            .select(plane, nearest)
            .store_slice(&mut self.at_centre[at.clone()]);
        let ids = u32x8::from_slice(simd, &self.ids[at.clone()]);
        is_at_centre
            .select(u32x8::simd_from(simd, id), ids)
            .store_slice(&mut self.ids[at]);
        [true, wins != 0]
    }

    fn find_farthest(&mut self, bx: usize, by: usize) {
        let rows = by * BLOCK..(by + 1) * BLOCK;
        let least = rows.fold(f32::INFINITY, |least, row| {
            let place = row * TILE + bx * BLOCK;
            least.min(least_of(&self.low[place..place + BLOCK]))
        });
        self.farthest[by * BLOCKS + bx] = least;
    }

    fn finished(
        self: Box<Self>,
        (width, height): (usize, usize),
        near: Vec<u32>,
        wide: Vec<u32>,
    ) -> Box<TileCover> {
        let (mut whole, mut mixed) = ([0; TILE], [0; TILE]);
        for row in 0..height {
            for column in 0..width {
                let place = row * TILE + column;
                let (low, other) = (self.low[place], self.other[place]);
                let rows = match other < low {
                    true => &mut whole,
                    false if other > f32::NEG_INFINITY => &mut mixed,
                    false => continue,
                };
                rows[row] |= 1 << column;
            }
        }
        Box::new(TileCover {
            ids: self.ids,
            low: self.low,
            whole,
            mixed,
            near,
            wide,
        })
    }
}
