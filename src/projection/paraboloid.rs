//! Rays from one point to all sides but straight back: the stereographic projection, which is where a paraboloid
//! around the light reflects them. With d the direction of a point, texel = scale d.xy / (1 + d.z) and depth =
//! distance; twin of `shaders/projection/paraboloid.wgsl`, which cites it.

use super::{Formulas, Kind, LaneKind, NOWHERE, Projection, ProjectionKind};
use crate::lanes::{Lane, V2, V3};
use crate::region::Region;
use glam::{DMat3, DVec2, DVec3};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Paraboloid<L = f64> {
    /// Texels per unit of the plane, whose unit circle is the hemisphere around the axis.
    pub scale: V2<L>,
}

impl<L: Lane> Paraboloid<L> {
    #[inline(always)]
    fn place(&self, centred: V2<L>) -> V2<L> {
        centred.zip(self.scale, L::div)
    }

    /// A place in the plane. Behind the light 1 + d.z cancels; there another form of it does not.
    #[inline(always)]
    fn plane_from_projected(q: V3<L>) -> V2<L> {
        let zero = q.x.constant(0.0);
        let size = q.length();
        let squared = q.xy().dot(q.xy());
        let before = q.xy() / (size + q.z);
        let behind = q.xy() * ((size - q.z) / squared);
        let place = before.zip(behind, |a, b| L::select(zero.at_most(q.z), a, b));
        let most = q.x.constant(NOWHERE);
        // Straight back there is no place.
        let is_back = squared.at_most(zero) & q.z.less(zero);
        place.map(|x| L::select(is_back, most, x.clamp(-most, most)))
    }
}

impl<L: Lane> Formulas<L> for Paraboloid<L> {
    #[inline(always)]
    fn homogeneous_from_projected(&self, q: V3<L>) -> V3<L> {
        q
    }

    #[inline(always)]
    fn centred_texel_from_projected(&self, q: V3<L>) -> V2<L> {
        Self::plane_from_projected(q).zip(self.scale, L::mul)
    }

    // Published paraboloids interpolate distances, as if nothing was projected.
    #[inline(always)]
    fn homogeneous_texel(&self, q: V3<L>) -> V3<L> {
        self.centred_texel_from_projected(q)
            .extend(q.x.constant(1.0))
    }

    #[inline(always)]
    fn projected_from_ray(&self, ray: V3<L>, depth: L) -> V3<L> {
        ray * depth
    }

    #[inline(always)]
    fn depth_from_projected(&self, q: V3<L>) -> L {
        q.length()
    }

    #[inline(always)]
    fn ray_from_projected(&self, q: V3<L>) -> V3<L> {
        q / q.length()
    }

    #[inline(always)]
    fn ray_from_texel(&self, centred: V2<L>) -> V3<L> {
        let place = self.place(centred);
        self.direction_from_texel(centred) / (self.scale.x.constant(1.0) + place.dot(place))
    }

    #[inline(always)]
    fn direction_from_texel(&self, centred: V2<L>) -> V3<L> {
        let place = self.place(centred);
        (place * self.scale.x.constant(2.0)).extend(self.scale.x.constant(1.0) - place.dot(place))
    }

    // One over the distance along a ray to a plane is linear in the ray.
    #[inline(always)]
    fn depth_plane(&self, normal: V3<L>, _: V3<L>, height: L) -> V3<L> {
        normal / height
    }

    #[inline(always)]
    fn depth_on_plane(&self, plane: V3<L>, ray: V3<L>) -> L {
        self.scale.x.constant(1.0) / plane.dot(ray)
    }

