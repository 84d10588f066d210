//! The camera: it looks along its own -Z (glTF's convention), from a pinhole or along parallel rays.

use crate::error::{Result, ensure_value};
use crate::rounding::{MAX_SEEN_ROUNDING, ROUNDING};
use crate::sides::Source;
use glam::{DMat4, DVec2, DVec3, DVec4};

/// Where the rays of an image's pixels go.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rays {
    /// All from the eye: a pinhole.
    Perspective,
    /// Side by side along the view: an orthographic camera.
    Orthographic,
}

/// A camera, in float64.
///
/// It takes a point that is `x` to the right of the eye, `y` below it and `depth` ahead to `centre + focal * (x, y) / w`,
/// where `w` is the depth, or 1 of parallel rays.
///
/// Image coordinates are in pixels, x to the right, y down, origin at the top left corner; the
/// centre of pixel (column, row) is at (column + 0.5, row + 0.5).
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    pub rays: Rays,
    /// Position of the pinhole in world space, or of the middle of the image.
    pub eye: DVec3,
    /// Unit axes of the image in world space; `forward` is the viewing direction.
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Focal lengths in pixels; pixels per world unit of parallel rays.
    pub focal: DVec2,
    /// Principal point in image coordinates.
    pub centre: DVec2,
    pub width: u32,
    pub height: u32,
    /// Range of depth along `forward` that is seen; `zfar` may be infinite.
    pub znear: f64,
    pub zfar: f64,
}

impl Camera {
    /// A pinhole, from a camera-to-world pose, whose rotation must be orthonormal, and intrinsics in pixels.
    pub fn new(
        world_from_camera: DMat4,
        focal: DVec2,
        centre: DVec2,
        size: (u32, u32),
        depths: (f64, f64),
    ) -> Result<Self> {
        let rays = Rays::Perspective;
        Self::with_rays(rays, world_from_camera, focal, centre, size, depths)
    }

    /// The same, or a camera of parallel rays, whose focal lengths are pixels per world unit.
    pub fn with_rays(
        rays: Rays,
        world_from_camera: DMat4,
        focal: DVec2,
        centre: DVec2,
        (width, height): (u32, u32),
        (znear, zfar): (f64, f64),
    ) -> Result<Self> {
        ensure_value!(
            world_from_camera.is_finite(),
            "camera pose must be finite, got {:?}",
            world_from_camera.transpose().to_cols_array_2d()
        );
        let bottom = world_from_camera.transpose().w_axis;
        ensure_value!(
            (bottom - DVec4::W).abs().max_element() < 1e-9,
            "camera pose must have the last row (0, 0, 0, 1), got {:?}",
            bottom.to_array()
        );
        let axes = glam::DMat3::from_mat4(world_from_camera);
        let gram = axes.transpose() * axes;
        let skew = (gram - glam::DMat3::IDENTITY)
            .to_cols_array()
            .iter()
            .fold(0.0_f64, |m, v| m.max(v.abs()));
        ensure_value!(
            skew < 1e-4 && axes.determinant() > 0.0,
            "camera pose must be a rotation and a translation without scale or mirror: \
             its axes differ from orthonormal by {skew:.3e} and have determinant {:.3e}",
            axes.determinant()
        );
        ensure_value!(
            width > 0 && height > 0,
            "image size must be at least 1 x 1 pixels, got width {width}, height {height}"
        );
        ensure_value!(
            focal.is_finite() && focal.min_element() > 0.0,
            "focal lengths must be finite and positive, got {:?}",
            focal.to_array()
        );
        ensure_value!(
            centre.is_finite(),
            "principal point must be finite, got {:?}",
            centre.to_array()
        );
        // The image of a pinhole is at no depth.
        let (least, is_far_enough) = match rays {
            Rays::Perspective => ("<", znear > 0.0),
            Rays::Orthographic => ("<=", znear >= 0.0),
        };
        ensure_value!(
            is_far_enough && znear.is_finite() && zfar > znear,
            "znear and zfar must satisfy 0 {least} znear < zfar, got znear {znear}, zfar {zfar}"
        );
        // Exactly orthonormal axes: a pose that went through float32 is not.
        let forward = -axes.z_axis.normalize();
        let right = forward.cross(axes.y_axis).normalize();
        Ok(Self {
            rays,
            eye: world_from_camera.w_axis.truncate(),
            right,
            up: right.cross(forward),
            forward,
            focal,
            centre,
            width,
            height,
            znear,
            zfar,
        })
    }

    /// Refuses a camera that float32 cannot follow: an engine keeps positions relative to the eye.
    pub fn check_float32(&self, (low, high): (DVec3, DVec3)) -> Result<()> {
        let size = (high - low).length();
        let distance = self.eye.distance(self.eye.clamp(low, high));
        ensure_value!(
            ROUNDING * distance <= MAX_SEEN_ROUNDING * size || size == 0.0,
            "camera eye must be within {} times the scene's size of it to be rendered, got {:.3e} times: \
             positions relative to it are float32 (lixel.reference is float64, and sees from there)",
            MAX_SEEN_ROUNDING / ROUNDING,
            distance / size
        );
        let focal = self.focal.max_element();
        ensure_value!(
            self.rays == Rays::Orthographic || ROUNDING * focal <= 1.0,
            "camera focal lengths must be at most {} pixels to be rendered, got {focal:e}: directions are \
             float32, which does not tell narrower pixels apart (lixel.reference is float64)",
            1.0 / ROUNDING
        );
        Ok(())
    }

