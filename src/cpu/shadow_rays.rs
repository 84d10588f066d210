//! Shadow rays: every receiver's own ray to the light, through the scene's hierarchy.
//!
//! The rays of a block of pixels go through the hierarchy together (Wald, Slusallek, Benthin and Wagner, "Interactive
//! rendering with coherent ray tracing", 2001): as one ray with a box around it, which holds them all. A packet that meets
//! many triangles is halved, and a ray that is left alone goes on its own. The triangles that shadowed the packet before are
//! asked first. The hierarchy finds triangles; whether one stands in the way is decided as in `candidates`, and in float64
//! where float32 is not sure.

use super::candidates::{Candidates, PlacedBlock};
use super::exact::views;
use super::extents::sampled_extents;
use super::lanes::{Simd, bits, dispatch, level, mask_bits, splat};
use super::light_grid::fitted;
use super::rasterize::{Image, NONE};
use super::receivers::{
    BlockPlaces, BlockReceivers, KnownPlanes, Receivers, ViewFromEye, masks_of_views, splat64,
};
use super::tiles::{BLOCK, cut};
use super::view::{Place, View};
use crate::bvh::{Bvh, Search, ThickRay};
use crate::camera::Camera;
use crate::lanes::Each;
use crate::light::Light;
use crate::occlusion::ReceiverRay;
use crate::rounding::FLOAT64_ROUNDING;
use crate::scene::Scene;
use fearless_simd::{mask64x8, prelude::*};
use glam::DVec3;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// What float64 rounds of where a ray enters a box: a quotient of positions.
pub const RAY_ROUNDING: f64 = 16.0 * FLOAT64_ROUNDING;

/// Triangles that a packet may meet before it is halved.
const MANY: usize = 64;

/// Rays that are not cast together: fewer are quicker alone.
const FEW: u32 = 4;

/// Triangles that shadowed receivers before, and are asked first.
const BLOCKERS: usize = 8;

/// 1 lit, 0 in shadow, NaN where nothing is seen, row by row; and the number of rays.
pub fn shadow_rays(
    scene: &Scene,
    image: &Image,
    camera: &Camera,
    light: &Light,
    hierarchy: &Bvh,
) -> (Vec<f32>, u64) {
    let from_origin = camera.eye.length() + hierarchy.farthest(camera.eye);
    let receivers = Receivers::new(scene, image, camera, light);
    let views = views(light, scene.bounds());
    let from_eye = |view: &View| ViewFromEye::new(view, receivers.eye);
    let seen: Vec<_> = views.iter().map(from_eye).collect();
    let extents = sampled_extents(&receivers, &seen, 1);
    let placed = views.iter().zip(&extents).map(|(view, extent)| {
        let view = (!extent.is_empty()).then(|| fitted(view, extent))?;
        Some(PlacedView {
            vertices: view.places(scene),
            seen: from_eye(&view),
            view,
        })
    });
    let rays = ShadowRays {
        views: placed.collect(),
        receivers,
        hierarchy,
        margin: RAY_ROUNDING * from_origin,
    };
    let mut visibility = vec![0.0; image.tiling.width * image.tiling.height];
    let tiles = cut(&mut visibility, image.tiling)
        .into_par_iter()
        .enumerate();
    let count = tiles
        .map_init(Known::default, |known, (tile, mut rows)| {
            dispatch!(level(), simd => rays.answer_tile(simd, tile, &mut rows, known))
        })
        .sum();
    (visibility, count)
}

/// What the light sees, where it saw receivers.
struct PlacedView {
    view: View,
    seen: ViewFromEye,
    vertices: Vec<Place>,
}

struct ShadowRays<'a> {
    views: Vec<Option<PlacedView>>,
    receivers: Receivers<'a>,
    hierarchy: &'a Bvh,
    /// What rounding may have moved a ray by.
    margin: f64,
}

/// What a thread keeps from block to block.
struct Known {
    planes: KnownPlanes,
    blockers: [u32; BLOCKERS],
    next: usize,
    /// Room for triangles, and for packets.
    met: Vec<u32>,
    packets: Vec<[u32; BLOCK]>,
}

