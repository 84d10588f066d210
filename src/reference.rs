//! The truth: hard shadows by ray casting in float64, on the CPU.
//!
//! A ray goes through the centre of each pixel to the first triangle it meets; where it meets the
//! triangle's plane is the receiver. A ray goes from the receiver towards the light; the receiver is
//! in shadow if any other triangle is met, or if it faces away from the light. A triangle never
//! shadows itself. Both sides of a triangle are hit.
//!
//! **Watertight.** The corners are projected along the ray onto the plane across it, and the ray is
//! inside the triangle if it is on the same side of the three edges (Woop, Benthin and Wald,
//! "Watertight ray/triangle intersection", JCGT 2013). Two triangles that share an edge compute the
//! very same number for it but for the sign, and a ray on the edge counts as inside both, so no ray
//! slips between them.
//!
//! **Ties.** Where the answer turns within the rounding of float64 nobody can say who is right. So a ray
//! is tested against triangles whose corners are only known to within [`GRANTED`] times their distance: a
//! triangle is *definitely* hit, *possibly* hit or missed. The margin of a point on a triangle is what
//! the corners' margins make of it (weighted as the point is), so that a floor of two huge triangles is
//! neither trusted too much at its far end nor too little at one's feet. The receiver has a margin too,
//! which grows as the camera's ray becomes oblique to its triangle.
//!
//! Not every possible hit is a tie. An edge inside a mesh is met definitely if every ray around it
//! meets a triangle there; a first hit that is a tie has a shadow that is none if all triangles in
//! question agree; and neighbours on a flat or convex surface do not shadow each other's rim.
//!
//! **Contacts.** What lies in the receiver's plane does not shadow it, and a triangle in whose plane the
//! light lies shadows nothing and is not lit: seen from the light it has no width. Which side of a
//! triangle the light is on is one answer for the whole triangle, never where a ray happens to end.
//!
//! **Float32.** Programs that work in float32 may see another surface than float64 does where an outline
//! passes the middle of a pixel within their rounding, [`ROUNDING`] times the distance, and where its
//! shadow differs they are not to blame. Such pixels are no ties: they are counted on their own.
//!
//! **Holes.** A masked triangle is hit where its alpha at the point reaches the cutoff. Rounding moves the point over the
//! image, too: where that may change the answer, the triangle is possibly hit, and rays nearby may slip through.
//!
//! **Far from the origin.** All coordinates are relative to the eye, or to the receiver, before
//! anything is multiplied.

use crate::bvh::{Search, ThickRay};
use crate::camera::Camera;
use crate::light::Light;
use crate::masks::{Mask, Solidity};
use crate::rounding::{FLOAT64_ROUNDING as GRANTED, MAX_SEEN_ROUNDING, ROUNDING};
use crate::scene::{Scene, unit_normal};
use crate::sides::Source;
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::ops::ControlFlow;

/// The truth for every pixel, rows from the top.
#[derive(Debug, Clone, Default)]
pub struct Reference {
    /// First triangle on the pixel's ray, -1 where there is none.
    pub triangle_id: Vec<i32>,
    /// Whether another triangle, or none, may be the first within the rounding of float32.
    pub triangle_tie: Vec<bool>,
    /// 1 lit, 0 in shadow, NaN where there is no surface.
    pub visibility: Vec<f32>,
    /// Whether the visibility may be another one within the rounding of float64.
    pub tie: Vec<bool>,
    /// Whether float64 knows the visibility, but not float32: a triangle that may be first has another one.
    pub float32_tie: Vec<bool>,
}

/// What is seen and what is lit, for every pixel.
pub fn reference(scene: &Scene, search: &impl Search, camera: &Camera, light: &Light) -> Reference {
    let pixels = (0..camera.pixel_count()).into_par_iter();
    collect(pixels.map(|pixel| answer_pixel(scene, search, camera, light, pixel)))
}

/// The same for some pixels, each given as row * width + column. With
/// [`Everything`](crate::bvh::Everything) as the search it is brute force.
///
/// # Panics
/// If a pixel is not in the image.
pub fn reference_of_pixels(
    scene: &Scene,
    search: &impl Search,
    camera: &Camera,
    light: &Light,
    pixels: &[usize],
) -> Reference {
    let pixels = pixels.par_iter();
    collect(pixels.map(|&pixel| answer_pixel(scene, search, camera, light, pixel)))
}

/// Where the ray of each pixel meets the plane of its triangle: positions in world space, unit
/// normals on the camera's side, depths along the camera's forward axis. NaN where there is none.
///
/// # Panics
/// If there is not one triangle for each pixel, or one is not in the scene.
pub fn surface(
    scene: &Scene,
    camera: &Camera,
    triangle_id: &[i32],
) -> (Vec<[f64; 3]>, Vec<[f32; 3]>, Vec<f64>) {
    assert_eq!(triangle_id.len(), camera.pixel_count());
    let pixels = triangle_id.par_iter().enumerate();
    let points = pixels.map_init(
        || Surface::new(scene, camera),
        |surface, (pixel, &id)| match surface.point(pixel, id) {
            None => ([f64::NAN; 3], ([f32::NAN; 3], f64::NAN)),
            Some(point) => (
                point.position.to_array(),
                (point.normal.as_vec3().to_array(), point.depth),
            ),
        },
    );
    let (positions, (normals, depths)) = points.unzip();
    (positions, normals, depths)
}

/// Finds the points that pixels see, one after the other.
pub struct Surface<'a> {
    scene: &'a Scene,
    camera: &'a Camera,
    /// Neighbours mostly show the same.
    last: Option<OwnPlane>,
}

/// Where the ray of a pixel meets the plane of its triangle.
pub struct SurfacePoint {
    /// In world space.
    pub position: DVec3,
    /// A unit vector on the camera's side.
    pub normal: DVec3,
    /// Along the camera's forward axis.
    pub depth: f64,
}

impl<'a> Surface<'a> {
    pub fn new(scene: &'a Scene, camera: &'a Camera) -> Self {
        Self {
            scene,
            camera,
            last: None,
        }
    }

    /// Of a pixel, row * width + column, and its triangle; `None` where that is negative.
    pub fn point(&mut self, pixel: usize, triangle_id: i32) -> Option<SurfacePoint> {
        let id = u32::try_from(triangle_id).ok()?;
        let eye = self.camera.eye;
        let plane = match self.last.take() {
            Some(plane) if plane.triangle == id => plane,
            _ => OwnPlane::new(self.scene, eye, id),
        };
        let ray = camera_ray(self.camera, pixel, GRANTED);
        let seen = self.last.insert(plane);
        let Receiver { point, normal, .. } = seen.receiver(&ray, (f64::MIN, f64::MAX));
        Some(SurfacePoint {
            position: eye + point,
            normal,
            depth: point.dot(self.camera.forward),
        })
    }
}

