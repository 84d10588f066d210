//! The rays of a tile of a map, where they are no middles of pixels.

use super::lanes::{
    LANES, Simd, f32x8, f64x8, greatest_of, least_of, mask_bits, mask32x8, narrow, splat,
};
use super::shapes::Shapes;
use super::tiles::{BLOCK, BLOCKS, TILE, TILE_PIXELS, Tiling};
use fearless_simd::prelude::*;
use glam::DVec2;
use std::ops::Range;

/// Eights of texels in a tile, row by row.
const EIGHTS: usize = TILE_PIXELS / LANES;

/// Places of a tile's texels in a plane: columns, rows.
pub type Places = [[f64; TILE_PIXELS]; 2];

/// Some of a tile's texels: of eight in a row a bit each.
#[derive(Clone, Copy)]
pub struct Taken([u8; EIGHTS]);

impl Taken {
    pub const NONE: Self = Self([0; EIGHTS]);

    /// Those of a tile that lie within an image, whose first pixel that is.
    pub fn inside((x, y): (usize, usize), (width, height): (usize, usize)) -> Self {
        let mut taken = Self::NONE;
        for (i, eight) in taken.0.iter_mut().enumerate() {
            let (x, y) = (x + i * LANES % TILE, y + i * LANES / TILE);
            let columns = if y < height {
                width.saturating_sub(x)
            } else {
                0
            };
            *eight = u8::MAX
                .checked_shr(LANES.saturating_sub(columns) as u32)
                .unwrap_or(0);
        }
        taken
    }

    /// Those that lie in some blocks, a bit each.
    pub fn of_blocks(mut self, blocks: u64) -> Self {
        for (i, eight) in self.0.iter_mut().enumerate() {
            let (bx, by) = (i % BLOCKS, i / BLOCKS / BLOCK);
            if blocks >> (by * BLOCKS + bx) & 1 == 0 {
                *eight = 0;
            }
        }
        self
    }

    pub fn add(&mut self, texel: usize) {
        self.0[texel / LANES] |= 1 << (texel % LANES);
    }

    pub fn is_all(&self) -> bool {
        self.0 == [u8::MAX; EIGHTS]
    }

    pub fn has(&self, texel: usize) -> bool {
        self.0[texel / LANES] >> (texel % LANES) & 1 != 0
    }

    #[inline(always)]
    pub fn masks<S: Simd>(&self, simd: S) -> impl Iterator<Item = mask32x8<S>> {
        self.0.iter().map(
            #[inline(always)]
            move |&eight| mask32x8::from_bitmask(simd, u64::from(eight)),
        )
    }

    fn first(&self) -> Option<usize> {
        let i = self.0.iter().position(|&eight| eight != 0)?;
        Some(i * LANES + self.0[i].trailing_zeros() as usize)
    }
}

/// The rays of a tile's texels, as places in the plane of a view.
pub struct TileRays {
    /// Relative to the origin.
    pub x: [f32; TILE_PIXELS],
    pub y: [f32; TILE_PIXELS],
    pub origin: [f32; 2],
    /// No place is farther from it along an axis.
    pub side: f32,
    /// Least and greatest places of each block's rows, block by block.
    rows: [[f32; EIGHTS]; 4],
    /// The same of the blocks.
    boxes: [[f32; BLOCKS * BLOCKS]; 4],
    /// The same of the blocks of each row of them.
    row_boxes: [[f32; BLOCKS]; 4],
}

impl TileRays {
    pub fn new() -> Box<Self> {
        Box::new(Self {
            x: [0.0; TILE_PIXELS],
            y: [0.0; TILE_PIXELS],
            origin: [0.0; 2],
            side: 0.0,
            rows: [[0.0; EIGHTS]; 4],
            boxes: [[0.0; BLOCKS * BLOCKS]; 4],
            row_boxes: [[0.0; BLOCKS]; 4],
        })
    }

