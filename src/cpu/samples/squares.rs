//! What a triangle does in the squares of pixels.

use super::super::bins::{Bin, eights, ids_at};
use super::super::lanes::{EPSILON, LANES, Simd, f32x8, indices, least, numbers, splat};
use super::super::rasterize::Painter;
use super::super::shapes::Shapes;
use super::super::tiles::{BLOCK, TILE};
use crate::lanes::Each;
use fearless_simd::prelude::*;
use glam::DVec2;

/// Of what is sure half a unit is for the rounding here, as in `Shapes::blocks`.
const SURE: f32 = 1.5;

/// What one sum more may add to the rounding of a nearness, of which four parts are that of its size.
const ROOM: f32 = 1.25;

/// Triangles of a tile: those that float32 knows well, and those that are set up in float64.
pub struct Listed<'a> {
    pub near: &'a [u32],
    pub wide: &'a [u32],
}

impl<'a> From<&'a Bin> for Listed<'a> {
    fn from(bin: &'a Bin) -> Self {
        Self {
            near: &bin.near,
            wide: &bin.wide,
        }
    }
}

/// A triangle that is set up relative to the corner of a tile.
pub struct SetUp<'a> {
    pub id: u32,
    pub shapes: &'a Shapes,
    pub lane: usize,
    /// Whether it may pass the near plane or the far one.
    pub is_wide: bool,
    /// First and last column and row of the pixels that it may touch.
    pub pixels: [usize; 4],
}

/// Sets the triangles of a tile up, one after the other.
#[inline(always)]
pub fn each_triangle<S: Simd>(
    simd: S,
    painter: &Painter,
    corner: (usize, usize),
    listed: &Listed,
    mut work: impl FnMut(SetUp),
) {
    let origin = [corner.0 as f32, corner.1 as f32];
    let (rounding, side) = (painter.view.rounding(), TILE as f32);
    for (list, is_wide) in [(listed.near, false), (listed.wide, true)] {
        for (places, count) in eights(0..list.len()) {
            let ids = ids_at(list, places);
            let eight = painter.set_up(simd, ids, is_wide, (origin, side), rounding);
            let pixels = touched_pixels(simd, eight.boxes);
            for lane in 0..count {
                let mut set_up = SetUp {
                    id: ids[lane],
                    shapes: &eight.shapes,
                    lane,
                    is_wide: false,
                    pixels: pixels.each(|side| side[lane] as usize),
                };
                if eight.wide >> lane & 1 == 0 {
                    work(set_up);
                    continue;
                }
                let place = DVec2::new(corner.0 as f64, corner.1 as f64);
                let seen = (painter.view, painter.scene);
                if let Some(shapes) = Shapes::wide(seen, ids[lane], place, f64::from(side), 0.0) {
                    (set_up.shapes, set_up.lane, set_up.is_wide) = (&shapes, 0, true);
                    work(set_up);
                }
            }
        }
    }
}

/// First and last column and row of the pixels of a tile that eight boxes may touch.
#[inline(always)]
fn touched_pixels<S: Simd>(simd: S, [x0, x1, y0, y1]: [f32x8<S>; 4]) -> [[u32; LANES]; 4] {
    let (zero, end) = (splat(simd, 0.0), splat(simd, TILE as f32 - 1.0));
    let pixel = |number: f32x8<S>| indices(simd, number.max(zero).min(end));
    [
        pixel((x0 - 1.0).ceil()),
        pixel(x1.floor()),
        pixel((y0 - 1.0).ceil()),
        pixel(y1.floor()),
    ]
}

