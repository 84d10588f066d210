//! Projections: invertible maps between points and (texel, depth), in float64.
//!
//! The twin of `shaders/lib/projection.wgsl` and `shaders/projection/*.wgsl`; a method fits one here,
//! the shaders use it in float32.

use crate::camera::Camera;
use crate::gpu::scene_tables::double_single;
use bytemuck::{Pod, Zeroable};
use glam::{DMat3, DMat4, DVec2, DVec3, DVec4};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Parallel rays along `z_axis`.
    Parallel,
    /// Rays from the origin, through a plane.
    Perspective,
    /// Rays from the origin, to all sides but one: texels lie in the plane of a stereographic
    /// projection, which is where a paraboloid reflects them.
    Paraboloid,
}

/// A homography of a projection's plane: its texels need not be even.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Homography {
    /// Takes (q.x, q.y, 1) to a homogeneous texel, centred; its last row is positive before the
    /// map's horizon.
    matrix: DMat3,
    inverse: DMat3,
    /// No receiver is farther from the projection's origin across the rays.
    pub reach: f64,
}

impl Homography {
    /// # Panics
    /// If the matrix has no inverse.
    pub fn new(matrix: DMat3, reach: f64) -> Self {
        let inverse = matrix.inverse();
        assert!(inverse.is_finite());
        Self {
            matrix,
            inverse,
            reach,
        }
    }

    /// Centred texel of a place in the plane; not a number behind the horizon.
    fn texel(&self, place: DVec2) -> DVec2 {
        let h = self.matrix * place.extend(1.0);
        if h.z > 0.0 {
            h.truncate() / h.z
        } else {
            DVec2::NAN
        }
    }

    fn place(&self, centred: DVec2) -> DVec2 {
        let h = self.inverse * centred.extend(1.0);
        h.truncate() / h.z
    }

    /// How the place moves per texel to the right and down.
    fn steps(&self, place: DVec2) -> [DVec2; 2] {
        let w = (self.matrix * place.extend(1.0)).z;
        let columns = [self.inverse.x_axis, self.inverse.y_axis];
        columns.map(|column| (column.truncate() - place * column.z) * w)
    }

    /// The least w of a map of that size around the axis, a little less: nothing nearer to the horizon
    /// is in the map.
    fn least_w(&self, half: DVec2) -> f64 {
        let signs = [DVec2::new(1.0, 1.0), DVec2::new(1.0, -1.0)];
        let corners = signs.into_iter().flat_map(|sign| [sign, -sign]);
        let inverses = corners.map(|sign| (self.inverse * (sign * half).extend(1.0)).z);
        0.999 / inverses.fold(f64::MIN_POSITIVE.sqrt(), f64::max)
    }
}

/// A projection. Projection space is `q = axes * (point - origin)`; with `c = centre`, `s = scale`,
///
/// | kind | texel | depth |
/// |---|---|---|
/// | parallel | `q.xy + c` | `q.z` |
/// | perspective | `q.xy / q.z + c` | `q.z` |
/// | paraboloid | `s q.xy / (\|q\| + q.z) + c` | `\|q\|` |
///
/// A homography moves the texels of parallel rays; that of a perspective is in its axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Projection {
    pub kind: Kind,
    pub origin: DVec3,
    /// Rows of the matrix from world to projection space: texels (to the right, down) per world unit,
    /// and depth. Orthonormal for a paraboloid.
    pub x_axis: DVec3,
    pub y_axis: DVec3,
    pub z_axis: DVec3,
    /// Texel coordinates of the projection's axis.
    pub centre: DVec2,
    /// Texels per unit of a paraboloid's plane, whose unit circle is the hemisphere around the axis;
    /// the others have their scale in their axes.
    pub scale: DVec2,
    /// Of parallel rays only.
    pub homography: Option<Homography>,
    pub width: u32,
    pub height: u32,
    /// Depths that are stored, in world units.
    pub near: f64,
    pub far: f64,
    /// Whether depth is stored as 0 at `near` to 1 at `far`, or as it is.
    pub normalizes_depth: bool,
}