fn collect(answers: impl ParallelIterator<Item = Answer>) -> Reference {
    let (seen, lit): (Vec<_>, Vec<_>) = answers
        .map(|a| {
            (
                (a.triangle_id, a.triangle_tie),
                (a.visibility, (a.tie, a.float32_tie)),
            )
        })
        .unzip();
    let (triangle_id, triangle_tie) = seen.into_iter().unzip();
    let (visibility, ties): (_, Vec<_>) = lit.into_iter().unzip();
    let (tie, float32_tie) = ties.into_iter().unzip();
    Reference {
        triangle_id,
        triangle_tie,
        visibility,
        tie,
        float32_tie,
    }
}

/// One pixel of a [`Reference`].
struct Answer {
    triangle_id: i32,
    triangle_tie: bool,
    visibility: f32,
    tie: bool,
    float32_tie: bool,
}

fn answer_pixel(
    scene: &Scene,
    search: &impl Search,
    camera: &Camera,
    light: &Light,
    pixel: usize,
) -> Answer {
    let ray = camera_ray(camera, pixel, GRANTED);
    let coarse = camera_ray(camera, pixel, granted_to_eyes(scene, camera));
    let seen = first_triangles(scene, search, camera, &coarse);
    // Most pixels have a single candidate even in float32, and are done.
    let first = match seen.is_tie() {
        true => &first_triangles(scene, search, camera, &ray),
        false => &seen,
    };
    let shade = |candidate: &(u32, Contact)| {
        let (triangle, contact) = candidate;
        let reach = (contact.near, contact.far);
        let receiver = OwnPlane::new(scene, camera.eye, *triangle).receiver(&ray, reach);
        shade(scene, search, camera, light, &receiver)
    };
    let (visibility, tie) = first.hit.as_ref().map_or((f32::NAN, false), shade);
    let differs = |other: (f32, bool)| {
        other.1 || other.0 != visibility && !(other.0.is_nan() && visibility.is_nan())
    };
    // An edge between two triangles with the same shadow is no reason to throw the pixel out.
    let may_differ = |first: &First| {
        first.is_tie()
            && (first.may_be_none && differs((f32::NAN, false))
                || first.others.iter().any(|other| differs(shade(other))))
    };
    let tie = tie || may_differ(first);
    Answer {
        triangle_id: first.triangle_id(),
        triangle_tie: seen.is_tie(),
        visibility,
        tie,
        float32_tie: !tie && may_differ(&seen),
    }
}

/// What rounding is granted to what sees the scene: that of float32, unless it can tell nothing from so far away.
fn granted_to_eyes(scene: &Scene, camera: &Camera) -> f64 {
    let (low, high) = scene.bounds();
    let rounding = ROUNDING * (0.5 * (low + high) - camera.eye).length();
    match rounding > MAX_SEEN_ROUNDING * (high - low).length() {
        true => GRANTED,
        false => ROUNDING,
    }
}

/// The triangles that may be the first on a ray.
struct First {
    /// The first one in float64.
    hit: Option<(u32, Contact)>,
    /// Others that may be the first within rounding.
    others: Vec<(u32, Contact)>,
    /// Whether there may be none within rounding.
    may_be_none: bool,
}

impl First {
    fn triangle_id(&self) -> i32 {
        self.hit
            .as_ref()
            .map_or(-1, |(triangle, _)| *triangle as i32)
    }

    fn is_tie(&self) -> bool {
        !self.others.is_empty() || self.may_be_none && self.hit.is_some()
    }
}

fn first_triangles(scene: &Scene, search: &impl Search, camera: &Camera, ray: &Ray) -> First {
    // All triangles that are possibly hit, up to where the first definite one ends.
    let mut candidates: Vec<(u32, Contact)> = Vec::new();
    let mut end = f64::INFINITY;
    search.visit(ray.thick(camera), |triangle| {
        if let Some(contact) = ray.meet(scene, camera, triangle) {
            if contact.definite {
                end = end.min(contact.far);
            }
            if contact.near <= end {
                candidates.push((triangle, contact));
            }
        }
        ControlFlow::Continue(end)
    });
    candidates.retain(|(_, contact)| contact.near <= end);
    if candidates.iter().any(|(_, contact)| !contact.definite) {
        end = end.min(covered_until(&candidates, ray.range));
        candidates.retain(|(_, contact)| contact.near <= end);
    }
    // The order of the search must not show: equal distances go to the lower index.
    let hit = (0..candidates.len())
        .filter(|&i| candidates[i].1.hit.is_some())
        .min_by(|&i, &j| {
            let key = |i: usize| (candidates[i].1.hit.unwrap_or(f64::MAX), candidates[i].0);
            let (a, b) = (key(i), key(j));
            a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))
        })
        .map(|i| candidates.swap_remove(i));
    First {
        hit,
        others: candidates,
        may_be_none: end == f64::INFINITY,
    }
}

/// The distance before which every ray nearby meets some candidate, infinite if one meets none.
///
/// A ray near an edge that several triangles share meets none of them definitely, though no ray
/// nearby gets past all of them; what lies behind is not in question.
fn covered_until(candidates: &[(u32, Contact)], range: (f64, f64)) -> f64 {
    if candidates.is_empty() {
        return f64::INFINITY;
    }
    let radius = candidates
        .iter()
        .map(|(_, contact)| contact.margin)
        .fold(f64::INFINITY, f64::min);
    (0..=8)
        .map(|i| {
            let angle = std::f64::consts::TAU * i as f64 / 8.0;
            let offset = if i == 8 { 0.0 } else { radius } * DVec2::from_angle(angle);
            candidates
                .iter()
                .filter(|(_, contact)| contact.lies_within(range) && !contact.leaks)
                .filter(|(_, contact)| is_inside(contact.corners.map(|c| c - offset)))
                .map(|(_, contact)| contact.far)
                .fold(f64::INFINITY, f64::min)
        })
        .fold(0.0, f64::max)
}

/// The point that a pixel shows.
struct Receiver {
    triangle: u32,
    /// Relative to the eye.
    point: DVec3,
    /// Of the plane, towards the eye.
    normal: DVec3,
    /// How far rounding may move the point.
    margin: f64,
}

/// What is known of a triangle before a ray meets its plane.
struct OwnPlane {
    triangle: u32,
    /// Relative to the eye.
    corners: [DVec3; 3],
    /// Of length one, to either side.
    normal: DVec3,
    /// How far rounding may move the corners.
    margin: f64,
    /// The longest edge.
    extent: f64,
    /// Over the eye, where all rays of a perspective camera begin.
    height: f64,
}

impl OwnPlane {
    fn new(scene: &Scene, eye: DVec3, triangle: u32) -> Self {
        let corners = scene.corners(triangle).map(|c| c - eye);
        let [a, b, c] = corners;
        let normal = unit_normal(a, b, c);
        Self {
            triangle,
            corners,
            normal,
            height: normal.dot(nearest(corners)),
            margin: GRANTED * corners.map(DVec3::length).into_iter().fold(0.0, f64::max),
            extent: (b - a).length().max((c - b).length()).max((a - c).length()),
        }
    }

