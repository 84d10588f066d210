//! Points anywhere in space, and which of them a light reaches: those that nothing stands before.
//!
//! Points are put in Morton order, so that blocks of them lie close together whatever the light. Many points are
//! tested against the triangles in their cell of a grid of the light, as pixels are (`caster_tests`); few are
//! cheaper to trace through the scene's hierarchy. Both decide in float64 what float32 is not sure of.
//!
//! **What a point on a surface sees.** Rounding puts a point on a triangle to either side of it. With a normal the
//! side is known: the point is moved along it by as much as rounding may have moved it. Without one, no triangle
//! shadows a point that lies in its plane within rounding.

use super::caster_tests::{Known, Lit, Tests};
use super::exact::views;
use super::extents::{Extent, add_extents, extents_of_jobs};
use super::finer_grids::make_finer;
use super::lanes::{LANES, Simd, dispatch, f64x8, level};
use super::light_grid::{LightGrid, fitted};
use super::light_grids::SeenGrid;
use super::rasterize::NONE;
use super::receivers::{
    BlockPlaces, BlockReceivers, ViewFromEye, dot, in_cone, masks_of_views, splat64,
};
use super::shadow_rays::{RAY_ROUNDING, is_lit};
use super::tiles::BLOCK;
use super::view::View;
use crate::bvh::Bvh;
use crate::geometry::bounds_of;
use crate::lanes::Each;
use crate::light::{Cone, Light};
use crate::occlusion::ReceiverRay;
use crate::rounding::FLOAT64_ROUNDING;
use crate::scene::Scene;
use fearless_simd::prelude::*;
use glam::DVec3;
use rayon::prelude::*;
use std::sync::Arc;

/// Points of a block, and of a job of a thread.
const BLOCK_POINTS: usize = BLOCK * LANES;
const JOB_POINTS: usize = 64 * BLOCK_POINTS;

/// Points that are answered between two looks at whether the caller still waits.
pub const CHUNK_POINTS: usize = 256 * JOB_POINTS;

/// How far a point is moved along its normal beyond its rounding: more than what is granted to it where it is tested.
const MOVED: f64 = 16.0 * FLOAT64_ROUNDING;

/// Nanoseconds on one core: a triangle in a light's grid and in the hierarchy, a point in a grid, and a ray. Only the speed
/// depends on them.
const GRID_OF_TRIANGLE: usize = 35;
const HIERARCHY_OF_TRIANGLE: usize = 290;
const TEST_OF_POINT: usize = 110;
const RAY_OF_POINT: usize = 320;

/// What a grid is widened by to each side, as a share of the scene's size or, around a position, of half a face.
const LEAST_EXTENT: f32 = 1e-3;

/// Vectors of eight points: their coordinates along each axis.
type Eight = [[f64; LANES]; 3];

/// Whether rays through the hierarchy are expected to answer sooner than grids of each light.
pub fn prefers_rays(triangles: usize, points: usize, lights: usize) -> bool {
    let by_grid = lights * (triangles * GRID_OF_TRIANGLE + points * TEST_OF_POINT);
    let by_rays = triangles * HIERARCHY_OF_TRIANGLE + lights * points * RAY_OF_POINT;
    by_rays < by_grid
}

/// Points in Morton order, relative to the middle of the scene.
pub struct Points<'a> {
    scene: &'a Scene,
    eye: DVec3,
    /// Of the scene and the points.
    bounds: (DVec3, DVec3),
    /// Where each point that was given is in the order.
    place_of: Vec<u32>,
    /// Filled up to whole blocks with the last point.
    positions: Vec<Eight>,
    normals: Option<Vec<Eight>>,
    /// What rounding does to a coordinate, as a share of it.
    rounding: f64,
}

