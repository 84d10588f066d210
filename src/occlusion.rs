//! Whether one triangle shadows one receiver, in float64: what an engine asks where float32 is not sure.
//!
//! The receiver is the point where the middle of a pixel meets the plane of a triangle. It is in shadow where its
//! triangle shows the camera the side away from the light, where it is outside of the light's cone, or where
//! another triangle lies between it and the light. A triangle in whose plane the light lies shadows nothing, and
//! one in whose plane the receiver lies does not shadow it.

use crate::camera::Camera;
use crate::light::{Cone, Light};
use crate::rounding::FLOAT64_ROUNDING;
use crate::scene::{Scene, unit_normal};
use crate::sides::Source;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

/// How a camera sees a receiver.
#[derive(Debug, Clone, Copy)]
pub struct Own {
    /// The one that it is on.
    triangle: u32,
    viewer: Source,
    /// Where the camera's ray starts, relative to the eye.
    start: DVec3,
}

/// A receiver and its ray towards the light.
pub struct ReceiverRay<'a> {
    scene: &'a Scene,
    pub eye: DVec3,
    source: Source,
    own: Option<Own>,
    /// The receiver relative to the eye.
    pub point: DVec3,
    /// The vector from the receiver to the light, of length one where that is at infinity.
    pub to_light: DVec3,
    /// How far rounding may have moved the receiver.
    margin: f64,
    /// Unit axes across it.
    axes: [DVec3; 2],
}

impl<'a> ReceiverRay<'a> {
    /// Of a pixel, row * width + column, that sees a triangle.
    pub fn new(
        scene: &'a Scene,
        camera: &Camera,
        light: &Light,
        pixel: u32,
        triangle: u32,
    ) -> Self {
        let normal = Self::normal(scene, camera.eye, triangle);
        Self::along((scene, camera), light, pixel, triangle, normal)
    }

    /// The unit normal of a triangle, as it is found from an eye.
    pub fn normal(scene: &Scene, eye: DVec3, triangle: u32) -> DVec3 {
        let [a, b, c] = scene.corners(triangle).map(|corner| corner - eye);
        unit_normal(a, b, c)
    }