    /// The point where the ray meets the plane, kept within a range of distances because a ray along the plane may
    /// meet it anywhere.
    fn receiver(&self, ray: &Ray, (near, far): (f64, f64)) -> Receiver {
        let Self { normal, margin, .. } = *self;
        let height = match ray.origin == DVec3::ZERO {
            true => self.height,
            false => normal.dot(nearest(self.corners.map(|c| c - ray.origin))),
        };
        let cosine = normal.dot(ray.direction);
        let distance = (height / cosine).max(near).min(far);
        Receiver {
            triangle: self.triangle,
            point: ray.origin + distance * ray.direction,
            normal: if height > 0.0 { -normal } else { normal },
            // The plane moves by the corners' margin, the point by more if the ray is oblique, but
            // it stays on the triangle.
            margin: margin + (margin / cosine.abs()).min(self.extent),
        }
    }
}

impl Receiver {
    /// Whether a ray from the receiver's triangle towards the light cannot meet another triangle
    /// because the plane of one of them keeps them apart.
    ///
    /// Neighbours on a flat or convex surface touch the receivers near their common edge, and what lies
    /// in the receiver's plane touches all of them. Without this all those would be ties, which would
    /// hide the errors there.
    fn is_left_by(&self, scene: &Scene, camera: &Camera, direction: DVec3, triangle: u32) -> bool {
        let own = scene.corners(self.triangle).map(|c| c - camera.eye);
        let other = scene.corners(triangle).map(|c| c - camera.eye);
        let towards_light = |normal: DVec3| normal * normal.dot(direction).signum();
        // The other one is nowhere above the receiver's plane, or the receiver's triangle nowhere
        // below the other one's; above is where the light is.
        let normal = towards_light(self.normal);
        if other
            .iter()
            .all(|&c| normal.dot(c - self.point) <= self.margin)
        {
            return true;
        }
        let normal = towards_light(unit_normal(other[0], other[1], other[2]));
        normal.dot(direction) > GRANTED
            && own
                .iter()
                .all(|&c| normal.dot(c - other[0]) >= -self.margin)
    }

    /// How far the receiver is before the plane of a triangle, on the side of its normal, and how far rounding
    /// may move that.
    fn height_over(&self, scene: &Scene, camera: &Camera, triangle: u32) -> (f64, f64) {
        let corners = scene
            .corners(triangle)
            .map(|c| (c - camera.eye) - self.point);
        let [a, b, c] = corners;
        let corner = nearest(corners);
        let height = -unit_normal(a, b, c).dot(corner);
        (height, self.margin + GRANTED * corner.length())
    }
}

/// The corner that is nearest to the origin: it knows best how far that is off the plane.
fn nearest([a, b, c]: [DVec3; 3]) -> DVec3 {
    let nearer = |a: DVec3, b: DVec3| if b.length() < a.length() { b } else { a };
    nearer(nearer(a, b), c)
}

/// Visibility of the light from the receiver, and whether it is a tie.
fn shade(
    scene: &Scene,
    search: &impl Search,
    camera: &Camera,
    light: &Light,
    receiver: &Receiver,
) -> (f32, bool) {
    // Relative to the eye first: so far from the origin nothing is lost.
    let to_light = match light.position() {
        Some(position) => (position - camera.eye) - receiver.point,
        None => light.vector_from_point(camera.eye),
    };
    let distance = light
        .position()
        .map_or(f64::INFINITY, |_| to_light.length());
    if distance <= receiver.margin {
        // The light is where the receiver is.
        return (1.0, true);
    }
    let direction = to_light.normalize();
    // One answer for the whole triangle: the camera and the light see the same side of it.
    let source = Source::of(light);
    let own = scene.corners(receiver.triangle);
    let (to_light_side, to_eye_side) = (source.side_of(own), camera.source().side_of(own));
    let facing = to_light_side * to_eye_side;
    // How far inside the light's cone the receiver is, and by how much that may change.
    let (depth_in_cone, cone_margin) = light.cone().map_or((1.0, 0.0), |cone| {
        let along = -to_light.dot(cone.axis);
        let aside = (to_light + along * cone.axis).length();
        let margin = receiver.margin + GRANTED * distance;
        (cone.sine * along - cone.cosine * aside, margin)
    });
    // The eye may be on either side, where the light is on one.
    let is_edge_on = to_light_side != 0 && to_eye_side == 0;
    if facing <= 0 && !is_edge_on || depth_in_cone < -cone_margin {
        return (0.0, false);
    }
    let may_turn = is_edge_on || depth_in_cone <= cone_margin;
    let ray = Ray::new(receiver.point, direction, (0.0, distance), GRANTED).from(receiver.margin);
    let mut definite = false;
    let mut candidates: Vec<(u32, Contact)> = Vec::new();
    search.visit(ray.thick(camera), |triangle| {
        if triangle != receiver.triangle
            && let Some(contact) = ray.meet(scene, camera, triangle)
            && let Some(contact) = contact.before(source, receiver, scene, camera, &ray, triangle)
        {
            definite |= contact.definite;
            candidates.push((triangle, contact));
        }
        match definite {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(f64::INFINITY),
        }
    });
    if definite || covered_until(&candidates, ray.range) < f64::INFINITY {
        return (0.0, false);
    }
    let hit = candidates.iter().any(|(_, contact)| contact.hit.is_some());
    let lit = facing > 0 && depth_in_cone >= 0.0 && !hit;
    (lit as u8 as f32, !candidates.is_empty() || may_turn)
}

/// A ray in its own frame, and how well its origin is known.
struct Ray {
    /// Relative to the eye.
    origin: DVec3,
    /// Unit axes; x and y span the plane across the ray.
    x: DVec3,
    y: DVec3,
    direction: DVec3,
    /// Range of distances in which triangles are hit, both ends excluded.
    range: (f64, f64),
    /// How far rounding may move the origin.
    margin: f64,
    /// How far it may move a corner, as a share of its distance.
    granted: f64,
}

/// How a ray meets a triangle, seen along the ray.
#[derive(Debug, Clone)]
struct Contact {
    /// The corners in the plane across the ray, which is at the origin.
    corners: [DVec2; 3],
    /// The distance if the triangle is hit in float64.
    hit: Option<f64>,
    /// Whether the line of the ray passes inside its edges for all roundings.
    inside: bool,
    /// Whether it is hit for all roundings.
    definite: bool,
    /// Whether a ray nearby may pass through a hole of it.
    leaks: bool,
    /// The distances at which it may be hit within rounding.
    near: f64,
    far: f64,
    /// Where the ray's line meets the plane, if it is inside the edges in float64.
    crossing: Option<f64>,
    /// Whether the origin and the end of the ray are on different sides of the plane for sure.
    parts_ends: bool,
    /// How far rounding may move the triangle here.
    margin: f64,
}

impl Ray {
    fn new(origin: DVec3, direction: DVec3, range: (f64, f64), granted: f64) -> Self {
        let (x, y) = direction.any_orthonormal_pair();
        Self {
            origin,
            x,
            y,
            direction,
            range,
            margin: 0.0,
            granted,
        }
    }

