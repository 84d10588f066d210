//! Receivers: where the ray of each pixel meets the plane of its triangle, in float64.

use super::lanes::{LANES, Simd, bits, columns64, each_row, f32x8, f64x8, narrow, u32x8};
use super::rasterize::{Image, NONE};
use super::tiles::{BLOCK, TILE};
use super::view::{Nearness, View};
use crate::camera::{Camera, Rays};
use crate::lanes::{Each, V3};
use crate::light::{Cone, Light};
use crate::occlusion::ReceiverRay;
use crate::scene::{Scene, unit_normal};
use crate::sides::Source;
use fearless_simd::prelude::*;
use glam::{DVec3, DVec4};
use std::ops::Range;

/// A height over a plane whose sign rounding cannot turn, as a share of the lengths that it is a product of.
const SURE_OF_SIDE: f64 = 1e-10;

/// Triangles whose planes are kept at hand.
const KNOWN: usize = 512;

/// What a camera sees, and a light that may reach it. Points are relative to the eye.
pub struct Receivers<'a> {
    pub scene: &'a Scene,
    pub image: &'a Image,
    pub camera: &'a Camera,
    pub eye: DVec3,
    pub light: &'a Light,
    /// The light's position, or the way to it.
    pub light_at: DVec3,
    /// Places one unit ahead on the camera's rays: of the middle of the first pixel, and what a column and a row add.
    pub first: DVec3,
    pub column: DVec3,
    pub row: DVec3,
}

/// Planes of triangles that were asked for before, each at the rest of its number by theirs.
pub struct KnownPlanes {
    triangles: Box<[u32; KNOWN]>,
    /// The normal, of any length, and its product with the points of the plane.
    planes: Box<[[f64; 4]; KNOWN]>,
    faces_light: Box<[bool; KNOWN]>,
}

impl Default for KnownPlanes {
    fn default() -> Self {
        Self {
            triangles: Box::new([NONE; KNOWN]),
            planes: Box::new([[0.0; 4]; KNOWN]),
            faces_light: Box::new([false; KNOWN]),
        }
    }
}

/// The receivers of a block of pixels.
pub struct BlockReceivers<S: Simd> {
    pub ids: [[u32; LANES]; BLOCK],
    /// Whether all pixels of a row show the same.
    pub is_one: [bool; BLOCK],
    /// Of each row, the pixels that face the light and are within its cone.
    pub facing: [u32; BLOCK],
    pub points: [[f64x8<S>; 3]; BLOCK],
}