/// As `Projection` in `shaders/lib/projection.wgsl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, Pod, Zeroable)]
pub struct ProjectionUniform {
    origin_high: [f32; 3],
    depth_offset: f32,
    origin_low: [f32; 3],
    depth_scale: f32,
    x_axis: [f32; 3],
    z_min: f32,
    y_axis: [f32; 3],
    z_max: f32,
    z_axis: [f32; 3],
    least_w: f32,
    centre: [f32; 2],
    size: [u32; 2],
    scale: [f32; 2],
    padding: [u32; 2],
    step_x: [f32; 4],
    step_y: [f32; 4],
    step_z: [f32; 4],
    texel_from_place: [[f32; 4]; 3],
    place_from_texel: [[f32; 4]; 3],
}

/// Rows of a matrix, padded.
fn rows(matrix: DMat3) -> [[f32; 4]; 3] {
    let rows = matrix.transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.as_vec3().extend(0.0).to_array())
}

impl Projection {
    /// The camera's image: texels are pixels, depth is along the viewing direction.
    pub fn from_camera(camera: &Camera) -> Self {
        Self {
            kind: Kind::Perspective,
            origin: camera.eye,
            x_axis: camera.right * camera.focal.x,
            y_axis: -camera.up * camera.focal.y,
            z_axis: camera.forward,
            centre: camera.centre,
            scale: DVec2::ONE,
            homography: None,
            width: camera.width,
            height: camera.height,
            near: camera.znear,
            far: camera.zfar,
            normalizes_depth: false,
        }
    }

    /// The same rays in another number of texels along each side.
    pub fn with_resolution(&self, resolution: u32) -> Self {
        let side = f64::from(resolution);
        let k = DVec2::new(side / f64::from(self.width), side / f64::from(self.height));
        // The texels of a homography and of a paraboloid are not in their axes.
        let is_round = self.kind == Kind::Paraboloid;
        let is_even = !is_round && self.homography.is_none();
        let axes = if is_even { k } else { DVec2::ONE };
        Self {
            x_axis: self.x_axis * axes.x,
            y_axis: self.y_axis * axes.y,
            scale: self.scale * if is_round { k } else { DVec2::ONE },
            homography: self.homography.map(|homography| {
                let texels = DMat3::from_diagonal(k.extend(1.0));
                Homography::new(texels * homography.matrix, homography.reach)
            }),
            centre: self.centre * k,
            width: resolution,
            height: resolution,
            ..self.clone()
        }
    }