    /// Takes the places of some texels; the others get that of one of these. `false` where there are none.
    #[inline(always)]
    pub fn set<S: Simd>(&mut self, simd: S, places: &Places, taken: &Taken) -> bool {
        let Some(first) = taken.first() else {
            return false;
        };
        self.origin = places.each_ref().map(|along| along[first] as f32);
        let mut farthest = splat(simd, 0.0);
        for (k, relative) in [&mut self.x, &mut self.y].into_iter().enumerate() {
            let origin = f64::from(self.origin[k]);
            let of_first = splat(simd, (places[k][first] - origin) as f32);
            for (i, is_taken) in taken.masks(simd).enumerate() {
                let texels = i * LANES..(i + 1) * LANES;
                let place = f64x8::from_slice(simd, &places[k][texels.clone()]) - origin;
                let place = is_taken.select(narrow(place), of_first);
                place.store_slice(&mut relative[texels]);
                farthest = farthest.max(place.abs());
                // Row by row of a tile, where they are kept block by block.
                let (row, bx) = (i / BLOCKS, i % BLOCKS);
                let of_block = (row / BLOCK * BLOCKS + bx) * BLOCK + row % BLOCK;
                let low = is_taken.select(place, splat(simd, f32::INFINITY));
                let high = is_taken.select(place, splat(simd, f32::NEG_INFINITY));
                self.rows[2 * k][of_block] = low.reduce_min();
                self.rows[2 * k + 1][of_block] = high.reduce_max();
            }
        }
        self.side = farthest.reduce_max();
        for k in [0, 2] {
            for (low, rows) in self.boxes[k].iter_mut().zip(self.rows[k].chunks(BLOCK)) {
                *low = f32x8::from_slice(simd, rows).reduce_min();
            }
            for (high, rows) in self.boxes[k + 1]
                .iter_mut()
                .zip(self.rows[k + 1].chunks(BLOCK))
            {
                *high = f32x8::from_slice(simd, rows).reduce_max();
            }
            for by in 0..BLOCKS {
                let of_row = by * BLOCKS..(by + 1) * BLOCKS;
                self.row_boxes[k][by] = least_of(&self.boxes[k][of_row.clone()]);
                self.row_boxes[k + 1][by] = greatest_of(&self.boxes[k + 1][of_row]);
            }
        }
        true
    }

    /// Least and greatest column and row of the rays.
    pub fn sides(&self) -> [f32; 4] {
        let [x0, x1, y0, y1] = &self.row_boxes;
        [least_of(x0), greatest_of(x1), least_of(y0), greatest_of(y1)]
    }

    /// First and last column and row of the tiles of the view that the rays fall in.
    pub fn tiles(&self, tiling: Tiling) -> [usize; 4] {
        let [x0, x1, y0, y1] = self.sides();
        let tile = |v: f32, k: usize, count: usize| {
            let tile = ((v + self.origin[k]) / TILE as f32).floor();
            (tile.max(0.0) as usize).min(count - 1)
        };
        let (columns, rows) = (tiling.columns, tiling.rows);
        [
            tile(x0, 0, columns),
            tile(x1, 0, columns),
            tile(y0, 1, rows),
            tile(y1, 1, rows),
        ]
    }

    /// Those of eight texels of a row.
    #[inline(always)]
    pub fn eight<S: Simd>(&self, simd: S, first: usize) -> (f32x8<S>, f32x8<S>) {
        let (x, y) = (&self.x[first..first + LANES], &self.y[first..first + LANES]);
        (f32x8::from_slice(simd, x), f32x8::from_slice(simd, y))
    }

    pub fn origin(&self) -> DVec2 {
        DVec2::from(self.origin.map(f64::from))
    }

    /// The place of a texel in the plane, relative to the origin.
    pub fn offset(&self, texel: usize) -> DVec2 {
        DVec2::from([self.x[texel], self.y[texel]].map(f64::from))
    }

    /// The rows of blocks whose box a triangle's box meets: least and greatest column and row.
    #[inline(always)]
    pub fn rows_of_box<S: Simd>(&self, simd: S, sides: [f32; 4]) -> u32 {
        let [x0, x1, y0, y1] = &self.row_boxes;
        let boxes = [x0, x1, y0, y1].map(|side| f32x8::simd_from(simd, *side));
        boxes_met(simd, boxes, sides)
    }

