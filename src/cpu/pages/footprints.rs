//! Of each receiver the map that it falls in, and how many of its texels a pixel is as large as.
//!
//! Both are measured across their rays, whatever the surface between them: the perspective error is matched, not the one of
//! projection (Lloyd et al., "Warping and partitioning for low error shadow maps", 2006, section 3). A measure on the
//! surface would give neighbours that are turned another way levels of their own, and so pages.

use crate::camera::Rays;
use crate::cpu::lanes::{LANES, Simd, bits, dispatch, f64x8, level, narrow};
use crate::cpu::light_space::LightSpace;
use crate::cpu::receivers::{BlockReceivers, KnownPlanes, Receivers, dot, function_of, splat64};
use crate::cpu::tiles::{BLOCK, TILE, TILE_PIXELS};
use crate::fits::layer::Layer;
use crate::lanes::Each;
use crate::paging::NO_LAYER;
use fearless_simd::prelude::*;
use glam::{DVec3, DVec4};
use rayon::prelude::*;

/// However small a pixel is, a bias reaches the coarsest level in the end.
const LEAST_TEXELS: f32 = 1e-12;

/// Of each pixel, in tiles.
pub struct Footprints {
    /// `NO_LAYER` of those that need none.
    pub maps: Vec<u8>,
    /// The area of a pixel in texels of the map's finest level.
    pub texels: Vec<f32>,
}

/// How many pixels of an image, or texels of a map, there are to a unit of area.
struct Density {
    /// Column, row and w of a place as functions of (point, 1), relative to the eye.
    rows: [DVec4; 3],
    /// How the area of the image grows with column and row times w, and with w.
    parts: [DVec3; 3],
}

impl Density {
    /// With x, y and w the rows, the gradients of column and row are (x - column w) / w and (y - row w) / w; their cross
    /// product, times the normal of a surface, is the density on it.
    fn new(rows: [DVec4; 3]) -> Self {
        let [x, y, w] = rows.each(DVec4::truncate);
        Self {
            rows,
            parts: [y.cross(w), w.cross(x), x.cross(y)],
        }
    }

    /// For rows that are relative to another origin, from which the eye is so far.
    fn moved(rows: [DVec4; 3], eye: DVec3) -> Self {
        let moved = |row: DVec4| row.truncate().extend(row.w + row.truncate().dot(eye));
        Self::new(rows.each(moved))
    }

    /// At points, across rays of any length.
    #[inline(always)]
    fn across<S: Simd>(&self, simd: S, ray: [f64x8<S>; 3], point: &[f64x8<S>; 3]) -> f64x8<S> {
        let places = self.rows.each(|row| function_of(simd, row, point));
        let along = self
            .parts
            .each(|part| dot(ray, part.to_array().each(|v| splat64(simd, v))));
        let w = places[2];
        let sum = dot(places, along) / (w * w * w);
        sum.abs() / dot(ray, ray).sqrt()
    }
}

/// A map, for receivers relative to the eye.
struct Faced {
    space: LightSpace,
    density: Density,
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
    (image, faced): (&Density, &[Faced]),
    tile: usize,
    (maps, texels): (&mut [u8], &mut [f32]),
    planes: &mut KnownPlanes,
) {
    let tiling = receivers.image.tiling;
    let corner = tiling.corner(tile);
    let (width, height) = (tiling.width - corner.0, tiling.height - corner.1);
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
                    let [from_eye, from_light] = rays(simd, receivers, point);
                    let of_map = faced.density.across(simd, from_light, point);
                    let share = of_map / image.across(simd, from_eye, point);
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
    /// Of each pixel the number of its level among those of all maps, one map after the other: the coarsest level whose
    /// texels are no larger than the pixel, and coarser by the bias. `sides` are the levels' texels, the finest first.
    pub fn levels(&self, sides: &[u32], bias: f64) -> Vec<u8> {
        let finest = f64::from(sides[0]);
        let least = sides.iter().skip(1).map(|&side| {
            let width = finest / f64::from(side);
            (width * width / 4_f64.powf(bias)) as f32
        });
        let least: Vec<f32> = least.collect();
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
