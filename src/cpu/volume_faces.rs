//! The faces of shadow volumes as an image sees them.

use super::lanes::EPSILON;
use super::view::{Nearness, View};
use crate::camera::Camera;
use crate::geometry::is_before;
use crate::sides::Source;
use glam::{DVec2, DVec3, DVec4, Vec4Swizzles};

/// What the lanes may round a function by, as a share of its greatest terms: coefficients, places and sums.
const FUNCTION_SHARE: f64 = 8.0 * EPSILON as f64;

/// A camera's image and a light.
pub struct VolumeView {
    /// Columns and rows count from the middle of the image.
    pub view: View,
    /// Half the longer side of the image.
    side: f64,
    /// Triangles nearer than this are not seen, but shadow.
    nearest: f64,
    light: Source,
    /// Where the image sees the light.
    seen_light: DVec3,
}

/// A face in float64: functions of (column, row, 1).
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// Positive inside.
    edges: [DVec3; 3],
    /// How near it is, times `weight`; less what a constant number takes away.
    plane: DVec3,
    weight: f64,
    /// How many volumes a line of sight enters there.
    pub entered: i32,
}

/// The same for lanes: of each edge (column, row, 1) and one of the three of the plane, then weight and entered volumes. Above
/// 1 an edge is passed inside for sure and the plane is nearer, below -1 they are not.
pub type FaceRows = [[f32; 4]; 4];

/// Where the light is, as an edge sees it: outside of the volumes that are entered over the edge from its right, seen
/// along the light.
struct SidePlane {
    /// Nearness times `height`, as a function of the place.
    plane: DVec3,
    height: f64,
    /// 1 where the eye is outside, -1 where it is inside.
    eye_side: i32,
    /// Of both ends.
    light_planes: [DVec3; 2],
}

impl VolumeView {
    pub fn new(camera: &Camera, light: Source) -> Self {
        let mut view = View::of_camera(camera);
        let [width, height] = [view.width, view.height].map(|size| size as f64);
        let [column, row, ahead] = view.rows;
        view.rows = [
            column - ahead * (0.5 * width),
            row - ahead * (0.5 * height),
            ahead,
        ];
        let mut found = Self {
            nearest: view.seen.1,
            view,
            side: 0.5 * width.max(height),
            light,
            seen_light: DVec3::ZERO,
        };
        found.seen_light = match light {
            Source::Point(position) => found.seen(position).xyz(),
            Source::Direction(towards) => found.seen_vector(towards).xyz(),
        };
        found
    }

    /// Of a point: place and nearness, each times `w`.
    fn seen(&self, point: DVec3) -> DVec4 {
        let homogeneous = self.view.homogeneous(point);
        homogeneous.place.extend(homogeneous.nearness)
    }

    /// Of what lies between two points, or of a point at infinity.
    fn seen_vector(&self, vector: DVec3) -> DVec4 {
        let [column, row, w] = self.view.rows.map(|row| row.truncate().dot(vector));
        let nearness = match self.view.nearness {
            Nearness::Inverse => 0.0,
            Nearness::Linear(row) => row.truncate().dot(vector),
        };
        DVec4::new(column, row, w, nearness)
    }

    fn away_from_light(&self, point: DVec3) -> DVec3 {
        match self.light {
            Source::Point(position) => point - position,
            Source::Direction(towards) => -towards,
        }
    }

    /// The plane through the eye, a corner and the light, as a function of the place; and how well it is known, from 0 on.
    fn light_plane(&self, corner: DVec3) -> (DVec3, f64) {
        let place = self.seen(corner).xyz();
        let plane = place.cross(self.seen_light);
        if plane != DVec3::ZERO {
            return (plane, plane.length_squared() / place.length_squared());
        }
        // All three are on a line: as if the eye lay a little to the right, or further down.
        let away = self.seen_vector(self.away_from_light(corner)).xyz();
        let planes = [DVec3::X, DVec3::Y].map(|moved| moved.cross(away));
        let first = planes.into_iter().find(|&plane| plane != DVec3::ZERO);
        (first.unwrap_or(DVec3::ZERO), 0.0)
    }

    /// Of the edge from a place to another that comes after it.
    fn side_plane(&self, from: DVec3, to: DVec3) -> SidePlane {
        let corner = self.seen(from);
        let edge = self.seen_vector(to - from);
        let away = self.seen_vector(self.away_from_light(from));
        let plane = plane_through(corner, edge, away);
        let height = corner.xyz().dot(edge.xyz().cross(away.xyz()));
        // Which side the eye is on is asked of the light plane of the end that knows it less well: behind a corner the
        // rounded eye lies on any side of the light's ray, and all edges there have to agree on which.
        let ((of_from, known), (of_to, known_of_to)) =
            (self.light_plane(from), self.light_plane(to));
        let side = match known < known_of_to {
            true => of_from.dot(self.seen(to).xyz()),
            false => -of_to.dot(corner.xyz()),
        };
        // An eye in the plane is moved likewise.
        let sides = [side, -plane.x, -plane.y, -plane.z];
        let first = sides.into_iter().find(|&v| v != 0.0);
        SidePlane {
            plane,
            height,
            eye_side: if first.unwrap_or(0.0) > 0.0 { 1 } else { -1 },
            light_planes: [of_from, of_to],
        }
    }

