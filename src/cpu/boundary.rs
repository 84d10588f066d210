//! Weights of the receivers near the boundaries of shadows, as `shaders/boundary.wgsl`.

use super::importance_map::Words;
use super::lanes::{Simd, bits, dispatch, level};
use super::receivers::Receivers;
use super::tiles::BLOCK;
use crate::importance::{BOUNDARY_BLOCK, Grid};
use rayon::prelude::*;

const SIDE: usize = BOUNDARY_BLOCK as usize;

/// What a block of pixels holds.
const LIT: u8 = 1;
const SHADOWED: u8 = 2;

/// Of each block of the image `weight` where it or a neighbour holds a boundary of the visibility image, else 1.
pub fn boundary(receivers: &Receivers, visibility: &[f32], weight: f64) -> Grid<Words> {
    let tiling = receivers.image.tiling;
    let (columns, rows) = (tiling.width.div_ceil(SIDE), tiling.height.div_ceil(SIDE));
    let mut marks = vec![0; columns * rows];
    let of_rows = marks.par_chunks_mut(columns * (BLOCK / SIDE)).enumerate();
    of_rows.for_each(|(i, marks)| {
        dispatch!(level(), simd => mark(simd, receivers, visibility, i * BLOCK, columns, marks));
    });
    let mut weights: Words = vec![0; columns * rows];
    let of_rows = weights.par_chunks_mut(columns).enumerate();
    of_rows.for_each(|(y, weights)| {
        for (x, value) in weights.iter_mut().enumerate() {
            let mut found = 0;
            for near in y.saturating_sub(1)..(y + 2).min(rows) {
                let row = &marks[near * columns..][..columns];
                let beside = &row[x.saturating_sub(1)..(x + 2).min(columns)];
                found |= beside.iter().fold(0, |found, mark| found | mark);
            }
            let is_near = found == LIT | SHADOWED;
            *value = (if is_near { weight as f32 } else { 1.0 }).to_bits();
        }
    });
    Grid {
        values: weights,
        columns: columns as u32,
        rows: rows as u32,
    }
}

/// Marks the blocks of a few rows of the image from `y` on.
#[inline(always)]
fn mark<S: Simd>(
    simd: S,
    receivers: &Receivers,
    visibility: &[f32],
    y: usize,
    columns: usize,
    marks: &mut [u8],
) {
    let width = receivers.image.tiling.width;
    receivers.each_block(
        simd,
        y,
        #[inline(always)]
        |x, block| {
            for (i, &facing) in block.facing.iter().enumerate() {
                for lane in bits(facing) {
                    let is_lit = visibility[(y + i) * width + x + lane] > 0.5;
                    marks[i / SIDE * columns + (x + lane) / SIDE] |=
                        if is_lit { LIT } else { SHADOWED };
                }
            }
        },
    );
}
