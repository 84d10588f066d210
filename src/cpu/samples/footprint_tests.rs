//! The footprints of whole pixels against the triangles in the cells of the light's grid that they touch.
//!
//! A linear function over a parallelogram is within the sum of what its two half sides add, so one test of a triangle
//! answers for all samples of a pixel: all in shadow, none of them by this triangle, or open. Frusta that a receiver's
//! pixel makes with the light are tested so by Wyman, Hoetzlein and Lefohn ("Frustum-traced raster shadows: revisiting
//! irregular z-buffers", I3D 2015, section 4), there triangle by triangle against each pixel's samples.

use super::super::caster_tests::{Known, KnownShapes, Tests, own_lanes};
use super::super::holes::Holes;
use super::super::lanes::{EPSILON, LANES, Simd, bits, f32x8, f32x16, mask_bits, splat};
use super::super::light_grid::{CELL, Cell, GRID, GRID_CELLS, Group, LightGrid};
use super::super::receivers::{BlockReceivers, masks_of_views};
use super::super::row_boxes::{RowBoxes, least_within};
use super::super::shapes::Shapes;
use super::super::tiles::BLOCK;
use super::footprints::{BlockFootprints, BlockSquares};
use crate::lanes::Each;
use fearless_simd::prelude::*;
use glam::DVec2;

/// Units of the grid that a footprint reaches from its middle, at most: then it is in two cells along an axis, and no farther
/// from the middle of either than shapes are sure of.
const MAX_REACH: f32 = 0.5 * CELL as f32;

/// What rounding may do to the sides of a footprint's box.
const ROOM: f32 = 4.0 * EPSILON * GRID as f32;

/// Of what is sure half a unit is for the rounding here, as in `Shapes::blocks`.
const SURE: f32 = 1.5;

/// The pixels of a block that are lit wherever a sample is, and those whose samples are to be asked; the others are in shadow.
pub struct Decided {
    pub lit: [u32; BLOCK],
    pub open: [u32; BLOCK],
}

/// Footprints in a grid, two rows of them together, and the boxes around them.
struct InGrid<'a, S: Simd> {
    grid: &'a LightGrid,
    ids: &'a [[u32; LANES]; BLOCK],
    middle: [[f32x16<S>; 3]; BLOCK / 2],
    sides: [[[f32x16<S>; 3]; 2]; BLOCK / 2],
    /// Least and greatest column and row of each, and how near it is where it is farthest.
    boxes: [[f32x8<S>; 4]; BLOCK],
    farthest: [f32x8<S>; BLOCK],
    /// The pixels that no triangle certainly shadows, and those that one may.
    left: [u32; BLOCK],
    maybe: [u32; BLOCK],
}

/// What is in one cell.
struct InCell<S: Simd> {
    /// The pixels of each row.
    within: [u32; BLOCK],
    boxes: RowBoxes<8>,
    /// The middle of the cell.
    origin: [f32; 2],
    u: [f32x16<S>; BLOCK / 2],
    v: [f32x16<S>; BLOCK / 2],
}

