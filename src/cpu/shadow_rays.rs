//! Shadow rays: every receiver's own ray to the light, through the scene's hierarchy.
//!
//! The hierarchy finds the triangles near a ray; whether one stands in the way is decided in float64. A pixel
//! asks the triangle that shadowed the pixel before it first.

use super::lanes::{Simd, bits, dispatch, level};
use super::rasterize::{Image, NONE};
use super::receivers::{BlockReceivers, KnownPlanes, Receivers};
use super::tiles::{BLOCK, cut};
use crate::bvh::{Bvh, Search, ThickRay};
use crate::camera::Camera;
use crate::light::Light;
use crate::occlusion::ReceiverRay;
use crate::rounding::FLOAT64_ROUNDING;
use crate::scene::Scene;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// What float64 rounds of where a ray enters a box: a quotient of positions.
pub const RAY_ROUNDING: f64 = 16.0 * FLOAT64_ROUNDING;

/// 1 lit, 0 in shadow, NaN where nothing is seen, row by row; and the number of rays.
pub fn shadow_rays(
    scene: &Scene,
    image: &Image,
    camera: &Camera,
    light: &Light,
    hierarchy: &Bvh,
) -> (Vec<f32>, u64) {
    let from_origin = camera.eye.length() + hierarchy.farthest(camera.eye);
    let rays = ShadowRays {
        receivers: Receivers::new(scene, image, camera, light),
        hierarchy,
        margin: RAY_ROUNDING * from_origin,
    };
    let mut visibility = vec![0.0; image.tiling.width * image.tiling.height];
    let tiles = cut(&mut visibility, image.tiling)
        .into_par_iter()
        .enumerate();
    let count = tiles
        .map_init(KnownPlanes::default, |known, (tile, mut rows)| {
            dispatch!(level(), simd => rays.answer_tile(simd, tile, &mut rows, known))
        })
        .sum();
    (visibility, count)
}

struct ShadowRays<'a> {
    receivers: Receivers<'a>,
    hierarchy: &'a Bvh,
    /// What rounding may have moved a ray by.
    margin: f64,
}

impl ShadowRays<'_> {
    /// Answers the pixels of a tile, and gives the number of rays.
    #[inline(always)]
    fn answer_tile<S: Simd>(
        &self,
        simd: S,
        tile: usize,
        rows: &mut [&mut [f32]],
        known: &mut KnownPlanes,
    ) -> u64 {
        let image = self.receivers.image;
        let corner = image.tiling.corner(tile);
        let mut block = BlockReceivers::none(simd);
        let mut blocker = NONE;
        let mut count = 0;
        for (i, rows) in rows.chunks_mut(BLOCK).enumerate() {
            for x in (0..rows[0].len()).step_by(BLOCK) {
                let (left, top) = (corner.0 + x, corner.1 + i * BLOCK);
                self.receivers
                    .block(simd, (left, top), 0..BLOCK, known, &mut block);
                image.write(rows, x, (left, top), |i| {
                    let mut lit = [0.0; BLOCK];
                    count += u64::from(block.facing[i].count_ones());
                    for j in bits(block.facing[i]) {
                        let pixel = (left + j, top + i);
                        let is_lit = self.is_lit(pixel, block.ids[i][j], &mut blocker);
                        lit[j] = f32::from(u8::from(is_lit));
                    }
                    lit
                });
            }
        }
        count
    }

    /// Casts the ray of a receiver.
    #[inline(never)]
    fn is_lit(&self, pixel: (usize, usize), own: u32, blocker: &mut u32) -> bool {
        let ray = self.receivers.ray(pixel, own);
        let has_end = self.receivers.light.position().is_some();
        is_lit(self.hierarchy, (&ray, has_end), self.margin, blocker)
    }
}

/// Casts a ray, which ends at a light or goes on for ever: first at the triangle that shadowed the ray before.
pub fn is_lit(
    hierarchy: &Bvh,
    (ray, has_end): (&ReceiverRay, bool),
    margin: f64,
    blocker: &mut u32,
) -> bool {
    let blocks = |triangle| ray.is_shadowed_by(triangle);
    if *blocker != NONE && blocks(*blocker) {
        return false;
    }
    let length = ray.to_light.length();
    let thick = ThickRay {
        origin: ray.eye + ray.point,
        direction: ray.to_light / length,
        start: 0.0,
        end: if has_end { length } else { f64::INFINITY },
        margin,
    };
    let mut is_lit = true;
    hierarchy.visit(thick, |triangle| {
        if blocks(triangle) {
            (is_lit, *blocker) = (false, triangle);
            return ControlFlow::Break(());
        }
        ControlFlow::Continue(f64::INFINITY)
    });
    is_lit
}
