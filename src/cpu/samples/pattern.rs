//! The places of a pixel's samples, for lanes and as cameras of their own.

use super::super::lanes::{LANES, Simd, f32x8, f64x8};
use super::super::view::View;
use crate::camera::Camera;
use fearless_simd::prelude::*;
use glam::DVec2;

/// Samples of a pixel that are drawn together.
pub const MAX_SAMPLES: usize = 64;

/// The same in eights.
pub const MAX_EIGHTS: usize = MAX_SAMPLES / LANES;

/// Places around the centre of a pixel, eight by eight; the last one stands for those that are missing.
pub struct Pattern {
    pub count: usize,
    columns: [[f64; LANES]; MAX_EIGHTS],
    rows: [[f64; LANES]; MAX_EIGHTS],
    /// The same in float32.
    short: [[[f32; LANES]; MAX_EIGHTS]; 2],
    /// Of each sample the camera whose pixels' centres are there, and its view: what float32 leaves open they decide.
    pub cameras: Vec<Camera>,
    pub views: Vec<View>,
}

impl Pattern {
    /// Of at most `MAX_SAMPLES` places, columns and rows from the centre, none farther than half a pixel.
    pub fn new(camera: &Camera, places: &[DVec2]) -> Self {
        let moved = |place: &DVec2| Camera {
            centre: camera.centre - *place,
            ..camera.clone()
        };
        let cameras: Vec<_> = places.iter().map(moved).collect();
        let at = |eight: usize, lane: usize| places[(eight * LANES + lane).min(places.len() - 1)];
        let eights = |axis: usize| {
            std::array::from_fn(|eight| std::array::from_fn(|lane| at(eight, lane)[axis]))
        };
        let short = |axis: usize| eights(axis).map(|eight| eight.map(|v| v as f32));
        Self {
            count: places.len(),
            columns: eights(0),
            rows: eights(1),
            short: [short(0), short(1)],
            views: cameras.iter().map(View::of_camera).collect(),
            cameras,
        }
    }

    /// How many eights there are.
    #[inline(always)]
    pub fn eights(&self) -> usize {
        self.count.div_ceil(LANES)
    }

    /// Which lanes of an eight are samples.
    #[inline(always)]
    pub fn lanes(&self, eight: usize) -> u32 {
        0xff >> (LANES - (self.count - eight * LANES).min(LANES))
    }

    /// Columns and rows of an eight from the pixel's centre.
    #[inline(always)]
    pub fn places<S: Simd>(&self, simd: S, eight: usize) -> [f32x8<S>; 2] {
        let [columns, rows] = &self.short;
        [
            f32x8::simd_from(simd, columns[eight]),
            f32x8::simd_from(simd, rows[eight]),
        ]
    }

    /// The same in float64.
    #[inline(always)]
    pub fn places64<S: Simd>(&self, simd: S, eight: usize) -> [f64x8<S>; 2] {
        [
            f64x8::simd_from(simd, self.columns[eight]),
            f64x8::simd_from(simd, self.rows[eight]),
        ]
    }
}
