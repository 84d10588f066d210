//! What an image or a map sees of points, and the edges of triangles in it, in float64.

use super::lanes::EPSILON;
use crate::camera::{Camera, Rays};
use crate::lanes::Each;
use crate::scene::Scene;
use crate::sides::Source;
use glam::{DVec2, DVec3, DVec4};
use rayon::prelude::*;

/// How near a point is: the greater, the nearer. Linear in the image over any plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Nearness {
    /// The inverse of `w`.
    Inverse,
    /// A linear function of (point, 1), over `w`.
    Linear(DVec4),
}

/// A light matrix, or a camera's.
#[derive(Debug, Clone)]
pub struct View {
    /// Points are relative to it before anything is multiplied.
    pub origin: DVec3,
    /// Column and row, each times `w`, and `w`: functions of (point, 1).
    pub rows: [DVec4; 3],
    pub nearness: Nearness,
    /// Pixels.
    pub width: usize,
    pub height: usize,
    /// Between which nearness a surface is seen.
    pub seen: (f64, f64),
    /// The light that triangles in a plane with it do not hide.
    pub light: Option<Source>,
}

/// A corner before it is divided: (column, row, 1) times `w`, and the nearness times `w`.
#[derive(Debug, Clone, Copy)]
pub struct Homogeneous {
    pub place: DVec3,
    pub nearness: f64,
}

/// (column, row, nearness) of a vertex, and 1, or -1 where it is not before the origin.
pub type Place = [f32; 4];

impl View {
    pub fn of_camera(camera: &Camera) -> Self {
        let (nearness, seen) = match camera.rays {
            Rays::Perspective => (Nearness::Inverse, (1.0 / camera.zfar, 1.0 / camera.znear)),
            Rays::Orthographic => (
                Nearness::Linear(-camera.forward.extend(0.0)),
                (-camera.zfar, -camera.znear),
            ),
        };
        Self {
            origin: camera.eye,
            rows: camera.image_rows(),
            nearness,
            width: camera.width as usize,
            height: camera.height as usize,
            seen,
            light: None,
        }
    }

    pub fn homogeneous(&self, vertex: DVec3) -> Homogeneous {
        let point = (vertex - self.origin).extend(1.0);
        Homogeneous {
            place: DVec3::from_array(self.rows.each(|row| row.dot(point))),
            nearness: match self.nearness {
                Nearness::Inverse => 1.0,
                Nearness::Linear(row) => row.dot(point),
            },
        }
    }

    pub fn place(&self, vertex: DVec3) -> Place {
        let Homogeneous { place, nearness } = self.homogeneous(vertex);
        let inverse = 1.0 / place.z;
        match place.z > 0.0 {
            true => [
                (place.x * inverse) as f32,
                (place.y * inverse) as f32,
                (nearness * inverse) as f32,
                1.0,
            ],
            false => [0.0, 0.0, 0.0, -1.0],
        }
    }

    /// Those of all vertices.
    pub fn places(&self, scene: &Scene) -> Vec<Place> {
        let vertices = scene.vertices().par_iter().with_min_len(1024);
        vertices.map(|&vertex| self.place(vertex)).collect()
    }

    /// Whether a triangle lies beyond one side of the view, wherever its corners are.
    pub fn lies_beside(&self, scene: &Scene, triangle: u32) -> bool {
        let (width, height) = (self.width as f64, self.height as f64);
        let sides = scene.corners(triangle).each(|corner| {
            let DVec3 { x, y, z: w } = self.homogeneous(corner).place;
            let bits = [x < 0.0, x > width * w, y < 0.0, y > height * w];
            bits.iter().enumerate().fold(0, |sides, (i, &is_beyond)| {
                sides | u32::from(is_beyond) << i
            })
        });
        sides[0] & sides[1] & sides[2] != 0
    }

    /// Columns and rows beyond which corners are set up in float64.
    pub fn reach(&self) -> f32 {
        2.0 * self.width.max(self.height) as f32
    }

    /// How far rounding may have moved a corner within reach, in pixels.
    pub fn rounding(&self) -> f32 {
        self.reach() * EPSILON
    }

    /// How near a triangle is at a place; `None` where it does not cover the place, has a hole there or is out of range. Two
    /// triangles that share an edge compute the same number for it but for the sign, so that nothing slips between
    /// them (Woop, Benthin and Wald, "Watertight ray/triangle intersection", JCGT 2013).
    pub fn nearness_at(&self, scene: &Scene, place: DVec2, triangle: u32) -> Option<f64> {
        let found = self.nearness_even_edge_on(scene, place, triangle);
        found.filter(|_| !self.is_edge_on(scene, triangle))
    }

