//! Receivers in the projection space of a layer, eight at once.

use super::lanes::{Simd, f32x8, f64x8, narrow, splat};
use super::receivers::{BlockPlaces, BlockReceivers, Receivers, function_of, splat64};
use super::tiles::BLOCK;
use crate::fits::layer::Layer;
use crate::lanes::{Each, V3};
use crate::projection::{Formulas, Kind, KindVisitor, LaneKind};
use fearless_simd::prelude::*;
use glam::{DVec3, DVec4, Vec3};

/// What float64 may round of a point's height over a plane, as a share of how far both are from the eye.
const ROUNDING: f64 = 16.0 * f64::EPSILON;

/// A layer, for points relative to the eye.
pub struct LightSpace {
    pub kind: Kind,
    /// Projection space is scaled by it, so that products of coordinates stay within float32.
    pub unit: f64,
    rows: [DVec4; 3],
    /// World vectors of a unit step along each of its axes.
    steps: [DVec3; 3],
    /// The half-spaces of the receivers that the layer is for, moved out by what rounding may do: a receiver where several
    /// layers meet is in one of them.
    planes: Vec<DVec4>,
}

impl LightSpace {
    pub fn new(layer: &Layer, receivers: &Receivers) -> Self {
        let Layer { projection, region } = layer;
        let unit = projection.unit();
        let Receivers { scene, eye, .. } = *receivers;
        let offset = eye - projection.origin;
        let axes = [projection.x_axis, projection.y_axis, projection.z_axis];
        let steps = projection.steps();
        let half_spaces = region.half_spaces().iter();
        Self {
            kind: projection.kind,
            unit,
            steps: [steps.x_axis, steps.y_axis, steps.z_axis].each(|step| step / unit),
            rows: axes.each(|axis| axis.extend(axis.dot(offset)) * unit),
            planes: half_spaces
                .map(|half| {
                    let to_plane = eye - half.origin;
                    let slack = ROUNDING * (scene.farthest(eye) + to_plane.length());
                    half.normal.extend(half.normal.dot(to_plane) + slack)
                })
                .collect(),
        }
    }

    #[inline(always)]
    pub fn projected<S: Simd>(&self, simd: S, point: &[f64x8<S>; 3]) -> V3<f32x8<S>> {
        let [x, y, z] = self.rows.each(|row| narrow(function_of(simd, row, point)));
        V3::new(x, y, z)
    }

    /// A vector of the world.
    #[inline(always)]
    pub fn turned<S: Simd>(&self, simd: S, v: V3<f32x8<S>>) -> V3<f32x8<S>> {
        let [x, y, z] = self.rows.each(|row| {
            let row = row.as_vec4();
            let sum = v.y.mul_add(splat(simd, row.y), v.z * row.z);
            v.x.mul_add(splat(simd, row.x), sum)
        });
        V3::new(x, y, z)
    }

    /// A plane's normal as a covector.
    pub fn covector(&self, normal: DVec3) -> Vec3 {
        let [x, y, z] = self.steps.each(|step| step.dot(normal) as f32);
        Vec3::new(x, y, z)
    }

    /// Which receivers of each row are in the layer's region and face the light.
    #[inline(always)]
    pub fn masks<S: Simd>(&self, simd: S, block: &BlockReceivers<S>) -> [u32; BLOCK] {
        let mut masks = block.facing;
        for plane in &self.planes {
            for (i, mask) in masks.iter_mut().enumerate() {
                if *mask != 0 {
                    let height = function_of(simd, *plane, &block.points[i]);
                    *mask &= splat64(simd, 0.0).simd_le(height).to_bitmask() as u32;
                }
            }
        }
        masks
    }

    /// Centred texels and depths of receivers, in place of how near they are.
    #[inline(always)]
    pub fn places<S: Simd>(
        &self,
        simd: S,
        block: &BlockReceivers<S>,
        masks: &[u32; BLOCK],
        places: &mut BlockPlaces<S>,
    ) {
        self.kind.visit(Places {
            simd,
            space: self,
            block,
            masks,
            places,
        });
    }
}

struct Places<'a, S: Simd> {
    simd: S,
    space: &'a LightSpace,
    block: &'a BlockReceivers<S>,
    masks: &'a [u32; BLOCK],
    places: &'a mut BlockPlaces<S>,
}

impl<S: Simd> KindVisitor for Places<'_, S> {
    type Output = ();

    #[inline(always)]
    fn visit<K: LaneKind>(self, kind: &K) {
        let zero = splat(self.simd, 0.0);
        let kind = kind.in_lanes(self.space.unit, zero);
        for (i, &mask) in self.masks.iter().enumerate() {
            if mask != 0 {
                let q = self.space.projected(self.simd, &self.block.points[i]);
                let texel = kind.centred_texel_from_projected(q);
                self.places.u[i] = texel.x;
                self.places.v[i] = texel.y;
                self.places.nearness[i] = kind.depth_from_projected(q);
            }
        }
    }
}
