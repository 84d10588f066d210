//! Where the light sees the squares of pixels that each see one triangle.
//!
//! From a pixel's square through the triangle's plane to the light's plane goes one homography, P(x) = P + D x / (1 + w x)
//! of the step x from the pixel's centre, so the square's image lies in the parallelogram that D makes of it, larger by
//! 1 / (1 - |w x|). How near the plane is goes the same way, as a third coordinate.

use super::super::lanes::{Simd, f32x8, f64x8, narrow};
use super::super::receivers::{
    BlockReceivers, KnownPlanes, Receivers, ViewFromEye, dot, function_of, row_dot, splat64,
};
use super::super::tiles::BLOCK;
use super::super::view::Nearness;
use crate::camera::Rays;
use crate::lanes::Each;
use crate::light::Cone;
use fearless_simd::prelude::*;
use glam::DVec4;

/// How much |w x| may be at most: beyond it, samples are asked one by one.
const MAX_BEND: f64 = 0.25;

/// What float64 and the step to float32 may take off a parallelogram's sides, as a share.
const GROWTH: f64 = 1.0 + 1e-6;

/// The squares of a block of pixels: their centres, and how these move along columns and rows.
pub struct BlockSquares<S: Simd> {
    /// Of each row, the pixels that a light may reach everywhere, and those of which that is not known.
    pub facing: [u32; BLOCK],
    pub unsure: [u32; BLOCK],
    pub steps: [[[f64x8<S>; 3]; 2]; BLOCK],
    /// The two coordinates of w.
    pub bends: [[f64x8<S>; 2]; BLOCK],
}

/// Where a view sees them: a parallelogram around a middle, each with column, row and nearness.
pub struct BlockFootprints<S: Simd> {
    pub middle: [[f32x8<S>; 3]; BLOCK],
    /// From the middle half along two of its sides.
    pub sides: [[[f32x8<S>; 3]; 2]; BLOCK],
    /// Those that there are.
    pub known: [u32; BLOCK],
}

impl<S: Simd> BlockSquares<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let zero = splat64(simd, 0.0);
        Self {
            facing: [0; BLOCK],
            unsure: [0; BLOCK],
            steps: [[[zero; 3]; 2]; BLOCK],
            bends: [[zero; 2]; BLOCK],
        }
    }
}

impl<S: Simd> BlockFootprints<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let zero = f32x8::simd_from(simd, 0.0);
        Self {
            middle: [[zero; 3]; BLOCK],
            sides: [[[zero; 3]; 2]; BLOCK],
            known: [0; BLOCK],
        }
    }
}

impl Receivers<'_> {
    /// Finds the squares of those pixels of a block that are asked for, by their triangles in `block`; `false` where no light
    /// reaches any.
    #[inline(always)]
    pub fn squares<S: Simd>(
        &self,
        simd: S,
        (x, y): (usize, usize),
        asked: &[u32; BLOCK],
        known: &mut KnownPlanes,
        block: &mut BlockReceivers<S>,
        squares: &mut BlockSquares<S>,
    ) -> bool {
        let columns = f64x8::simd_from(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) + x as f64;
        let mut has_any = false;
        self.learn(simd, block, 0..BLOCK, known);
        for (i, &asked) in asked.iter().enumerate() {
            (squares.facing[i], squares.unsure[i]) = (0, 0);
            if asked == 0 {
                continue;
            }
            let Some((normal, height, facing)) = self.planes_of_row(simd, block, i, known) else {
                continue;
            };
            let at_row = self.first + self.row * (y + i) as f64;
            let ray = [0, 1, 2].each(
                #[inline(always)]
                |k| columns.mul_add(splat64(simd, self.column[k]), splat64(simd, at_row[k])),
            );
            let point = self.points(simd, ray, normal, height);
            block.points[i] = point;
            self.steps(simd, i, (ray, normal, height), &point, squares);
            let [sure, unsure] = self.reached(simd, &point, &squares.steps[i], &squares.bends[i]);
            (squares.facing[i], squares.unsure[i]) =
                (asked & facing & sure, asked & facing & unsure);
            has_any |= asked & facing & (sure | unsure) != 0;
        }
        has_any
    }

    /// How the points of a row move along columns and rows.
    #[inline(always)]
    fn steps<S: Simd>(
        &self,
        simd: S,
        i: usize,
        (ray, normal, height): ([f64x8<S>; 3], [f64x8<S>; 3], f64x8<S>),
        point: &[f64x8<S>; 3],
        squares: &mut BlockSquares<S>,
    ) {
        for (k, axis) in [self.column, self.row].into_iter().enumerate() {
            let axis = axis.to_array().each(
                #[inline(always)]
                |v| splat64(simd, v),
            );
            let (step, bend) = match self.camera.rays {
                Rays::Perspective => {
                    let along = row_dot(ray, normal);
                    let (depth, bend) = (height / along, row_dot(axis, normal) / along);
                    let step = [0, 1, 2].each(
                        #[inline(always)]
                        |j| axis[j] * depth - point[j] * bend,
                    );
                    (step, bend)
                }
                Rays::Orthographic => {
                    let forward = self.camera.forward.to_array().each(
                        #[inline(always)]
                        |v| splat64(simd, v),
                    );
                    let further = row_dot(axis, normal) / row_dot(forward, normal);
                    let step = [0, 1, 2].each(
                        #[inline(always)]
                        |j| axis[j] - forward[j] * further,
                    );
                    (step, splat64(simd, 0.0))
                }
            };
            (squares.steps[i][k], squares.bends[i][k]) = (step, bend);
        }
    }

    /// Which squares are wholly within the light's cone, and of which that is not known. How far a point is within the cone
    /// changes by no more than the point moves.
    #[inline(always)]
    fn reached<S: Simd>(
        &self,
        simd: S,
        point: &[f64x8<S>; 3],
        steps: &[[f64x8<S>; 3]; 2],
        bends: &[f64x8<S>; 2],
    ) -> [u32; 2] {
        let Some(Cone {
            axis, sine, cosine, ..
        }) = self.light.cone()
        else {
            return [0xff, 0];
        };
        let from_light = [0, 1, 2].each(
            #[inline(always)]
            |k| point[k] - splat64(simd, self.light_at[k]),
        );
        let axis = axis.to_array().each(
            #[inline(always)]
            |v| splat64(simd, v),
        );
        let along = dot(from_light, axis);
        let aside = [0, 1, 2].each(
            #[inline(always)]
            |k| from_light[k] - axis[k] * along,
        );
        let within = along * splat64(simd, sine) - dot(aside, aside).sqrt() * splat64(simd, cosine);
        // Twice the half, for the bend and for rounding.
        let reach = dot(steps[0], steps[0]).sqrt() + dot(steps[1], steps[1]).sqrt();
        let bend = bends[0].abs().max(bends[1].abs());
        let is_flat = bend.simd_lt(splat64(simd, MAX_BEND));
        let inside = (is_flat & reach.simd_lt(within)).to_bitmask() as u32;
        let outside = (is_flat & within.simd_lt(-reach)).to_bitmask() as u32;
        [inside, 0xff & !(inside | outside)]
    }
}