impl<S: Simd> BlockReceivers<S> {
    #[inline(always)]
    pub fn none(simd: S) -> Self {
        Self {
            ids: [[NONE; LANES]; BLOCK],
            is_one: [false; BLOCK],
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
        let (start, ray) = camera.ray_from_pixel(0, 0);
        Self {
            scene,
            image,
            camera,
            eye: camera.eye,
            light,
            light_at: light.vector_from_point(camera.eye),
            first: start + ray,
            column: camera.right / camera.focal.x,
            row: -camera.up / camera.focal.y,
        }
    }

    /// Finds the planes of eight triangles, and which of them show the camera the side that the light reaches.
    #[inline(never)]
    fn learn_eight<S: Simd>(&self, simd: S, ids: [u32; LANES], known: &mut KnownPlanes) {
        simd.vectorize(
            #[inline(always)]
            || self.learn_lanes(simd, ids, known),
        );
    }

    #[inline(always)]
    fn learn_lanes<S: Simd>(&self, simd: S, ids: [u32; LANES], known: &mut KnownPlanes) {
        let mut world = [[[0.0; LANES]; 3]; 3];
        for (lane, &id) in ids.iter().enumerate() {
            for (of_corner, corner) in world.iter_mut().zip(self.scene.corners(id)) {
                for (of_axis, value) in of_corner.iter_mut().zip(corner.to_array()) {
                    of_axis[lane] = value;
                }
            }
        }
        let world = world.each(|corner| corner.each(|axis| f64x8::simd_from(simd, axis)));
        let eye = self.eye.to_array();
        let minus = |a: &[f64x8<S>; 3], b: &[f64x8<S>; 3]| [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
        let eye = eye.each(|v| splat64(simd, v));
        let a = minus(&world[0], &eye);
        let (v, w) = (minus(&world[1], &world[0]), minus(&world[2], &world[0]));
        let normal = [
            v[1] * w[2] - v[2] * w[1],
            v[2] * w[0] - v[0] * w[2],
            v[0] * w[1] - v[1] * w[0],
        ];
        let height = dot(normal, a);
        let light_at = self.light_at.to_array().each(|v| splat64(simd, v));
        let to_light = match self.light.position() {
            Some(_) => minus(&light_at, &a),
            None => light_at,
        };
        let above = dot(normal, to_light);
        let beyond = match self.camera.rays {
            Rays::Perspective => height,
            Rays::Orthographic => {
                let forward = self.camera.forward.to_array().each(|v| splat64(simd, v));
                dot(normal, forward)
            }
        };
        // Far from what rounding may do, the sign of a height is the answer.
        let size = |v: &[f64x8<S>; 3]| v[0].abs().max(v[1].abs()).max(v[2].abs());
        let farthest = size(&world[0]).max(size(&world[1])).max(size(&world[2]));
        let unsure = size(&v) * size(&w) * SURE_OF_SIDE;
        let is_sure = (unsure * (size(&to_light) + farthest)).simd_lt(above.abs())
            & (unsure * (size(&a) + farthest)).simd_lt(beyond.abs());
        let zero = splat64(simd, 0.0);
        let is_above = zero.simd_lt(above).to_bitmask() as u32;
        let is_behind = zero.simd_lt(beyond).to_bitmask() as u32;
        let mut faces_light = is_above ^ is_behind;
        for lane in bits(!is_sure.to_bitmask() as u32 & 0xff) {
            let corners = self.scene.corners(ids[lane]);
            let sides = [Source::of(self.light), self.camera.source()]
                .map(|source| source.side_of(corners));
            faces_light &= !(1 << lane);
            faces_light |= u32::from(sides[0] * sides[1] > 0) << lane;
        }
        let [x, y, z] = normal.each(|v| v.to_array());
        let height = height.to_array();
        for (lane, &id) in ids.iter().enumerate() {
            let place = id as usize % KNOWN;
            known.triangles[place] = id;
            known.planes[place] = [x[lane], y[lane], z[lane], height[lane]];
            known.faces_light[place] = faces_light >> lane & 1 != 0;
        }
    }

    /// Finds the planes that a block needs.
    #[inline(always)]
    pub fn learn<S: Simd>(
        &self,
        simd: S,
        block: &BlockReceivers<S>,
        rows: Range<usize>,
        known: &mut KnownPlanes,
    ) {
        let mut unknown = [NONE; BLOCK * LANES];
        let mut count = 0;
        let mut last = NONE;
        for i in rows {
            let ids = &block.ids[i];
            let different = if block.is_one[i] { &ids[..1] } else { &ids[..] };
            for &id in different {
                let known = &mut known.triangles[id as usize % KNOWN];
                if id != last && id != NONE && *known != id {
                    *known = id;
                    unknown[count] = id;
                    count += 1;
                }
                last = id;
            }
        }
        // The last one stands for those that are missing.
        for first in (0..count).step_by(LANES) {
            let mut ids = [unknown[count - 1]; LANES];
            let end = count.min(first + LANES);
            ids[..end - first].copy_from_slice(&unknown[first..end]);
            self.learn_eight(simd, ids, known);
        }
    }

    /// The unit normal of a triangle that faces the light, to the side of the light and the eye.
    pub fn lit_normal(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self
            .scene
            .corners(triangle)
            .each(|corner| corner - self.eye);
        let normal = unit_normal(a, b, c);
        normal * -normal.dot(self.camera.sight_of(a)).signum()
    }

    /// From the light to receivers; of a light at infinity a unit vector.
    #[inline(always)]
    pub fn rays_of_light<S: Simd>(&self, simd: S, point: &[f64x8<S>; 3]) -> V3<f32x8<S>> {
        let [x, y, z] = [0, 1, 2].each(|k| match self.light.position() {
            Some(_) => narrow(point[k] - splat64(simd, self.light_at[k])),
            None => f32x8::splat(simd, -self.light_at[k] as f32),
        });
        V3::new(x, y, z)
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

    /// Gives each block of a tile that has receivers, with its first pixel. Neighbours mostly show the same triangles.
    #[inline(always)]
    pub fn each_block_of_tile<S: Simd>(
        &self,
        simd: S,
        tile: usize,
        known: &mut KnownPlanes,
        mut work: impl FnMut((usize, usize), &BlockReceivers<S>),
    ) {
        let mut block = BlockReceivers::none(simd);
        for pixel in self.image.tiling.blocks(tile) {
            if self.block(simd, pixel, 0..BLOCK, known, &mut block) {
                work(pixel, &block);
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
        let rows = rows.start..rows.end.min(self.image.tiling.height - y);
        for i in rows.clone() {
            let place = first + i * TILE;
            let ids = &self.image.triangles[place..place + LANES];
            let one = u32x8::simd_from(simd, ids[0]);
            let ids = u32x8::from_slice(simd, ids);
            block.ids[i] = ids.to_array();
            block.is_one[i] = ids.simd_eq(one).all_true();
        }
        self.learn(simd, block, rows.clone(), known);
        for i in rows {
            let Some((normal, height, facing)) = self.planes_of_row(simd, block, i, known) else {
                continue;
            };
            let at_row = self.first + self.row * (y + i) as f64;
            let ray = [0, 1, 2]
                .each(|k| columns.mul_add(splat64(simd, self.column[k]), splat64(simd, at_row[k])));
            let point = self.points(simd, ray, normal, height);
            block.points[i] = point;
            block.facing[i] = facing & in_cone(simd, self.light.cone(), self.light_at, &point);
            has_any |= block.facing[i] != 0;
        }
        has_any
    }

    /// Where rays, by their places one unit ahead, meet planes.
    #[inline(always)]
    pub fn points<S: Simd>(
        &self,
        simd: S,
        ray: [f64x8<S>; 3],
        normal: [f64x8<S>; 3],
        height: f64x8<S>,
    ) -> [f64x8<S>; 3] {
        match self.camera.rays {
            Rays::Perspective => {
                let along = row_dot(ray, normal);
                let depth = height / along;
                ray.each(|ray| ray * depth)
            }
            Rays::Orthographic => {
                let forward = self.camera.forward.to_array().each(|v| splat64(simd, v));
                let further = (height - row_dot(ray, normal)) / row_dot(forward, normal);
                [0, 1, 2].each(|k| forward[k].mul_add(further, ray[k]))
            }
        }
    }

    /// Normals and heights of the planes of a row, and which of them face the light; `None`: not one.
    #[inline(always)]
    pub fn planes_of_row<S: Simd>(
        &self,
        simd: S,
        block: &BlockReceivers<S>,
        row: usize,
        known: &mut KnownPlanes,
    ) -> Option<([f64x8<S>; 3], f64x8<S>, u32)> {
        let ids = &block.ids[row];
        if block.is_one[row] {
            let (plane, faces_light) = self.plane(simd, ids[0], known);
            return faces_light.then(|| {
                let [x, y, z, height] = plane;
                let normal = [x, y, z].each(|v| splat64(simd, v));
                (normal, splat64(simd, height), 0xff)
            });
        }
        let mut facing = 0;
        let mut rows = [[1.0; 4]; LANES];
        for (lane, (row, &id)) in rows.iter_mut().zip(ids).enumerate() {
            let (plane, faces_light) = self.plane(simd, id, known);
            *row = plane;
            facing |= u32::from(faces_light) << lane;
        }
        if facing == 0 {
            return None;
        }
        let [x, y, z, height] = columns64(simd, each_row(&rows));
        Some(([x, y, z], height, facing))
    }

    /// The plane of a triangle, and whether it shows the camera the side that the light reaches.
    #[inline(always)]
    fn plane<S: Simd>(&self, simd: S, id: u32, known: &mut KnownPlanes) -> ([f64; 4], bool) {
        if id == NONE {
            return ([1.0; 4], false);
        }
        let place = id as usize % KNOWN;
        // Two triangles of a block may be at the same place.
        if known.triangles[place] != id {
            self.learn_eight(simd, [id; LANES], known);
        }
        (known.planes[place], known.faces_light[place])
    }
}

/// Which receivers a light with such a cone may reach.
#[inline(always)]
pub fn in_cone<S: Simd>(
    simd: S,
    cone: Option<Cone>,
    light_at: DVec3,
    point: &[f64x8<S>; 3],
) -> u32 {
    let Some(cone) = cone else {
        return 0xff;
    };
    let from_light = [0, 1, 2].each(|k| point[k] - splat64(simd, light_at[k]));
    let axis = cone.axis.to_array().each(|v| splat64(simd, v));
    let along = dot(from_light, axis);
    let aside = [0, 1, 2].each(|k| from_light[k] - axis[k] * along);
    let within = along * splat64(simd, cone.sine);
    let outside = dot(aside, aside).sqrt() * splat64(simd, cone.cosine);
    outside.simd_le(within).to_bitmask() as u32
}

/// Which face of a cube around a light each receiver falls in: the axis twice, and 1 where it goes down.
#[inline(always)]
pub fn faces_around<S: Simd>(simd: S, light_at: DVec3, point: &[f64x8<S>; 3]) -> [u32; 6] {
    let from_light = [0, 1, 2].each(|k| point[k] - splat64(simd, light_at[k]));
    let [x, y, z] = from_light.each(|v| v.abs());
    let is_x = y.simd_le(x) & z.simd_le(x);
    let is_y = !is_x & z.simd_le(y);
    let axes = [is_x, is_y, !(is_x | is_y)].each(|mask| mask.to_bitmask() as u32);
    let zero = f64x8::simd_from(simd, 0.0);
    let down = from_light.each(|v| v.simd_lt(zero).to_bitmask() as u32);
    let mut faces = [0; 6];
    for axis in 0..3 {
        faces[2 * axis] = axes[axis] & !down[axis];
        faces[2 * axis + 1] = axes[axis] & down[axis];
    }
    faces
}

/// Which of the receivers of a block each view sees.
#[inline(always)]
pub fn masks_of_views<S: Simd>(
    simd: S,
    light_at: DVec3,
    block: &BlockReceivers<S>,
    count: usize,
) -> [[u32; BLOCK]; 6] {
    let mut masks = [[0; BLOCK]; 6];
    if count == 1 {
        masks[0] = block.facing;
        return masks;
    }
    for (i, &facing) in block.facing.iter().enumerate() {
        if facing != 0 {
            let faces = faces_around(simd, light_at, &block.points[i]);
            for (masks, face) in masks.iter_mut().zip(faces) {
                masks[i] = face & facing;
            }
        }
    }
    masks
}

/// A view whose points are relative to an eye.
pub struct ViewFromEye {
    pub rows: [DVec4; 3],
    pub nearness: Nearness,
    /// Whether `w` is 1 everywhere.
    pub is_parallel: bool,
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
pub fn dot<S: Simd>(a: [f64x8<S>; 3], b: [f64x8<S>; 3]) -> f64x8<S> {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The same, rounded less often.
#[inline(always)]
pub fn row_dot<S: Simd>(a: [f64x8<S>; 3], b: [f64x8<S>; 3]) -> f64x8<S> {
    a[0].mul_add(b[0], a[1].mul_add(b[1], a[2] * b[2]))
}

/// A linear function of (point, 1).
#[inline(always)]
pub fn function_of<S: Simd>(simd: S, row: DVec4, [x, y, z]: &[f64x8<S>; 3]) -> f64x8<S> {
    let last = z.mul_add(splat64(simd, row.z), splat64(simd, row.w));
    x.mul_add(splat64(simd, row.x), y.mul_add(splat64(simd, row.y), last))
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
