//! Receivers: where the ray of each pixel meets the plane of its triangle, in float64.

use super::lanes::{LANES, Simd, each, f32x8, f64x8, mask32x8};
use super::rasterize::{Image, NONE};
use super::tiles::{BLOCK, TILE};
use super::view::{Nearness, View};
use crate::camera::Camera;
use crate::light::Light;
use crate::occlusion::ReceiverRay;
use crate::scene::Scene;
use crate::sides::Source;
use fearless_simd::prelude::*;
use glam::{DVec3, DVec4};
use std::ops::Range;

/// A height over a plane whose sign rounding cannot turn, as a share of the lengths that it is a product of.
const SURE_OF_SIDE: f64 = 1e-10;

/// Triangles whose planes are kept at hand.
const KNOWN: usize = 32;

/// What a camera sees, and a light that may reach it. Points are relative to the eye.
pub struct Receivers<'a> {
    pub scene: &'a Scene,
    pub image: &'a Image,
    pub camera: &'a Camera,
    pub eye: DVec3,
    pub light: &'a Light,
    /// The light's position, or the way to it.
    light_at: DVec3,
    /// Rays one unit ahead: through the middle of the first pixel, and what a column and a row add.
    first: DVec3,
    column: DVec3,
    row: DVec3,
}

/// The plane of a triangle: normal * point = height. The normal is of any length.
#[derive(Debug, Clone, Copy)]
struct SeenPlane {
    triangle: u32,
    normal: DVec3,
    height: f64,
    faces_light: bool,
}

/// Planes of triangles that were asked for before.
pub struct KnownPlanes([SeenPlane; KNOWN]);

impl Default for KnownPlanes {
    fn default() -> Self {
        let none = SeenPlane {
            triangle: NONE,
            normal: DVec3::ZERO,
            height: 0.0,
            faces_light: false,
        };
        Self([none; KNOWN])
    }
}

/// The receivers of a block of pixels.
pub struct BlockReceivers<S: Simd> {
    pub ids: [[u32; LANES]; BLOCK],
    /// Of each row, the pixels that face the light and are within its cone.
    pub facing: [u32; BLOCK],
    pub points: [[f64x8<S>; 3]; BLOCK],
}

impl<S: Simd> BlockReceivers<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        Self {
            ids: [[NONE; LANES]; BLOCK],
            facing: [0; BLOCK],
            points: [[splat64(simd, 0.0); 3]; BLOCK],
        }
    }
}

/// Where a view sees the receivers of a block.
pub struct BlockPlaces<S: Simd> {
    pub u: [f32x8<S>; BLOCK],
    pub v: [f32x8<S>; BLOCK],
    pub nearness: [f32x8<S>; BLOCK],
}

impl<'a> Receivers<'a> {
    pub fn new(scene: &'a Scene, image: &'a Image, camera: &'a Camera, light: &'a Light) -> Self {
        Self {
            scene,
            image,
            camera,
            eye: camera.eye,
            light,
            light_at: match light.position() {
                Some(position) => position - camera.eye,
                None => light.vector_from_point(camera.eye),
            },
            first: camera.ray_from_pixel(0, 0),
            column: camera.right / camera.focal.x,
            row: -camera.up / camera.focal.y,
        }
    }

    fn plane(&self, triangle: u32) -> SeenPlane {
        let corners = self.scene.corners(triangle);
        let [a, b, c] = each(corners, |corner| corner - self.eye);
        let (v, w) = (b - a, c - a);
        let normal = v.cross(w);
        let side = |source: Source, way: DVec3| {
            let height = normal.dot(way);
            // Far from what rounding may do, the sign is the answer.
            let size = |v: DVec3| v.abs().max_element();
            let farthest = size(corners[0]).max(size(corners[1])).max(size(corners[2]));
            match height.abs() > SURE_OF_SIDE * size(v) * size(w) * (size(way) + farthest) {
                true => height.signum() as i8,
                false => source.side_of(corners),
            }
        };
        let to_light = match self.light.position() {
            Some(_) => self.light_at - a,
            None => self.light_at,
        };
        let faces_light =
            side(Source::of(self.light), to_light) * side(Source::Point(self.eye), -a) > 0;
        SeenPlane {
            triangle,
            normal,
            height: normal.dot(a),
            faces_light,
        }
    }

