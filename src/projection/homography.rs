//! Rays that are parallel or nearly so, whose texels a homography moves, so that they need not be even: the light
//! matrices of perspective, light space perspective, plane optimal and scene optimized shadow maps, and every map of a
//! light that is far away. With H the homography and k the convergence, homogeneous texel = H (q.x, q.y, 1 + k q.z) and
//! depth = q.z; twin of `shaders/projection/homography.wgsl`, which argues for it.

use super::{Formulas, Kind, LaneKind, NOWHERE, Projection, ProjectionKind, area_across};
use crate::lanes::{Each, Lane, V2, V3};
use crate::region::Region;
use glam::{DMat3, DVec2, DVec3};

/// Rows of the matrix from a homogeneous place to a homogeneous centred texel, whose last row is positive before the
/// map's horizon, and of the one back. The place of a ray is where it crosses the plane q.z = 0.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homography<L = f64> {
    pub texel_from_place: [V3<L>; 3],
    pub place_from_texel: [V3<L>; 3],
    /// No receiver is farther from the projection's origin across the rays.
    pub reach: L,
    /// One over how far before the origin the rays meet; 0 where they are parallel.
    pub convergence: L,
}

#[inline(always)]
fn times<L: Lane>(rows: &[V3<L>; 3], v: V3<L>) -> V3<L> {
    V3::new(rows[0].dot(v), rows[1].dot(v), rows[2].dot(v))
}

impl<L: Lane> Homography<L> {
    /// How wide the rays of a bundle are at a depth, against where they cross the plane of places.
    #[inline(always)]
    pub(super) fn width_at(&self, depth: L) -> L {
        self.convergence * depth + self.convergence.constant(1.0)
    }

    #[inline(always)]
    pub(super) fn place_from_projected(&self, q: V3<L>) -> V2<L> {
        q.xy() / self.width_at(q.z)
    }

    /// The product of a plane's normal with the direction of the ray through a place.
    #[inline(always)]
    fn steepness_at(&self, normal: V3<L>, place: V2<L>) -> L {
        self.convergence * normal.xy().dot(place) + normal.z
    }

    /// How a place moves per texel to the right and down.
    #[inline(always)]
    pub(super) fn place_slopes(&self, place: V2<L>) -> [V2<L>; 2] {
        let w = self.texel_from_place[2].dot(place.extend(self.convergence.constant(1.0)));
        let [x, y, z] = self.place_from_texel;
        [
            (V2::new(x.x, y.x) - place * z.x) * w,
            (V2::new(x.y, y.y) - place * z.y) * w,
        ]
    }

    /// How a place moves over some texels.
    #[inline(always)]
    fn place_step(&self, place: V2<L>, step: V2<L>) -> V2<L> {
        let w = self.texel_from_place[2].dot(place.extend(self.convergence.constant(1.0)));
        let [x, y, z] = self.place_from_texel.each(|row| row.xy().dot(step));
        // A neighbour near the horizon is taken for a nearer one.
        let nearer = (self.convergence.constant(1.0) + w * z).max(self.convergence.constant(0.1));
        (V2::new(x, y) - place * z) * w / nearer
    }
}

impl<L: Lane> Formulas<L> for Homography<L> {
    #[inline(always)]
    fn homogeneous_from_projected(&self, q: V3<L>) -> V3<L> {
        q.xy().extend(self.width_at(q.z))
    }

    #[inline(always)]
    fn centred_texel_from_projected(&self, q: V3<L>) -> V2<L> {
        let texel = self.homogeneous_texel(q);
        let is_before = self.convergence.constant(0.0).less(texel.z);
        // Nothing behind the horizon is in the map.
        (texel.xy() / texel.z).map(|t| L::select(is_before, t, self.convergence.constant(NOWHERE)))
    }

    #[inline(always)]
    fn homogeneous_texel(&self, q: V3<L>) -> V3<L> {
        times(&self.texel_from_place, self.homogeneous_from_projected(q))
    }

    #[inline(always)]
    fn projected_from_ray(&self, ray: V3<L>, depth: L) -> V3<L> {
        (ray.xy() * self.width_at(depth)).extend(depth)
    }

    #[inline(always)]
    fn depth_from_projected(&self, q: V3<L>) -> L {
        q.z
    }

    #[inline(always)]
    fn ray_from_projected(&self, q: V3<L>) -> V3<L> {
        self.place_from_projected(q)
            .extend(self.convergence.constant(1.0))
    }

