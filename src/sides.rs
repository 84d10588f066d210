//! On which side of a triangle's plane a light or an eye is, decided in float64.
//!
//! It is one answer for a whole triangle. Float32 finds it anew for each pixel and turns it where the light
//! is nearly in the plane: a lamp on a ceiling, a sun along a wall. A triangle that the light lies in the
//! plane of is seen edge-on from the light: it is not lit, and it shadows nothing.

use crate::geometry::bounds_of;
use crate::light::Light;
use crate::rounding::ROUNDING;
use crate::scene::Scene;
use glam::{DVec3, Vec3, Vec4};
use rayon::prelude::*;

/// Of a determinant of differences, as a share of the sum of its terms' sizes: Shewchuk's bound ("Adaptive
/// precision floating-point arithmetic and fast robust geometric predicates", 1997) is 7 * 2^-53; twice that.
const DETERMINANT_ROUNDING: f64 = 16.0 / (1_u64 << 53) as f64;

/// Of a coordinate of the input, as a share of it: whoever put a wall upright rounded its corners.
const INPUT_ROUNDING: f64 = 2.0 / (1_u64 << 53) as f64;

/// Where a ray of a light comes from.
#[derive(Debug, Clone, Copy)]
pub enum Source {
    Point(DVec3),
    /// The vector towards a light at infinity.
    Direction(DVec3),
}

impl Source {
    pub fn of(light: &Light) -> Self {
        match light.position() {
            Some(position) => Self::Point(position),
            None => Self::Direction(light.vector_from_point(DVec3::ZERO)),
        }
    }

    /// 1 where the triangle's normal points to the source by the right-hand rule, -1 where it points away, 0
    /// where the source is in the plane within the rounding of float64.
    pub fn side_of(self, corners: [DVec3; 3]) -> i8 {
        // From the corner that is nearest to a point, so that the differences are as small as the input allows.
        let (first, u) = match self {
            Self::Direction(towards) => (0, towards),
            Self::Point(point) => {
                let squared = corners.map(|corner| corner.distance_squared(point));
                let nearer = |a: usize, b: usize| if squared[b] < squared[a] { b } else { a };
                let first = nearer(nearer(0, 1), 2);
                (first, point - corners[first])
            }
        };
        let [v, w] = [1, 2].map(|next| corners[(first + next) % 3] - corners[first]);
        let minors = [
            v.y * w.z,
            v.z * w.y,
            v.z * w.x,
            v.x * w.z,
            v.x * w.y,
            v.y * w.x,
        ];
        let determinant = u.x * (minors[0] - minors[1])
            + u.y * (minors[2] - minors[3])
            + u.z * (minors[4] - minors[5]);
        let sizes = minors.map(f64::abs);
        let terms = u.x.abs() * (sizes[0] + sizes[1])
            + u.y.abs() * (sizes[2] + sizes[3])
            + u.z.abs() * (sizes[4] + sizes[5]);
        // What the rounding of the input does to each of the differences.
        let largest = corners.map(|corner| corner.abs().max_element());
        let moved = INPUT_ROUNDING * largest.into_iter().fold(0.0, f64::max);
        let [u, v, w] = [u, v, w].map(DVec3::length);
        let moved = moved
            * match self {
                Self::Direction(_) => u * (v + w),
                Self::Point(_) => u * (v + w) + v * w,
            };
        match determinant.abs() <= DETERMINANT_ROUNDING * terms + moved {
            true => 0,
            false if determinant > 0.0 => 1,
            false => -1,
        }
    }
}

/// Triangles to a word of the table.
const PER_WORD: usize = 16;

/// What float32 may hide of a light's height above a plane, as a share of the distances that it is a difference
/// of: sixteen times the rounding of a position.
const HIDDEN_SHARE: f64 = 16.0 * ROUNDING;

