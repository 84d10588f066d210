//! The hull of the rays that a map must hold, and the matrices that focus the map on it.

use super::light_matrix::{LightMatrix, product};
use crate::geometry::{bounds_of_places, convex_hull, range_of};
use crate::map_size::MapSize;
use glam::{DMat3, DQuat, DVec2, DVec3};

/// The rays that a map must hold, as the corners of their convex hull in the plane of an axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Hull {
    pub corners: Vec<DVec3>,
}

/// No optical axis may stretch one side of the map more than this against the other: float32 could
/// not follow.
pub const MAX_STRETCH: f64 = 1e5;

impl Hull {
    /// `None` where there is no ray, or one is behind the plane of the axis.
    pub fn new(axis: DVec3, rays: impl Iterator<Item = DVec3>) -> Option<Self> {
        let [x, y] = across(axis);
        let mut places = Vec::new();
        for ray in rays {
            let w = axis.dot(ray);
            if w.is_nan() || w <= 0.0 {
                return None;
            }
            places.push(DVec2::new(x.dot(ray), y.dot(ray)) / w);
        }
        if !places.iter().all(|place| place.is_finite()) {
            return None;
        }
        let hull = convex_hull(&without_interior(places));
        let corners = hull.iter().map(|p| x * p.x + y * p.y + axis);
        (!hull.is_empty()).then(|| Self {
            corners: corners.collect(),
        })
    }

    /// The corners' places after a matrix, if all are before its horizon; the hull of rays is that of their places
    /// through any matrix that has all of them in front.
    fn places(&self, view: LightMatrix) -> Option<Vec<DVec2>> {
        let is_even = self.is_even(view, MAX_STRETCH);
        is_even.then(|| self.corners.iter().map(|ray| view.place(*ray)).collect())
    }

    /// Whether no corner's depth is more than so many times another's, and none is behind the horizon.
    pub fn is_even(&self, view: LightMatrix, most: f64) -> bool {
        let depths = self.corners.iter().map(|corner| view.w.dot(*corner));
        let (least, greatest) = range_of(depths);
        least * most > greatest.max(0.0)
    }

    /// `focus * view`: the map is the smallest parallelogram that the paper finds around the hull, seen along an
    /// optical axis. `None` where the hull crosses the axis' horizon.
    pub fn focused_along(&self, optical_axis: DVec3, frame: MapFrame) -> Option<LightMatrix> {
        // The rotation that takes the optical axis to the third coordinate.
        let [x, y] = across(optical_axis);
        let view = LightMatrix {
            x,
            y,
            w: optical_axis,
        };
        let parallelogram = smallest_parallelogram(&self.places(view)?);
        Some(parallelogram.focus_lengthwise(view, frame))
    }

    /// `focus * view`: the map is the box around the hull along the rows of a view. `None` where the hull crosses its
    /// horizon.
    pub fn boxed(&self, view: LightMatrix, frame: MapFrame) -> Option<LightMatrix> {
        let places = self.places(view)?;
        Some(Parallelogram::around(&places, DVec2::X, 0.0).focus(view, frame))
    }
}

/// What a map is fitted into.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MapFrame {
    pub size: MapSize,
    /// By how much of its size the frame is widened.
    pub margin: f64,
}

/// Unit vectors across an axis: those of the coordinates, turned with the third onto the axis.
pub fn across(axis: DVec3) -> [DVec3; 2] {
    let turn = DQuat::from_rotation_arc(DVec3::Z, axis);
    [turn * DVec3::X, turn * DVec3::Y]
}