    /// The same as `new` where the triangle's normal is known.
    pub fn along(
        (scene, camera): (&'a Scene, &Camera),
        light: &Light,
        pixel: u32,
        triangle: u32,
        normal: DVec3,
    ) -> Self {
        let eye = camera.eye;
        let (start, ray) = camera.ray_from_pixel(pixel % camera.width, pixel / camera.width);
        let corners = scene.corners(triangle).map(|corner| corner - eye);
        let from_start = corners.map(|corner| corner - start);
        let point = start + ray * (normal.dot(nearest(from_start)) / normal.dot(ray));
        let margin = FLOAT64_ROUNDING * point.length();
        let own = Own {
            triangle,
            viewer: camera.source(),
            start,
        };
        Self::from_point((scene, eye), light, (point, margin), Some(own))
    }

    /// Of a point relative to some eye, known to within a margin, that a camera may see.
    pub fn from_point(
        (scene, eye): (&'a Scene, DVec3),
        light: &Light,
        (point, margin): (DVec3, f64),
        own: Option<Own>,
    ) -> Self {
        let to_light = match light.position() {
            Some(position) => (position - eye) - point,
            None => light.vector_from_point(eye),
        };
        let (x, y) = to_light.normalize().any_orthonormal_pair();
        Self {
            scene,
            eye,
            source: Source::of(light),
            own,
            point,
            to_light,
            margin,
            axes: [x, y],
        }
    }

    /// Whether the light would reach the receiver if nothing lay between them.
    pub fn is_facing(&self, light: &Light) -> bool {
        let is_lit_side = |own: Own| {
            let corners = self.scene.corners(own.triangle);
            self.source.side_of(corners) * own.viewer.side_of(corners) > 0
        };
        let is_in_cone = |cone: Cone| cone.depth_of(-self.to_light) >= 0.0;
        self.own.is_none_or(is_lit_side) && light.cone().is_none_or(is_in_cone)
    }

    /// Whether another triangle lies between the receiver and the light. The same edge of two triangles is the
    /// same numbers but for the sign, so that no ray slips between them.
    pub fn is_shadowed_by(&self, caster: u32) -> bool {
        let corners = self.scene.corners(caster);
        let relative = corners.map(|corner| (corner - self.eye) - self.point);
        self.own.is_none_or(|own| own.triangle != caster)
            && self.meets(caster, relative, self.axes)
            && self.is_behind(relative, self.source.side_of(corners))
    }

    /// Whether another triangle lies before the receiver on the camera's ray. Where float32 saw a surface a
    /// hair's breadth below the first one, that does not shadow it: it is what the pixel sees.
    pub fn is_hidden_by(&self, triangle: u32) -> bool {
        let Some(Own { viewer, start, .. }) = self.own else {
            return false;
        };
        let corners = self.scene.corners(triangle);
        let from_eye = corners.map(|corner| corner - self.eye);
        let (x, y) = (self.point - start).normalize().any_orthonormal_pair();
        self.meets(triangle, from_eye.map(|corner| corner - start), [x, y])
            && self.is_behind(
                from_eye.map(|corner| corner - self.point),
                viewer.side_of(corners),
            )
    }

    /// Whether the origin is inside of a triangle that is seen along axes, and not in one of its holes.
    fn meets(&self, triangle: u32, corners: [DVec3; 3], [x, y]: [DVec3; 2]) -> bool {
        let edges = edges_at_origin(corners, x, y);
        is_inside(edges) && self.scene.is_solid(triangle, edges)
    }

    /// Whether the receiver is on the other side of a triangle's plane, by more than float64 rounds. Corners are
    /// relative to it.
    fn is_behind(&self, corners: [DVec3; 3], side: i8) -> bool {
        let [a, b, c] = corners;
        let corner = nearest(corners);
        let depth = f64::from(side) * unit_normal(a, b, c).dot(corner);
        depth > FLOAT64_ROUNDING * corner.length() + self.margin
    }
}

/// What gives the ray of a receiver, by its column and row and the triangle that it is on.
pub type RayOf<'a> = dyn Fn((usize, usize), u32) -> ReceiverRay<'a> + Sync + 'a;

/// Puts lit pixels that one of the casters shadows into shadow, and tells how many pixels were lit and how many of them it
/// found. `triangles` are what pixels see, negative for nothing.
pub fn shadow_by(
    casters: &[u32],
    (scene, camera, light): (&Scene, &Camera, &Light),
    triangles: &[i32],
    visibility: &mut [f32],
) -> [u32; 2] {
    let pixels = visibility.par_iter_mut().zip(triangles).enumerate();
    let count = pixels.map(|(pixel, (lit, &triangle))| {
        let Some(triangle) = u32::try_from(triangle).ok().filter(|_| *lit > 0.0) else {
            return [0, 0];
        };
        let ray = ReceiverRay::new(scene, camera, light, pixel as u32, triangle);
        let is_found = casters.iter().any(|&caster| ray.is_shadowed_by(caster));
        if is_found {
            *lit = 0.0;
        }
        [1, u32::from(is_found)]
    });
    count.reduce(|| [0, 0], |a, b| [a[0] + b[0], a[1] + b[1]])
}

/// Whether the side of the surface that each pixel sees faces the light, within its cone; not where nothing is seen.
/// `triangles` are negative there.
pub fn facing(scene: &Scene, camera: &Camera, light: &Light, triangles: &[i32]) -> Vec<bool> {
    let pixels = triangles.par_iter().enumerate();
    let faces = |(pixel, &triangle)| {
        let triangle = u32::try_from(triangle);
        triangle.is_ok_and(|triangle| {
            ReceiverRay::new(scene, camera, light, pixel as u32, triangle).is_facing(light)
        })
    };
    pixels.map(faces).collect()
}

/// How many triangles a ray from a light's position meets, but for those in whose plane it starts.
pub fn triangles_along(scene: &Scene, start: DVec3, direction: DVec3) -> usize {
    let (x, y) = direction.any_orthonormal_pair();
    let is_met = |triangle: &u32| {
        let corners = scene.corners(*triangle);
        let [a, b, c] = corners.map(|corner| corner - start);
        let normal = unit_normal(a, b, c);
        let ahead = normal.dot(nearest([a, b, c])) * normal.dot(direction);
        is_inside(edges_at_origin([a, b, c], x, y))
            && ahead > 0.0
            && Source::Point(start).side_of(corners) != 0
    };
    let triangles = (0..scene.triangles().len() as u32).into_par_iter();
    triangles.filter(is_met).count()
}

/// Whether the origin is on one side of all edges.
fn is_inside(edges: [f64; 3]) -> bool {
    let has_one_sign = edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0);
    has_one_sign && edges != [0.0; 3]
}

/// Of a triangle that is seen along axes, the edge opposite to each corner: twice the area between it and the origin. These
/// are the corners' shares of the point at the origin, too.
fn edges_at_origin(corners: [DVec3; 3], x: DVec3, y: DVec3) -> [f64; 3] {
    let [a, b, c] = corners.map(|v| DVec2::new(x.dot(v), y.dot(v)));
    [b.perp_dot(c), c.perp_dot(a), a.perp_dot(b)]
}

/// The corner that is nearest to the origin: it knows best how far that is off the plane.
fn nearest(corners: [DVec3; 3]) -> DVec3 {
    let [a, b, c] = corners;
    let nearer = |a: DVec3, b: DVec3| match b.length_squared() < a.length_squared() {
        true => b,
        false => a,
    };
    nearer(nearer(a, b), c)
}