/// The sides of the light where float32 may be wrong: 2 bits for each triangle, 16 triangles to a word, the first
/// in the lowest bits. 0: float32 finds the side; else the side plus 2. `None` where float32 finds all of them.
pub fn sides_for_float32(scene: &Scene, light: &Light, eye: DVec3) -> Option<Vec<u32>> {
    let source = Source::of(light);
    let (to_height, reach) = heights(scene, source, eye);
    let word = |(index, planes): (usize, &[Vec4])| {
        let is_near = |plane: &Vec4| plane.dot(to_height).abs() <= reach;
        if !planes.iter().fold(false, |any, plane| any | is_near(plane)) {
            return 0;
        }
        let near = planes
            .iter()
            .enumerate()
            .filter(|(_, plane)| is_near(plane));
        near.fold(0, |word, (i, _)| {
            let side = source.side_of(scene.corners((PER_WORD * index + i) as u32));
            word | ((side + 2) as u32) << (2 * i)
        })
    };
    let words = scene.planes().par_chunks(PER_WORD).enumerate();
    let words: Vec<u32> = words.with_min_len(1024).map(word).collect();
    words.iter().any(|&word| word != 0).then_some(words)
}

/// What float32 may hide of the height of a light above a plane.
fn hidden_height(scene: &Scene, position: DVec3, eye: DVec3) -> f64 {
    HIDDEN_SHARE * (scene.farthest(position) + scene.farthest(eye))
}

/// The sides of all triangles, 0 also of those without an area. Those that float32 is sure of are not asked for again.
pub fn sides_of_triangles(scene: &Scene, light: &Light) -> Vec<i8> {
    let source = Source::of(light);
    let (to_height, reach) = heights(scene, source, scene.centre());
    let side = |(triangle, plane): (usize, &Vec4)| {
        let height = plane.dot(to_height);
        match height.abs() <= reach {
            false => height.signum() as i8,
            true if plane.truncate() == Vec3::ZERO => 0,
            true => source.side_of(scene.corners(triangle as u32)),
        }
    };
    let planes = scene.planes().par_iter().enumerate();
    planes.with_min_len(1024).map(side).collect()
}

/// What a plane is multiplied by to the height of a source above it, and what float32 may hide of that.
fn heights(scene: &Scene, source: Source, eye: DVec3) -> (Vec4, f32) {
    let (to_height, reach) = match source {
        Source::Point(position) => (
            (position - scene.centre()).as_vec3().extend(-1.0),
            hidden_height(scene, position, eye),
        ),
        Source::Direction(towards) => (towards.as_vec3().extend(0.0), HIDDEN_SHARE),
    };
    (to_height, reach as f32)
}

/// How far beside a light a triangle may end, in heights that float32 may hide, and still be at it: the rays that leave
/// it farther away are within a degree of its plane.
const BESIDE: f64 = 64.0;

/// The triangles that a light is at, on one side or the other, of those whose sides `sides_for_float32` told. They are
/// nearer to it than what a map holds, and may shadow half of space.
pub fn triangles_at_light(scene: &Scene, light: &Light, eye: DVec3, words: &[u32]) -> Vec<u32> {
    let Some(position) = light.position() else {
        return Vec::new();
    };
    let reach = BESIDE * hidden_height(scene, position, eye);
    let has_side = |triangle: u32| {
        let triangle = triangle as usize;
        matches!(
            words[triangle / PER_WORD] >> (2 * (triangle % PER_WORD)) & 3,
            1 | 3
        )
    };
    let is_near = |triangle: u32| {
        let (low, high) = bounds_of(scene.corners(triangle).into_iter());
        position.distance(position.clamp(low, high)) <= reach
    };
    let count = scene.planes().len() as u32;
    (0..count).filter(|&t| has_side(t) && is_near(t)).collect()
}

