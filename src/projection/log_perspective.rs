//! A perspective along the view whose rows a logarithm spreads evenly: the parameterization of D. Brandon Lloyd, Naga K.
//! Govindaraju, Cory Quammen, Steven E. Molnar, Dinesh Manocha. Logarithmic perspective shadow maps. ACM Transactions on
//! Graphics 27(4), 2008. With H a homography, k the convergence and c the rate,
//!
//! (x, s, 1) w = H (q.x, q.y, 1 + k q.z)        texel = (x, -c log s)        depth = q.z
//!
//! so that s is one over how far a place is from the apex, and a row is as long as it is far away: twin of
//! `shaders/projection/log_perspective.wgsl`, which argues for it.

use super::homography::corners;
use super::{
    Formulas, Homography, Kind, LaneKind, NOWHERE, Projection, ProjectionKind, area_across,
};
use crate::lanes::{Lane, V2, V3};
use crate::region::Region;
use glam::{DMat3, DVec2, DVec3};

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogPerspective<L = f64> {
    /// From a place to (x, s): the column, and one over the distance from the apex, which is one on the axis.
    pub straight: Homography<L>,
    /// Rows for a distance that is e times as large.
    pub rate: L,
}

/// Below this the exponential is near to one, and the difference is taken from a series.
const SMALL: f64 = 0.25;

/// The exponential less one, in which nothing cancels.
#[inline(always)]
fn exp_less_one<L: Lane>(x: L) -> L {
    let term = |n: f64, rest: L| x.constant(1.0) + x / x.constant(n) * rest;
    let series = x * term(
        2.0,
        term(3.0, term(4.0, term(5.0, term(6.0, x.constant(1.0))))),
    );
    L::select(
        x.abs().less(x.constant(SMALL)),
        series,
        x.exp() - x.constant(1.0),
    )
}

impl<L: Lane> LogPerspective<L> {
    /// (x, s) of a texel.
    #[inline(always)]
    fn straight_from_texel(&self, centred: V2<L>) -> V2<L> {
        V2::new(centred.x, (-centred.y / self.rate).exp())
    }

    /// How s falls per row at a point.
    #[inline(always)]
    fn fall(&self, q: V3<L>) -> L {
        let texel = self.straight.homogeneous_texel(q);
        texel.y / (texel.z * self.rate)
    }
}

impl<L: Lane> Formulas<L> for LogPerspective<L> {
    #[inline(always)]
    fn homogeneous_from_projected(&self, q: V3<L>) -> V3<L> {
        self.straight.homogeneous_from_projected(q)
    }

    #[inline(always)]
    fn centred_texel_from_projected(&self, q: V3<L>) -> V2<L> {
        let texel = self.straight.homogeneous_texel(q);
        let nowhere = self.rate.constant(NOWHERE);
        let is_before = self.rate.constant(0.0).less(texel.z);
        let row = -self.rate * (texel.y / texel.z).ln();
        // Nothing behind the horizon is in the map.
        V2::new(texel.x / texel.z, row).map(|t| L::select(is_before, t, nowhere))
    }

    #[inline(always)]
    fn homogeneous_texel(&self, q: V3<L>) -> V3<L> {
        let w = self.straight.homogeneous_texel(q).z;
        (self.centred_texel_from_projected(q) * w).extend(w)
    }

    #[inline(always)]
    fn projected_from_ray(&self, ray: V3<L>, depth: L) -> V3<L> {
        self.straight.projected_from_ray(ray, depth)
    }

    #[inline(always)]
    fn depth_from_projected(&self, q: V3<L>) -> L {
        q.z
    }

    #[inline(always)]
    fn ray_from_projected(&self, q: V3<L>) -> V3<L> {
        self.straight.ray_from_projected(q)
    }

    #[inline(always)]
    fn ray_from_texel(&self, centred: V2<L>) -> V3<L> {
        let straight = self.straight_from_texel(centred);
        self.straight.ray_from_texel(straight)
    }

    #[inline(always)]
    fn depth_plane(&self, normal: V3<L>, q: V3<L>, height: L) -> V3<L> {
        self.straight.depth_plane(normal, q, height)
    }

    #[inline(always)]
    fn depth_on_plane(&self, plane: V3<L>, ray: V3<L>) -> L {
        self.straight.depth_on_plane(plane, ray)
    }

    #[inline(always)]
    fn height_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L> {
        let slope = self.straight.height_slope(normal, q);
        V2::new(slope.x, -slope.y * self.fall(q))
    }

    #[inline(always)]
    fn depth_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L> {
        let slope = self.straight.depth_slope(normal, q);
        V2::new(slope.x, -slope.y * self.fall(q))
    }

    #[inline(always)]
    fn depth_of_neighbour(&self, normal: V3<L>, q: V3<L>, step: V2<L>, most: L) -> L {
        let s = self.fall(q) * self.rate;
        let straight = V2::new(step.x, s * exp_less_one(-step.y / self.rate));
        self.straight.depth_of_neighbour(normal, q, straight, most)
    }

    // The width of a texel's beam at a point.
    #[inline(always)]
    fn beam_growth(&self, q: V3<L>) -> L {
        let place = self.straight.place_from_projected(q);
        let [right, along] = self.straight.place_slopes(place);
        let down = along.length() * self.fall(q);
        self.straight.width_at(q.z) * right.length().max(down)
    }