    /// The ray of a pixel's receiver, for what is decided in float64.
    pub fn ray(&self, (x, y): (usize, usize), triangle: u32) -> ReceiverRay<'a> {
        let pixel = y * self.camera.width as usize + x;
        ReceiverRay::new(self.scene, self.camera, self.light, pixel as u32, triangle)
    }

    /// Gives each block of eight rows that has receivers, with its first column.
    #[inline(always)]
    pub fn each_block<S: Simd>(
        &self,
        simd: S,
        y: usize,
        mut work: impl FnMut(usize, &BlockReceivers<S>),
    ) {
        let mut known = KnownPlanes::default();
        let mut block = BlockReceivers::none(simd);
        for x in (0..self.image.tiling.width).step_by(BLOCK) {
            if self.block(simd, (x, y), 0..BLOCK, &mut known, &mut block) {
                work(x, &block);
            }
        }
    }

    /// Finds those of some rows of the block whose first pixel that is; `false` where nothing there is seen and faces
    /// the light.
    #[inline(always)]
    pub fn block<S: Simd>(
        &self,
        simd: S,
        (x, y): (usize, usize),
        rows: Range<usize>,
        known: &mut KnownPlanes,
        block: &mut BlockReceivers<S>,
    ) -> bool {
        let columns = f64x8::simd_from(simd, [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]) + x as f64;
        let mut has_any = false;
        block.facing = [0; BLOCK];
        let first = self.image.tiling.index(x, y);
        for i in rows.start..rows.end.min(self.image.tiling.height - y) {
            let place = first + i * TILE;
            let ids: [u32; LANES] = self.image.triangles[place..place + LANES]
                .try_into()
                .expect("eight");
            block.ids[i] = ids;
            let Some((normal, height, facing)) = self.planes_of_row(simd, &ids, known) else {
                continue;
            };
            let at_row = self.first + self.row * (y + i) as f64;
            let ray = each([0, 1, 2], |k| {
                columns.mul_add(splat64(simd, self.column[k]), splat64(simd, at_row[k]))
            });
            let along = ray[0].mul_add(normal[0], ray[1].mul_add(normal[1], ray[2] * normal[2]));
            let depth = height / along;
            let point = each(ray, |ray| ray * depth);
            block.points[i] = point;
            block.facing[i] = facing & self.in_cone(simd, point);
            has_any |= block.facing[i] != 0;
        }
        has_any
    }

    /// Normals and heights of eight planes, and which of them face the light; `None`: not one.
    #[inline(always)]
    fn planes_of_row<S: Simd>(
        &self,
        simd: S,
        ids: &[u32; LANES],
        known: &mut KnownPlanes,
    ) -> Option<([f64x8<S>; 3], f64x8<S>, u32)> {
        if ids[0] != NONE && *ids == [ids[0]; LANES] {
            let plane = known.get(self, ids[0]);
            let normal = each(plane.normal.to_array(), |v| splat64(simd, v));
            return plane
                .faces_light
                .then(|| (normal, splat64(simd, plane.height), 0xff));
        }
        let mut facing = 0;
        let mut columns = [[1.0; LANES]; 4];
        for (lane, &id) in ids.iter().enumerate() {
            if id == NONE {
                continue;
            }
            let plane = known.get(self, id);
            facing |= u32::from(plane.faces_light) << lane;
            let row = plane.normal.extend(plane.height).to_array();
            for (column, value) in columns.iter_mut().zip(row) {
                column[lane] = value;
            }
        }
        let [x, y, z, height] = columns;
        let normal = each([x, y, z], |column| f64x8::simd_from(simd, column));
        (facing != 0).then(|| (normal, f64x8::simd_from(simd, height), facing))
    }

    #[inline(always)]
    fn in_cone<S: Simd>(&self, simd: S, point: [f64x8<S>; 3]) -> u32 {
        let Some(cone) = self.light.cone() else {
            return 0xff;
        };
        let from_light = each([0, 1, 2], |k| point[k] - splat64(simd, self.light_at[k]));
        let axis = each(cone.axis.to_array(), |v| splat64(simd, v));
        let along = dot(from_light, axis);
        let aside = each([0, 1, 2], |k| from_light[k] - axis[k] * along);
        let within = along * splat64(simd, cone.sine);
        let outside = dot(aside, aside).sqrt() * splat64(simd, cone.cosine);
        outside.simd_le(within).to_bitmask() as u32
    }

    /// Which face of a cube around the light each receiver falls in: the axis twice, and 1 where it goes down.
    #[inline(always)]
    pub fn faces<S: Simd>(&self, simd: S, point: &[f64x8<S>; 3]) -> [u32; 6] {
        let from_light = each([0, 1, 2], |k| point[k] - splat64(simd, self.light_at[k]));
        let [x, y, z] = each(from_light, |v| v.abs());
        let is_x = y.simd_le(x) & z.simd_le(x);
        let is_y = !is_x & z.simd_le(y);
        let axes = each([is_x, is_y, !(is_x | is_y)], |mask| {
            mask.to_bitmask() as u32
        });
        let zero = f64x8::simd_from(simd, 0.0);
        let down = each(from_light, |v| v.simd_lt(zero).to_bitmask() as u32);
        let mut faces = [0; 6];
        for axis in 0..3 {
            faces[2 * axis] = axes[axis] & !down[axis];
            faces[2 * axis + 1] = axes[axis] & down[axis];
        }
        faces
    }
}