    // A texel behind the horizon has the negative of a ray, which no triangle covers.
    #[inline(always)]
    fn ray_from_texel(&self, centred: V2<L>) -> V3<L> {
        let ray = times(
            &self.place_from_texel,
            centred.extend(self.convergence.constant(1.0)),
        );
        ray / ray.z.abs()
    }

    // The slope of the plane against the axis and its depth there: what is over a plane's height would not be
    // precise on a steep one.
    #[inline(always)]
    fn depth_plane(&self, normal: V3<L>, q: V3<L>, _: L) -> V3<L> {
        let slope = -normal.xy() / normal.z;
        slope.extend(q.z - slope.dot(q.xy()))
    }

    // A quotient of linear functions of the place, as the ray at a place leaves the axis.
    #[inline(always)]
    fn depth_on_plane(&self, plane: V3<L>, ray: V3<L>) -> L {
        let depth = plane.x * ray.x + (plane.y * ray.y + plane.z);
        depth / (self.convergence.constant(1.0) - self.convergence * plane.xy().dot(ray.xy()))
    }

    #[inline(always)]
    fn height_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L> {
        let normal = normal.xy() * self.width_at(q.z);
        let [right, down] = self.place_slopes(self.place_from_projected(q));
        V2::new(normal.dot(right), normal.dot(down))
    }

    #[inline(always)]
    fn depth_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L> {
        let place = self.place_from_projected(q);
        let slope = -normal.xy() / self.steepness_at(normal, place) * self.width_at(q.z);
        let [right, down] = self.place_slopes(place);
        V2::new(slope.dot(right), slope.dot(down))
    }

    #[inline(always)]
    fn depth_of_neighbour(&self, normal: V3<L>, q: V3<L>, step: V2<L>, _: L) -> L {
        let place = self.place_from_projected(q);
        let moved = self.place_step(place, step);
        let own = self.steepness_at(normal, place);
        let there = self.convergence * normal.xy().dot(moved) + own;
        // A neighbour whose ray runs along the plane, or away from it, is taken for one that meets it.
        let least = self.convergence.constant(0.1) * own.abs();
        let is_behind = own.less(self.convergence.constant(0.0));
        let steepness = L::select(is_behind, there.min(-least), there.max(least));
        q.z + self.width_at(q.z) * (-normal.xy() / steepness).dot(moved)
    }

    // The width of a texel's beam at a point.
    #[inline(always)]
    fn beam_growth(&self, q: V3<L>) -> L {
        let [right, down] = self.place_slopes(self.place_from_projected(q));
        self.width_at(q.z) * right.length().max(down.length())
    }

    // The area grows as the third power of w.
    #[inline(always)]
    fn texel_width(&self, q: V3<L>) -> L {
        let place = self.place_from_projected(q);
        let w = self.texel_from_place[2]
            .dot(place.extend(self.convergence.constant(1.0)))
            .abs();
        self.width_at(q.z) * w * w.sqrt()
    }
}

/// Rows of a matrix.
fn rows(matrix: DMat3) -> [V3<f64>; 3] {
    [0, 1, 2].map(|i| matrix.row(i).into())
}

fn matrix(rows: &[V3<f64>; 3]) -> DMat3 {
    let [x, y, z] = rows.map(DVec3::from);
    DMat3::from_cols(x, y, z).transpose()
}

impl Homography {
    /// # Panics
    /// If the matrix has no inverse.
    pub fn new(matrix: DMat3, reach: f64) -> Self {
        let inverse = matrix.inverse();
        assert!(inverse.is_finite());
        Self {
            texel_from_place: rows(matrix),
            place_from_texel: rows(inverse),
            reach,
            convergence: 0.0,
        }
    }

    /// The same of rays that meet before the origin.
    pub fn with_convergence(self, convergence: f64) -> Self {
        Self {
            convergence,
            ..self
        }
    }

    /// The least w of a map with those corners, a little less: nothing nearer to the horizon is in the map.
    pub(super) fn least_w_in(&self, corners: [DVec2; 4]) -> f64 {
        let last = DVec3::from(self.place_from_texel[2]);
        let inverses = corners.map(|corner| last.dot(corner.extend(1.0)));
        0.999
            / inverses
                .into_iter()
                .fold(f64::MIN_POSITIVE.sqrt(), f64::max)
    }

    /// With so many times the texels along each side.
    pub(super) fn stretched_rows(&self, k: DVec2) -> (Self, DVec2) {
        let texels = DMat3::from_diagonal(k.extend(1.0));
        let stretched = Self::new(texels * matrix(&self.texel_from_place), self.reach);
        (stretched.with_convergence(self.convergence), DVec2::ONE)
    }
}