impl Default for Known {
    fn default() -> Self {
        Self {
            planes: KnownPlanes::default(),
            blockers: [NONE; BLOCKERS],
            next: 0,
            met: Vec::new(),
            packets: Vec::new(),
        }
    }
}

impl Known {
    /// Keeps a triangle in place of the oldest, unless it is there.
    fn remember(&mut self, blocker: u32) {
        if blocker != NONE && !self.blockers.contains(&blocker) {
            self.blockers[self.next] = blocker;
            self.next = (self.next + 1) % BLOCKERS;
        }
    }
}

fn rays_of(packet: &[u32; BLOCK]) -> u32 {
    packet.iter().map(|row| row.count_ones()).sum()
}

/// Two halves of a packet: of its rows, or of its one row.
fn halves(packet: &[u32; BLOCK]) -> [[u32; BLOCK]; 2] {
    let mut second = *packet;
    let count = packet.iter().filter(|row| **row != 0).count();
    let rows = second.iter_mut().filter(|row| **row != 0);
    if count > 1 {
        rows.take(count.div_ceil(2)).for_each(|row| *row = 0);
    } else {
        for row in rows {
            for _ in 0..row.count_ones().div_ceil(2) {
                *row &= *row - 1;
            }
        }
    }
    [std::array::from_fn(|i| packet[i] & !second[i]), second]
}

/// The receivers that lie where float32 knows a view's places as well as it should.
#[inline(always)]
fn within_reach<S: Simd>(
    simd: S,
    view: &View,
    places: &BlockPlaces<S>,
    masks: &[u32; BLOCK],
) -> [u32; BLOCK] {
    let reach = splat(simd, view.reach());
    let mut within = *masks;
    for (i, within) in within
        .iter_mut()
        .enumerate()
        .filter(|(_, mask)| **mask != 0)
    {
        *within &= mask_bits(places.u[i].abs().max(places.v[i].abs()).simd_le(reach));
    }
    within
}