impl<'a> Points<'a> {
    /// Points in the world, normals of any length, and what rounding does to a coordinate, as a share of it.
    pub fn new(
        scene: &'a Scene,
        points: &[DVec3],
        normals: Option<&[DVec3]>,
        rounding: f64,
    ) -> Self {
        let eye = scene.centre();
        let of_points = bounds_of_many(points);
        let order = morton_order(points, of_points);
        let mut place_of = vec![0; points.len()];
        for (place, &index) in order.iter().enumerate() {
            place_of[index as usize] = place as u32;
        }
        let normal = |index: u32| {
            normals.map_or(DVec3::ZERO, |normals| {
                normals[index as usize].normalize_or_zero()
            })
        };
        let position = |index: u32| {
            let point = points[index as usize];
            let moved = (rounding + MOVED) * point.length();
            (point - eye) + moved * normal(index)
        };
        let eights = order.len().div_ceil(BLOCK_POINTS) * BLOCK;
        let in_eights = |vector: &(dyn Fn(u32) -> DVec3 + Sync)| {
            let eight = |i: usize| {
                let mut eight = [[0.0; LANES]; 3];
                for lane in 0..LANES {
                    let index = order[(i * LANES + lane).min(order.len() - 1)];
                    for (of_axis, value) in eight.iter_mut().zip(vector(index).to_array()) {
                        of_axis[lane] = value;
                    }
                }
                eight
            };
            (0..eights).into_par_iter().map(eight).collect()
        };
        let (low, high) = scene.bounds();
        Self {
            scene,
            eye,
            bounds: (low.min(of_points.0), high.max(of_points.1)),
            positions: in_eights(&position),
            normals: normals.map(|_| in_eights(&normal)),
            place_of,
            rounding,
        }
    }

    pub fn count(&self) -> usize {
        self.place_of.len()
    }

    /// Answers in Morton order as they were asked for.
    pub fn as_given(&self, answers: &[u8], visibility: &mut [f32]) {
        let places = self.place_of.par_iter().zip(visibility);
        let places = places.with_min_len(JOB_POINTS);
        places.for_each(|(&place, visibility)| *visibility = f32::from(answers[place as usize]));
    }

    /// The ray of a point to a light.
    fn ray(&self, light: &Light, place: usize) -> ReceiverRay<'a> {
        let point = vector_at(&self.positions, place);
        let from_origin = (point + self.eye).length();
        // Where there is a normal, the point has left what rounding may do to it.
        let rounding = match self.normals {
            Some(_) => FLOAT64_ROUNDING,
            None => self.rounding,
        };
        let margin = rounding * from_origin + FLOAT64_ROUNDING * point.length();
        ReceiverRay::from_point((self.scene, self.eye), light, (point, margin), None)
    }

    /// Whether a point is turned to the light, as far as it has a normal.
    fn is_turned(&self, place: usize, to_light: DVec3) -> bool {
        let normals = self.normals.as_ref();
        normals.is_none_or(|normals| vector_at(normals, place).dot(to_light) > 0.0)
    }

    /// Finds the points of a block, and which of them the light would reach if nothing stood before them.
    #[inline(always)]
    fn block<S: Simd>(&self, simd: S, first: usize, light: &Seen, block: &mut BlockReceivers<S>) {
        for i in 0..BLOCK {
            let from = first + i * LANES;
            let eight =
                |vectors: &[Eight]| vectors[from / LANES].each(|axis| f64x8::simd_from(simd, axis));
            let point = eight(&self.positions);
            block.points[i] = point;
            let count = self.count().saturating_sub(from).min(LANES);
            block.facing[i] = ((1_u32 << count) - 1) & in_cone(simd, light.cone, light.at, &point);
            if let Some(normals) = &self.normals {
                let [a, b, c] = light.at.to_array().each(|v| splat64(simd, v));
                let to_light = match light.is_at_infinity {
                    true => [a, b, c],
                    false => [a - point[0], b - point[1], c - point[2]],
                };
                let along = dot(eight(normals), to_light);
                let is_turned = splat64(simd, 0.0).simd_lt(along);
                block.facing[i] &= is_turned.to_bitmask() as u32;
            }
        }
    }
}

fn vector_at(vectors: &[Eight], place: usize) -> DVec3 {
    let eight = &vectors[place / LANES];
    DVec3::from_array([0, 1, 2].map(|axis| eight[axis][place % LANES]))
}

/// A light, relative to the middle of the scene.
struct Seen {
    /// Its position, or the way to it.
    at: DVec3,
    is_at_infinity: bool,
    cone: Option<Cone>,
}