    /// The same from an origin that rounding may move.
    fn from(self, margin: f64) -> Self {
        Self { margin, ..self }
    }

    /// The ray as the search wants it, thick enough for all margins.
    fn thick(&self, camera: &Camera) -> ThickRay {
        ThickRay {
            origin: camera.eye + self.origin,
            direction: self.direction,
            start: self.range.0,
            end: self.range.1,
            margin: self.margin,
            // Twice, because the margins below are made from a sum of coordinates, not from a length.
            growth: 2.0 * self.granted,
            spread: DVec3::ZERO,
        }
    }

    /// Tests one triangle; none if it is missed for all roundings.
    #[inline]
    fn meet(&self, scene: &Scene, camera: &Camera, triangle: u32) -> Option<Contact> {
        // Edge by edge the same numbers for each triangle that shares the edge.
        let relative = scene
            .corners(triangle)
            .map(|c| (c - camera.eye) - self.origin);
        let corners = relative.map(|c| DVec2::new(self.x.dot(c), self.y.dot(c)));
        let distances = relative.map(|c| self.direction.dot(c));
        let margins: [f64; 3] = std::array::from_fn(|i| {
            let length = corners[i].x.abs() + corners[i].y.abs() + distances[i].abs();
            self.granted * length + self.margin
        });

        let largest = margins[0].max(margins[1]).max(margins[2]);
        let [a, b, c] = corners;
        if a.min(b).min(c).max_element() > largest || a.max(b).max(c).min_element() < -largest {
            return None;
        }
        let edges = edge_functions(corners);
        let area = edges[0] + edges[1] + edges[2];

        // Near an edge: how close does the ray pass, and at which distances along it?
        let (mut near, mut far, mut margin) = (f64::INFINITY, f64::NEG_INFINITY, 0.0_f64);
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            let edge = [corners[j], corners[k]];
            let Some((ends, edge_margin)) = part_at_ray(edge, [margins[j], margins[k]]) else {
                continue;
            };
            for end in ends {
                let distance = distances[j] + end * (distances[k] - distances[j]);
                near = near.min(distance - edge_margin);
                far = far.max(distance + edge_margin);
            }
            margin = margin.max(edge_margin);
        }
        let inside = far == f64::NEG_INFINITY;

        let mut crossing = None;
        if area != 0.0 && has_one_sign(edges) {
            let weights = edges.map(|e| e / area);
            let weigh = |v: [f64; 3]| weights[0] * v[0] + weights[1] * v[1] + weights[2] * v[2];
            let distance = weigh(distances);
            let plane_margin = weigh(margins);
            // The plane moves by its margin, the distance by more if the ray is oblique, but the
            // hit stays on the triangle.
            let [a, b, c] = relative;
            let normal = unit_normal(a, b, c);
            let reach = plane_margin / normal.dot(self.direction).abs();
            let [a, b, c] = distances;
            let lowest = a.min(b).min(c) - plane_margin;
            let highest = a.max(b).max(c) + plane_margin;
            near = near.min((distance - reach).max(lowest));
            far = far.max((distance + reach).min(highest));
            margin = margin.max(plane_margin);
            crossing = Some(distance);
        } else if inside {
            return None;
        }
        if far < self.range.0 || near > self.range.1 {
            return None;
        }
        let mut leaks = false;
        if let Some(mask) = scene.mask_of(triangle) {
            match mask.solidity(edges, self.reach_in_image(&mask, corners, margin)) {
                Solidity::Solid => {}
                Solidity::Hole => return None,
                Solidity::Open(is_solid) => {
                    leaks = true;
                    crossing = crossing.filter(|_| is_solid);
                }
            }
        }
        let inside = inside && !leaks;
        let (start, end) = self.range;
        let mut contact = Contact {
            corners,
            hit: crossing.filter(|&distance| distance > start && distance < end),
            crossing,
            parts_ends: false,
            inside,
            definite: false,
            leaks,
            near,
            far,
            margin,
        };
        contact.definite = inside && contact.lies_within(self.range);
        Some(contact)
    }
}

impl Ray {
    /// How far a point of a triangle moves over its alpha image, and its factor changes, where rounding moves the ray by a
    /// margin across itself. Corners are in the plane across the ray.
    fn reach_in_image(&self, mask: &Mask, corners: [DVec2; 3], margin: f64) -> DVec3 {
        let [a, b, c] = corners;
        let area = (b - a).perp_dot(c - a).abs();
        let reach = |k: usize| {
            let [of_a, of_b, of_c] = mask.corners.map(|corner| corner[k]);
            let steepest = (of_a * (c - b) + of_b * (a - c) + of_c * (b - a)).length() / area;
            let size = of_a.abs().max(of_b.abs()).max(of_c.abs());
            margin * steepest + self.granted * size
        };
        DVec3::new(reach(0), reach(1), reach(2))
    }
}

/// The part of an edge within the margin of a ray at the origin, both ends as shares of the edge, and the margin
/// there; none if the ray passes farther off. The ends of the edge have margins of their own.
fn part_at_ray([from, to]: [DVec2; 2], margins: [f64; 2]) -> Option<([f64; 2], f64)> {
    let along = to - from;
    let length_squared = along.length_squared();
    let is_point = length_squared <= 0.0;
    let closest = match is_point {
        true => 0.0,
        false => (-from.dot(along) / length_squared).clamp(0.0, 1.0),
    };
    let margin = margins[0] + closest * (margins[1] - margins[0]);
    let slack = margin * margin - (from + closest * along).length_squared();
    if slack < 0.0 {
        return None;
    }
    let half = match is_point {
        true => 1.0,
        false => (slack / length_squared).sqrt(),
    };
    Some((
        [closest - half, closest + half].map(|end| end.clamp(0.0, 1.0)),
        margin,
    ))
}

impl Contact {
    /// Whether the hit is in a range of distances for all roundings.
    fn lies_within(&self, (start, end): (f64, f64)) -> bool {
        self.parts_ends || self.near > start && self.far < end
    }

    /// The contact of a ray from a receiver to a light, where rounding does not find the hit between them: the
    /// sides of the triangle that both are on say more. None where the triangle shadows nothing there.
    fn before(
        mut self,
        source: Source,
        receiver: &Receiver,
        scene: &Scene,
        camera: &Camera,
        ray: &Ray,
        triangle: u32,
    ) -> Option<Self> {
        if self.lies_within(ray.range) && self.inside {
            return Some(self);
        }
        let side = f64::from(source.side_of(scene.corners(triangle)));
        let (height, margin) = receiver.height_over(scene, camera, triangle);
        if side == 0.0 || side * height > margin {
            return None;
        }
        self.parts_ends = side * height < -margin;
        if !self.parts_ends && receiver.is_left_by(scene, camera, ray.direction, triangle) {
            return None;
        }
        self.definite = self.inside && self.parts_ends;
        self.hit = self.crossing.filter(|_| self.parts_ends);
        Some(self)
    }
}