impl ShadowRays<'_> {
    /// Answers the pixels of a tile, and gives the number of rays.
    #[inline(always)]
    fn answer_tile<S: Simd>(
        &self,
        simd: S,
        tile: usize,
        rows: &mut [&mut [f32]],
        known: &mut Known,
    ) -> u64 {
        let receivers = &self.receivers;
        let mut block = BlockReceivers::none(simd);
        let mut places = BlockPlaces::none(simd);
        let mut count = 0;
        for pixel in receivers.image.tiling.blocks(tile) {
            let mut lit = [0; BLOCK];
            if receivers.block(simd, pixel, 0..BLOCK, &mut known.planes, &mut block) {
                lit = self.lit(simd, pixel, &block, &mut places, known);
                count += u64::from(rays_of(&block.facing));
            }
            receivers.image.write_lit(simd, rows, pixel, lit);
        }
        count
    }

    /// Which receivers of a block are lit.
    #[inline(always)]
    fn lit<S: Simd>(
        &self,
        simd: S,
        pixel: (usize, usize),
        block: &BlockReceivers<S>,
        places: &mut BlockPlaces<S>,
        known: &mut Known,
    ) -> [u32; BLOCK] {
        let mut lit = block.facing;
        let light_at = self.receivers.light_at;
        let masks = masks_of_views(simd, light_at, block, self.views.len());
        let mut alone = block.facing;
        for (placed, mask) in self.views.iter().zip(masks) {
            let Some(PlacedView {
                view,
                seen,
                vertices,
            }) = placed
            else {
                continue;
            };
            seen.places(simd, block, &mask, places);
            let tests = Candidates {
                receivers: &self.receivers,
                view,
                vertices,
            };
            let seen = PlacedBlock {
                block,
                places,
                pixel,
            };
            let mut left = within_reach(simd, view, places, &mask);
            for (alone, left) in alone.iter_mut().zip(left) {
                *alone &= !left;
            }
            let mut darken = |shadowed: [u32; BLOCK]| {
                for (lit, shadowed) in lit.iter_mut().zip(shadowed) {
                    *lit &= !shadowed;
                }
            };
            let every = |_: usize, _: u32| 0xff;
            let blockers = known.blockers;
            let used = blockers.iter().take_while(|&&id| id != NONE).count();
            let (shadowed, _) = tests.shadowed(simd, seen, &blockers[..used], &left, every);
            darken(shadowed);
            for (left, shadowed) in left.iter_mut().zip(shadowed) {
                *left &= !shadowed;
            }
            known.packets.clear();
            known.packets.extend((left != [0; BLOCK]).then_some(left));
            while let Some(packet) = known.packets.pop() {
                if rays_of(&packet) < FEW {
                    for (alone, packet) in alone.iter_mut().zip(packet) {
                        *alone |= packet;
                    }
                    continue;
                }
                if !self.meet(self.thick_ray(simd, block, &packet), &mut known.met) {
                    known.packets.extend(halves(&packet));
                    continue;
                }
                let (shadowed, last) = tests.shadowed(simd, seen, &known.met, &packet, every);
                darken(shadowed);
                known.remember(last);
            }
        }
        for (row, (lit, alone)) in lit.iter_mut().zip(alone).enumerate() {
            for j in bits(alone & *lit) {
                let at = (pixel.0 + j, pixel.1 + row);
                if !self.is_lit(at, block.ids[row][j], &mut known.blockers[0]) {
                    *lit &= !(1 << j);
                }
            }
        }
        lit
    }

    /// The ray from the middle of some receivers, and how far they are from it.
    #[inline(always)]
    fn thick_ray<S: Simd>(
        &self,
        simd: S,
        block: &BlockReceivers<S>,
        packet: &[u32; BLOCK],
    ) -> ThickRay {
        let mut low = [splat64(simd, f64::INFINITY); 3];
        let mut high = [splat64(simd, f64::NEG_INFINITY); 3];
        for (point, &row) in block.points.iter().zip(packet) {
            let mask = mask64x8::from_bitmask(simd, u64::from(row));
            for k in 0..3 {
                low[k] = mask.select(low[k].min(point[k]), low[k]);
                high[k] = mask.select(high[k].max(point[k]), high[k]);
            }
        }
        let low =
            DVec3::from_array(low.each(|v| v.to_array().into_iter().fold(f64::INFINITY, f64::min)));
        let high = DVec3::from_array(
            high.each(|v| v.to_array().into_iter().fold(f64::NEG_INFINITY, f64::max)),
        );
        let middle = 0.5 * (low + high);
        let (light_at, has_end) = (self.receivers.light_at, self.has_end());
        let to_light = if has_end { light_at - middle } else { light_at };
        let length = to_light.length();
        ThickRay {
            origin: self.receivers.eye + middle,
            direction: to_light / length,
            start: 0.0,
            end: if has_end { length } else { f64::INFINITY },
            margin: self.margin,
            growth: 0.0,
            spread: 0.5 * (high - low),
        }
    }

    /// Lists the triangles near a packet, unless they are many.
    #[inline(never)]
    fn meet(&self, packet: ThickRay, met: &mut Vec<u32>) -> bool {
        met.clear();
        self.hierarchy.visit(packet, |triangle| {
            met.push(triangle);
            match met.len() <= MANY {
                true => ControlFlow::Continue(f64::INFINITY),
                false => ControlFlow::Break(()),
            }
        });
        met.len() <= MANY
    }

    fn has_end(&self) -> bool {
        self.receivers.light.position().is_some()
    }

    /// Casts the ray of a receiver.
    #[inline(never)]
    fn is_lit(&self, pixel: (usize, usize), own: u32, blocker: &mut u32) -> bool {
        let ray = self.receivers.ray(pixel, own);
        is_lit(self.hierarchy, (&ray, self.has_end()), self.margin, blocker)
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
        growth: 0.0,
        spread: DVec3::ZERO,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_hold_each_ray_of_a_packet_once() {
        let packets = [
            [0xff; BLOCK],
            [0, 0, 0b0110_1101, 0, 0, 0, 0, 0],
            [0, 0x80, 0, 1, 0, 0x11, 0, 0],
            [0xff, 0, 0, 0, 0, 0, 0, 0xff],
            [0, 0, 1, 0, 0b110, 0, 0, 0],
        ];
        for packet in packets {
            let [a, b] = halves(&packet);
            for i in 0..BLOCK {
                assert_eq!((a[i] | b[i], a[i] & b[i]), (packet[i], 0));
            }
            assert!(a != [0; BLOCK] && b != [0; BLOCK]);
        }
    }
}