impl Tests<'_> {
    /// Decides the pixels of a block whose squares the light may reach.
    #[inline(always)]
    pub fn footprints<S: Simd>(
        &self,
        simd: S,
        block: &mut BlockReceivers<S>,
        squares: &BlockSquares<S>,
        footprints: &mut BlockFootprints<S>,
        known: &mut Known,
    ) -> Decided {
        block.facing = squares.facing;
        let mut masks = masks_of_views(simd, self.light_at, block, self.views.len());
        let mut decided = Decided {
            lit: [0; BLOCK],
            open: squares.unsure,
        };
        for (grids, left) in self.grids.iter().zip(&mut masks) {
            for fitted in grids {
                if *left == [0; BLOCK] {
                    break;
                }
                let view = &fitted.view;
                view.footprints(simd, block, squares, left, footprints);
                let mut seen = InGrid::new(&fitted.grid, &block.ids, footprints);
                let within = seen.within(simd, &footprints.known);
                self.footprints_in_grid(simd, &mut seen, &within, &mut known.shapes);
                for i in 0..BLOCK {
                    let is_open = seen.left[i] & seen.maybe[i];
                    decided.open[i] |= is_open;
                    decided.lit[i] |= seen.left[i] & !is_open;
                    left[i] &= !within[i];
                }
            }
            for (open, left) in decided.open.iter_mut().zip(left) {
                *open |= *left;
            }
        }
        decided
    }

    #[inline(always)]
    fn footprints_in_grid<S: Simd>(
        &self,
        simd: S,
        seen: &mut InGrid<S>,
        within: &[u32; BLOCK],
        known: &mut KnownShapes,
    ) {
        seen.left = *within;
        // Each pixel is in the cells that the corners of its box are in.
        let mut cells = [[splat(simd, 0.0); BLOCK]; 4];
        let mut pending = [[0; BLOCK]; 4];
        for (i, &within) in within.iter().enumerate() {
            if within == 0 {
                continue;
            }
            let [u0, u1, v0, v1] = seen.boxes[i].each(
                #[inline(always)]
                |side| {
                    let last = splat(simd, GRID_CELLS as f32 - 1.0);
                    (side * (1.0 / CELL as f32))
                        .floor()
                        .max(splat(simd, 0.0))
                        .min(last)
                },
            );
            let (many_u, many_v) = (!mask_bits(u0.simd_eq(u1)), !mask_bits(v0.simd_eq(v1)));
            let number = |u: f32x8<S>, v: f32x8<S>| v * GRID_CELLS as f32 + u;
            let corners = [
                (number(u0, v0), within),
                (number(u1, v0), within & many_u),
                (number(u0, v1), within & many_v),
                (number(u1, v1), within & many_u & many_v),
            ];
            for (k, (cell, mask)) in corners.into_iter().enumerate() {
                (cells[k][i], pending[k][i]) = (cell, mask);
            }
        }
        for k in 0..4 {
            while let Some(row) = (0..BLOCK).find(|&i| pending[k][i] != 0) {
                let cell = cells[k][row][pending[k][row].trailing_zeros() as usize];
                let mut in_cell = [0; BLOCK];
                for (cells, pending) in cells[k..].iter().zip(&mut pending[k..]) {
                    for i in 0..BLOCK {
                        let same = pending[i] & mask_bits(cells[i].simd_eq(splat(simd, cell)));
                        pending[i] &= !same;
                        in_cell[i] |= same & seen.left[i];
                    }
                }
                if in_cell != [0; BLOCK] {
                    self.footprints_in_cell(simd, seen, cell as usize, in_cell, known);
                }
            }
        }
    }

    #[inline(always)]
    fn footprints_in_cell<S: Simd>(
        &self,
        simd: S,
        seen: &mut InGrid<S>,
        number: usize,
        within: [u32; BLOCK],
        known: &mut KnownShapes,
    ) {
        // Samples are tested in its finer grid one by one.
        if seen.grid.crowds.of_cell(number).is_some() {
            for (maybe, within) in seen.maybe.iter_mut().zip(within) {
                *maybe |= within;
            }
            return;
        }
        let (column, row) = (number % GRID_CELLS, number / GRID_CELLS);
        let Cell { heads, groups } = seen.grid.cell(column, row);
        let origin = [column, row].map(|i| (i * CELL + CELL / 2) as f32);
        let mut in_cell = InCell::new(simd, seen, within, origin);
        for head in heads {
            for place in bits(head.meets(simd, in_cell.boxes.sides, in_cell.boxes.limit)) {
                let group = &groups[head.ids[place] as usize];
                let met = group.meets(simd, in_cell.boxes.sides, in_cell.boxes.limit);
                if met != 0 {
                    self.footprints_of_group(simd, seen, (group, met), &mut in_cell, known);
                    if in_cell.boxes.limit == f32::INFINITY {
                        return;
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn footprints_of_group<S: Simd>(
        &self,
        simd: S,
        seen: &mut InGrid<S>,
        (group, met): (&Group, u32),
        in_cell: &mut InCell<S>,
        known: &mut KnownShapes,
    ) {
        let (scene, origin) = (self.scene, in_cell.origin);
        let (shapes, met) = known.of_group(simd, (scene, seen.grid), (group, met), origin);
        let sides = in_cell.boxes.sides_from(origin);
        for lane in bits(met & shapes.may_hide(simd, sides, in_cell.boxes.limit)) {
            let rows = in_cell.boxes.rows(simd, group, lane);
            let middle = DVec2::from(origin.map(f64::from));
            let id = group.ids[lane];
            let has_holes = scene.mask_of(id).is_some()
                && Holes::new(&seen.grid.view, scene, id, middle).is_some();
            let triangle = (shapes, lane, id, has_holes);
            if test_triangle(simd, seen, triangle, rows, in_cell) {
                in_cell.boxes.set_limit();
                if in_cell.boxes.limit == f32::INFINITY {
                    return;
                }
            }
        }
    }
}

/// Tests rows of footprints against a triangle; whether some went into shadow.
#[inline(always)]
fn test_triangle<S: Simd>(
    simd: S,
    seen: &mut InGrid<S>,
    (shapes, lane, id, has_holes): (&Shapes, usize, u32, bool),
    rows: u32,
    in_cell: &mut InCell<S>,
) -> bool {
    let mut has_changed = false;
    for row in bits((rows | rows >> 1) & 0x55) {
        let within = in_cell.within[row] | in_cell.within[row + 1] << LANES;
        if within == 0 {
            continue;
        }
        let pair = row / 2;
        let place = [in_cell.u[pair], in_cell.v[pair], seen.middle[pair][2]];
        let (hit, maybe) = shapes.test_footprints(simd, lane, place, &seen.sides[pair]);
        let met = (hit | maybe) & within;
        if met == 0 {
            continue;
        }
        let others = met
            & !own_lanes(
                simd,
                &seen.ids.as_flattened()[row * LANES..][..2 * LANES],
                id,
            );
        let hit = if has_holes { 0 } else { hit & others };
        for (row, hit, maybe) in [
            (row, hit & 0xff, others & 0xff),
            (row + 1, hit >> LANES, others >> LANES),
        ] {
            seen.maybe[row] |= maybe;
            if hit != 0 {
                seen.left[row] &= !hit;
                in_cell.leave(simd, row, hit, seen.farthest[row]);
                has_changed = true;
            }
        }
    }
    has_changed
}

impl<'a, S: Simd> InGrid<'a, S> {
    #[inline(always)]
    fn new(
        grid: &'a LightGrid,
        ids: &'a [[u32; LANES]; BLOCK],
        footprints: &BlockFootprints<S>,
    ) -> Self {
        let BlockFootprints { middle, sides, .. } = footprints;
        let both = |a: &[f32x8<S>; 3], b: &[f32x8<S>; 3]| {
            [0, 1, 2].each(
                #[inline(always)]
                |k| a[k].combine(b[k]),
            )
        };
        let reach = |i: usize, k: usize| sides[i][0][k].abs() + sides[i][1][k].abs();
        Self {
            grid,
            ids,
            middle: [0, 1, 2, 3].each(
                #[inline(always)]
                |pair| both(&middle[2 * pair], &middle[2 * pair + 1]),
            ),
            sides: [0, 1, 2, 3].each(
                #[inline(always)]
                |pair| {
                    [0, 1].each(
                        #[inline(always)]
                        |k| both(&sides[2 * pair][k], &sides[2 * pair + 1][k]),
                    )
                },
            ),
            boxes: std::array::from_fn(
                #[inline(always)]
                |i| {
                    let ([u, v, _], reach_u, reach_v) =
                        (middle[i], reach(i, 0) + ROOM, reach(i, 1) + ROOM);
                    [u - reach_u, u + reach_u, v - reach_v, v + reach_v]
                },
            ),
            farthest: std::array::from_fn(
                #[inline(always)]
                |i| middle[i][2] - reach(i, 2),
            ),
            left: [0; BLOCK],
            maybe: [0; BLOCK],
        }
    }

    /// The footprints that are wholly within the grid, and in few of its cells.
    #[inline(always)]
    fn within(&self, simd: S, known: &[u32; BLOCK]) -> [u32; BLOCK] {
        let (low, high) = (splat(simd, 0.0), splat(simd, GRID as f32));
        let mut within = *known;
        for (within, [u0, u1, v0, v1]) in within.iter_mut().zip(self.boxes) {
            let size = splat(simd, 2.0 * MAX_REACH);
            let is_small = (u1 - u0).max(v1 - v0).simd_le(size);
            *within &= mask_bits(is_small & low.simd_le(u0.min(v0)) & u1.max(v1).simd_le(high));
        }
        within
    }
}

impl<S: Simd> InCell<S> {
    #[inline(always)]
    fn new(simd: S, seen: &InGrid<S>, within: [u32; BLOCK], origin: [f32; 2]) -> Self {
        let zero = f32x16::splat(simd, 0.0);
        let mut in_cell = Self {
            within,
            boxes: RowBoxes::EMPTY,
            origin,
            u: [zero; BLOCK / 2],
            v: [zero; BLOCK / 2],
        };
        for (i, &within) in within.iter().enumerate() {
            if within == 0 {
                continue;
            }
            let [u0, u1, v0, v1] = seen.boxes[i];
            let sides = [
                least_within(simd, u0, within),
                -least_within(simd, -u1, within),
                least_within(simd, v0, within),
                -least_within(simd, -v1, within),
            ];
            let farthest = least_within(simd, seen.farthest[i], within);
            in_cell.boxes.set(i, sides, farthest);
        }
        for pair in 0..BLOCK / 2 {
            in_cell.u[pair] = seen.middle[pair][0] - origin[0];
            in_cell.v[pair] = seen.middle[pair][1] - origin[1];
        }
        in_cell.boxes.set_sides(simd);
        in_cell.boxes.set_limit();
        in_cell
    }

    #[inline(always)]
    fn leave(&mut self, simd: S, row: usize, shadowed: u32, farthest: f32x8<S>) {
        self.within[row] &= !shadowed;
        let farthest = least_within(simd, farthest, self.within[row]);
        self.boxes.set_farthest(row, farthest);
    }
}

impl Shapes {
    /// Which of sixteen footprints are certainly behind a triangle everywhere, and which may be somewhere.
    #[inline(always)]
    pub fn test_footprints<S: Simd>(
        &self,
        simd: S,
        lane: usize,
        [u, v, nearness]: [f32x16<S>; 3],
        sides: &[[f32x16<S>; 3]; 2],
    ) -> (u32, u32) {
        let constant = |value: f32| f32x16::splat(simd, value);
        // What a linear function adds over a footprint.
        let spread = |a: f32, b: f32| {
            sides.each(
                #[inline(always)]
                |[u, v, _]| u.mul_add(constant(a), v * constant(b)),
            )
        };
        let mut least = constant(f32::INFINITY);
        let mut greatest = constant(f32::INFINITY);
        for i in 0..3 {
            let (a, b, c) = (self.a[i][lane], self.b[i][lane], self.c[i][lane]);
            let e = u.mul_add(constant(a), v.mul_add(constant(b), constant(c)));
            let [p, q] = spread(a, b);
            let reach = p.abs() + q.abs();
            least = least.min(e - reach);
            greatest = greatest.min(e + reach);
        }
        let (low, high, rounding) = (self.low[lane], self.high[lane], self.rounding[lane]);
        let depth = sides[0][2].abs() + sides[1][2].abs();
        let mut nearest = (constant(high) - nearness) + depth;
        let mut farthest = (constant(low) - nearness) - depth;
        // Else the plane is less well known than its corners.
        if rounding < high - low {
            let (x, y) = (self.step_x[lane], self.step_y[lane]);
            let plane = u.mul_add(
                constant(x),
                v.mul_add(constant(y), constant(self.first[lane])),
            );
            let [p, q] = spread(x, y);
            let reach = (p - sides[0][2]).abs() + (q - sides[1][2]).abs();
            let before = plane - nearness;
            nearest = nearest.min(before + reach);
            farthest = farthest.max(before - reach);
        }
        let room = nearness.abs() * (8.0 * EPSILON) + 2.0 * rounding;
        let hit = constant(SURE).simd_lt(least) & room.simd_lt(farthest);
        let maybe = constant(-SURE).simd_le(greatest) & (-room).simd_le(nearest);
        (hit.to_bitmask() as u32, maybe.to_bitmask() as u32)
    }
}
