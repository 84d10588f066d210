//! Parallel rays: a directional light. Texel = (q.x, q.y), depth = q.z; twin of
//! `shaders/projection/parallel.wgsl`.

use super::{Formulas, Kind, LaneKind, Projection, ProjectionKind, area_across};
use crate::lanes::{Lane, V2, V3};
use glam::{DMat3, DVec2, DVec3};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parallel;

impl<L: Lane> Formulas<L> for Parallel {
    // The edges and the rays of a parallel projection live in the plane q.z = 1.
    #[inline(always)]
    fn homogeneous_from_projected(&self, q: V3<L>) -> V3<L> {
        q.xy().extend(q.x.constant(1.0))
    }

    #[inline(always)]
    fn centred_texel_from_projected(&self, q: V3<L>) -> V2<L> {
        q.xy()
    }

    #[inline(always)]
    fn projected_from_ray(&self, ray: V3<L>, depth: L) -> V3<L> {
        ray.xy().extend(depth)
    }

    #[inline(always)]
    fn depth_from_projected(&self, q: V3<L>) -> L {
        q.z
    }

    #[inline(always)]
    fn ray_from_projected(&self, q: V3<L>) -> V3<L> {
        q.xy().extend(q.x.constant(1.0))
    }

    #[inline(always)]
    fn ray_from_texel(&self, centred: V2<L>) -> V3<L> {
        centred.extend(centred.x.constant(1.0))
    }

    // Depth is linear in the texel: the coefficients of the plane. On a steep plane that is more precise
    // than the plane's height.
    #[inline(always)]
    fn depth_plane(&self, normal: V3<L>, q: V3<L>, _: L) -> V3<L> {
        let slope = -normal.xy() / normal.z;
        slope.extend(q.z - slope.dot(q.xy()))
    }

    #[inline(always)]
    fn depth_on_plane(&self, plane: V3<L>, ray: V3<L>) -> L {
        plane.x * ray.x + (plane.y * ray.y + plane.z)
    }

    #[inline(always)]
    fn height_slope(&self, normal: V3<L>, _: V3<L>) -> V2<L> {
        normal.xy()
    }

    #[inline(always)]
    fn depth_slope(&self, normal: V3<L>, _: V3<L>) -> V2<L> {
        -normal.xy() / normal.z
    }

    #[inline(always)]
    fn depth_of_neighbour(&self, normal: V3<L>, q: V3<L>, step: V2<L>, _: L) -> L {
        q.z + (-normal.xy() / normal.z).dot(step)
    }

    #[inline(always)]
    fn beam_growth(&self, q: V3<L>) -> L {
        q.x.constant(1.0)
    }

    #[inline(always)]
    fn texel_width(&self, q: V3<L>) -> L {
        q.x.constant(1.0)
    }
}

impl LaneKind for Parallel {
    type Formulas<L: Lane> = Self;

    fn in_lanes<L: Lane>(&self, _: f64, _: L) -> Self {
        Self
    }
}

impl ProjectionKind for Parallel {
    fn name(&self) -> &'static str {
        "parallel"
    }

    fn stretched(&self, k: DVec2) -> (Kind, DVec2) {
        (Self.into(), k)
    }

    fn texel_area(&self, _: &Projection, steps: &DMat3, _: DVec3) -> f64 {
        area_across(steps, steps.z_axis, 1.0)
    }

    fn extent(&self, projection: &Projection) -> f64 {
        let steps = projection.steps();
        let width = steps.x_axis.length() * f64::from(projection.width);
        let height = steps.y_axis.length() * f64::from(projection.height);
        DVec3::new(width, height, projection.far - projection.near).length()
    }

    // Texels, of which there are few thousand.
    fn greatest_coordinate(&self, _: &Projection) -> f64 {
        1.0
    }
}