/// The points without those strictly inside the octagon of extreme ones, which cannot be corners of
/// the hull (S. G. Akl, G. T. Toussaint. A fast convex hull algorithm. IPL 7(5), 1978).
pub(super) fn without_interior(points: Vec<DVec2>) -> Vec<DVec2> {
    const DIRECTIONS: [DVec2; 8] = [
        DVec2::new(1.0, 0.0),
        DVec2::new(1.0, 1.0),
        DVec2::new(0.0, 1.0),
        DVec2::new(-1.0, 1.0),
        DVec2::new(-1.0, 0.0),
        DVec2::new(-1.0, -1.0),
        DVec2::new(0.0, -1.0),
        DVec2::new(1.0, -1.0),
    ];
    let farthest = |direction: DVec2| {
        let values = points.iter().map(|p| direction.dot(*p));
        let best = values.enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
        best.map(|(index, _)| points[index])
    };
    let octagon: Vec<_> = DIRECTIONS.into_iter().filter_map(farthest).collect();
    let edges: Vec<_> = (0..octagon.len())
        .map(|i| (octagon[i], octagon[(i + 1) % octagon.len()] - octagon[i]))
        .filter(|(_, edge)| *edge != DVec2::ZERO)
        .collect();
    if edges.is_empty() {
        return points;
    }
    let is_inside = |p: DVec2| {
        edges
            .iter()
            .all(|(start, edge)| edge.perp_dot(p - *start) > 0.0)
    };
    points.into_iter().filter(|&p| !is_inside(p)).collect()
}

/// A parallelogram whose second side leans: x' = x + shear y along its axes.
#[derive(Debug, Clone, Copy)]
struct Parallelogram {
    axis: DVec2,
    shear: f64,
    centre: DVec2,
    half: DVec2,
}

impl Parallelogram {
    fn around(points: &[DVec2], axis: DVec2, shear: f64) -> Self {
        let (low, high) = bounds_of_places(points.iter().map(|&p| {
            let y = axis.perp_dot(p);
            DVec2::new(axis.dot(p) + shear * y, y)
        }));
        Self {
            axis,
            shear,
            centre: 0.5 * (low + high),
            half: 0.5 * (high - low),
        }
    }

    fn area(&self) -> f64 {
        self.half.x * self.half.y
    }

    /// The same with its longer side along the longer one of the map: "to handle shadow maps that do not have aspect
    /// ratios of one, we make sure to map the longer side of the min-area rectangle to the dimension of the shadow map
    /// with more samples" (the paper's section 2.4). Of a leaning one the sides are those of its rectangle.
    fn focus_lengthwise(&self, view: LightMatrix, frame: MapFrame) -> LightMatrix {
        if !frame.size.lies_across(self.half) {
            return self.focus(view, frame);
        }
        let size = frame.size.transposed();
        let LightMatrix { x, y, w } = self.focus(view, MapFrame { size, ..frame });
        LightMatrix { x: y, y: -x, w }
    }

    /// `focus * view`: makes the parallelogram the map.
    fn focus(&self, view: LightMatrix, frame: MapFrame) -> LightMatrix {
        // A hull without a width gets one.
        let least = 1e-6 * (1.0 + self.half.max_element());
        let half = (self.half * (1.0 + frame.margin)).max(DVec2::splat(least));
        let texels_per_unit = frame.size.middle() / half;
        let DVec2 { x, y } = self.axis;
        // The first side lies along the rows of the map.
        let turn = DMat3::from_cols(DVec3::new(x, -y, 0.0), DVec3::new(y, x, 0.0), DVec3::Z);
        // The second side stands upright.
        let shear = DMat3::from_cols(DVec3::X, DVec3::new(self.shear, 1.0, 0.0), DVec3::Z);
        // Its centre is the map's.
        let shift = DMat3::from_translation(-self.centre);
        // Its sides are those of the map, in texels.
        let scale = DMat3::from_diagonal(texels_per_unit.extend(1.0));
        product([scale, shift, shear, turn, view.matrix()]).into()
    }
}