    pub fn pixel_count(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// How far a homogeneous point is to the right of an eye, above it and ahead, as functions of the point.
    pub fn rows_from(&self, eye: DVec3) -> [DVec4; 3] {
        [self.right, self.up, self.forward].map(|axis| axis.extend(-axis.dot(eye)))
    }

    /// The ray through the centre of a pixel: where it starts relative to the eye, and its direction, whose component
    /// along `forward` is 1, so that a point `eye + start + depth * direction` has depth `depth`.
    pub fn ray_from_pixel(&self, column: u32, row: u32) -> (DVec3, DVec3) {
        self.ray_from_place(DVec2::new(column as f64 + 0.5, row as f64 + 0.5))
    }

    /// The same through any place in image coordinates.
    pub fn ray_from_place(&self, place: DVec2) -> (DVec3, DVec3) {
        let image = place - self.centre;
        let (x, y) = (image.x / self.focal.x, image.y / self.focal.y);
        match self.rays {
            Rays::Perspective => (DVec3::ZERO, self.forward + self.right * x - self.up * y),
            Rays::Orthographic => (self.right * x - self.up * y, self.forward),
        }
    }

    /// What image coordinates are divided by at a depth: how many times as wide as at a depth of 1 the image is there.
    pub fn width_at(&self, depth: f64) -> f64 {
        match self.rays {
            Rays::Perspective => depth,
            Rays::Orthographic => 1.0,
        }
    }

    /// The same as a function of a homogeneous point, by that of the depth.
    pub fn row_of_width(&self, depth: DVec4) -> DVec4 {
        match self.rays {
            Rays::Perspective => depth,
            Rays::Orthographic => DVec4::W,
        }
    }

    /// Where a point relative to the eye is in the image, and its depth.
    pub fn place_from_eye(&self, from_eye: DVec3) -> (DVec2, f64) {
        let depth = from_eye.dot(self.forward);
        let across = DVec2::new(from_eye.dot(self.right), -from_eye.dot(self.up));
        (
            self.centre + self.focal * across / self.width_at(depth),
            depth,
        )
    }

    /// Along the ray that sees a point relative to the eye, of any length.
    pub fn sight_of(&self, from_eye: DVec3) -> DVec3 {
        match self.rays {
            Rays::Perspective => from_eye,
            Rays::Orthographic => self.forward,
        }
    }

    /// Where the image is, as a source of rays: the same side of a triangle is seen by all pixels.
    pub fn source(&self) -> Source {
        match self.rays {
            Rays::Perspective => Source::Point(self.eye),
            Rays::Orthographic => Source::Direction(-self.forward),
        }
    }

    /// Column and row around the principal point, each times `w`, and `w`: functions of a homogeneous point in the world.
    pub fn rows_of_centred_image(&self) -> [DVec4; 3] {
        let [right, up, forward] = self.rows_from(self.eye);
        let w = self.row_of_width(forward);
        [right * self.focal.x, -up * self.focal.y, w]
    }

    /// Column and row, each times `w`, and `w`: functions of (point, 1), the point relative to the eye.
    pub fn image_rows(&self) -> [DVec4; 3] {
        let w = self.row_of_width(self.forward.extend(0.0));
        let row = |axis: DVec3, focal: f64, centre: f64| (axis * focal).extend(0.0) + w * centre;
        [
            row(self.right, self.focal.x, self.centre.x),
            row(-self.up, self.focal.y, self.centre.y),
            w,
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera(pose: DMat4, size: (u32, u32)) -> Result<Camera> {
        Camera::new(
            pose,
            DVec2::splat(100.0),
            DVec2::new(8.0, 4.0),
            size,
            (0.1, f64::INFINITY),
        )
    }

    #[test]
    fn looks_along_minus_z_with_row_0_at_the_top() {
        let camera = camera(DMat4::IDENTITY, (16, 8)).unwrap();
        assert_eq!(camera.forward, DVec3::NEG_Z);
        let (start, ray) = camera.ray_from_pixel(0, 0);
        assert_eq!(start, DVec3::ZERO);
        assert!(ray.x < 0.0 && ray.y > 0.0 && ray.z == -1.0, "{ray}");
    }

    #[test]
    fn points_on_the_ray_of_a_place_are_there() {
        let pose = DMat4::from_rotation_y(0.7) * DMat4::from_rotation_x(-0.4);
        let (focal, centre) = (DVec2::new(30.0, 40.0), DVec2::new(7.0, 5.0));
        for rays in [Rays::Perspective, Rays::Orthographic] {
            let camera = Camera::with_rays(rays, pose, focal, centre, (16, 8), (0.1, 9.0)).unwrap();
            let place = DVec2::new(3.25, 6.5);
            let (start, ray) = camera.ray_from_place(place);
            for depth in [0.5, 4.0] {
                let point = start + depth * ray;
                let (there, found) = camera.place_from_eye(point);
                assert!((there - place).length() < 1e-12 && (found - depth).abs() < 1e-12);
                let image = camera.image_rows().map(|row| row.dot(point.extend(1.0)));
                let there = DVec2::new(image[0], image[1]) / image[2];
                assert!((there - place).length() < 1e-12);
                assert!((image[2] - camera.width_at(depth)).abs() < 1e-12);
                assert!(camera.sight_of(point).cross(ray).length() < 1e-12);
            }
        }
    }

    #[test]
    fn refuses_what_is_not_a_camera() {
        let scaled = DMat4::from_scale(DVec3::splat(2.0));
        for (pose, size, rule) in [
            (scaled, (16, 8), "rotation"),
            (
                DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0)),
                (16, 8),
                "mirror",
            ),
            (DMat4::NAN, (16, 8), "finite"),
            (DMat4::IDENTITY, (0, 8), "at least 1 x 1"),
        ] {
            let message = camera(pose, size).unwrap_err().to_string();
            assert!(message.contains(rule), "{message}");
        }
    }
}
