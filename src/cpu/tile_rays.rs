//! The rays of a tile of a map, where they are no middles of pixels.

use super::lanes::{LANES, Simd, f32x8, greatest_of, least_of, mask_bits, splat};
use super::shapes::Shapes;
use super::tiles::{BLOCK, BLOCKS, TILE, TILE_PIXELS, Tiling};
use fearless_simd::prelude::*;
use glam::DVec2;

/// The rays of a tile's texels, as places in the plane of a view.
pub struct TileRays {
    /// Relative to the origin.
    pub x: [f32; TILE_PIXELS],
    pub y: [f32; TILE_PIXELS],
    pub origin: [f32; 2],
    /// No place is farther from it along an axis.
    pub side: f32,
    /// Of each block, least and greatest places.
    boxes: [[f32; BLOCKS * BLOCKS]; 4],
    /// Of the blocks of each row of them.
    row_boxes: [[f32; BLOCKS]; 4],
}

impl TileRays {
    pub fn new() -> Box<Self> {
        Box::new(Self {
            x: [0.0; TILE_PIXELS],
            y: [0.0; TILE_PIXELS],
            origin: [0.0; 2],
            side: 0.0,
            boxes: [[0.0; BLOCKS * BLOCKS]; 4],
            row_boxes: [[0.0; BLOCKS]; 4],
        })
    }

    /// Takes the places of some texels; the others get that of one of these. `false` where there are none.
    pub fn set(&mut self, places: &[[f64; 2]], is_taken: &[bool; TILE_PIXELS]) -> bool {
        let taken = || places.iter().zip(is_taken).filter(|(_, taken)| **taken);
        let Some((first, _)) = taken().next() else {
            return false;
        };
        let origin = first.map(|v| v as f32);
        self.origin = origin;
        let relative = |place: &[f64; 2], k: usize| (place[k] - f64::from(origin[k])) as f32;
        self.side = 0.0;
        for (i, (place, taken)) in places.iter().zip(is_taken).enumerate() {
            let place = if *taken { place } else { first };
            (self.x[i], self.y[i]) = (relative(place, 0), relative(place, 1));
            self.side = self.side.max(self.x[i].abs()).max(self.y[i].abs());
        }
        for block in 0..BLOCKS * BLOCKS {
            let first = block / BLOCKS * BLOCK * TILE + block % BLOCKS * BLOCK;
            let mut sides = [
                f32::INFINITY,
                f32::NEG_INFINITY,
                f32::INFINITY,
                f32::NEG_INFINITY,
            ];
            for row in 0..BLOCK {
                let start = first + row * TILE;
                let of_row = self.x[start..].iter().zip(&self.y[start..]);
                for ((&x, &y), &is_taken) in of_row.zip(&is_taken[start..]).take(BLOCK) {
                    if is_taken {
                        let [x0, x1, y0, y1] = sides;
                        sides = [x0.min(x), x1.max(x), y0.min(y), y1.max(y)];
                    }
                }
            }
            for (side, values) in sides.into_iter().zip(&mut self.boxes) {
                values[block] = side;
            }
        }
        for by in 0..BLOCKS {
            let of_row = |k: usize| &self.boxes[k][by * BLOCKS..(by + 1) * BLOCKS];
            let sides = [
                least_of(of_row(0)),
                greatest_of(of_row(1)),
                least_of(of_row(2)),
                greatest_of(of_row(3)),
            ];
            for (side, values) in sides.into_iter().zip(&mut self.row_boxes) {
                values[by] = side;
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

    #[inline(always)]
    fn boxes_of_row<S: Simd>(&self, simd: S, by: usize) -> [f32x8<S>; 4] {
        let first = by * BLOCKS;
        let [x0, x1, y0, y1] = &self.boxes;
        [
            f32x8::from_slice(simd, &x0[first..first + LANES]),
            f32x8::from_slice(simd, &x1[first..first + LANES]),
            f32x8::from_slice(simd, &y0[first..first + LANES]),
            f32x8::from_slice(simd, &y1[first..first + LANES]),
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
fn boxes_met<S: Simd>(simd: S, [x0, x1, y0, y1]: [f32x8<S>; 4], sides: [f32; 4]) -> u32 {
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