/// The smallest of the rectangles on the edges of a convex polygon (counter-clockwise), each with the
/// shear that brings its extreme corners over the edge (the paper's section 2.3 and Fig. 3).
fn smallest_parallelogram(hull: &[DVec2]) -> Parallelogram {
    let mut best = Parallelogram::around(hull, DVec2::X, 0.0);
    for i in 0..hull.len() {
        let j = (i + 1) % hull.len();
        let axis = (hull[j] - hull[i]).normalize_or_zero();
        if axis == DVec2::ZERO {
            continue;
        }
        // The others above the edge, with the edge's ends at 0 and `end`.
        let end = axis.dot(hull[j] - hull[i]);
        let others = (0..hull.len()).filter(|&k| k != i && k != j).map(|k| {
            let offset = hull[k] - hull[i];
            DVec2::new(axis.dot(offset), axis.perp_dot(offset))
        });
        let (mut left, mut right) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for other in others {
            left = if other.x < left.x { other } else { left };
            right = if other.x > right.x { other } else { right };
        }
        let mut shears = vec![0.0];
        if left.x < 0.0 && right.x < end {
            shears.push(-left.x / left.y);
        } else if left.x > 0.0 && right.x > end {
            shears.push((end - right.x) / right.y);
        }
        for shear in shears.into_iter().filter(|shear| shear.abs() < MAX_SHEAR) {
            let candidate = Parallelogram::around(hull, axis, shear);
            if candidate.area() < best.area() {
                best = candidate;
            }
        }
    }
    best
}

/// A frame that leans more makes texels long and thin.
const MAX_SHEAR: f64 = 1.0;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::fixtures::FRAME;

    #[test]
    fn parallelogram_leans_with_the_points() {
        let points = [[0.0, 0.0], [4.0, 0.0], [5.0, 2.0], [1.0, 2.0]].map(DVec2::from);
        let frame = smallest_parallelogram(&convex_hull(&points));
        assert!((4.0 * frame.area() - 8.0).abs() < 1e-12);
        let view = LightMatrix::from(DMat3::IDENTITY);
        let matrix = frame.focus(view, FRAME);
        for point in points {
            let place = matrix.place(point.extend(1.0)).abs();
            assert!((place - 200.0 / 1.01).length() < 1e-9, "{place}");
        }
    }

    #[test]
    fn hulls_without_a_width_have_a_matrix() {
        for corners in [1, 2] {
            let corners = [DVec3::new(0.2, 0.1, 1.0), DVec3::new(0.4, -0.3, 1.0)]
                .into_iter()
                .take(corners);
            let hull = Hull::new(DVec3::Z, corners).unwrap();
            let matrix = hull.focused_along(DVec3::Z, FRAME).unwrap();
            assert!(matrix.matrix().is_finite());
            for corner in &hull.corners {
                assert!(matrix.place(*corner).abs().max_element() <= 200.0);
            }
        }
        assert_eq!(Hull::new(DVec3::Z, std::iter::empty()), None);
        assert_eq!(Hull::new(DVec3::Z, [DVec3::NEG_Z].into_iter()), None);
    }

    /// Chong and Gortler, section 2.4.
    #[test]
    fn the_longer_side_of_the_rectangle_lies_along_the_more_texels() {
        let axis = DVec2::from_angle(0.4);
        let corners = [(0.0, 0.0), (7.0, 0.0), (7.0, 2.0), (0.0, 2.0)];
        let corners = corners.map(|(x, y)| axis * x + axis.perp() * y);
        let hull = Hull::new(DVec3::Z, corners.map(|c| c.extend(10.0)).into_iter()).unwrap();
        for (width, height) in [(400, 100), (100, 400), (200, 200)] {
            let size = MapSize { width, height };
            let frame = MapFrame { size, margin: 0.0 };
            let matrix = hull.focused_along(DVec3::Z, frame).unwrap();
            let places = corners.map(|corner| matrix.place(corner.extend(10.0)));
            for place in places {
                assert!((place.abs() - size.middle()).length() < 1e-9, "{place}");
            }
            // No map is a mirror image.
            let [long, short] = [places[1] - places[0], places[3] - places[0]];
            assert!(long.perp_dot(short) * axis.perp_dot(axis.perp()) > 0.0);
            let along = if long.x.abs() > long.y.abs() {
                width
            } else {
                height
            };
            assert!(along == size.longer(), "{size} {long}");
        }
    }

    #[test]
    fn points_inside_the_octagon_are_no_corners() {
        let points: Vec<_> = (0..2000)
            .map(|i| DVec2::from_angle(f64::from(i)) * f64::from(i % 97))
            .collect();
        let corners = without_interior(points.clone());
        assert!(corners.len() < 600);
        assert_eq!(convex_hull(&corners), convex_hull(&points));
    }
}