    /// The same even where the light lies in the triangle's plane, which is asked for last: it takes longest.
    pub fn nearness_even_edge_on(&self, scene: &Scene, place: DVec2, triangle: u32) -> Option<f64> {
        let corners = self.corners_from(scene, place, triangle);
        let (first, volume) = first_edge(corners)?;
        let [a, b, c] = corners.each(|corner| corner.place);
        // The third coordinates of the edges of `Planes`: most places are outside.
        let across = |from: DVec3, to: DVec3| from.x * to.y - to.x * from.y;
        let edges = [first.z, across(c, a), across(a, b)];
        let inside = edges.each(|edge| edge * volume.signum());
        if !inside.iter().all(|edge| *edge >= 0.0) {
            return None;
        }
        let [at_a, at_b, at_c] = [0, 1, 2].each(|i| edges[i] * corners[i].nearness);
        let nearness = (at_a + at_b + at_c) / volume;
        let (far, near) = self.seen;
        let is_met = far < nearness && nearness < near;
        (is_met && scene.is_solid(triangle, inside)).then_some(nearness)
    }

    /// The corners of a triangle, their columns and rows from a place on.
    fn corners_from(&self, scene: &Scene, origin: DVec2, triangle: u32) -> [Homogeneous; 3] {
        scene.corners(triangle).each(|corner| {
            let Homogeneous { place, nearness } = self.homogeneous(corner);
            let place = DVec3::new(
                place.x - origin.x * place.z,
                place.y - origin.y * place.z,
                place.z,
            );
            Homogeneous { place, nearness }
        })
    }

    /// The same for the plane of a triangle that is not seen edge-on.
    pub fn nearness_of_plane(&self, scene: &Scene, place: DVec2, triangle: u32) -> f64 {
        Planes::even_edge_on(self, scene, triangle, place)
            .map_or(f64::NAN, |planes| planes.nearness.z)
    }

    /// Whether the light lies in the triangle's plane.
    pub fn is_edge_on(&self, scene: &Scene, triangle: u32) -> bool {
        let is_in_plane = |light: Source| light.side_of(scene.corners(triangle)) == 0;
        self.light.is_some_and(is_in_plane)
    }
}

/// The faces of a cube around a position: each axis up, and down. They have so many columns and rows.
pub fn cube_views(position: DVec3, light: Source, side: usize) -> impl Iterator<Item = View> {
    (0..6).map(move |face| {
        let axis = |k: usize| DVec3::AXES[(face / 2 + k) % 3];
        let ahead = if face % 2 == 1 { -axis(0) } else { axis(0) };
        View {
            origin: position,
            rows: [axis(1), axis(2), ahead].map(|axis| axis.extend(0.0)),
            nearness: Nearness::Inverse,
            width: side,
            height: side,
            seen: (0.0, f64::INFINITY),
            light: Some(light),
        }
    })
}

/// The edges and the nearness of a triangle as linear functions of (column, row, 1), relative to a place.
#[derive(Debug, Clone, Copy)]
pub struct Planes {
    /// Positive inside.
    pub edges: [DVec3; 3],
    pub nearness: DVec3,
}

/// The edge across from the first corner, and the volume that the corners span with the origin; `None` where that is zero.
fn first_edge(corners: [Homogeneous; 3]) -> Option<(DVec3, f64)> {
    let [a, b, c] = corners.each(|corner| corner.place);
    let edge = b.cross(c);
    let volume = a.dot(edge);
    (volume != 0.0).then_some((edge, volume))
}

impl Planes {
    /// `None` where the triangle is seen edge-on.
    pub fn new(view: &View, scene: &Scene, triangle: u32, origin: DVec2) -> Option<Self> {
        match view.is_edge_on(scene, triangle) {
            true => None,
            false => Self::even_edge_on(view, scene, triangle, origin),
        }
    }

    /// The same even where the light lies in the plane of the triangle. No corner is clipped: an edge is the plane
    /// through the origin and two corners (Olano and Greer, "Triangle scan conversion using 2D homogeneous coordinates",
    /// 1997).
    pub fn even_edge_on(view: &View, scene: &Scene, triangle: u32, origin: DVec2) -> Option<Self> {
        let corners = view.corners_from(scene, origin, triangle);
        let (first, volume) = first_edge(corners)?;
        let [a, b, c] = corners.each(|corner| corner.place);
        let edges = [first, c.cross(a), a.cross(b)];
        let nearness = edges[0] * corners[0].nearness
            + edges[1] * corners[1].nearness
            + edges[2] * corners[2].nearness;
        let sign = volume.signum();
        Some(Self {
            edges: edges.each(|edge| edge * sign),
            nearness: nearness / volume,
        })
    }

    /// Whether the triangle may touch a square.
    pub fn may_touch(&self, corner: DVec2, side: f64) -> bool {
        self.edges.iter().all(|edge| {
            let greatest =
                edge.dot(corner.extend(1.0)) + side * (edge.x.max(0.0) + edge.y.max(0.0));
            let farthest = corner.abs() + side;
            let rounding = edge.x.abs() * farthest.x + edge.y.abs() * farthest.y + edge.z.abs();
            greatest >= -1e-9 * rounding
        })
    }
}