impl KnownPlanes {
    #[inline(always)]
    fn get(&mut self, receivers: &Receivers, triangle: u32) -> SeenPlane {
        let known = &mut self.0[triangle as usize % KNOWN];
        if known.triangle != triangle {
            *known = receivers.plane(triangle);
        }
        *known
    }
}

/// A view whose points are relative to an eye.
pub struct ViewFromEye {
    rows: [DVec4; 3],
    nearness: Nearness,
    /// Whether `w` is 1 everywhere.
    is_parallel: bool,
}

impl ViewFromEye {
    pub fn new(view: &View, eye: DVec3) -> Self {
        let offset = eye - view.origin;
        let moved = |row: DVec4| row.truncate().extend(row.w + row.truncate().dot(offset));
        Self {
            rows: view.rows.map(moved),
            nearness: match view.nearness {
                Nearness::Inverse => Nearness::Inverse,
                Nearness::Linear(row) => Nearness::Linear(moved(row)),
            },
            is_parallel: view.rows[2] == DVec4::W,
        }
    }

    #[inline(always)]
    pub fn places<S: Simd>(
        &self,
        simd: S,
        block: &BlockReceivers<S>,
        masks: &[u32; BLOCK],
        places: &mut BlockPlaces<S>,
    ) {
        for (i, &mask) in masks.iter().enumerate() {
            if mask == 0 {
                continue;
            }
            let point = &block.points[i];
            let mut u = function_of(simd, self.rows[0], point);
            let mut v = function_of(simd, self.rows[1], point);
            let mut nearness = match self.nearness {
                Nearness::Inverse => splat64(simd, 1.0),
                Nearness::Linear(row) => function_of(simd, row, point),
            };
            if !self.is_parallel {
                let inverse = splat64(simd, 1.0) / function_of(simd, self.rows[2], point);
                (u, v, nearness) = (u * inverse, v * inverse, nearness * inverse);
            }
            places.u[i] = narrow(u);
            places.v[i] = narrow(v);
            places.nearness[i] = narrow(nearness);
        }
    }
}

#[inline(always)]
pub fn splat64<S: Simd>(simd: S, value: f64) -> f64x8<S> {
    f64x8::simd_from(simd, value)
}

#[inline(always)]
fn dot<S: Simd>(a: [f64x8<S>; 3], b: [f64x8<S>; 3]) -> f64x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A linear function of (point, 1).
#[inline(always)]
pub fn function_of<S: Simd>(simd: S, row: DVec4, [x, y, z]: &[f64x8<S>; 3]) -> f64x8<S> {
    let last = z.mul_add(splat64(simd, row.z), splat64(simd, row.w));
    x.mul_add(splat64(simd, row.x), y.mul_add(splat64(simd, row.y), last))
}

#[inline(always)]
pub fn narrow<S: Simd>(v: f64x8<S>) -> f32x8<S> {
    let (low, high) = v.split();
    low.narrow(high)
}

impl<S: Simd> BlockPlaces<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        let none = [f32x8::simd_from(simd, 0.0); BLOCK];
        Self {
            u: none,
            v: none,
            nearness: none,
        }
    }
}

/// Least and greatest place of receivers, and how near they are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    pub low: [f32; 3],
    pub high: [f32; 3],
}

impl Extent {
    pub const EMPTY: Self = Self {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };

    pub fn is_empty(&self) -> bool {
        self.low[0] > self.high[0]
    }

    pub fn and(self, other: Self) -> Self {
        Self {
            low: std::array::from_fn(|i| self.low[i].min(other.low[i])),
            high: std::array::from_fn(|i| self.high[i].max(other.high[i])),
        }
    }

    #[inline(always)]
    pub fn add<S: Simd>(&mut self, simd: S, places: &BlockPlaces<S>, masks: &[u32; BLOCK]) {
        let mut low = [f32x8::simd_from(simd, f32::INFINITY); 3];
        let mut high = [f32x8::simd_from(simd, f32::NEG_INFINITY); 3];
        for (i, &mask) in masks.iter().enumerate() {
            if mask == 0 {
                continue;
            }
            let mask = mask32x8::from_bitmask(simd, u64::from(mask));
            let values = [places.u[i], places.v[i], places.nearness[i]];
            for k in 0..3 {
                low[k] = mask.select(low[k].min(values[k]), low[k]);
                high[k] = mask.select(high[k].max(values[k]), high[k]);
            }
        }
        for k in 0..3 {
            self.low[k] = self.low[k].min(low[k].reduce_min());
            self.high[k] = self.high[k].max(high[k].reduce_max());
        }
    }
}