    /// The same of the eight blocks in a row of them.
    #[inline(always)]
    pub fn blocks_of_box<S: Simd>(&self, simd: S, by: usize, sides: [f32; 4]) -> u32 {
        boxes_met(simd, self.boxes_of_row(simd, by), sides)
    }

    /// The rows of a block whose rays a triangle's box meets: from the first to the last.
    #[inline(always)]
    pub fn rows_of_block<S: Simd>(
        &self,
        simd: S,
        (bx, by): (usize, usize),
        sides: [f32; 4],
    ) -> Range<usize> {
        let met = boxes_met(
            simd,
            self.eight_boxes(simd, &self.rows, by * BLOCKS + bx),
            sides,
        );
        let first = by * BLOCK;
        match met {
            0 => first..first,
            _ => first + met.trailing_zeros() as usize..first + 1 + met.ilog2() as usize,
        }
    }

    #[inline(always)]
    fn boxes_of_row<S: Simd>(&self, simd: S, by: usize) -> [f32x8<S>; 4] {
        self.eight_boxes(simd, &self.boxes, by)
    }

    #[inline(always)]
    fn eight_boxes<S: Simd, const N: usize>(
        &self,
        simd: S,
        [x0, x1, y0, y1]: &[[f32; N]; 4],
        number: usize,
    ) -> [f32x8<S>; 4] {
        let eight = number * LANES..(number + 1) * LANES;
        [
            f32x8::from_slice(simd, &x0[eight.clone()]),
            f32x8::from_slice(simd, &x1[eight.clone()]),
            f32x8::from_slice(simd, &y0[eight.clone()]),
            f32x8::from_slice(simd, &y1[eight]),
        ]
    }

    /// Of the eight blocks in a row of them, those that a triangle may touch, those that it covers for sure, and how near it
    /// comes in each. A block without rays has a box that is turned inside out.
    #[inline(always)]
    pub fn blocks<S: Simd>(
        &self,
        simd: S,
        (shapes, lane): (&Shapes, usize),
        by: usize,
    ) -> (u32, u32, f32x8<S>) {
        let boxes = self.boxes_of_row(simd, by);
        let mut most = splat(simd, f32::INFINITY);
        let mut fewest = splat(simd, f32::INFINITY);
        for i in 0..3 {
            let (a, b, c) = (shapes.a[i][lane], shapes.b[i][lane], shapes.c[i][lane]);
            most = most.min(greatest_in(&boxes, [a, b, c]));
            fewest = fewest.min(-greatest_in(&boxes, [-a, -b, -c]));
        }
        let plane = [shapes.step_x[lane], shapes.step_y[lane], shapes.first[lane]];
        let nearest = greatest_in(&boxes, plane).min(splat(simd, shapes.high[lane]));
        // Half a unit of what is sure is for the rounding here.
        let is_there = boxes[0].simd_le(boxes[1]);
        let touched = is_there & splat(simd, -1.5).simd_le(most);
        let covered = is_there & splat(simd, 1.5).simd_lt(fewest);
        (mask_bits(touched), mask_bits(covered), nearest)
    }
}

/// Which of eight boxes meet a box.
#[inline(always)]
pub fn boxes_met<S: Simd>(simd: S, [x0, x1, y0, y1]: [f32x8<S>; 4], sides: [f32; 4]) -> u32 {
    let [low_x, high_x, low_y, high_y] = sides;
    let along_x = x0.simd_le(splat(simd, high_x)) & splat(simd, low_x).simd_le(x1);
    let along_y = y0.simd_le(splat(simd, high_y)) & splat(simd, low_y).simd_le(y1);
    mask_bits(along_x & along_y)
}

/// The greatest value of a linear function in each of eight boxes.
#[inline(always)]
fn greatest_in<S: Simd>([x0, x1, y0, y1]: &[f32x8<S>; 4], [a, b, c]: [f32; 3]) -> f32x8<S> {
    *x1 * a.max(0.0) + *x0 * a.min(0.0) + *y1 * b.max(0.0) + *y0 * b.min(0.0) + c
}