    /// 1 where the eye is outside of what lies behind the left of an edge, seen along the light; -1 where it is inside.
    fn eye_side(&self, from: DVec3, to: DVec3) -> i32 {
        match is_before(from, to) {
            true => self.side_plane(from, to).eye_side,
            false => -self.side_plane(to, from).eye_side,
        }
    }

    /// The side of volumes behind an edge: the plane through it and the light, from the edge on. It is a triangle whose
    /// third corner lies opposite to the light. `volumes`: how many lie behind the left of the edge, seen along the light.
    /// `None` where the edge points to the light.
    pub fn side(&self, from: DVec3, to: DVec3, volumes: i32) -> Option<Face> {
        if !is_before(from, to) {
            return self.side(to, from, -volumes);
        }
        let SidePlane {
            plane,
            height,
            eye_side,
            light_planes: [of_from, of_to],
        } = self.side_plane(from, to);
        let edge = edge_through(self.seen(from).xyz(), self.seen_vector(to - from).xyz());
        let edges = [edge, -of_to, of_from];
        let sign = f64::from(eye_side);
        (plane != DVec3::ZERO).then(|| Face {
            edges: edges.map(|edge| edge * sign),
            plane: plane * sign,
            weight: height.abs(),
            entered: volumes * eye_side,
        })
    }

    /// The volume between the eye and two edges of a triangle: negative where the eye is on the side that its normal points to.
    fn height(&self, [a, b, c]: [DVec3; 3]) -> f64 {
        let (u, v) = (self.seen_vector(b - a), self.seen_vector(c - a));
        self.seen(a).xyz().dot(u.xyz().cross(v.xyz()))
    }

    /// The part of a triangle that is nearer than what is seen, where its volume begins. `None` where there is none.
    pub fn cap(&self, corners: [DVec3; 3], light_side: i8) -> Option<Face> {
        let seen = corners.map(|corner| self.seen(corner));
        let is_near = |corner: DVec4| corner.w >= self.nearest * corner.z;
        if seen.iter().all(|&corner| !is_near(corner)) || seen.iter().all(|corner| corner.z <= 0.0)
        {
            return None;
        }
        let [a, b, c] = corners;
        let (u, v) = (self.seen_vector(b - a), self.seen_vector(c - a));
        let plane = plane_through(seen[0], u, v);
        let height = self.height(corners);
        let sign = height.signum();
        let edge = |from: DVec3, to: DVec3| match is_before(from, to) {
            true => edge_through(self.seen(from).xyz(), self.seen_vector(to - from).xyz()),
            false => -edge_through(self.seen(to).xyz(), self.seen_vector(from - to).xyz()),
        };
        (height != 0.0).then(|| Face {
            edges: [edge(b, c), edge(c, a), edge(a, b)].map(|edge| edge * sign),
            plane: plane * sign - DVec3::Z * (height.abs() * self.nearest),
            weight: 0.0,
            entered: -i32::from(light_side) * sign as i32,
        })
    }

    /// Whether the eye is in the volume behind a triangle.
    pub fn holds_eye(&self, corners: [DVec3; 3], light_side: i8) -> bool {
        let [a, b, c] = corners;
        let side = f64::from(light_side);
        let is_behind = self.height(corners) * side > 0.0;
        is_behind
            && [(a, b), (b, c), (c, a)]
                .into_iter()
                .all(|(from, to)| self.eye_side(from, to) * i32::from(light_side) < 0)
    }
}

/// How near the plane through a point and two vectors is, times the volume that they span, as a function of the place.
fn plane_through(point: DVec4, u: DVec4, v: DVec4) -> DVec3 {
    let (p, a, b) = (point.xyz(), u.xyz(), v.xyz());
    a.cross(b) * point.w + b.cross(p) * u.w + p.cross(a) * v.w
}

/// The edge from a corner along a vector, as a function of the place.
fn edge_through(corner: DVec3, vector: DVec3) -> DVec3 {
    corner.cross(vector)
}

impl Face {
    /// Whether a line of sight passes it before a receiver of some nearness. On an edge, as if the pixel lay a little
    /// more to the right, and still less further down: one of two neighbours has it.
    pub fn is_passed(&self, place: DVec2, nearness: f64) -> bool {
        let is_inside = |edge: &DVec3| {
            let signs = [edge.dot(place.extend(1.0)), edge.x, edge.y];
            signs.into_iter().find(|&v| v != 0.0).unwrap_or(0.0) > 0.0
        };
        let ahead = self.plane.dot(place.extend(1.0)) - self.weight * nearness;
        ahead > 0.0 && self.edges.iter().all(is_inside)
    }

    pub fn rows(&self, view: &VolumeView) -> FaceRows {
        let scaled = |function: DVec3| {
            let length = function.truncate().length();
            let band = FUNCTION_SHARE * (function.z.abs() + view.side * length);
            // An edge that is a point is sure of nothing.
            if band > 0.0 { 1.0 / band } else { 0.0 }
        };
        let scale = scaled(self.plane);
        let plane = (self.plane * scale).as_vec3().to_array();
        let mut rows = [[0.0; 4]; 4];
        for (i, edge) in self.edges.iter().enumerate() {
            let edge = (*edge * scaled(*edge)).as_vec3();
            rows[i] = edge.extend(plane[i]).to_array();
        }
        rows[3] = [(self.weight * scale) as f32, self.entered as f32, 0.0, 0.0];
        rows
    }
}