/// A light, and what was found of the scene for it.
pub struct LitPoints<'a> {
    points: &'a Points<'a>,
    light: &'a Light,
    seen: Seen,
    search: By<'a>,
}

/// What finds the triangles that may stand before a point.
enum By<'a> {
    Grids {
        views: Vec<ViewFromEye>,
        grids: Vec<Vec<SeenGrid>>,
    },
    Rays {
        hierarchy: &'a Bvh,
        margin: f64,
    },
}

impl<'a> LitPoints<'a> {
    /// By rays where there is a hierarchy, else by grids.
    pub fn new(points: &'a Points<'a>, light: &'a Light, hierarchy: Option<&'a Bvh>) -> Self {
        let seen = Seen {
            at: light.vector_from_point(points.eye),
            is_at_infinity: light.position().is_none(),
            cone: light.cone(),
        };
        let search = match hierarchy {
            Some(hierarchy) => By::Rays {
                hierarchy,
                margin: RAY_ROUNDING * (points.eye.length() + hierarchy.farthest(points.eye)),
            },
            None => grids(points, light, &seen),
        };
        Self {
            points,
            light,
            seen,
            search,
        }
    }

    /// 1 for each point that the light reaches, from one on, in Morton order. The first is the first of a block.
    pub fn answer(&self, first: usize, answers: &mut [u8]) {
        let jobs = answers.par_chunks_mut(JOB_POINTS).enumerate();
        match &self.search {
            By::Rays { hierarchy, margin } => jobs.for_each(|(job, answers)| {
                let first = first + job * JOB_POINTS;
                let mut blocker = NONE;
                for (i, answer) in answers.iter_mut().enumerate() {
                    let ray = self.points.ray(self.light, first + i);
                    let is_lit = self.points.is_turned(first + i, ray.to_light)
                        && ray.is_facing(self.light)
                        && is_lit(
                            hierarchy,
                            (&ray, !self.seen.is_at_infinity),
                            *margin,
                            &mut blocker,
                        );
                    *answer = u8::from(is_lit);
                }
            }),
            By::Grids { views, grids } => {
                let ray = |(x, y): (usize, usize), _| self.points.ray(self.light, x + y * LANES);
                let tests = Tests {
                    scene: self.points.scene,
                    light_at: self.seen.at,
                    views,
                    grids,
                    ray: &ray,
                    trusts_hits: self.points.normals.is_some()
                        || self.points.rounding <= FLOAT64_ROUNDING,
                };
                jobs.for_each_init(Known::default, |known, (job, answers)| {
                    let first = first + job * JOB_POINTS;
                    dispatch!(level(), simd => self.answer_job(simd, &tests, first, answers, known));
                });
            }
        }
    }

    #[inline(always)]
    fn answer_job<S: Simd>(
        &self,
        simd: S,
        tests: &Tests,
        first: usize,
        answers: &mut [u8],
        known: &mut Known,
    ) {
        let mut block = BlockReceivers::none(simd);
        let mut places = BlockPlaces::none(simd);
        for (i, answers) in answers.chunks_mut(BLOCK_POINTS).enumerate() {
            let first = first + i * BLOCK_POINTS;
            self.points.block(simd, first, &self.seen, &mut block);
            if block.facing == [0; BLOCK] {
                answers.fill(0);
                continue;
            }
            let place = (first, 0);
            let Lit { mut lit, left, .. } = tests.lit(simd, place, &block, &mut places, known);
            // Where no grid reaches, nothing stands.
            for (i, lit) in lit.iter_mut().enumerate() {
                *lit |= left.iter().fold(0, |all, left| all | left[i]);
            }
            for (j, answer) in answers.iter_mut().enumerate() {
                *answer = (lit[j / LANES] >> (j % LANES) & 1) as u8;
            }
        }
    }
}