/// The same for whoever has no use for the sides.
pub fn casters_at_light(scene: &Scene, light: &Light, eye: DVec3) -> Vec<u32> {
    let position = light.position();
    let words = position.and_then(|_| sides_for_float32(scene, light, eye));
    words.map_or_else(Vec::new, |words| {
        triangles_at_light(scene, light, eye, &words)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scene(corners: &[[DVec3; 3]]) -> Scene {
        let triangles = (0..corners.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]);
        Scene::new(corners.concat(), triangles.collect()).unwrap()
    }

    /// Whole numbers, of which float64 rounds no product: the exact side.
    fn exact_side(point: [i64; 3], corners: [[i64; 3]; 3]) -> i8 {
        let relative =
            |corner: [i64; 3]| -> [i64; 3] { std::array::from_fn(|k| corner[k] - point[k]) };
        let [a, b, c] = corners.map(relative);
        let determinant = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0])
            + a[2] * (b[0] * c[1] - b[1] * c[0]);
        -determinant.signum() as i8
    }

    #[test]
    fn sides_of_points_are_those_of_whole_numbers() {
        let mut random = crate::twin::Random(5);
        let mut seen = [0; 3];
        for round in 0..4000 {
            let mut point = || -> [i64; 3] { std::array::from_fn(|_| random.below(9) as i64 - 4) };
            let (corners, light) = ([point(), point(), point()], point());
            let scale = [1e-9, 1.0, 1e9][round % 3];
            let as_vector = |p: [i64; 3]| scale * DVec3::from_array(p.map(|x| x as f64));
            let side = Source::Point(as_vector(light)).side_of(corners.map(as_vector));
            assert_eq!(side, exact_side(light, corners), "{light:?} {corners:?}");
            seen[(side + 1) as usize] += 1;
        }
        assert!(seen.iter().all(|&count| count > 60), "{seen:?}");
    }

    #[test]
    fn a_point_a_billionth_off_a_plane_has_a_side_and_a_rounded_one_has_none() {
        // A slanted plane: its points are rounded, so that some are above it by half a step and some below.
        let corners = [
            DVec3::new(0.3, 1.1, -0.7),
            DVec3::new(2.9, 1.7, 0.1),
            DVec3::new(-0.2, 2.3, 3.1),
        ];
        let normal = crate::scene::unit_normal(corners[0], corners[1], corners[2]);
        for (u, v) in [(0.3, 0.3), (0.1, 0.7), (0.21, 0.05)] {
            let on = corners[0] + u * (corners[1] - corners[0]) + v * (corners[2] - corners[0]);
            assert_eq!(Source::Point(on).side_of(corners), 0);
            assert_eq!(Source::Point(on + 1e-12 * normal).side_of(corners), 1);
            assert_eq!(Source::Point(on - 1e-12 * normal).side_of(corners), -1);
        }
        let along = corners[1] - corners[2];
        assert_eq!(Source::Direction(along).side_of(corners), 0);
        assert_eq!(
            Source::Direction(along + 1e-12 * normal).side_of(corners),
            1
        );
        assert_eq!(
            Source::Direction(along - 1e-12 * normal).side_of(corners),
            -1
        );
    }

    #[test]
    fn only_planes_near_the_light_are_in_the_table() {
        let level = |y: f64| {
            [
                DVec3::new(0.0, y, 0.0),
                DVec3::new(0.0, y, 1.0),
                DVec3::new(1.0, y, 0.0),
            ]
        };
        let mut corners = vec![level(0.0); 17];
        corners[3] = level(3.0);
        corners[16] = level(3.0 + 1e-9);
        let scene = scene(&corners);
        let light = |y: f64| Light::point(DVec3::new(0.2, y, 0.2)).unwrap();
        let eye = DVec3::new(0.0, 1.0, 5.0);
        assert_eq!(sides_for_float32(&scene, &light(1.5), eye), None);
        // In the plane of one, and behind the other, whose normal points up.
        assert_eq!(
            sides_for_float32(&scene, &light(3.0), eye),
            Some(vec![2 << 6, 1])
        );
        assert_eq!(
            sides_for_float32(&scene, &light(3.0 + 2e-9), eye),
            Some(vec![3 << 6, 3])
        );
        // Of those that it is off, only the one beside it is at it.
        let words = sides_for_float32(&scene, &light(3.0 + 2e-9), eye).unwrap();
        let at = |x: f64, words: &[u32]| {
            let light = Light::point(DVec3::new(x, 3.0 + 2e-9, 0.2)).unwrap();
            triangles_at_light(&scene, &light, eye, words)
        };
        assert_eq!(at(0.2, &words), [3, 16]);
        assert!(at(-0.2, &words).is_empty());
        assert_eq!(at(0.2, &[2 << 6, 1]), [16]);
        // A sun along all of them.
        let sun = Light::directional(DVec3::X).unwrap();
        assert_eq!(
            sides_for_float32(&scene, &sun, eye),
            Some(vec![0xaaaa_aaaa, 2])
        );
    }
}