/// Twice the signed areas between the origin and each edge; edge i is opposite of corner i.
///
/// Rounding can make one zero but never turn its sign, and it turns exactly with the direction of
/// the edge.
fn edge_functions([a, b, c]: [DVec2; 3]) -> [f64; 3] {
    [
        b.x * c.y - b.y * c.x,
        c.x * a.y - c.y * a.x,
        a.x * b.y - a.y * b.x,
    ]
}

fn has_one_sign(edges: [f64; 3]) -> bool {
    edges.iter().all(|&e| e >= 0.0) || edges.iter().all(|&e| e <= 0.0)
}

/// Whether the origin is in the triangle.
fn is_inside(corners: [DVec2; 3]) -> bool {
    let edges = edge_functions(corners);
    has_one_sign(edges) && edges != [0.0; 3]
}

/// The ray through the centre of a pixel, given as row * width + column.
fn camera_ray(camera: &Camera, pixel: usize, granted: f64) -> Ray {
    assert!(pixel < camera.pixel_count());
    let width = camera.width as usize;
    let (start, ray) = camera.ray_from_pixel((pixel % width) as u32, (pixel / width) as u32);
    // Depths are along the camera's axis, distances along the ray.
    let length = ray.length();
    Ray::new(
        start,
        ray / length,
        (camera.znear * length, camera.zfar * length),
        granted,
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh::{Bvh, Everything};
    use crate::occlusion::ReceiverRay;
    use glam::DMat4;

    /// Numbers in [-1, 1), the same in every run (xorshift64*).
    struct Random(u64);

    impl Random {
        fn number(&mut self) -> f64 {
            self.0 ^= self.0 >> 12;
            self.0 ^= self.0 << 25;
            self.0 ^= self.0 >> 27;
            (self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        }

        fn vector(&mut self) -> DVec3 {
            DVec3::new(self.number(), self.number(), self.number())
        }
    }

    fn scene(corners: &[[DVec3; 3]]) -> Scene {
        let triangles = (0..corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        Scene::new(corners.concat(), triangles.collect()).unwrap()
    }

    /// Looks along -Z, with a quarter turn across `size` pixels; with an odd size the central ray is
    /// parallel to the axis.
    fn camera(eye: DVec3, size: u32) -> Camera {
        let half = DVec2::splat(0.5 * size as f64);
        let pose = DMat4::from_translation(eye);
        Camera::new(pose, half, half, (size, size), (1e-9, f64::INFINITY)).unwrap()
    }

    fn sun(direction: DVec3) -> Light {
        Light::directional(direction).unwrap()
    }

    fn quad([a, b, c, d]: [DVec3; 4]) -> [[DVec3; 3]; 2] {
        [[a, b, c], [a, c, d]]
    }

    /// Two triangles in the plane z, a square of a given half size.
    fn square(x: f64, y: f64, z: f64, half: f64) -> [[DVec3; 3]; 2] {
        let corner = |i: f64, j: f64| DVec3::new(x + i * half, y + j * half, z);
        quad([
            corner(-1.0, -1.0),
            corner(1.0, -1.0),
            corner(1.0, 1.0),
            corner(-1.0, 1.0),
        ])
    }

    fn assert_same(a: &Reference, b: &Reference, case: &str) {
        let lit = |r: &Reference| r.visibility.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
        assert_eq!(a.triangle_id, b.triangle_id, "{case}");
        assert_eq!(a.triangle_tie, b.triangle_tie, "{case}");
        assert_eq!(lit(a), lit(b), "{case}");
        assert_eq!(a.tie, b.tie, "{case}");
    }

    fn count(flags: &[bool]) -> usize {
        flags.iter().filter(|&&flag| flag).count()
    }

    #[test]
    fn no_ray_slips_between_triangles_that_share_an_edge_or_a_corner() {
        let mut random = Random(1);
        let eye = DVec3::new(3.0, -2.0, 9.0);
        let camera = camera(eye, 1);
        for round in 0..20_000 {
            // A fan around the corner 0, closed; thin in every other round.
            let thin = if round % 2 == 0 { 1.0 } else { 1e-7 };
            let centre = random.vector();
            let turn = random.number();
            let rim: Vec<DVec3> = (0..5)
                .map(|i| {
                    let (y, x) = (std::f64::consts::TAU * (i as f64 / 5.0 + turn)).sin_cos();
                    centre + DVec3::new(x, thin * y, 0.1 * thin * random.number())
                })
                .collect();
            let fan: Vec<[DVec3; 3]> = (0..5).map(|i| [centre, rim[i], rim[(i + 1) % 5]]).collect();
            let scene = scene(&fan);
            let along = if round % 5 == 0 {
                0.0
            } else {
                0.5 + 0.5 * random.number()
            };
            let target = centre + along * (rim[round % 5] - centre);
            let direction = (target - eye).normalize();
            let ray = Ray::new(DVec3::ZERO, direction, (0.0, f64::INFINITY), ROUNDING);
            let contacts: Vec<_> = (0..5)
                .filter_map(|t| ray.meet(&scene, &camera, t))
                .collect();
            assert!(contacts.iter().any(|c| c.hit.is_some()), "round {round}");
            assert!(contacts.iter().all(|c| !c.definite), "round {round}");
        }
    }

    /// Triangles of all sizes, among them slivers, pairs that share an edge, triangles along the
    /// axes and triangles without area.
    fn soup(seed: u64, count: usize) -> Vec<[DVec3; 3]> {
        let mut random = Random(seed);
        let mut corners = Vec::new();
        while corners.len() < count {
            let size = 10_f64.powf(2.0 * random.number() - 1.5);
            let a = random.vector();
            let (b, c) = (a + size * random.vector(), a + size * random.vector());
            let along_axis = a + DVec3::new(size, 0.0, 0.0);
            match corners.len() % 5 {
                0 => corners.push([a, b, c]),
                1 => corners.push([a, b, a.lerp(b, 0.4) + 1e-7 * random.vector()]),
                2 => corners.extend([[a, b, c], [c, b, random.vector()]]),
                3 => corners.push([a, along_axis, a + DVec3::new(0.0, 0.0, size)]),
                _ => corners.push([a, a, b]),
            }
        }
        corners
    }

    #[test]
    fn the_search_finds_what_brute_force_finds() {
        // Powers of two scale without rounding: 1e-6, 1 and 1e6 roughly.
        for (seed, scale) in [(1, 2_f64.powi(-20)), (2, 1.0), (3, 2_f64.powi(20))] {
            for (eye, size) in [
                (DVec3::new(0.0, 0.0, 2.5), 33),
                (DVec3::new(0.1, -0.2, 0.3), 33),
                (DVec3::new(0.0, 0.0, 3000.0), 4001),
            ] {
                let corners: Vec<_> = soup(seed, 300)
                    .iter()
                    .map(|t| t.map(|v| v * scale))
                    .collect();
                let scene = scene(&corners);
                let camera = camera(eye * scale, size);
                let bvh = Bvh::new(&scene);
                let middle = size as usize / 2;
                let near_middle = middle.saturating_sub(16)..=(middle + 16).min(size as usize - 1);
                let pixels: Vec<usize> = near_middle
                    .clone()
                    .flat_map(|row| near_middle.clone().map(move |c| row * size as usize + c))
                    .collect();
                for light in [DVec3::NEG_Y, DVec3::NEG_Z, DVec3::new(0.3, -1.0, 0.2)].map(sun) {
                    let case = format!("seed {seed}, eye {eye}, {light:?}");
                    let found = reference_of_pixels(&scene, &bvh, &camera, &light, &pixels);
                    let all = Everything(&scene);
                    let truth = reference_of_pixels(&scene, &all, &camera, &light, &pixels);
                    assert_same(&found, &truth, &case);
                    assert!(found.triangle_id.iter().any(|&t| t >= 0), "{case}");
                }
            }
        }
    }

    #[test]
    fn the_place_in_the_world_does_not_matter() {
        // On a grid, so that moving rounds nothing.
        let grid = |v: DVec3| (v * 2_f64.powi(20)).round() / 2_f64.powi(20);
        let corners: Vec<_> = soup(7, 200).into_iter().map(|t| t.map(grid)).collect();
        let light = sun(DVec3::new(0.3, -1.0, 0.2));
        let answers = [DVec3::ZERO, DVec3::new(2.0, -1.0, 1.0) * 2_f64.powi(24)].map(|place| {
            let scene = scene(
                &corners
                    .iter()
                    .map(|t| t.map(|v| v + place))
                    .collect::<Vec<_>>(),
            );
            let camera = camera(place + DVec3::new(0.0, 0.0, 2.5), 64);
            reference(&scene, &Bvh::new(&scene), &camera, &light)
        });
        assert_same(&answers[0], &answers[1], "moved");
    }

    #[test]
    fn a_triangle_never_shadows_itself() {
        let mut random = Random(3);
        for round in 0..200 {
            let corners = [random.vector(), random.vector(), random.vector()];
            let scene = scene(&[corners]);
            let camera = camera(DVec3::new(0.0, 0.0, 3.0), 16);
            let normal = scene.unit_normals()[0].as_dvec3();
            let side = normal * normal.dot(camera.eye - corners[0]).signum();
            // From steep to grazing.
            let slope = 10_f64.powi(-(round % 5));
            let across = normal.any_orthonormal_vector();
            let light = sun(-(slope * side + across));
            let truth = reference(&scene, &Bvh::new(&scene), &camera, &light);
            for (pixel, visibility) in truth.visibility.iter().enumerate() {
                assert!(
                    visibility.is_nan() || *visibility == 1.0,
                    "round {round} {pixel}"
                );
                assert!(
                    truth.triangle_tie[pixel] || !truth.tie[pixel],
                    "round {round} {pixel}"
                );
            }
        }
    }

    #[test]
    fn a_square_throws_its_shadow_where_it_must() {
        // The light comes along the diagonal of x and z: a point of the floor at x is shadowed by
        // what is at x + 1 one unit higher.
        let corners = [square(0.0, 0.0, -4.0, 3.0), square(2.0, 0.0, -3.0, 0.5)].concat();
        let scene = scene(&corners);
        let camera = camera(DVec3::ZERO, 64);
        let light = sun(DVec3::new(-1.0, 0.0, -1.0));
        let truth = reference(&scene, &Bvh::new(&scene), &camera, &light);
        let (positions, normals, depths) = surface(&scene, &camera, &truth.triangle_id);
        let mut shadowed = 0;
        for (pixel, &[x, y, z]) in positions.iter().enumerate() {
            match truth.triangle_id[pixel] {
                -1 => assert!(truth.visibility[pixel].is_nan() && depths[pixel].is_nan()),
                0 | 1 => {
                    let shadow = (x - 1.0).abs() < 0.5 && y.abs() < 0.5;
                    shadowed += shadow as usize;
                    assert_eq!(truth.visibility[pixel], !shadow as u8 as f32, "{x} {y} {z}");
                    assert!((z + 4.0).abs() < 1e-14 && (depths[pixel] - 4.0).abs() < 1e-14);
                    assert_eq!(normals[pixel], [0.0, 0.0, 1.0]);
                }
                _ => assert_eq!(truth.visibility[pixel], 1.0),
            }
        }
        assert!(shadowed > 20, "{shadowed}");
        assert_eq!(count(&truth.tie), 0);
    }

    #[test]
    fn a_silhouette_on_the_ray_is_a_tie_and_half_a_pixel_away_it_is_not() {
        // The rays of column 10 pass x = 0 (the image is 21 pixels wide); the caster ends there.
        // Row 8 keeps away from the diagonals of the squares.
        let pixel = 8 * 21 + 10;
        let light = sun(DVec3::new(0.1, -0.2, -1.0));
        let answer = |edge: f64| {
            let corners = [
                square(0.0, 0.0, -4.0, 9.0),
                square(edge - 1.0, 0.0, -3.0, 1.0),
            ]
            .concat();
            let scene = scene(&corners);
            reference(&scene, &Bvh::new(&scene), &camera(DVec3::ZERO, 21), &light)
        };
        let on_edge = |edge: f64| answer(edge).triangle_tie[pixel];
        assert!(on_edge(0.0) && on_edge(1e-7) && on_edge(-1e-7));
        let pixel_size = 3.0 / 10.5;
        for share in [0.5, 1e-4] {
            assert!(
                !on_edge(share * pixel_size) && !on_edge(-share * pixel_size),
                "{share}"
            );
        }
        // The receiver at (0, y, -4) is shadowed by what is at x = -0.1 on its way to the light.
        let lit = |edge: f64| {
            let truth = answer(edge);
            (truth.visibility[pixel], truth.tie[pixel])
        };
        // Seen past a caster that ends left of the ray. What float32 cannot tell is no tie.
        assert!(lit(-0.1).1);
        for off in [1e-4, 1e-7, 1e-12] {
            assert_eq!(lit(-0.1 + off), (0.0, false), "{off}");
            assert_eq!(lit(-0.1 - off), (1.0, false), "{off}");
        }
    }

    #[test]
    fn coplanar_twins_are_both_first_and_do_not_shadow_each_other() {
        let once = square(0.0, 0.0, -4.0, 3.0);
        let twins = scene(&[once, once].concat());
        let camera = camera(DVec3::ZERO, 16);
        let light = sun(DVec3::new(0.1, -0.2, -1.0));
        let truth = reference(&twins, &Bvh::new(&twins), &camera, &light);
        for pixel in (0..256).filter(|&pixel| truth.triangle_id[pixel] >= 0) {
            assert!(truth.triangle_tie[pixel] && !truth.tie[pixel], "{pixel}");
            assert!(!truth.float32_tie[pixel] && truth.visibility[pixel] == 1.0);
            assert!(truth.triangle_id[pixel] < 2, "the lower index");
        }
        assert!(count(&truth.triangle_tie) > 50);
    }

    #[test]
    fn a_sheet_that_only_float64_tells_from_the_floor_shadows_it_and_is_what_is_seen() {
        // The sheet lies 1e-9 above the floor, which float32 may see through it; a wide roof shadows half.
        let roof = square(-2.0, 0.0, -1.0, 1.9);
        let floor = square(0.0, 0.0, -4.0, 9.0);
        let sheet = square(0.0, 0.0, -4.0 + 1e-9, 9.0);
        let scene = scene(&[floor, sheet, roof].concat());
        let light = sun(DVec3::new(0.1, -0.2, -1.0));
        let truth = reference(&scene, &Bvh::new(&scene), &camera(DVec3::ZERO, 64), &light);
        let seen = |pixel: &usize| [2, 3].contains(&truth.triangle_id[*pixel]);
        let sheet: Vec<usize> = (0..64 * 64).filter(seen).collect();
        assert!(sheet.len() > 1000);
        let lit: Vec<_> = sheet
            .iter()
            .filter(|&&p| truth.visibility[p] == 1.0)
            .collect();
        assert!(lit.len() > 500 && lit.len() < sheet.len());
        assert!(
            sheet
                .iter()
                .all(|&p| truth.triangle_tie[p] && !truth.tie[p])
        );
        // Through the sheet the floor is seen in its shadow.
        assert!(lit.iter().all(|&&p| truth.float32_tie[p]));
    }

    /// The inside of a box, which one lamp may be on, and an eye.
    fn room(turn: f64) -> (Vec<[DVec3; 3]>, impl Fn(DVec3) -> DVec3) {
        let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
        let turned = glam::DQuat::from_axis_angle(axis, turn);
        let place = move |v: DVec3| turned * (v * DVec3::new(4.1, 1.7, 3.3));
        let corner =
            |i: u32| DVec3::from_array([0, 1, 2].map(|k| f64::from((i >> k) & 1) * 2.0 - 1.0));
        let faces = [
            [0, 1, 3, 2],
            [4, 6, 7, 5],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 2, 6, 4],
            [1, 5, 7, 3],
        ];
        let quads = faces.map(|face| quad(face.map(|i| place(corner(i)))));
        (quads.concat(), place)
    }

    #[test]
    fn a_lamp_on_a_wall_an_edge_or_a_corner_lights_all_that_it_sees() {
        // Straight, and turned, so that the lamp's own place is rounded.
        for turn in [0.0, 0.7, 2.1] {
            let (corners, place) = room(turn);
            let scene = scene(&corners);
            let camera = camera(place(DVec3::new(-0.3, 0.2, 0.4)), 24);
            for lamp in [
                (0.2, 1.0, -0.3),
                (1.0, 0.3, 0.1),
                (0.4, 1.0, -1.0),
                (1.0, -1.0, 1.0),
            ] {
                // A few steps of float64 from a wall it is within the rounding of its distance to the receivers.
                let gaps = [1e-14, 1e-12, 1e-9, 1e-7, 1e-5];
                for gap in [0.0].into_iter().chain(gaps).chain(gaps.map(|gap| -gap)) {
                    let lamp = DVec3::from(lamp);
                    // Outwards where the gap is negative.
                    let position = place(lamp * (1.0 - gap));
                    let light = Light::point(position).unwrap();
                    let truth = reference(&scene, &Bvh::new(&scene), &camera, &light);
                    let case = format!("{turn} {lamp} {gap}");
                    for (pixel, &triangle) in truth.triangle_id.iter().enumerate() {
                        // Of the walls that the lamp is on.
                        let own = scene.corners(triangle as u32);
                        let is_on = (own[0] - position)
                            .dot(unit_normal(own[0], own[1], own[2]))
                            .abs()
                            < 1e-4;
                        let lit = f32::from(u8::from(gap >= 0.0));
                        if !is_on || gap != 0.0 {
                            assert_eq!(truth.visibility[pixel], lit, "{case} {pixel}");
                            assert!(!truth.tie[pixel], "{case} {pixel}");
                        }
                    }
                }
            }
        }
    }

    #[test]
    fn engines_decide_in_float64_what_the_reference_does() {
        for (seed, light) in [
            (1, sun(DVec3::new(0.3, -1.0, 0.2))),
            (2, Light::point(DVec3::new(0.4, 1.3, 0.2)).unwrap()),
            (
                3,
                Light::spot(DVec3::new(0.4, 1.3, 0.2), DVec3::new(0.1, -1.0, -0.1), 0.6).unwrap(),
            ),
        ] {
            let scene = scene(&soup(seed, 120));
            let camera = camera(DVec3::new(0.1, -0.2, 2.4), 64);
            let truth = reference(&scene, &Everything(&scene), &camera, &light);
            let (mut lit, mut dark) = (0, 0);
            for pixel in (0..4096).filter(|&p| truth.triangle_id[p] >= 0 && !truth.tie[p]) {
                let triangle = truth.triangle_id[pixel] as u32;
                let ray = ReceiverRay::new(&scene, &camera, &light, pixel as u32, triangle);
                let has_area = |&t: &u32| scene.unit_normals()[t as usize] != glam::Vec3::ZERO;
                let mut casters = (0..scene.triangles().len() as u32).filter(has_area);
                let is_lit = ray.is_facing(&light) && !casters.any(|t| ray.is_shadowed_by(t));
                assert_eq!(truth.visibility[pixel] == 1.0, is_lit, "{seed} {pixel}");
                *if is_lit { &mut lit } else { &mut dark } += 1;
                assert!(!(0..120).any(|t| ray.is_hidden_by(t)), "{seed} {pixel}");
            }
            assert!(lit > 20 && dark > 200, "{seed}: {lit} {dark}");
        }
    }

    #[test]
    fn an_edge_inside_a_surface_is_no_tie_of_its_shadow() {
        // The diagonal of the square is on the rays of the image's diagonal; behind it is another
        // square, all in its shadow.
        let corners = [square(0.0, 0.0, -2.0, 1.0), square(0.0, 0.0, -3.0, 9.0)].concat();
        let scene = scene(&corners);
        let light = sun(DVec3::NEG_Z);
        let truth = reference(&scene, &Bvh::new(&scene), &camera(DVec3::ZERO, 16), &light);
        // Row 0 is at the top: the diagonal of the first square goes up to the right.
        for column in 5..11 {
            let pixel = (15 - column) * 16 + column;
            assert!(truth.triangle_tie[pixel] && !truth.tie[pixel], "{pixel}");
            assert_eq!(truth.visibility[pixel], 1.0);
        }
    }

    #[test]
    fn the_side_away_from_the_light_is_in_shadow_and_so_is_what_the_light_sees_edge_on() {
        let scene = scene(&square(0.0, 0.0, -4.0, 9.0));
        let bvh = Bvh::new(&scene);
        for (direction, visibility, tie) in [
            (DVec3::new(1.0, 0.0, -0.01), 1.0, 0),
            (DVec3::new(1.0, 0.0, 0.01), 0.0, 0),
            (DVec3::X, 0.0, 0),
            (DVec3::new(1.0, 0.0, -1e-12), 1.0, 0),
        ] {
            let truth = reference(&scene, &bvh, &camera(DVec3::ZERO, 8), &sun(direction));
            assert!(
                truth.visibility.iter().all(|&v| v == visibility),
                "{direction}"
            );
            assert_eq!(count(&truth.tie), tie, "{direction}");
        }
    }

    /// The rectangle between two corners along x, over z, where y is a function of z.
    fn strip(x: [f64; 2], z: [f64; 2], y: impl Fn(f64) -> f64) -> [[DVec3; 3]; 2] {
        let corner = |x: f64, z: f64| DVec3::new(x, y(z), z);
        quad([
            corner(x[0], z[0]),
            corner(x[1], z[0]),
            corner(x[1], z[1]),
            corner(x[0], z[1]),
        ])
    }

    #[test]
    fn the_flatter_a_surface_is_seen_the_wider_are_the_ties_of_its_shadow() {
        // The central ray meets the receiver at z = -4, at a thousandth of a right angle, so that rounding
        // moves it along z by a thousand times as much; above it the caster ends near there.
        let answer = |edge: f64| {
            let receiver = strip([-1.3, 0.7], [-5.0, -3.0], |z| -1e-3 * (z + 4.0));
            let caster = strip([-1.3, 0.9], [-4.0 + edge, -2.0], |_| 1.0);
            let scene = scene(&[receiver, caster].concat());
            let light = sun(DVec3::NEG_Y);
            let truth = reference(&scene, &Bvh::new(&scene), &camera(DVec3::ZERO, 21), &light);
            (truth.visibility[220], truth.tie[220])
        };
        assert_eq!(answer(0.02), (1.0, false));
        assert_eq!(answer(-0.02), (0.0, false));
        // Of a surface that is met at a right angle 2e-12 would be clear.
        assert!(answer(2e-12).1 && answer(-2e-12).1);
        assert_eq!(answer(1e-9), (1.0, false));
        assert_eq!(answer(-1e-9), (0.0, false));
    }

    #[test]
    fn a_ridge_is_no_tie_of_its_shadow() {
        // It passes the ray of column 10 within rounding; either side is lit, and none shadows the other.
        for x in [0.0, 2e-7, -2e-7] {
            let side = |far: f64| {
                quad([
                    DVec3::new(x, -9.0, -4.0),
                    DVec3::new(x, 9.0, -4.0),
                    DVec3::new(far, 9.0, -5.0),
                    DVec3::new(far, -9.0, -5.0),
                ])
            };
            let scene = scene(&[side(-3.0), side(3.0)].concat());
            let light = sun(DVec3::new(0.1, -0.2, -1.0));
            let truth = reference(&scene, &Bvh::new(&scene), &camera(DVec3::ZERO, 21), &light);
            let pixel = 8 * 21 + 10;
            assert!(truth.triangle_tie[pixel] && !truth.tie[pixel], "{x}");
            assert_eq!(truth.visibility[pixel], 1.0);
        }
    }

    #[test]
    fn a_surface_edge_on_to_the_eye_may_be_seen_from_either_side() {
        // Behind it is a lit wall. Which side of the first one is seen decides whether it is lit.
        let edge_on = strip([-1.3, 0.7], [-5.0, -3.0], |_| 0.0);
        let scene = scene(&[edge_on, square(0.3, 0.0, -6.0, 9.0)].concat());
        for y in [-1.0, 1.0] {
            let light = sun(DVec3::new(0.0, y, -1.0));
            let truth = reference(&scene, &Bvh::new(&scene), &camera(DVec3::ZERO, 21), &light);
            assert!(truth.triangle_tie[220] && truth.tie[220], "{y}");
        }
        // The light comes from behind a small wall, which is as dark as the wrong side of the first one.
        let edge_on = strip([-1.3, 0.7], [-5.0, -3.0], |_| 0.0);
        let scene = self::scene(&[edge_on, square(0.3, 0.0, -6.0, 0.5)].concat());
        for y in [-1.0, 1.0] {
            let light = sun(DVec3::new(0.0, y, 0.5));
            let truth = reference(&scene, &Bvh::new(&scene), &camera(DVec3::ZERO, 21), &light);
            assert!(truth.tie[220], "{y}");
        }
    }

    #[test]
    fn depths_outside_the_camera_range_are_not_seen() {
        let corners: Vec<_> = [-1.0, -2.0, -3.0]
            .iter()
            .flat_map(|&z| square(0.0, 0.0, z, 9.0))
            .collect();
        let scene = scene(&corners);
        let (bvh, light) = (Bvh::new(&scene), sun(DVec3::NEG_Z));
        let mut camera = camera(DVec3::ZERO, 8);
        for (range, first) in [
            ((0.5, 9.0), 0),
            ((1.5, 9.0), 2),
            ((2.5, 9.0), 4),
            ((0.1, 0.9), -1),
        ] {
            (camera.znear, camera.zfar) = range;
            let truth = reference(&scene, &bvh, &camera, &light);
            let (triangle_id, tie) = (truth.triangle_id, truth.triangle_tie);
            assert!(
                triangle_id.iter().all(|&t| t == first || t == first + 1),
                "{range:?}"
            );
            assert!(first < 0 || triangle_id.contains(&first));
            assert!(count(&tie) <= 8, "{range:?}: only the diagonal is one");
        }
        (camera.znear, camera.zfar) = (1.0, 9.0);
        assert_eq!(
            count(&reference(&scene, &bvh, &camera, &light).triangle_tie),
            64,
            "on the near plane"
        );
    }

    #[test]
    fn a_floor_of_huge_triangles_has_few_ties() {
        // Seen from 1.7 above it; the corners are 1e5 away.
        let turned = square(0.0, 0.0, 0.0, 1e5).map(|t| t.map(|v| DVec3::new(v.x, v.z - 1.7, v.y)));
        let scene = scene(&turned);
        let truth = reference(
            &scene,
            &Bvh::new(&scene),
            &camera(DVec3::new(0.3, 0.0, 0.1), 128),
            &sun(DVec3::new(0.3, -1.0, 0.2)),
        );
        let covered = truth.triangle_id.iter().filter(|&&t| t >= 0).count();
        assert!(covered > 8000, "{covered}");
        assert_eq!(count(&truth.tie), 0);
        assert!(
            count(&truth.triangle_tie) < 80,
            "{}",
            count(&truth.triangle_tie)
        );
    }

    #[test]
    fn triangles_without_area_are_ignored() {
        let line = [
            DVec3::new(-1.0, 0.0, -2.0),
            DVec3::new(1.0, 0.0, -2.0),
            DVec3::NEG_Z * 2.0,
        ];
        let scene = scene(&[line]);
        assert_eq!(scene.degenerate_count(), 1);
        let light = sun(DVec3::NEG_Y);
        let truth = reference(&scene, &Bvh::new(&scene), &camera(DVec3::ZERO, 9), &light);
        assert!(truth.visibility.iter().all(|v| v.is_nan()));
        assert_eq!(count(&truth.tie) + count(&truth.triangle_tie), 0);
    }
}
