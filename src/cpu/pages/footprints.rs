//! Of each receiver the map that it falls in, and how many of its texels a pixel is as large as.

use crate::camera::Rays;
use crate::cpu::lanes::{LANES, Simd, bits, dispatch, f64x8, level, narrow};
use crate::cpu::light_space::LightSpace;
use crate::cpu::receivers::{BlockReceivers, KnownPlanes, Receivers, splat64};
use crate::cpu::tiles::{BLOCK, TILE, TILE_PIXELS};
use crate::fits::layer::Layer;
use crate::lanes::Each;
use crate::lanes::V3;
use crate::paging::footprint::{Density, texels_of_pixel};
use crate::paging::{LEAST_TEXELS, NO_LAYER, least_texels};
use glam::DVec3;
use rayon::prelude::*;

/// Of each pixel, in tiles.
pub struct Footprints {
    /// `NO_LAYER` of those that need none.
    pub maps: Vec<u8>,
    /// The area of a pixel in texels of the map's finest level.
    pub texels: Vec<f32>,
}

/// A map, for receivers relative to the eye.
struct Faced {
    space: LightSpace,
    density: Density<f64>,
}

/// A receiver where several maps meet is in the first one of them.
pub fn footprints(receivers: &Receivers, maps: &[Layer]) -> Footprints {
    let image = Density::new(receivers.camera.image_rows());
    let faced = maps.iter().map(|layer| {
        let projection = &layer.projection;
        let rows = projection.homogeneous_rows();
        let rows = rows.expect("it has a light matrix");
        Faced {
            space: LightSpace::new(layer, receivers),
            density: Density::moved(rows, receivers.eye - projection.origin),
        }
    });
    let faced: Vec<_> = faced.collect();
    let pixels = receivers.image.triangles.len();
    let mut found = Footprints {
        maps: vec![NO_LAYER; pixels],
        texels: vec![0.0; pixels],
    };
    let tiles = found.maps.par_chunks_mut(TILE_PIXELS);
    let tiles = tiles.zip(found.texels.par_chunks_mut(TILE_PIXELS));
    let known = KnownPlanes::default;
    tiles.enumerate().for_each_init(known, |known, (tile, found)| {
        dispatch!(level(), simd => of_tile(simd, receivers, (&image, &faced), tile, found, known));
    });
    found
}

#[inline(always)]
fn of_tile<S: Simd>(
    simd: S,
    receivers: &Receivers,
    (image, faced): (&Density<f64>, &[Faced]),
    tile: usize,
    (maps, texels): (&mut [u8], &mut [f32]),
    planes: &mut KnownPlanes,
) {
    let tiling = receivers.image.tiling;
    let corner = tiling.corner(tile);
    let (width, height) = (tiling.width - corner.0, tiling.height - corner.1);
    let zero = splat64(simd, 0.0);
    let image = image.in_lanes(zero);
    let mut block = BlockReceivers::none(simd);
    for y in (0..TILE.min(height)).step_by(BLOCK) {
        for x in (0..TILE.min(width)).step_by(BLOCK) {
            let pixel = (corner.0 + x, corner.1 + y);
            if !receivers.block(simd, pixel, 0..BLOCK, planes, &mut block) {
                continue;
            }
            let mut left = block.facing;
            for (number, faced) in faced.iter().enumerate() {
                let masks = faced.space.masks(simd, &block);
                for i in 0..BLOCK {
                    let mask = masks[i] & left[i];
                    if mask == 0 {
                        continue;
                    }
                    left[i] &= !mask;
                    let point = &block.points[i];
                    let densities = [&image, &faced.density.in_lanes(zero)];
                    let rays = rays(simd, receivers, point).each(vector);
                    let share = texels_of_pixel(densities, rays, vector(*point));
                    let share: [f32; LANES] = narrow(share).into();
                    let first = (y + i) * TILE + x;
                    for lane in bits(mask) {
                        maps[first + lane] = number as u8;
                        texels[first + lane] = share[lane];
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn vector<S: Simd>([x, y, z]: [f64x8<S>; 3]) -> V3<f64x8<S>> {
    V3 { x, y, z }
}

/// Of the camera and of the light, to points relative to the eye.
#[inline(always)]
fn rays<S: Simd>(simd: S, receivers: &Receivers, point: &[f64x8<S>; 3]) -> [[f64x8<S>; 3]; 2] {
    let all = |v: DVec3| v.to_array().each(|v| splat64(simd, v));
    let from_eye = match receivers.camera.rays {
        Rays::Perspective => *point,
        Rays::Orthographic => all(receivers.camera.forward),
    };
    let light_at = all(receivers.light_at);
    let from_light = match receivers.light.position() {
        Some(_) => [0, 1, 2].each(|k| point[k] - light_at[k]),
        None => light_at,
    };
    [from_eye, from_light]
}

impl Footprints {
    /// Of each pixel the number of its level among those of all maps, one map after the other; see `least_texels`.
    pub fn levels(&self, sides: &[u32], bias: f64) -> Vec<u8> {
        let least = least_texels(sides, bias);
        let count = sides.len() as u8;
        let pixels = self.maps.par_iter().zip(&self.texels);
        let level = |(&map, &texels): (&u8, &f32)| {
            if map == NO_LAYER {
                return NO_LAYER;
            }
            let texels = texels.max(LEAST_TEXELS);
            let level = least.iter().map(|least| u8::from(*least <= texels));
            map * count + level.sum::<u8>()
        };
        pixels.map(level).collect()
    }
}
