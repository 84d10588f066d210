//! The camera: a pinhole that looks along its own -Z (glTF's convention).

use crate::error::{Result, ensure_value};
use crate::rounding::{MAX_SEEN_ROUNDING, ROUNDING};
use glam::{DMat4, DVec2, DVec3, DVec4};

/// A pinhole camera, in float64.
///
/// Image coordinates are in pixels, x to the right, y down, origin at the top left corner; the
/// centre of pixel (column, row) is at (column + 0.5, row + 0.5).
#[derive(Debug, Clone, PartialEq)]
pub struct Camera {
    /// Position of the pinhole in world space.
    pub eye: DVec3,
    /// Unit axes of the image in world space; `forward` is the viewing direction.
    pub right: DVec3,
    pub up: DVec3,
    pub forward: DVec3,
    /// Focal lengths in pixels.
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
    /// From a camera-to-world pose, whose rotation must be orthonormal, and intrinsics in pixels.
    pub fn new(
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
        ensure_value!(
            znear > 0.0 && znear.is_finite() && zfar > znear,
            "znear and zfar must satisfy 0 < znear < zfar, got znear {znear}, zfar {zfar}"
        );
        // Exactly orthonormal axes: a pose that went through float32 is not.
        let forward = -axes.z_axis.normalize();
        let right = forward.cross(axes.y_axis).normalize();
        Ok(Self {
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
            ROUNDING * focal <= 1.0,
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

    /// The ray through the centre of a pixel; its component along `forward` is 1, so that a point
    /// `eye + depth * ray` has depth `depth`.
    pub fn ray_from_pixel(&self, column: u32, row: u32) -> DVec3 {
        let image = DVec2::new(column as f64 + 0.5, row as f64 + 0.5) - self.centre;
        self.forward + self.right * (image.x / self.focal.x) - self.up * (image.y / self.focal.y)
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
        let ray = camera.ray_from_pixel(0, 0);
        assert!(ray.x < 0.0 && ray.y > 0.0 && ray.z == -1.0, "{ray}");
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
