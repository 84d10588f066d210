//! Plane geometry in float64: convex hulls and smallest rectangles.

use glam::{DVec2, DVec3};
use robust::{Coord, orient2d};

/// The greatest distance between a point and one of a box.
pub fn farthest_in_box((low, high): (DVec3, DVec3), point: DVec3) -> f64 {
    (point - low).abs().max((point - high).abs()).length()
}

/// The corners of a box.
pub fn box_corners((low, high): (DVec3, DVec3)) -> [DVec3; 8] {
    std::array::from_fn(|i| {
        let pick = |bit: usize, low: f64, high: f64| if i & bit == 0 { low } else { high };
        DVec3::new(
            pick(1, low.x, high.x),
            pick(2, low.y, high.y),
            pick(4, low.z, high.z),
        )
    })
}

/// Least and greatest of some numbers; infinite and the wrong way round where there is none.
pub fn range_of(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    numbers.fold(none, |(least, greatest), x| (least.min(x), greatest.max(x)))
}

/// One order of all points: who shares an edge begins at the same end, and computes the same numbers.
pub fn is_before(a: DVec3, b: DVec3) -> bool {
    (a.x, a.y, a.z) < (b.x, b.y, b.z)
}

/// Least and greatest corner of points.
pub fn bounds_of(points: impl Iterator<Item = DVec3>) -> (DVec3, DVec3) {
    let none = (DVec3::INFINITY, DVec3::NEG_INFINITY);
    points.fold(none, |(low, high), p| (low.min(p), high.max(p)))
}

/// Least and greatest corner of places in a plane.
pub fn bounds_of_places(places: impl Iterator<Item = DVec2>) -> (DVec2, DVec2) {
    let none = (DVec2::INFINITY, DVec2::NEG_INFINITY);
    places.fold(none, |(low, high), p| (low.min(p), high.max(p)))
}

/// Twice the signed area of a triangle, its sign exact: positive where it turns to the left.
fn orientation(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let [a, b, c] = [a, b, c].map(|p| Coord { x: p.x, y: p.y });
    orient2d(a, b, c)
}

/// The corners of the convex hull of finite points, counter-clockwise from the leftmost, the lowest
/// of those. No corner is repeated or lies between two others: one corner where all points are the
/// same, two where they lie on a line, none where there is no point.
///
/// A. M. Andrew. Another efficient algorithm for convex hulls in two dimensions. Information
/// Processing Letters 9(5), 1979; with J. R. Shewchuk's exact predicate (1997), so that no rounding
/// makes a hull that is not convex.
pub fn convex_hull(points: &[DVec2]) -> Vec<DVec2> {
    assert!(points.iter().all(|point| point.is_finite()));
    let mut sorted = points.to_vec();
    sorted.sort_unstable_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    // The lower chain from left to right, then the upper one back; each ends where the other starts.
    let mut hull: Vec<DVec2> = Vec::new();
    for chain in [false, true] {
        let start = hull.len();
        let mut extend = |point: DVec2| {
            while let [.., a, b] = hull[start..]
                && orientation(a, b, point) <= 0.0
            {
                hull.pop();
            }
            hull.push(point);
        };
        if chain {
            sorted.iter().rev().copied().for_each(&mut extend);
        } else {
            sorted.iter().copied().for_each(&mut extend);
        }
        hull.pop();
    }
    hull
}

/// A rectangle in any orientation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rectangle {
    pub centre: DVec2,
    /// Unit vector along the first side; the second side is perpendicular, to its left.
    pub axis: DVec2,
    /// Half the lengths of the sides.
    pub half: DVec2,
}

impl Rectangle {
    /// The smallest with that axis around points, at least one.
    fn around(points: &[DVec2], axis: DVec2) -> Self {
        let points = points.iter();
        let (low, high) = bounds_of_places(points.map(|&p| (axis.dot(p), axis.perp_dot(p)).into()));
        let middle = 0.5 * (low + high);
        Self {
            centre: axis * middle.x + axis.perp() * middle.y,
            axis,
            half: 0.5 * (high - low),
        }
    }
}

