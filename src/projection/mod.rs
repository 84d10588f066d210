//! Projections: invertible maps between points and (texel, depth).
//!
//! A kind is a file here and its twin of the same name in `shaders/projection/`, and a line in the list below. What
//! the shaders compute in float32 is written once for float64, in which methods fit, and for lanes.

#[cfg(test)]
mod bounds;
mod homography;
mod log_perspective;
mod paraboloid;
mod parallel;
mod perspective;
#[cfg(test)]
mod twins;

pub use homography::Homography;
pub use log_perspective::LogPerspective;
pub use paraboloid::Paraboloid;
pub use parallel::Parallel;
pub use perspective::Perspective;

use crate::camera::{Camera, Rays};
use crate::lanes::{Lane, V2, V3};
use crate::map_size::MapSize;
use crate::region::Region;
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};
use std::ops::Deref;

macro_rules! kinds {
    ($($(#[$doc:meta])* $kind:ident),*) => {
        /// How a projection's rays meet its plane.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum Kind {
            $($(#[$doc])* $kind($kind)),*
        }

        impl Deref for Kind {
            type Target = dyn ProjectionKind;

            fn deref(&self) -> &Self::Target {
                match self {
                    $(Self::$kind(kind) => kind),*
                }
            }
        }

        impl Kind {
            /// What a visitor makes of the kind, compiled for each.
            #[inline(always)]
            pub fn visit<V: KindVisitor>(&self, visitor: V) -> V::Output {
                match self {
                    $(Self::$kind(kind) => visitor.visit(kind)),*
                }
            }
        }

        $(impl From<$kind> for Kind {
            fn from(kind: $kind) -> Self {
                Self::$kind(kind)
            }
        })*
    };
}

kinds! {
    /// Parallel rays along `z_axis`.
    Parallel,
    /// The same or nearly so, where texels need not be even.
    Homography,
    /// The same along the view, whose rows a logarithm spreads.
    LogPerspective,
    /// Rays from the origin, through a plane.
    Perspective,
    /// Rays from the origin, to all sides but one.
    Paraboloid
}

/// A kind as formulas for any lanes.
pub trait LaneKind {
    type Formulas<L: Lane>: Formulas<L>;

    /// For projection space that is scaled by `unit`; `like` says which lanes.
    fn in_lanes<L: Lane>(&self, unit: f64, like: L) -> Self::Formulas<L>;
}

pub trait KindVisitor {
    type Output;

    fn visit<K: LaneKind>(self, kind: &K) -> Self::Output;
}

/// What the shaders ask of a projection, by their names: functions of a point `q` in projection space, of the ray
/// of a texel, and of planes, whose normals are covectors of projection space.
pub trait Formulas<L: Lane> {
    /// Where a triangle's edges and the rays are compared.
    fn homogeneous_from_projected(&self, q: V3<L>) -> V3<L>;
    fn centred_texel_from_projected(&self, q: V3<L>) -> V2<L>;

    /// Centred texel times w, and w: what depths are divided by before they are interpolated along lines of the map.
    #[inline(always)]
    fn homogeneous_texel(&self, q: V3<L>) -> V3<L> {
        self.homogeneous_from_projected(q)
    }

    fn projected_from_ray(&self, ray: V3<L>, depth: L) -> V3<L>;
    fn depth_from_projected(&self, q: V3<L>) -> L;
    fn ray_from_projected(&self, q: V3<L>) -> V3<L>;
    fn ray_from_texel(&self, centred: V2<L>) -> V3<L>;

    /// The same but of any length.
    #[inline(always)]
    fn direction_from_texel(&self, centred: V2<L>) -> V3<L> {
        self.ray_from_texel(centred)
    }

    /// Coefficients of the plane through a point, at a height: the normal's product with any point of the plane.
    fn depth_plane(&self, normal: V3<L>, q: V3<L>, height: L) -> V3<L>;
    fn depth_on_plane(&self, plane: V3<L>, ray: V3<L>) -> L;
    /// Height over the plane through a point, per texel along each axis.
    fn height_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L>;
    /// Depth per texel of the plane through a point.
    fn depth_slope(&self, normal: V3<L>, q: V3<L>) -> V2<L>;
    /// Depth of the plane through a point where a ray `step` texels away meets it; around a light no more than
    /// `most` times as near or as far.
    fn depth_of_neighbour(&self, normal: V3<L>, q: V3<L>, step: V2<L>, most: L) -> L;
    /// How much wider a texel's beam is at a point than at the depth that widths are given for.
    fn beam_growth(&self, q: V3<L>) -> L;
    /// How wide a texel is at a point, against others of the same map: the root of its area across the axis.
    fn texel_width(&self, q: V3<L>) -> L;
}

/// What else there is to know of a kind, in float64.
pub trait ProjectionKind: Formulas<f64> {
    /// That of the file here and of its twin.
    fn name(&self) -> &'static str;

    /// Whether a triangle's edges are lines in the map, those of `line_of_edge` in the shaders.
    fn has_straight_edges(&self) -> bool {
        true
    }

    /// Whether the rays come from the projection's origin.
    fn is_central(&self) -> bool {
        false
    }

    /// Positive in the half of space that corners can be taken from to the map.
    fn side_from_projected(&self, _: &Projection, _: V3<f64>) -> f64 {
        1.0
    }

    /// Texels per unit of a plane that is no plane of the world.
    fn plane_scale(&self) -> DVec2 {
        DVec2::ONE
    }

    /// One over how far before the origin rays meet that are nearly parallel.
    fn convergence(&self) -> f64 {
        0.0
    }

    /// Half the width of the axes' plane within an angle of the axis.
    fn plane_radius(&self, _angle: f64) -> f64 {
        f64::INFINITY
    }

    /// Matrices from homogeneous places in the plane to homogeneous centred texels, and back; none where
    /// texels follow from points by no matrix. Where edges are not straight, rows follow from what they give.
    fn matrices(&self) -> Option<[DMat3; 2]> {
        Some([DMat3::IDENTITY; 2])
    }

    /// A map of the same rays in which a triangle's edges are lines; none where there is none or this is one.
    fn straightened(&self, _: &Projection) -> Option<Projection> {
        None
    }

    /// The kind with so many times the texels along each side, and what of that is left to the axes.
    fn stretched(&self, k: DVec2) -> (Kind, DVec2);

    /// The area across the ray at a point that one texel covers, in square world units; `steps` are
    /// the projection's.
    fn texel_area(&self, projection: &Projection, steps: &DMat3, point: DVec3) -> f64;

    /// The width of the widest texel's beam in world units, at a depth of 1 where the rays part.
    fn beam_width(&self, projection: &Projection) -> f64 {
        projection.step_lengths().max_element()
    }

    /// Lengths of the sides of the smallest texel of a map for a region, across the axis, in world units at a depth of 1
    /// where the rays part.
    fn smallest_texel(&self, projection: &Projection, _: &Region) -> DVec2 {
        projection.step_lengths()
    }

    /// No point of the map is farther from another one, or from the origin of the rays, in world units.
    fn extent(&self, projection: &Projection) -> f64 {
        projection.far
    }

    /// No coordinate of projection space is larger by magnitudes.
    fn greatest_coordinate(&self, projection: &Projection) -> f64 {
        // A camera may see to infinity.
        if projection.far.is_infinite() {
            projection.near
        } else {
            projection.far
        }
    }

    /// No homogeneous texel in the map has a smaller w: nothing in it is nearer to the horizon.
    fn least_w(&self, _: &Projection) -> f64 {
        0.0
    }
}

/// A texel far outside of every map: of a point that has none.
const NOWHERE: f64 = 1e8;

/// The area across a ray of a texel whose sides are so many times the steps, which lie in the plane of constant
/// depth: the ray meets it at an angle.
fn area_across(steps: &DMat3, ray: DVec3, growth: f64) -> f64 {
    let along = steps.x_axis.cross(steps.y_axis).dot(ray.normalize());
    (along * growth * growth).abs()
}

/// A projection. Projection space is `q = axes * (point - origin)`; the kind takes it to depths and to texels
/// around `centre`.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    pub kind: Kind,
    pub origin: DVec3,
    /// Rows of the matrix from world to projection space: texels (to the right, down) per world unit,
    /// and depth. Orthonormal where the kind has a scale of its own.
    pub x_axis: DVec3,
    pub y_axis: DVec3,
    pub z_axis: DVec3,
    /// Texel coordinates of the projection's axis.
    pub centre: DVec2,
    pub width: u32,
    pub height: u32,
    /// Depths that are stored, in world units.
    pub near: f64,
    pub far: f64,
    /// Whether depth is stored as 0 at `near` to 1 at `far`, or as it is.
    pub normalizes_depth: bool,
}

impl Projection {
    /// The camera's image: texels are pixels, depth is along the viewing direction.
    pub fn from_camera(camera: &Camera) -> Self {
        Self {
            kind: match camera.rays {
                Rays::Perspective => Perspective.into(),
                Rays::Orthographic => Parallel.into(),
            },
            origin: camera.eye,
            x_axis: camera.right * camera.focal.x,
            y_axis: -camera.up * camera.focal.y,
            z_axis: camera.forward,
            centre: camera.centre,
            width: camera.width,
            height: camera.height,
            near: camera.znear,
            far: camera.zfar,
            normalizes_depth: false,
        }
    }

    /// Of the map.
    pub fn size(&self) -> MapSize {
        MapSize {
            width: self.width,
            height: self.height,
        }
    }

    /// The same rays in another number of texels.
    pub fn with_size(&self, size: MapSize) -> Self {
        let k = size.texels() / self.size().texels();
        self.stretched(k, self.centre * k, size)
    }

    /// The map of axes with one texel to the unit of their plane over a rectangle around a place in it.
    pub fn around(&self, middle: DVec2, texels_per_unit: DVec2, size: MapSize) -> Self {
        let centre = size.middle() - middle * texels_per_unit;
        self.stretched(texels_per_unit, centre, size)
    }

    fn stretched(&self, k: DVec2, centre: DVec2, size: MapSize) -> Self {
        let (kind, k) = self.kind.stretched(k);
        Self {
            kind,
            x_axis: self.x_axis * k.x,
            y_axis: self.y_axis * k.y,
            centre,
            width: size.width,
            height: size.height,
            ..self.clone()
        }
    }

    pub fn texel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    fn axes(&self) -> DMat3 {
        DMat3::from_cols(self.x_axis, self.y_axis, self.z_axis).transpose()
    }

    pub fn projected_from_point(&self, point: DVec3) -> DVec3 {
        self.axes() * (point - self.origin)
    }

    /// Texel coordinates (x, y) and depth in world units; not numbers for a point that has no texel.
    pub fn texel_from_point(&self, point: DVec3) -> DVec3 {
        let q = self.projected_from_point(point).into();
        let centred = DVec2::from(self.kind.centred_texel_from_projected(q));
        let is_nowhere = centred == DVec2::splat(NOWHERE);
        let centred = if is_nowhere { DVec2::NAN } else { centred };
        (centred + self.centre).extend(self.kind.depth_from_projected(q))
    }

    /// The light ray of a place in the map: a point on it and its direction, such that the point
    /// and `depth` times the direction make the place at that depth.
    pub fn ray_from_texel(&self, texel: DVec2) -> (DVec3, DVec3) {
        let ray = DVec3::from(self.kind.ray_from_texel((texel - self.centre).into()));
        let steps = self.steps();
        if self.kind.is_central() {
            (self.origin, steps * ray)
        } else {
            let start = self.origin + steps.x_axis * ray.x + steps.y_axis * ray.y;
            let leaving = ray.truncate() * self.kind.convergence();
            (start, steps * leaving.extend(1.0))
        }
    }

    /// Points of the world at one depth: columns of the matrix from (column, row, 1) in texels to
    /// homogeneous points. `None` where texels follow from points by no matrix.
    pub fn world_from_texel(&self, depth: f64) -> Option<[DVec4; 3]> {
        let [_, plane] = self.straight_matrices()?;
        let steps = self.steps();
        let z = self.origin + steps.z_axis * depth;
        let width = match self.kind.is_central() {
            true => depth,
            false => 1.0 + self.kind.convergence() * depth,
        };
        let [x, y] = [steps.x_axis, steps.y_axis].map(|step| (step * width).extend(0.0));
        let plane = plane * DMat3::from_translation(-self.centre);
        let column = |c: DVec3| x * c.x + y * c.y + z.extend(1.0) * c.z;
        Some([plane.x_axis, plane.y_axis, plane.z_axis].map(column))
    }

    /// World vectors of a unit step along each axis of projection space, as columns.
    pub fn steps(&self) -> DMat3 {
        self.axes().inverse()
    }

    fn step_lengths(&self) -> DVec2 {
        let steps = self.steps();
        DVec2::new(steps.x_axis.length(), steps.y_axis.length())
    }

    /// Of a kind in which edges are straight.
    fn straight_matrices(&self) -> Option<[DMat3; 2]> {
        let matrices = self.kind.matrices();
        matrices.filter(|_| self.kind.has_straight_edges())
    }

    /// Homogeneous (column, row, depth, w) in texels from a point in the world; column and row are to
    /// be divided by w, the depth is as it is. Of a
    /// paraboloid, which has no such matrix, the point in the axes that it is taken in; of a logarithm s w for the row,
    /// which is the centre's less the rate times the logarithm of s.
    pub fn texel_from_world(&self) -> DMat4 {
        let from_origin = DMat4::from_translation(-self.origin);
        let Some(matrices) = self.kind.matrices() else {
            return DMat4::from_mat3(self.axes()) * from_origin;
        };
        let centre_row = match self.kind.has_straight_edges() {
            true => self.centre.y,
            false => 0.0,
        };
        let [x, y, w] = self.rows_over_points(&matrices[0], DVec2::new(self.centre.x, centre_row));
        let (offset, scale) = self.depth_from_z();
        let depth = (self.z_axis.extend(0.0) - DVec4::W * offset) * scale;
        DMat4::from_cols(x, y, depth, w).transpose() * from_origin
    }

    /// Column, row and w of a texel, column and row times w, as functions of (point, 1), the point relative to the
    /// origin. `None` where texels follow from points by no matrix.
    pub fn homogeneous_rows(&self) -> Option<[DVec4; 3]> {
        let [matrix, _] = self.straight_matrices()?;
        Some(self.rows_over_points(&matrix, self.centre))
    }

    fn rows_over_points(&self, matrix: &DMat3, centre: DVec2) -> [DVec4; 3] {
        let z = self.z_axis.extend(0.0);
        let last = match self.kind.is_central() {
            true => z,
            false => DVec4::W + z * self.kind.convergence(),
        };
        let (right, down) = (self.x_axis.extend(0.0), self.y_axis.extend(0.0));
        let row = |row: DVec3| right * row.x + down * row.y + last * row.z;
        let [x, y, w] = [0, 1, 2].map(|i| row(matrix.row(i)));
        [x + w * centre.x, y + w * centre.y, w]
    }

    /// (offset, scale) such that stored depth = (z - offset) * scale.
    pub fn depth_from_z(&self) -> (f64, f64) {
        if self.normalizes_depth {
            (self.near, 1.0 / (self.far - self.near))
        } else {
            (0.0, 1.0)
        }
    }

    pub fn greatest_stored_depth(&self) -> f64 {
        let (offset, scale) = self.depth_from_z();
        (self.far - offset) * scale
    }

    /// What projection space is scaled by for float32: products of three of its coordinates must stay within it, whatever the world's unit of length. A power of two, which rounds nothing.
    pub fn unit(&self) -> f64 {
        let length = self.kind.greatest_coordinate(self);
        (-length.log2().round()).clamp(-100.0, 100.0).exp2()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn homography() -> Homography {
        let matrix = DMat3::from_cols_array(&[1.1, 0.1, 0.002, -0.2, 0.9, -0.004, 3.0, 1.0, 1.2]);
        Homography::new(matrix, 100.0)
    }

    fn log_perspective() -> LogPerspective {
        let matrix = DMat3::from_cols_array(&[1.1, 0.0, 0.002, -0.2, 0.0, -0.004, 3.0, 1.0, 1.2]);
        LogPerspective::new(Homography::new(matrix, 100.0), 30.0)
    }

    /// Parallel, perspective, paraboloid, parallel with a homography, the same of rays that meet, and with a logarithm.
    fn projections() -> [Projection; 6] {
        let rotation = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(0.4);
        let even = DVec2::new(30.0, 40.0);
        let round = Paraboloid::UNIT.stretched(DVec2::new(8.0, 9.0)).0;
        let kinds = [
            (Parallel.into(), even),
            (Perspective.into(), even),
            (round, DVec2::ONE),
            (homography().into(), even),
            (homography().with_convergence(0.04).into(), even),
            (log_perspective().into(), even),
        ];
        kinds.map(|(kind, k)| Projection {
            kind,
            origin: DVec3::new(3.0, -2.0, 5.0),
            x_axis: rotation * DVec3::X * k.x,
            y_axis: rotation * DVec3::NEG_Y * k.y,
            z_axis: rotation * DVec3::NEG_Z,
            centre: DVec2::new(17.0, 9.5),
            width: 34,
            height: 19,
            near: 0.5,
            far: 20.0,
            normalizes_depth: true,
        })
    }

    #[test]
    fn both_directions_are_inverse() {
        for projection in projections() {
            for texel in [
                DVec2::new(0.5, 0.5),
                DVec2::new(31.0, 2.5),
                DVec2::new(16.9, 9.4),
            ] {
                let (start, ray) = projection.ray_from_texel(texel);
                let there = projection.texel_from_point(start + ray * 7.25);
                assert!((there - texel.extend(7.25)).length() < 1e-12, "{there}");
            }
        }
    }

    #[test]
    fn matrix_agrees_with_the_functions() {
        let point = DVec3::new(1.0, -4.0, -3.0);
        let [parallel, perspective, _, moved, meeting, _] = projections();
        for projection in [parallel, perspective, moved, meeting] {
            let homogeneous = projection.texel_from_world() * point.extend(1.0);
            let texel = projection.texel_from_point(point);
            let there = homogeneous.truncate() / homogeneous.w;
            assert!((there.truncate() - texel.truncate()).length() < 1e-10);
        }
    }

    #[test]
    fn places_at_one_depth_are_where_the_rays_say() {
        let [parallel, perspective, paraboloid, moved, meeting, log] = projections();
        for projection in [parallel, perspective, moved, meeting] {
            let texel = DVec2::new(5.5, 12.0);
            let columns = projection.world_from_texel(4.0).unwrap();
            let there = columns[0] * texel.x + columns[1] * texel.y + columns[2];
            let (start, ray) = projection.ray_from_texel(texel);
            let point = there.truncate() / there.w;
            assert!((point - (start + ray * 4.0)).length() < 1e-10, "{point}");
        }
        for curved in [paraboloid, log] {
            assert!(curved.world_from_texel(4.0).is_none());
        }
    }

    #[test]
    fn rays_of_a_log_perspective_are_in_its_straight_map() {
        let [.., log] = projections();
        let straight = log.kind.straightened(&log).unwrap();
        let size = log.size().texels();
        for share in [DVec2::ZERO, DVec2::new(0.3, 0.6), DVec2::ONE] {
            let (start, ray) = log.ray_from_texel(size * share);
            let there = straight.texel_from_point(start + ray * 4.0).truncate() / size;
            assert!(there.cmpge(DVec2::splat(-1e-12)).all(), "{there}");
            assert!(there.cmple(DVec2::splat(1.0 + 1e-12)).all(), "{there}");
            let row = [0.0, 1.0].contains(&share.y).then_some(share.y);
            assert!(
                row.is_none_or(|row| (there.y - row).abs() < 1e-12),
                "{there}"
            );
        }
        let homogeneous = log.texel_from_world() * DVec3::new(3.3, -2.1, -2.0).extend(1.0);
        let [x, s] = [homogeneous.x, homogeneous.y].map(|v| v / homogeneous.w);
        let texel = log.texel_from_point(DVec3::new(3.3, -2.1, -2.0));
        let row = log.centre.y - log.kind.plane_scale().y * s.ln();
        assert!((DVec2::new(x, row) - texel.truncate()).length() < 1e-10);
    }

    #[test]
    fn the_smallest_texel_is_at_a_corner() {
        let [parallel, perspective, _, moved, meeting, log] = projections();
        for projection in [parallel, perspective, moved, meeting, log] {
            let mut least = DVec2::INFINITY;
            for i in 0..projection.width {
                for j in 0..projection.height {
                    let texel = DVec2::new(f64::from(i), f64::from(j)) + 0.5;
                    let at = |texel| {
                        let (start, ray) = projection.ray_from_texel(texel);
                        start + ray / ray.dot(projection.z_axis)
                    };
                    let h = 1e-3;
                    least = least.min(DVec2::new(
                        (at(texel + DVec2::X * h) - at(texel)).length() / h,
                        (at(texel + DVec2::Y * h) - at(texel)).length() / h,
                    ));
                }
            }
            let everywhere = Region::EVERYWHERE;
            let got = projection.kind.smallest_texel(&projection, &everywhere);
            assert!(
                (got / least - 1.0).abs().max_element() < 0.1,
                "{got} {least}"
            );
        }
    }

    #[test]
    fn texel_area_is_that_of_the_parallelogram_across_the_ray() {
        for projection in projections() {
            let texel = DVec2::new(3.0, 4.0);
            let depth = 6.0;
            let at = |texel| {
                let (start, ray) = projection.ray_from_texel(texel);
                start + ray * depth
            };
            let h = 1e-4;
            let (dx, dy) = (
                at(texel + DVec2::X * (0.5 * h)) - at(texel - DVec2::X * (0.5 * h)),
                at(texel + DVec2::Y * (0.5 * h)) - at(texel - DVec2::Y * (0.5 * h)),
            );
            let ray = projection.ray_from_texel(texel).1.normalize();
            let area = (dx.cross(dy).dot(ray) / (h * h)).abs();
            let got = projection
                .kind
                .texel_area(&projection, &projection.steps(), at(texel));
            assert!((got / area - 1.0).abs() < 1e-6, "{got} {area}");
        }
    }
}
