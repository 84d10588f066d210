//! Rays from one point through a plane: the camera, a spot light, a face of a cube around a light. Texel
//! = q.xy / q.z, depth = q.z; twin of `shaders/projection/perspective.wgsl`.

use super::{Formulas, Kind, LaneKind, Projection, ProjectionKind, area_across};
use crate::lanes::{Lane, V2, V3};
use glam::{DMat3, DVec2, DVec3};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Perspective;

impl<L: Lane> Formulas<L> for Perspective {
    #[inline(always)]
    fn homogeneous_from_projected(&self, q: V3<L>) -> V3<L> {
        q
    }

    #[inline(always)]
    fn centred_texel_from_projected(&self, q: V3<L>) -> V2<L> {
        q.xy() / q.z
    }

    #[inline(always)]
    fn projected_from_ray(&self, ray: V3<L>, depth: L) -> V3<L> {
        ray * depth
    }

    #[inline(always)]
    fn depth_from_projected(&self, q: V3<L>) -> L {
        q.z
    }

    #[inline(always)]
    fn ray_from_projected(&self, q: V3<L>) -> V3<L> {
        (q.xy() / q.z).extend(q.x.constant(1.0))
    }

    #[inline(always)]
    fn ray_from_texel(&self, centred: V2<L>) -> V3<L> {
        centred.extend(centred.x.constant(1.0))
    }

    // One over depth is linear in the texel.
    #[inline(always)]
    fn depth_plane(&self, normal: V3<L>, _: V3<L>, height: L) -> V3<L> {
        normal / height
    }

    #[inline(always)]
    fn depth_on_plane(&self, plane: V3<L>, ray: V3<L>) -> L {
        ray.x.constant(1.0) / (plane.x * ray.x + (plane.y * ray.y + plane.z))
    }

    #[inline(always)]
    fn height_slope(&self, normal: V3<L>, _: V3<L>) -> V2<L> {
        normal.xy()
    }

    #[inline(always)]
    fn depth_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L> {
        -normal.xy() * q.z * q.z / normal.dot(q)
    }

    #[inline(always)]
    fn depth_of_neighbour(&self, normal: V3<L>, q: V3<L>, step: V2<L>, most: L) -> L {
        let one = q.x.constant(1.0);
        let growth = one + q.z * normal.xy().dot(step) / normal.dot(q);
        q.z / growth.clamp(one / most, most)
    }

    #[inline(always)]
    fn beam_growth(&self, q: V3<L>) -> L {
        q.z
    }

    #[inline(always)]
    fn texel_width(&self, q: V3<L>) -> L {
        q.z
    }
}

impl LaneKind for Perspective {
    type Formulas<L: Lane> = Self;

    fn in_lanes<L: Lane>(&self, _: f64, _: L) -> Self {
        Self
    }
}

impl ProjectionKind for Perspective {
    fn name(&self) -> &'static str {
        "perspective"
    }

    fn is_central(&self) -> bool {
        true
    }

    // Behind the near plane. A corner nearer than 2^-16 of the farthest depth would be placed by float32's rounding.
    fn side_from_projected(&self, projection: &Projection, q: V3<f64>) -> f64 {
        q.z - projection.near.max(projection.far / 65536.0)
    }

    fn plane_radius(&self, angle: f64) -> f64 {
        angle.tan()
    }

    fn stretched(&self, k: DVec2) -> (Kind, DVec2) {
        (Self.into(), k)
    }

    fn texel_area(&self, projection: &Projection, steps: &DMat3, point: DVec3) -> f64 {
        let depth = projection.projected_from_point(point).z;
        area_across(steps, point - projection.origin, depth)
    }
}