    #[inline(always)]
    fn height_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L> {
        let (zero, one) = (self.scale.x.constant(0.0), self.scale.x.constant(1.0));
        let place = Self::plane_from_projected(q);
        let growth = self.scale.x.constant(2.0) / (one + place.dot(place));
        let ray = q / q.length();
        // The derivative of the ray by the place: `growth` across the ray, by the derivatives of the
        // unnormalized ray (2 place, 1 - place^2).
        let along_x = (V3::new(one, zero, -place.x) - ray * place.x) * growth;
        let along_y = (V3::new(zero, one, -place.y) - ray * place.y) * growth;
        let changes = V2::new(normal.dot(along_x), normal.dot(along_y));
        changes.zip(self.scale, L::div)
    }

    #[inline(always)]
    fn depth_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L> {
        let cosine = normal.dot(q / q.length());
        self.height_slope(normal, q)
            .map(|height| -q.length() * height / cosine)
    }

    #[inline(always)]
    fn depth_of_neighbour(&self, normal: V3<L>, q: V3<L>, step: V2<L>, most: L) -> L {
        let ray = self.ray_from_texel(self.centred_texel_from_projected(q) + step);
        let growth = normal.dot(ray) * q.length() / normal.dot(q);
        q.length() / growth.clamp(self.scale.x.constant(1.0) / most, most)
    }

    #[inline(always)]
    fn beam_growth(&self, q: V3<L>) -> L {
        q.length()
    }

    // The stereographic projection scales alike in all directions.
    #[inline(always)]
    fn texel_width(&self, q: V3<L>) -> L {
        q.length() + q.z
    }
}

impl Paraboloid {
    /// One texel to the unit.
    pub const UNIT: Self = Self {
        scale: V2 { x: 1.0, y: 1.0 },
    };
}

impl LaneKind for Paraboloid {
    type Formulas<L: Lane> = Paraboloid<L>;

    #[inline(always)]
    fn in_lanes<L: Lane>(&self, _: f64, like: L) -> Paraboloid<L> {
        Paraboloid {
            scale: V2::new(like.constant(self.scale.x), like.constant(self.scale.y)),
        }
    }
}

impl ProjectionKind for Paraboloid {
    fn name(&self) -> &'static str {
        "paraboloid"
    }

    fn has_straight_edges(&self) -> bool {
        false
    }

    fn is_central(&self) -> bool {
        true
    }

    // Before the rim.
    fn side_from_projected(&self, _: &Projection, q: V3<f64>) -> f64 {
        q.z
    }

    fn plane_scale(&self) -> DVec2 {
        self.scale.into()
    }

    fn plane_radius(&self, angle: f64) -> f64 {
        (0.5 * angle).tan()
    }

    fn matrices(&self) -> Option<[DMat3; 2]> {
        None
    }

    fn stretched(&self, k: DVec2) -> (Kind, DVec2) {
        let scale = self.scale.zip(k.into(), |scale, k| scale * k);
        (Self { scale }.into(), DVec2::ONE)
    }

    // The stereographic projection scales alike in all directions.
    fn texel_area(&self, projection: &Projection, _: &DMat3, point: DVec3) -> f64 {
        let width = self.texel_width(projection.projected_from_point(point).into());
        width * width / (self.scale.x * self.scale.y)
    }

    fn beam_width(&self, _: &Projection) -> f64 {
        2.0 / self.scale.x.min(self.scale.y)
    }

    // The farther from the axis the finer: at a corner, or at the rim where the region is a hemisphere and ends there.
    fn smallest_texel(&self, projection: &Projection, region: &Region) -> DVec2 {
        let size = projection.size().texels();
        let [a, b] = [-projection.centre, size - projection.centre];
        let corners = [a, b, DVec2::new(a.x, b.y), DVec2::new(b.x, a.y)];
        let squares = corners.map(|corner| {
            let squared = (corner / self.plane_scale()).length_squared();
            let (origin, ray) = projection.ray_from_texel(corner + projection.centre);
            match region.contains(origin + ray) {
                true => squared,
                false => squared.min(1.0),
            }
        });
        let farthest = squares.into_iter().fold(0.0, f64::max);
        self.plane_scale().recip() * (2.0 / (1.0 + farthest))
    }
}