/// Of a map around its axis.
pub(super) fn corners(half: DVec2) -> [DVec2; 4] {
    let other = DVec2::new(half.x, -half.y);
    [half, -half, other, -other]
}

impl LaneKind for Homography {
    type Formulas<L: Lane> = Homography<L>;

    #[inline(always)]
    fn in_lanes<L: Lane>(&self, unit: f64, like: L) -> Homography<L> {
        let [x, y, z] = self.texel_from_place;
        let row = |v: V3<f64>, x: f64, y: f64, z: f64| {
            V3::new(
                like.constant(v.x * x),
                like.constant(v.y * y),
                like.constant(v.z * z),
            )
        };
        let inverse = unit.recip();
        let [u, v, w] = self.place_from_texel;
        Homography {
            texel_from_place: [
                row(x, inverse, inverse, 1.0),
                row(y, inverse, inverse, 1.0),
                row(z, inverse, inverse, 1.0),
            ],
            place_from_texel: [
                row(u, unit, unit, unit),
                row(v, unit, unit, unit),
                row(w, 1.0, 1.0, 1.0),
            ],
            reach: like.constant(self.reach * unit),
            convergence: like.constant(self.convergence * inverse),
        }
    }
}

impl ProjectionKind for Homography {
    fn name(&self) -> &'static str {
        "homography"
    }

    fn matrices(&self) -> Option<[DMat3; 2]> {
        Some([&self.texel_from_place, &self.place_from_texel].map(matrix))
    }

    fn stretched(&self, k: DVec2) -> (Kind, DVec2) {
        let (stretched, rest) = self.stretched_rows(k);
        (stretched.into(), rest)
    }

    // Before the horizon.
    fn side_from_projected(&self, projection: &Projection, q: V3<f64>) -> f64 {
        self.homogeneous_texel(q).z - self.least_w(projection)
    }

    fn convergence(&self) -> f64 {
        self.convergence
    }

    fn texel_area(&self, projection: &Projection, steps: &DMat3, point: DVec3) -> f64 {
        let q = projection.projected_from_point(point).into();
        let place = self.place_from_projected(q);
        let [right, down] = self.place_slopes(place);
        let area = DVec2::from(right).perp_dot(down.into()).abs();
        let ray = *steps * (DVec2::from(place) * self.convergence).extend(1.0);
        area_across(steps, ray, area.sqrt() * self.width_at(q.z))
    }

    // Widths differ, and the shaders know them.
    fn beam_width(&self, projection: &Projection) -> f64 {
        projection.step_lengths().max_element()
    }

    // The nearer to the horizon the larger: the smallest are at a corner.
    fn smallest_texel(&self, projection: &Projection, _: &Region) -> DVec2 {
        let steps = projection.steps();
        let places = corners(projection.centre).map(|c| DVec3::from(self.ray_from_texel(c.into())));
        let sides = places.map(|place| {
            if place.z < 0.0 {
                // Behind the horizon.
                return DVec2::INFINITY;
            }
            let slopes = self.place_slopes(place.truncate().into()).map(DVec2::from);
            DVec2::from(slopes.map(|slope| (steps * slope.extend(0.0)).length()))
        });
        sides.into_iter().fold(DVec2::INFINITY, DVec2::min)
    }

    fn extent(&self, projection: &Projection) -> f64 {
        self.reach.hypot(projection.far - projection.near)
    }

    fn greatest_coordinate(&self, _: &Projection) -> f64 {
        self.reach
    }

    // Homogeneous texels are as many times as large as the rays are wide.
    fn least_w(&self, projection: &Projection) -> f64 {
        let narrowest = self.width_at(projection.near).min(1.0);
        self.least_w_in(corners(projection.centre)) * narrowest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nothing_in_a_map_is_nearer_to_the_horizon_than_the_least_w() {
        let matrix = DMat3::from_cols_array(&[1.1, 0.1, 0.002, -0.2, 0.9, -0.004, 3.0, 1.0, 1.2]);
        let homography = Homography::new(matrix, 100.0);
        let half = DVec2::new(17.0, 9.5);
        let least = homography.least_w_in(corners(half));
        let mut nearest = f64::INFINITY;
        for i in 0..=20 {
            for j in 0..=20 {
                let unit = DVec2::new(f64::from(i), f64::from(j)) / 10.0 - 1.0;
                let place = homography.ray_from_texel((unit * half).into());
                nearest = nearest.min((matrix * DVec3::from(place)).z);
            }
        }
        assert!(
            least < nearest && least > 0.99 * nearest,
            "{least} {nearest}"
        );
    }
}