impl ViewFromEye {
    /// The footprints of some pixels.
    #[inline(always)]
    pub fn footprints<S: Simd>(
        &self,
        simd: S,
        block: &BlockReceivers<S>,
        squares: &BlockSquares<S>,
        masks: &[u32; BLOCK],
        footprints: &mut BlockFootprints<S>,
    ) {
        let one = splat64(simd, 1.0);
        for (i, &mask) in masks.iter().enumerate() {
            footprints.known[i] = 0;
            if mask == 0 {
                continue;
            }
            let point = &block.points[i];
            let inverse = match self.is_parallel {
                true => one,
                false => one / function_of(simd, self.rows[2], point),
            };
            let near = match self.nearness {
                Nearness::Inverse => DVec4::W,
                Nearness::Linear(row) => row,
            };
            let rows = [self.rows[0], self.rows[1], near];
            let middle = rows.each(
                #[inline(always)]
                |row| function_of(simd, row, point) * inverse,
            );
            let mut bend = splat64(simd, 0.0);
            let mut sides = [[splat64(simd, 0.0); 3]; 2];
            let mut is_known = splat64(simd, 0.0).simd_lt(inverse);
            for (k, sides) in sides.iter_mut().enumerate() {
                let step = &squares.steps[i][k];
                let along = match self.is_parallel {
                    true => splat64(simd, 0.0),
                    false => linear_part(simd, self.rows[2], step) * inverse,
                };
                *sides = [0, 1, 2].each(
                    #[inline(always)]
                    |j| linear_part(simd, rows[j], step) * inverse - middle[j] * along,
                );
                let own = squares.bends[i][k];
                bend += (along + own).abs();
                // The plane's own points must stay on one side of the eye, too.
                is_known &= own.abs().simd_lt(splat64(simd, MAX_BEND));
            }
            is_known &= bend.simd_lt(splat64(simd, 2.0 * MAX_BEND));
            let half = splat64(simd, 0.5 * GROWTH) / (one - bend * splat64(simd, 0.5));
            footprints.middle[i] = middle.each(narrow);
            footprints.sides[i] = sides.each(
                #[inline(always)]
                |side| {
                    side.each(
                        #[inline(always)]
                        |v| narrow(v * half),
                    )
                },
            );
            footprints.known[i] = mask & is_known.to_bitmask() as u32;
        }
    }
}

/// What a linear function of (point, 1) adds along a step.
#[inline(always)]
fn linear_part<S: Simd>(simd: S, row: DVec4, step: &[f64x8<S>; 3]) -> f64x8<S> {
    let row = row.truncate().to_array().each(
        #[inline(always)]
        |v| splat64(simd, v),
    );
    row_dot(row, *step)
}