    // Both sides grow as w does.
    #[inline(always)]
    fn texel_width(&self, q: V3<L>) -> L {
        let place = self.straight.place_from_projected(q);
        let [_, _, last] = self.straight.texel_from_place;
        let w = last.dot(place.extend(self.rate.constant(1.0))).abs();
        self.straight.width_at(q.z) * w
    }
}

impl LogPerspective {
    pub fn new(straight: Homography, rate: f64) -> Self {
        Self { straight, rate }
    }

    /// (x, s) of the corners of a map of that size around its axis.
    fn straight_corners(&self, half: DVec2) -> [DVec2; 4] {
        corners(half).map(|corner| self.straight_from_texel(corner.into()).into())
    }
}

impl LaneKind for LogPerspective {
    type Formulas<L: Lane> = LogPerspective<L>;

    #[inline(always)]
    fn in_lanes<L: Lane>(&self, unit: f64, like: L) -> LogPerspective<L> {
        LogPerspective {
            straight: self.straight.in_lanes(unit, like),
            rate: like.constant(self.rate),
        }
    }
}

impl ProjectionKind for LogPerspective {
    fn name(&self) -> &'static str {
        "log_perspective"
    }

    fn has_straight_edges(&self) -> bool {
        false
    }

    // Before the horizon.
    fn side_from_projected(&self, projection: &Projection, q: V3<f64>) -> f64 {
        self.straight.homogeneous_texel(q).z - self.least_w(projection)
    }

    fn plane_scale(&self) -> DVec2 {
        DVec2::new(1.0, self.rate)
    }

    fn convergence(&self) -> f64 {
        self.straight.convergence()
    }

    fn matrices(&self) -> Option<[DMat3; 2]> {
        self.straight.matrices()
    }

    // The same perspective from an apex as far before the nearest row as the mean of nearest and farthest is: there no
    // row is much wider than another one. (x, s) has the place (x, (1 - s) / 2) 2 / (1 + s).
    fn straightened(&self, projection: &Projection) -> Option<Projection> {
        let size = projection.size().texels();
        let rows = [0.0, size.y].map(|row| ((projection.centre.y - row) / self.rate).exp());
        let [first, last] = rows.map(|s| (1.0 - s) / (1.0 + s));
        let farther = DMat3::from_cols(
            DVec3::X,
            DVec3::new(0.0, -1.0, 1.0),
            DVec3::new(0.0, 1.0, 1.0),
        );
        let rows_per_unit = size.y / (last - first);
        let columns = 1.0 + rows[0].min(rows[1]);
        let scale = DMat3::from_diagonal(DVec3::new(columns, rows_per_unit, 1.0));
        let shift = DVec2::new(0.0, -first * rows_per_unit - projection.centre.y);
        let [matrix, _] = self.straight.matrices()?;
        let matrix = DMat3::from_translation(shift) * scale * farther * matrix;
        let straight = Homography::new(matrix, self.straight.reach);
        Some(Projection {
            kind: straight.with_convergence(self.straight.convergence).into(),
            ..projection.clone()
        })
    }

    fn stretched(&self, k: DVec2) -> (Kind, DVec2) {
        let (straight, rest) = self.straight.stretched_rows(DVec2::new(k.x, 1.0));
        let rate = self.rate * k.y;
        (Self { straight, rate }.into(), rest)
    }

    fn texel_area(&self, projection: &Projection, steps: &DMat3, point: DVec3) -> f64 {
        let q = projection.projected_from_point(point).into();
        let place = self.straight.place_from_projected(q);
        let [right, along] = self.straight.place_slopes(place).map(DVec2::from);
        let area = (right.perp_dot(along) * self.fall(q)).abs();
        let ray = *steps * (DVec2::from(place) * self.straight.convergence).extend(1.0);
        area_across(steps, ray, area.sqrt() * self.straight.width_at(q.z))
    }

    // Both sides grow with the distance from the apex: the smallest are at a corner.
    fn smallest_texel(&self, projection: &Projection, _: &Region) -> DVec2 {
        let steps = projection.steps();
        let sides = corners(projection.centre).map(|corner| {
            let q = DVec3::from(self.ray_from_texel(corner.into())) * DVec3::new(1.0, 1.0, 0.0);
            let place = q.truncate().into();
            let [right, along] = self.straight.place_slopes(place).map(DVec2::from);
            let slopes = [right, along * self.fall(q.into())];
            DVec2::from(slopes.map(|slope| (steps * slope.extend(0.0)).length()))
        });
        sides.into_iter().fold(DVec2::INFINITY, DVec2::min)
    }

    fn extent(&self, projection: &Projection) -> f64 {
        self.straight.extent(projection)
    }

    fn greatest_coordinate(&self, projection: &Projection) -> f64 {
        self.straight.greatest_coordinate(projection)
    }

    // Homogeneous texels are as many times as large as the rays are wide.
    fn least_w(&self, projection: &Projection) -> f64 {
        let narrowest = self.straight.width_at(projection.near).min(1.0);
        let corners = self.straight_corners(projection.centre);
        self.straight.least_w_in(corners) * narrowest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_less_one_is_continuous() {
        for x in [-3.0, -0.2501, -0.2499, -1e-9, 0.0, 1e-4, 0.2, 0.26, 2.0] {
            let x: f64 = x;
            assert!(
                (exp_less_one(x) - x.exp_m1()).abs() <= 6e-8 * x.abs(),
                "{x}"
            );
        }
    }
}