/// The rectangle of least area around finite points; `None` where there is none. It has no width
/// where they lie on a line.
///
/// One side holds an edge of the hull (H. Freeman, R. Shapira. Determining the minimum-area
/// encasing rectangle for an arbitrary closed curve. CACM 18(7), 1975). Rotating calipers find the
/// touching corners of every edge in one walk around the hull (G. Toussaint. Solving geometric
/// problems with the rotating calipers. MELECON 1983).
pub fn smallest_rectangle(points: &[DVec2]) -> Option<Rectangle> {
    let hull = convex_hull(points);
    let (&first, rest) = hull.split_first()?;
    let size = rest.iter().map(|p| (*p - first).abs().max_element());
    let size = size.fold(0.0, f64::max);
    if size == 0.0 {
        return Some(Rectangle::around(&hull, DVec2::X));
    }
    // Differences, scaled so that the products of tiny and of huge ones are numbers.
    let step = |from: usize, to: usize| (hull[to % hull.len()] - hull[from % hull.len()]) / size;
    // The corners farthest along an edge, to its left, and against it.
    let [mut ahead, mut above, mut behind] = [1, 1, 1];
    let mut best = (f64::INFINITY, DVec2::X);
    for i in 0..hull.len() {
        let axis = step(i, i + 1).normalize();
        let farthest = |mut at: usize, direction: DVec2| {
            while direction.dot(step(at, at + 1)) > 0.0 {
                at += 1;
            }
            at
        };
        ahead = farthest(ahead.max(i + 1), axis);
        above = farthest(above.max(ahead), axis.perp());
        behind = farthest(behind.max(above), -axis);
        let length = axis.dot(step(behind, ahead));
        let height = axis.perp_dot(step(i, above));
        if length * height < best.0 {
            best = (length * height, axis);
        }
    }
    Some(Rectangle::around(&hull, best.1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn points(coordinates: &[[f64; 2]]) -> Vec<DVec2> {
        coordinates.iter().map(|&p| DVec2::from(p)).collect()
    }

    /// Points that look random, the same at every run.
    fn scattered(count: u64, seed: u64) -> Vec<DVec2> {
        let unit = |n: u64| {
            let mixed = (n + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ (seed << 32);
            let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            (mixed >> 11) as f64 / (1u64 << 53) as f64
        };
        let point = |i| DVec2::new(3.0 * unit(2 * i), unit(2 * i + 1));
        (0..count).map(point).collect()
    }

    fn area(rectangle: &Rectangle) -> f64 {
        4.0 * rectangle.half.x * rectangle.half.y
    }

    fn holds(rectangle: &Rectangle, points: &[DVec2], slack: f64) -> bool {
        points.iter().all(|&p| {
            let offset = p - rectangle.centre;
            let seen = DVec2::new(rectangle.axis.dot(offset), rectangle.axis.perp_dot(offset));
            (seen.abs() - rectangle.half).max_element() <= slack
        })
    }

    #[test]
    fn hull_of_a_square_leaves_out_what_is_inside_and_on_its_sides() {
        let square = points(&[
            [0.0, 0.0],
            [1.0, 1.0],
            [0.5, 0.0],
            [1.0, 0.0],
            [0.2, 0.7],
            [0.0, 1.0],
            [0.0, 0.5],
            [1.0, 1.0],
        ]);
        let corners = points(&[[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]);
        assert_eq!(convex_hull(&square), corners);
    }

    #[test]
    fn degenerate_hulls_and_rectangles() {
        assert_eq!(convex_hull(&[]), []);
        assert_eq!(smallest_rectangle(&[]), None);
        let one = points(&[[3.0, -2.0]; 5]);
        assert_eq!(convex_hull(&one), one[..1]);
        let rectangle = smallest_rectangle(&one).unwrap();
        assert_eq!((rectangle.centre, rectangle.half), (one[0], DVec2::ZERO));
        // On a line that float64 cannot follow exactly, and back and forth on it.
        let line: Vec<_> = [0.3, 0.1, 0.9, 0.1, 0.5, 0.7]
            .map(|t| DVec2::new(1.0 + 3.0 * t, 7.0 * t))
            .to_vec();
        let rectangle = smallest_rectangle(&line).unwrap();
        assert!(holds(&rectangle, &line, 1e-14));
        assert!(rectangle.half.min_element() < 1e-14);
        let vertical = points(&[[1.0, 5.0], [1.0, 2.0], [1.0, 3.0]]);
        assert_eq!(convex_hull(&vertical), points(&[[1.0, 2.0], [1.0, 5.0]]));
        let rectangle = smallest_rectangle(&vertical).unwrap();
        assert_eq!(rectangle.half.max_element(), 1.5);
        assert_eq!(area(&rectangle), 0.0);
    }

    #[test]
    fn nearly_collinear_points_make_a_convex_hull() {
        // A grid of neighbouring float64 around a diagonal: naive orientations contradict each other.
        let step = f64::EPSILON / 2.0;
        let near: Vec<_> = (0..256)
            .map(|i| {
                DVec2::new(
                    0.5 + f64::from(i % 16) * step,
                    0.5 + f64::from(i / 16) * step,
                )
            })
            .chain([DVec2::splat(12.0), DVec2::splat(24.0)])
            .collect();
        let hull = convex_hull(&near);
        for i in 0..hull.len() {
            let [a, b, c] = [0, 1, 2].map(|k| hull[(i + k) % hull.len()]);
            assert!(orientation(a, b, c) > 0.0);
            assert!(near.iter().all(|&p| orientation(a, b, p) >= 0.0));
        }
    }

    #[test]
    fn a_turned_rectangle_is_found_at_any_size() {
        for scale in [1e-150, 1.0, 1e150] {
            for turn in 0..40 {
                let axis = DVec2::from_angle(f64::from(turn) * 0.17);
                let corner = |x: f64, y: f64| scale * (axis * x + axis.perp() * y);
                let corners: Vec<_> = [(-2.0, -1.0), (2.0, -1.0), (2.0, 1.0), (-2.0, 1.0)]
                    .map(|(x, y)| corner(x + 3.0, y))
                    .to_vec();
                let rectangle = smallest_rectangle(&corners).unwrap();
                let mut half = rectangle.half / scale;
                half = DVec2::new(half.max_element(), half.min_element());
                assert!((half - DVec2::new(2.0, 1.0)).length() < 1e-12, "{half}");
                assert!((rectangle.centre / scale - 3.0 * axis).length() < 1e-12);
            }
        }
    }

    #[test]
    fn no_turn_gives_a_smaller_rectangle() {
        for seed in 0..200 {
            let points = scattered(3 + seed % 40, seed);
            let rectangle = smallest_rectangle(&points).unwrap();
            assert!(holds(&rectangle, &points, 1e-14));
            // Every edge of the hull, and turns in between.
            let hull = convex_hull(&points);
            let edges = (0..hull.len()).map(|i| hull[(i + 1) % hull.len()] - hull[i]);
            let turns = (0..180).map(|i| DVec2::from_angle(f64::from(i) * PI / 360.0));
            for axis in edges.map(DVec2::normalize).chain(turns) {
                let other = Rectangle::around(&points, axis);
                assert!(area(&rectangle) <= area(&other) * (1.0 + 1e-12));
            }
        }
    }
}