/// A triangle's functions of the centres of pixels, and what they are off by over a pixel's square.
pub struct Squares<S: Simd> {
    pub a: [f32x8<S>; 3],
    pub b: [f32x8<S>; 3],
    c: [f32x8<S>; 3],
    reach: [f32x8<S>; 3],
    pub step_x: f32x8<S>,
    pub step_y: f32x8<S>,
    first: f32x8<S>,
    reach_of_plane: f32x8<S>,
    pub low: f32x8<S>,
    pub high: f32x8<S>,
    pub rounding: f32x8<S>,
    /// The nearness that is seen, if it may be beyond.
    seen: Option<(f32x8<S>, f32x8<S>)>,
}

/// What it does in the squares of eight pixels in a row.
pub struct InSquares<S: Simd> {
    /// The edges' values and the nearness at their centres.
    pub edges: [f32x8<S>; 3],
    pub plane: f32x8<S>,
    /// Which it may touch, and which it surely covers.
    pub touched: u32,
    pub covered: u32,
    /// Between which nearness it is there.
    pub low: f32x8<S>,
    pub high: f32x8<S>,
}

impl<S: Simd> Squares<S> {
    #[inline(always)]
    pub fn new(simd: S, set_up: &SetUp, (far, near): (f64, f64)) -> Self {
        let (shapes, lane) = (set_up.shapes, set_up.lane);
        let of = |values: &[[f32; LANES]; 3]| {
            [0, 1, 2].each(
                #[inline(always)]
                |i| splat(simd, values[i][lane]),
            )
        };
        let (a, b, c) = (of(&shapes.a), of(&shapes.b), of(&shapes.c));
        let (step_x, step_y) = (
            splat(simd, shapes.step_x[lane]),
            splat(simd, shapes.step_y[lane]),
        );
        Self {
            a,
            b,
            c,
            reach: [0, 1, 2].each(
                #[inline(always)]
                |i| (a[i].abs() + b[i].abs()) * 0.5,
            ),
            step_x,
            step_y,
            first: splat(simd, shapes.first[lane]),
            reach_of_plane: (step_x.abs() + step_y.abs()) * (0.5 + 8.0 * EPSILON),
            low: splat(simd, shapes.low[lane]),
            high: splat(simd, shapes.high[lane]),
            rounding: splat(simd, shapes.rounding[lane] * ROOM),
            seen: set_up
                .is_wide
                .then(|| (splat(simd, far as f32), splat(simd, near as f32))),
        }
    }

    /// Of a block of pixels and a row of the tile.
    #[inline(always)]
    pub fn at(&self, simd: S, bx: usize, row: usize) -> InSquares<S> {
        let x = numbers(simd) + ((bx * BLOCK) as f32 + 0.5);
        let y = splat(simd, row as f32 + 0.5);
        let edges = [0, 1, 2].each(
            #[inline(always)]
            |i| x.mul_add(self.a[i], y.mul_add(self.b[i], self.c[i])),
        );
        let plane = x.mul_add(self.step_x, y.mul_add(self.step_y, self.first));
        let greatest = least([0, 1, 2].each(
            #[inline(always)]
            |i| edges[i] + self.reach[i],
        ));
        let smallest = least([0, 1, 2].each(
            #[inline(always)]
            |i| edges[i] - self.reach[i],
        ));
        let mut touched = splat(simd, -SURE).simd_le(greatest);
        let mut covered = splat(simd, SURE).simd_lt(smallest);
        let low = (plane - self.reach_of_plane).max(self.low).min(self.high) - self.rounding;
        let high = (plane + self.reach_of_plane).max(self.low).min(self.high) + self.rounding;
        if let Some((far, near)) = self.seen {
            touched &= far.simd_le(high) & low.simd_le(near);
            covered &= far.simd_lt(low) & high.simd_lt(near);
        }
        InSquares {
            edges,
            plane,
            touched: touched.to_bitmask() as u32,
            covered: covered.to_bitmask() as u32,
            low,
            high,
        }
    }

    /// The nearness that is seen, where it may be beyond.
    #[inline(always)]
    pub fn seen(&self) -> Option<(f32x8<S>, f32x8<S>)> {
        self.seen
    }
}
