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

impl Kind {
    /// The file that fills the shaders' slot `projection`.
    pub fn shader(self) -> &'static str {
        match self {
            Self::Parallel => "projection/parallel",
            Self::Perspective => "projection/perspective",
            Self::Paraboloid => "projection/paraboloid",
        }
    }
}

/// A projection. Projection space is `q = axes * (point - origin)`; with `c = centre`, `s = scale`,
///
/// | kind | texel | depth |
/// |---|---|---|
/// | parallel | `q.xy + c` | `q.z` |
/// | perspective | `q.xy / q.z + c` | `q.z` |
/// | paraboloid | `s q.xy / (\|q\| + q.z) + c` | `\|q\|` |
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
    padding: u32,
    centre: [f32; 2],
    size: [u32; 2],
    scale: [f32; 2],
    more_padding: [u32; 2],
    step_x: [f32; 4],
    step_y: [f32; 4],
    step_z: [f32; 4],
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
        let is_round = self.kind == Kind::Paraboloid;
        Self {
            x_axis: if is_round {
                self.x_axis
            } else {
                self.x_axis * k.x
            },
            y_axis: if is_round {
                self.y_axis
            } else {
                self.y_axis * k.y
            },
            scale: self.scale * if is_round { k } else { DVec2::ONE },
            centre: self.centre * k,
            width: resolution,
            height: resolution,
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

    /// Texel coordinates (x, y) and depth in world units.
    pub fn texel_from_point(&self, point: DVec3) -> DVec3 {
        let q = self.projected_from_point(point);
        let (texel, depth) = match self.kind {
            Kind::Parallel => (q.truncate(), q.z),
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
            Kind::Parallel => (
                self.origin + steps.x_axis * centred.x + steps.y_axis * centred.y,
                steps.z_axis,
            ),
            Kind::Perspective => (self.origin, steps * centred.extend(1.0)),
            Kind::Paraboloid => {
                let plane = centred / self.scale;
                let squared = plane.length_squared();
                let ray = (2.0 * plane).extend(1.0 - squared) / (1.0 + squared);
                (self.origin, steps * ray)
            }
        }
    }

    /// World vectors of a unit step along each axis of projection space, as columns.
    pub fn steps(&self) -> DMat3 {
        self.axes().inverse()
    }

    /// The area across the ray at a point that one texel covers, in square world units; `steps` are
    /// this projection's.
    pub fn texel_area(&self, steps: &DMat3, point: DVec3) -> f64 {
        let (z, ray) = match self.kind {
            Kind::Parallel => (1.0, steps.z_axis),
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

    /// The width of the widest texel's beam in world units, at a depth of 1 where the rays part.
    pub fn beam_width(&self) -> f64 {
        match self.kind {
            Kind::Parallel | Kind::Perspective => {
                let steps = self.steps();
                steps.x_axis.length().max(steps.y_axis.length())
            }
            Kind::Paraboloid => 2.0 / self.scale.min_element(),
        }
    }

    /// Whether a beam is as wide as its depth is large.
    pub fn beams_widen(&self) -> bool {
        self.kind != Kind::Parallel
    }

    /// Homogeneous (column, row, depth, w) in texels from a point in the world; divide by w. Of a
    /// paraboloid, which has no such matrix, the point in the axes that it is taken in.
    pub fn texel_from_world(&self) -> DMat4 {
        let (offset, scale) = self.depth_from_z();
        let q = DMat4::from_mat3(self.axes()) * DMat4::from_translation(-self.origin);
        let rows = q.transpose();
        let w = match self.kind {
            Kind::Paraboloid => return q,
            Kind::Parallel => DVec4::W,
            Kind::Perspective => rows.z_axis,
        };
        DMat4::from_cols(
            rows.x_axis + w * self.centre.x,
            rows.y_axis + w * self.centre.y,
            (rows.z_axis - DVec4::W * offset) * scale,
            w,
        )
        .transpose()
    }

    /// (offset, scale) such that stored depth = (z - offset) * scale.
    fn depth_from_z(&self) -> (f64, f64) {
        if self.normalizes_depth {
            (self.near, 1.0 / (self.far - self.near))
        } else {
            (0.0, 1.0)
        }
    }

    /// What the shaders' projection space is scaled by: products of three of its coordinates must
    /// stay within float32, whatever the world's unit of length. A power of two, which rounds nothing.
    pub fn unit(&self) -> f64 {
        let length = match self.kind {
            Kind::Parallel => 1.0,
            // A camera may see to infinity.
            Kind::Perspective if !self.normalizes_depth => self.near,
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
            padding: 0,
            centre: self.centre.as_vec2().to_array(),
            size: [self.width, self.height],
            scale: self.scale.as_vec2().to_array(),
            more_padding: [0; 2],
            step_x: padded(steps.x_axis),
            step_y: padded(steps.y_axis),
            step_z: padded(steps.z_axis),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    fn projections() -> [Projection; 3] {
        let rotation = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(0.4);
        [Kind::Parallel, Kind::Perspective, Kind::Paraboloid].map(|kind| Projection {
            kind,
            origin: DVec3::new(3.0, -2.0, 5.0),
            x_axis: rotation * DVec3::X * if kind == Kind::Paraboloid { 1.0 } else { 30.0 },
            y_axis: rotation * DVec3::NEG_Y * if kind == Kind::Paraboloid { 1.0 } else { 40.0 },
            z_axis: rotation * DVec3::NEG_Z,
            centre: DVec2::new(17.0, 9.5),
            scale: DVec2::new(8.0, 9.0),
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
        for projection in &projections()[..2] {
            let homogeneous = projection.texel_from_world() * point.extend(1.0);
            let texel = projection.texel_from_point(point);
            let there = homogeneous.truncate() / homogeneous.w;
            assert!((there.truncate() - texel.truncate()).length() < 1e-10);
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
                at(texel + DVec2::X * h) - at(texel),
                at(texel + DVec2::Y * h) - at(texel),
            );
            let ray = projection.ray_from_texel(texel).1.normalize();
            let area = (dx.cross(dy).dot(ray) / (h * h)).abs();
            let got = projection.texel_area(&projection.steps(), at(texel));
            assert!((got / area - 1.0).abs() < 1e-6, "{got} {area}");
        }
    }
}