    /// The file that fills the shaders' slot `projection`.
    pub fn shader(&self) -> &'static str {
        match self.kind {
            Kind::Parallel if self.homography.is_some() => "projection/parallel_homography",
            Kind::Parallel => "projection/parallel",
            Kind::Perspective => "projection/perspective",
            Kind::Paraboloid => "projection/paraboloid",
        }
    }

    /// Whether a triangle's edges are lines in the map, those of `line_of_edge` in the shaders.
    pub fn has_straight_edges(&self) -> bool {
        self.kind != Kind::Paraboloid
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

    /// Texel coordinates (x, y) and depth in world units.
    pub fn texel_from_point(&self, point: DVec3) -> DVec3 {
        let q = self.projected_from_point(point);
        let (texel, depth) = match self.kind {
            Kind::Parallel => {
                let place = q.truncate();
                (self.homography.map_or(place, |h| h.texel(place)), q.z)
            }
            Kind::Perspective => (q.truncate() / q.z, q.z),
            Kind::Paraboloid => {
                let length = q.length();
                (self.scale * q.truncate() / (length + q.z), length)
            }
        };
        (texel + self.centre).extend(depth)
    }

    /// The light ray of a place in the map: a point on it and its direction, such that the point
    /// and `depth` times the direction make the place at that depth.
    pub fn ray_from_texel(&self, texel: DVec2) -> (DVec3, DVec3) {
        let centred = texel - self.centre;
        let steps = self.steps();
        match self.kind {
            Kind::Parallel => {
                let place = self.homography.map_or(centred, |h| h.place(centred));
                (
                    self.origin + steps.x_axis * place.x + steps.y_axis * place.y,
                    steps.z_axis,
                )
            }
            Kind::Perspective => (self.origin, steps * centred.extend(1.0)),
            Kind::Paraboloid => {
                let plane = centred / self.scale;
                let squared = plane.length_squared();
                let ray = (2.0 * plane).extend(1.0 - squared) / (1.0 + squared);
                (self.origin, steps * ray)
            }
        }
    }

    /// Points of the world at one depth: columns of the matrix from (column, row, 1) in texels to
    /// homogeneous points. `None` of a paraboloid, which has no such matrix.
    pub fn world_from_texel(&self, depth: f64) -> Option<[DVec4; 3]> {
        let steps = self.steps();
        let (plane, [x, y, origin]) = match self.kind {
            Kind::Paraboloid => return None,
            Kind::Parallel => {
                let plane = self.homography.map_or(DMat3::IDENTITY, |h| h.inverse);
                let origin = self.origin + steps.z_axis * depth;
                (plane, [steps.x_axis, steps.y_axis, origin])
            }
            Kind::Perspective => {
                let [x, y, z] = [steps.x_axis, steps.y_axis, steps.z_axis].map(|step| step * depth);
                (DMat3::IDENTITY, [x, y, self.origin + z])
            }
        };
        let plane = plane * DMat3::from_translation(-self.centre);
        let column =
            |c: DVec3| x.extend(0.0) * c.x + y.extend(0.0) * c.y + origin.extend(1.0) * c.z;
        Some([plane.x_axis, plane.y_axis, plane.z_axis].map(column))
    }

    /// World vectors of a unit step along each axis of projection space, as columns.
    pub fn steps(&self) -> DMat3 {
        self.axes().inverse()
    }

    /// The area across the ray at a point that one texel covers, in square world units; `steps` are
    /// this projection's.
    pub fn texel_area(&self, steps: &DMat3, point: DVec3) -> f64 {
        let (z, ray) = match self.kind {
            Kind::Parallel => {
                let scale = self.homography.map_or(1.0, |homography| {
                    let place = self.projected_from_point(point).truncate();
                    let [right, down] = homography.steps(place);
                    right.perp_dot(down).abs().sqrt()
                });
                (scale, steps.z_axis)
            }
            Kind::Perspective => (self.projected_from_point(point).z, point - self.origin),
            Kind::Paraboloid => {
                // The stereographic projection scales alike in all directions.
                let q = self.projected_from_point(point);
                let width = q.length() + q.z;
                return width * width / (self.scale.x * self.scale.y);
            }
        };
        // The steps lie in the plane of constant depth; the ray meets it at an angle.
        (steps.x_axis.cross(steps.y_axis).dot(ray.normalize()) * z * z).abs()
    }

    /// The width of the widest texel's beam in world units, at a depth of 1 where the rays part; 1
    /// with a homography, where widths differ and the shaders know them.
    pub fn beam_width(&self) -> f64 {
        match self.kind {
            Kind::Parallel if self.homography.is_some() => 1.0,
            Kind::Parallel | Kind::Perspective => {
                let steps = self.steps();
                steps.x_axis.length().max(steps.y_axis.length())
            }
            Kind::Paraboloid => 2.0 / self.scale.min_element(),
        }
    }

    /// Lengths of the sides of the smallest texel across the axis, world units at a depth of 1 where the
    /// rays part.
    pub fn smallest_texel(&self) -> DVec2 {
        if self.kind == Kind::Paraboloid {
            return self.scale.recip();
        }
        let steps = self.steps();
        let Some(homography) = self.homography else {
            return DVec2::new(steps.x_axis.length(), steps.y_axis.length());
        };
        // The nearer to the horizon the larger: the smallest are at a corner.
        let signs = [DVec2::new(1.0, 1.0), DVec2::new(1.0, -1.0)];
        let corners = signs.into_iter().flat_map(|sign| [sign, -sign]);
        let places = corners.map(|sign| homography.place(sign * self.centre));
        let places = places.filter(|place| homography.texel(*place).is_finite());
        let sides = places.map(|place| {
            let sides = homography.steps(place);
            DVec2::from(sides.map(|side| (steps * side.extend(0.0)).length()))
        });
        sides.fold(DVec2::INFINITY, DVec2::min)
    }

    /// Homogeneous (column, row, depth, w) in texels from a point in the world; column and row are to
    /// be divided by w, the depth is as it is. Of a
    /// paraboloid, which has no such matrix, the point in the axes that it is taken in.
    pub fn texel_from_world(&self) -> DMat4 {
        let (offset, scale) = self.depth_from_z();
        let q = DMat4::from_mat3(self.axes()) * DMat4::from_translation(-self.origin);
        let rows = q.transpose();
        let mut plane = [rows.x_axis, rows.y_axis, DVec4::W];
        match self.kind {
            Kind::Paraboloid => return q,
            Kind::Parallel => {
                if let Some(Homography { matrix, .. }) = self.homography {
                    let [x, y, w] = plane;
                    let of_points = |row: DVec3| x * row.x + y * row.y + w * row.z;
                    plane = [0, 1, 2].map(|i| of_points(matrix.row(i)));
                }
            }
            Kind::Perspective => plane[2] = rows.z_axis,
        }
        let [x, y, w] = plane;
        let depth = (rows.z_axis - DVec4::W * offset) * scale;
        DMat4::from_cols(x + w * self.centre.x, y + w * self.centre.y, depth, w).transpose()
    }

    /// (offset, scale) such that stored depth = (z - offset) * scale.
    fn depth_from_z(&self) -> (f64, f64) {
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

    /// What the shaders' projection space is scaled by: products of three of its coordinates must
    /// stay within float32, whatever the world's unit of length. A power of two, which rounds nothing.
    pub fn unit(&self) -> f64 {
        let length = match self.kind {
            // Texels, of which there are few thousand; with a homography, world units.
            Kind::Parallel => self.homography.map_or(1.0, |homography| homography.reach),
            // A camera may see to infinity.
            Kind::Perspective if self.far.is_infinite() => self.near,
            Kind::Perspective | Kind::Paraboloid => self.far,
        };
        (-length.log2().round()).clamp(-100.0, 100.0).exp2()
    }

    /// For the shaders; positions there are relative to `scene_origin`.
    pub fn uniform(&self, scene_origin: DVec3) -> ProjectionUniform {
        let (origin_high, origin_low) = double_single(self.origin - scene_origin);
        let (depth_offset, depth_scale) = self.depth_from_z();
        let unit = self.unit();
        let steps = self.steps() * unit.recip();
        let padded = |v: DVec3| v.as_vec3().extend(0.0).to_array();
        ProjectionUniform {
            origin_high: origin_high.to_array(),
            depth_offset: (depth_offset * unit) as f32,
            origin_low: origin_low.to_array(),
            depth_scale: (depth_scale / unit) as f32,
            x_axis: (self.x_axis * unit).as_vec3().to_array(),
            z_min: (self.near * unit) as f32,
            y_axis: (self.y_axis * unit).as_vec3().to_array(),
            z_max: (self.far * unit).min(f64::from(f32::MAX)) as f32,
            z_axis: (self.z_axis * unit).as_vec3().to_array(),
            least_w: self.homography.map_or(0.0, |h| h.least_w(self.centre)) as f32,
            centre: self.centre.as_vec2().to_array(),
            size: [self.width, self.height],
            scale: self.scale.as_vec2().to_array(),
            padding: [0; 2],
            step_x: padded(steps.x_axis),
            step_y: padded(steps.y_axis),
            step_z: padded(steps.z_axis),
            texel_from_place: rows(self.homography.map_or(DMat3::ZERO, |h| {
                h.matrix * DMat3::from_diagonal(DVec3::new(unit.recip(), unit.recip(), 1.0))
            })),
            place_from_texel: rows(self.homography.map_or(DMat3::ZERO, |h| {
                DMat3::from_diagonal(DVec3::new(unit, unit, 1.0)) * h.inverse
            })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    /// Parallel, perspective, paraboloid, and parallel with a homography.
    fn projections() -> [Projection; 4] {
        let rotation = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(0.4);
        let kinds = [Kind::Parallel, Kind::Perspective, Kind::Paraboloid];
        let [parallel, perspective, paraboloid] = kinds.map(|kind| Projection {
            kind,
            origin: DVec3::new(3.0, -2.0, 5.0),
            x_axis: rotation * DVec3::X * if kind == Kind::Paraboloid { 1.0 } else { 30.0 },
            y_axis: rotation * DVec3::NEG_Y * if kind == Kind::Paraboloid { 1.0 } else { 40.0 },
            z_axis: rotation * DVec3::NEG_Z,
            centre: DVec2::new(17.0, 9.5),
            scale: DVec2::new(8.0, 9.0),
            homography: None,
            width: 34,
            height: 19,
            near: 0.5,
            far: 20.0,
            normalizes_depth: true,
        });
        let matrix = DMat3::from_cols_array(&[1.1, 0.1, 0.002, -0.2, 0.9, -0.004, 3.0, 1.0, 1.2]);
        let homography = Some(Homography::new(matrix, 100.0));
        let moved = Projection {
            homography,
            ..parallel.clone()
        };
        [parallel, perspective, paraboloid, moved]
    }

    #[test]
    fn nothing_in_a_map_is_nearer_to_the_horizon_than_the_least_w() {
        let [.., moved] = projections();
        let homography = moved.homography.unwrap();
        let least = homography.least_w(moved.centre);
        let mut nearest = f64::INFINITY;
        for i in 0..=20 {
            for j in 0..=20 {
                let unit = DVec2::new(f64::from(i), f64::from(j)) / 10.0 - 1.0;
                let place = homography.place(unit * moved.centre);
                nearest = nearest.min((homography.matrix * place.extend(1.0)).z);
            }
        }
        assert!(
            least < nearest && least > 0.99 * nearest,
            "{least} {nearest}"
        );
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
        let [parallel, perspective, _, moved] = projections();
        for projection in [parallel, perspective, moved] {
            let homogeneous = projection.texel_from_world() * point.extend(1.0);
            let texel = projection.texel_from_point(point);
            let there = homogeneous.truncate() / homogeneous.w;
            assert!((there.truncate() - texel.truncate()).length() < 1e-10);
        }
    }

    #[test]
    fn places_at_one_depth_are_where_the_rays_say() {
        let [parallel, perspective, paraboloid, moved] = projections();
        for projection in [parallel, perspective, moved] {
            let texel = DVec2::new(5.5, 12.0);
            let columns = projection.world_from_texel(4.0).unwrap();
            let there = columns[0] * texel.x + columns[1] * texel.y + columns[2];
            let (start, ray) = projection.ray_from_texel(texel);
            let point = there.truncate() / there.w;
            assert!((point - (start + ray * 4.0)).length() < 1e-10, "{point}");
        }
        assert!(paraboloid.world_from_texel(4.0).is_none());
    }

    #[test]
    fn the_smallest_texel_is_at_a_corner() {
        let [parallel, perspective, _, moved] = projections();
        for projection in [parallel, perspective, moved] {
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
            let got = projection.smallest_texel();
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
            let got = projection.texel_area(&projection.steps(), at(texel));
            assert!((got / area - 1.0).abs() < 1e-6, "{got} {area}");
        }
    }
}