/// Grids of what the light sees, as far as both points and the scene reach.
fn grids<'a>(points: &Points, light: &Light, seen: &Seen) -> By<'a> {
    let views = views(light, points.bounds);
    let seen_views = views.iter().map(|view| ViewFromEye::new(view, points.eye));
    let seen_views: Vec<_> = seen_views.collect();
    let jobs = points.count().div_ceil(JOB_POINTS);
    let extents = extents_of_jobs(views.len(), jobs, |job, extents| {
        dispatch!(level(), simd => extents_of_job(simd, points, seen, &seen_views, job, extents));
    });
    // Of rays that do not start nearby.
    let is_one = views.len() == 1;
    let bounds = is_one.then(|| extent_of_scene(&views[0], points.scene));
    // A single point has no extent, nor have points in a row, seen along it.
    let (low, high) = points.scene.bounds();
    let room = match is_one {
        true => LEAST_EXTENT * (high - low).length() as f32,
        false => LEAST_EXTENT,
    };
    let grid = |(view, extent): (&View, &Extent)| {
        let extent = bounds.map_or(*extent, |bounds| extent.common(bounds));
        let grid = (!extent.is_empty()).then(|| {
            let view = fitted(view, &extent.widened(room));
            let grid = Arc::new(LightGrid::new(view, points.scene));
            make_finer(&grid, points.scene, true);
            SeenGrid::new(grid, points.eye)
        });
        Vec::from_iter(grid)
    };
    let grids = views.iter().zip(&extents).map(grid).collect();
    By::Grids {
        views: seen_views,
        grids,
    }
}

#[inline(always)]
fn extents_of_job<S: Simd>(
    simd: S,
    points: &Points,
    light: &Seen,
    views: &[ViewFromEye],
    job: usize,
    extents: &mut [Extent],
) {
    let mut block = BlockReceivers::none(simd);
    let mut places = BlockPlaces::none(simd);
    let range = job * JOB_POINTS..points.count().min((job + 1) * JOB_POINTS);
    for first in range.step_by(BLOCK_POINTS) {
        points.block(simd, first, light, &mut block);
        let masks = masks_of_views(simd, light.at, &block, views.len());
        add_extents(simd, views, &block, &masks, &mut places, extents);
    }
}

/// Where a view sees the scene's box, which is ahead of it.
fn extent_of_scene(view: &View, scene: &Scene) -> Extent {
    let (low, high) = scene.bounds();
    (0..8).fold(Extent::EMPTY, |extent, corner| {
        let is_high = DVec3::from_array([0, 1, 2].map(|k| f64::from(corner >> k & 1)));
        let [x, y, nearness, _] = view.place(low + (high - low) * is_high);
        let place = [x, y, nearness];
        extent.and(Extent {
            low: place,
            high: place,
        })
    })
}

fn bounds_of_many(points: &[DVec3]) -> (DVec3, DVec3) {
    points.par_iter().map(|&point| (point, point)).reduce(
        || bounds_of(std::iter::empty()),
        |a, b| (a.0.min(b.0), a.1.max(b.1)),
    )
}

/// The indices of points in the order of a curve that keeps neighbours together (Morton 1966).
fn morton_order(points: &[DVec3], (low, high): (DVec3, DVec3)) -> Vec<u32> {
    let scale = f64::from((1 << BITS) - 1) / (high - low).max_element().max(f64::MIN_POSITIVE);
    let keys = points.par_iter().enumerate().map(|(index, &point)| {
        let [x, y, z] = ((point - low) * scale).to_array().map(|v| spread(v as u64));
        (x | y << 1 | z << 2, index as u32)
    });
    let mut keys: Vec<_> = keys.collect();
    keys.par_sort_unstable();
    keys.into_par_iter().map(|(_, index)| index).collect()
}

/// Bits of a coordinate in a point's key.
const BITS: u32 = 21;

/// The bits of a number, each followed by two zeros.
fn spread(number: u64) -> u64 {
    let steps = [
        (32, 0x001f_0000_0000_ffff),
        (16, 0x001f_0000_ff00_00ff),
        (8, 0x100f_00f0_0f00_f00f),
        (4, 0x10c3_0c30_c30c_30c3),
        (2, 0x1249_2492_4924_9249),
    ];
    steps
        .iter()
        .fold(number, |bits, (shift, mask)| (bits | bits << shift) & mask)
}
