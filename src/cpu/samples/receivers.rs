//! Receivers of single samples, in blocks of eight rows of eight.

use super::super::lanes::{LANES, Simd};
use super::super::rasterize::NONE;
use super::super::receivers::{BlockReceivers, KnownPlanes, Receivers, in_cone, splat64};
use super::super::tiles::BLOCK;
use super::pattern::Pattern;
use crate::lanes::Each;
use fearless_simd::prelude::*;

/// Eight samples of a pixel.
#[derive(Debug, Clone, Copy)]
pub struct SampleRow {
    pub pixel: (usize, usize),
    /// Which eight of the pattern.
    pub eight: usize,
}

/// Rows of samples, as many as a block has.
pub struct SampleRows {
    pub rows: [SampleRow; BLOCK],
    pub ids: [[u32; LANES]; BLOCK],
    pub count: usize,
}

impl SampleRows {
    pub const NONE: Self = Self {
        rows: [SampleRow {
            pixel: (0, 0),
            eight: 0,
        }; BLOCK],
        ids: [[NONE; LANES]; BLOCK],
        count: 0,
    };
}

impl Receivers<'_> {
    /// Finds the receivers of samples; `false` where none of them faces the light.
    #[inline(always)]
    pub fn samples<S: Simd>(
        &self,
        simd: S,
        pattern: &Pattern,
        samples: &SampleRows,
        known: &mut KnownPlanes,
        block: &mut BlockReceivers<S>,
    ) -> bool {
        let mut has_any = false;
        block.facing = [0; BLOCK];
        for i in 0..samples.count {
            let ids = samples.ids[i];
            block.ids[i] = ids;
            block.is_one[i] = ids.iter().all(|id| *id == ids[0]);
        }
        self.learn(simd, block, 0..samples.count, known);
        for i in 0..samples.count {
            let Some((normal, height, facing)) = self.planes_of_row(simd, block, i, known) else {
                continue;
            };
            let SampleRow { pixel, eight } = samples.rows[i];
            let [columns, rows] = pattern.places64(simd, eight);
            let (columns, rows) = (columns + pixel.0 as f64, rows + pixel.1 as f64);
            let ray = [0, 1, 2].each(
                #[inline(always)]
                |k| {
                    let at_row =
                        rows.mul_add(splat64(simd, self.row[k]), splat64(simd, self.first[k]));
                    columns.mul_add(splat64(simd, self.column[k]), at_row)
                },
            );
            let point = self.points(simd, ray, normal, height);
            block.points[i] = point;
            block.facing[i] = facing & in_cone(simd, self.light.cone(), self.light_at, &point);
            has_any |= block.facing[i] != 0;
        }
        has_any
    }
}
