//! What fits ask about the receivers.

use super::extents::Extent;
use super::lanes::{LANES, Simd, bits, dispatch, level};
use super::light_space::LightSpace;
use super::receivers::{BlockPlaces, KnownPlanes, Receivers};
use super::tiles::BLOCK;
use crate::fits::layer::Layer;
use crate::fits::receivers::{Corners, OutlinePoints};
use crate::lanes::V3;
use crate::occlusion::ReceiverRay;
use crate::projection::Projection;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// Columns of a tile in which the farthest receivers are looked for.
const OUTLINE_COLUMNS: usize = 64;

/// Rows or columns of the samples of an outline, at most.
const MAX_SAMPLES: u32 = 128;

/// The box of the receivers of a layer, and how many they are.
#[derive(Clone, Copy)]
struct Bounds {
    extent: Extent,
    facing: u32,
}

impl Bounds {
    const EMPTY: Self = Self {
        extent: Extent::EMPTY,
        facing: 0,
    };

    fn and(self, other: Self) -> Self {
        Self {
            extent: self.extent.and(other.extent),
            facing: self.facing + other.facing,
        }
    }
}

/// The boxes of the receivers of each layer, in centred texels and depth, and how many they are in all layers.
pub fn bounds(receivers: &Receivers, layers: &[Layer]) -> (Vec<Option<Corners>>, u32) {
    let space = |layer| LightSpace::new(layer, receivers);
    let spaces: Vec<_> = layers.iter().map(space).collect();
    let of_tile = |known: &mut KnownPlanes, tile: usize| {
        let mut bounds = vec![Bounds::EMPTY; spaces.len()];
        let job = (receivers, &spaces[..], tile);
        dispatch!(level(), simd => bounds_of_tile(simd, job, known, &mut bounds));
        bounds
    };
    let both = |a: Vec<Bounds>, b: Vec<Bounds>| {
        let pairs = a.into_iter().zip(b);
        pairs.map(|(a, b)| a.and(b)).collect()
    };
    let tiles = (0..receivers.image.tiling.tiles()).into_par_iter();
    let bounds = tiles
        .map_init(KnownPlanes::default, of_tile)
        .reduce(|| vec![Bounds::EMPTY; spaces.len()], both);
    let facing = bounds.iter().map(|bounds| bounds.facing).sum();
    let corners = bounds.into_iter().zip(&spaces).map(|(bounds, space)| {
        let in_world = DVec3::new(1.0, 1.0, space.unit.recip());
        let corner = |corner: [f32; 3]| DVec3::from(corner.map(f64::from)) * in_world;
        let Extent { low, high } = bounds.extent;
        (bounds.facing > 0).then(|| (corner(low), corner(high)))
    });
    (corners.collect(), facing)
}

#[inline(always)]
fn bounds_of_tile<S: Simd>(
    simd: S,
    (receivers, spaces, tile): (&Receivers, &[LightSpace], usize),
    known: &mut KnownPlanes,
    bounds: &mut [Bounds],
) {
    let mut places = BlockPlaces::none(simd);
    receivers.each_block_of_tile(
        simd,
        tile,
        known,
        #[inline(always)]
        |_, block| {
            for (space, bounds) in spaces.iter().zip(bounds.iter_mut()) {
                let masks = space.masks(simd, block);
                let facing: u32 = masks.iter().map(|mask| mask.count_ones()).sum();
                if facing > 0 {
                    space.places(simd, block, &masks, &mut places);
                    bounds.extent.add(simd, &places, &masks);
                    bounds.facing += facing;
                }
            }
        },
    );
}

/// Points of the receivers of a layer, in centred texels.
pub fn outline(receivers: &Receivers, layer: &Layer, points: OutlinePoints) -> Vec<DVec2> {
    match points {
        OutlinePoints::Extremes => extremes(receivers, layer),
        OutlinePoints::Samples => samples(receivers, layer),
    }
}

/// The receivers of a tile that lie farthest along the axes, along the diagonals, and against them.
struct Farthest {
    reach: [f32; 8],
    place: [[f32; 2]; 8],
}

impl Farthest {
    const NONE: Self = Self {
        reach: [f32::NEG_INFINITY; 8],
        place: [[0.0; 2]; 8],
    };

    fn add(&mut self, x: f32, y: f32) {
        let along = [x, y, x + y, x - y];
        for (i, along) in along.into_iter().enumerate() {
            for (k, reach) in [(i, along), (i + 4, -along)] {
                if reach > self.reach[k] {
                    self.reach[k] = reach;
                    self.place[k] = [x, y];
                }
            }
        }
    }

    fn drain_into(&mut self, points: &mut Vec<DVec2>) {
        let found = self.reach.iter().zip(&self.place);
        let found = found.filter(|(reach, _)| **reach > f32::NEG_INFINITY);
        points.extend(found.map(|(_, place)| DVec2::from(place.map(f64::from))));
        *self = Self::NONE;
    }
}

fn extremes(receivers: &Receivers, layer: &Layer) -> Vec<DVec2> {
    let space = LightSpace::new(layer, receivers);
    let rows = (0..receivers.image.tiling.height.div_ceil(BLOCK)).into_par_iter();
    let of_rows = |i: usize| {
        let mut points = Vec::new();
        dispatch!(level(), simd => extremes_of_rows(simd, receivers, &space, i * BLOCK, &mut points));
        points
    };
    rows.flat_map_iter(of_rows).collect()
}

#[inline(always)]
fn extremes_of_rows<S: Simd>(
    simd: S,
    receivers: &Receivers,
    space: &LightSpace,
    y: usize,
    points: &mut Vec<DVec2>,
) {
    let mut places = BlockPlaces::none(simd);
    let mut farthest = Farthest::NONE;
    let mut tile = 0;
    receivers.each_block(
        simd,
        y,
        #[inline(always)]
        |x, block| {
            if x / OUTLINE_COLUMNS != tile {
                tile = x / OUTLINE_COLUMNS;
                farthest.drain_into(points);
            }
            let masks = space.masks(simd, block);
            space.places(simd, block, &masks, &mut places);
            for (i, &mask) in masks.iter().enumerate() {
                let (u, v): ([f32; LANES], [f32; LANES]) = (places.u[i].into(), places.v[i].into());
                for lane in bits(mask) {
                    farthest.add(u[lane], v[lane]);
                }
            }
        },
    );
    farthest.drain_into(points);
}

/// The receivers of a regular grid of pixels.
fn samples(receivers: &Receivers, layer: &Layer) -> Vec<DVec2> {
    let Receivers {
        scene,
        image,
        camera,
        light,
        ..
    } = *receivers;
    let Layer { projection, region } = layer;
    let step = camera.width.max(camera.height).div_ceil(MAX_SAMPLES) as usize;
    let along = |count: u32| (step / 2..count as usize).step_by(step);
    let pixels = along(camera.height).flat_map(|y| along(camera.width).map(move |x| (x, y)));
    let place = |(x, y): (usize, usize)| {
        let triangle = image.triangle_at(x, y)?;
        let pixel = (y * camera.width as usize + x) as u32;
        let ray = ReceiverRay::new(scene, camera, light, pixel, triangle);
        let point = camera.eye + ray.point;
        let is_receiver = ray.is_facing(light) && region.contains(point);
        is_receiver.then(|| centred_texel(projection, point))
    };
    pixels.filter_map(place).collect()
}

fn centred_texel(projection: &Projection, point: DVec3) -> DVec2 {
    let q: V3<f64> = projection.projected_from_point(point).into();
    projection.kind.centred_texel_from_projected(q).into()
}
