//! Trapezoidal: the map is a trapezoid around what is seen, as the light sees it.
//!
//! ```text
//! shadow_from_ray = focus * perspective * align
//! ```
//!
//! Tobias Martin, Tiow-Seng Tan. Anti-aliasing and continuity with trapezoidal shadow maps. Eurographics Symposium on
//! Rendering 2004.

use super::hull::MapFrame;
use super::light_matrix::{LightMatrix, product, rows};
use super::subject::Subject;
use super::view_across::{ViewAcross, place};
use crate::camera::{Camera, Rays};
use crate::geometry::range_of;
use glam::{DMat3, DVec2, DVec3};

/// Which part of the map the nearer part of the trapezoid gets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FocusRule {
    /// The nearer part, as a share of the trapezoid's length.
    pub focus: f64,
    /// What it gets, as a share of the map: 0.8 in the paper.
    pub line: f64,
}

/// The view covers this share of the trapezoid's length, or the rule fades: the rest is what the light sees of the
/// frustum's width, which has no nearer part.
const FULL_SHARE: f64 = 0.5;

/// However small the focus: the top line is at most so many times as large as it was.
const MAX_PERSPECTIVE: f64 = 1e3;

impl FocusRule {
    /// The perspective of a trapezoid of length 1, one over the distance of its apex from the top line: such that the
    /// focus is taken to the line.
    fn perspective(&self, fade: f64) -> f64 {
        let focus = self.line + (self.focus - self.line) * fade;
        let perspective = (self.line - focus) / ((1.0 - self.line) * focus);
        perspective.clamp(0.0, MAX_PERSPECTIVE)
    }
}

/// `None` where the light shines along the view, and no direction across the light is the view's.
pub fn trapezoidal(
    subject: &Subject,
    camera: &Camera,
    rule: FocusRule,
    frame: MapFrame,
) -> Option<LightMatrix> {
    let view = ViewAcross::new(subject, camera)?;
    let (start, end) = view.range;
    // A hull without a length gets one.
    let extent = (end - start).max(1e-6 * (1.0 + start.abs().max(end.abs())));
    let length = (1.0 + 2.0 * frame.margin) * extent;
    let top = start - frame.margin * length;
    let (z_near, z_far) = subject.depths(camera);
    let share = (z_far - z_near) * view.sine * view.scale / length;
    let rule = match camera.rays {
        Rays::Perspective => rule.perspective((share / FULL_SHARE).min(1.0)),
        // Pixels of parallel rays do not narrow.
        Rays::Orthographic => 0.0,
    };
    // The top line and the base line lie across the centre line, which is the view through the eye. Depths are one at
    // the top line, and zero in the point q, where the sides meet. Columns run across the centre line, to its left as the
    // light sees it.
    let column = view.beside_and_along(view.eye).x;
    let slope = rule / length;
    let perspective = rows([
        DVec3::new(-1.0, 0.0, column),
        DVec3::new(0.0, 1.0, -top),
        DVec3::new(0.0, slope, 1.0 - slope * top),
    ]);
    let aligned = product([perspective, view.align()]);
    let corners = subject.hull.corners.iter();
    let (left, right) = range_of(corners.map(|corner| place(aligned * *corner).x));
    let width = (right - left).max(1e-6 * (1.0 + left.abs().max(right.abs())));
    let half = DVec2::new((0.5 + frame.margin) * width, 0.5 * length / (1.0 + rule));
    let middle = DVec2::new(0.5 * (left + right), half.y);
    let texels_per_unit = frame.size.middle() / half;
    let focus = product([
        DMat3::from_diagonal(texels_per_unit.extend(1.0)),
        DMat3::from_translation(-middle),
    ]);
    Some(LightMatrix::from(product([focus, aligned])))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::fixtures::{FRAME, camera, surfaces};
    use crate::fits::source::Source;
    use crate::map_size::MapSize;

    const RULE: FocusRule = FocusRule {
        focus: 0.5,
        line: 0.8,
    };

    fn subject(direction: DVec3) -> Subject {
        let points = surfaces(&camera(-0.2)).into_iter().map(|(point, _)| point);
        Subject::new(Source::AtInfinity { direction }, points.collect()).unwrap()
    }

    #[test]
    fn the_focus_is_taken_to_the_line() {
        for focus in [0.2, 0.5, 0.7] {
            for line in [0.75, 0.8, 0.9] {
                let k = FocusRule { focus, line }.perspective(1.0);
                let share = |t: f64| t * (1.0 + k) / (1.0 + k * t);
                assert!((share(focus) - line).abs() < 1e-12);
                assert!(share(0.0) == 0.0 && (share(1.0) - 1.0).abs() < 1e-12);
            }
        }
        let even = FocusRule {
            focus: 0.9,
            line: 0.8,
        };
        assert_eq!(even.perspective(1.0), 0.0);
    }

    #[test]
    fn its_lines_touch_the_hull() {
        let camera = camera(-0.2);
        for direction in [
            DVec3::NEG_Y,
            DVec3::new(0.5, -1.0, 0.3),
            DVec3::new(-1.0, -0.4, -0.2),
        ] {
            let subject = subject(direction.normalize());
            let size = MapSize {
                width: 400,
                height: 150,
            };
            let frame = MapFrame { size, margin: 0.0 };
            let matrix = trapezoidal(&subject, &camera, RULE, frame).unwrap();
            let places = subject.hull.corners.iter().map(|ray| matrix.place(*ray));
            let places: Vec<_> = places.collect();
            for side in [DVec2::X, DVec2::Y] {
                let half = frame.size.middle().dot(side);
                let (low, high) = range_of(places.iter().map(|place| side.dot(*place)));
                assert!(
                    (low + half).abs() < 1e-9 && (high - half).abs() < 1e-9,
                    "{low} {high}"
                );
            }
        }
    }

    #[test]
    fn the_map_changes_little_as_the_light_comes_to_shine_along_the_view() {
        let camera = camera(-0.2);
        let mut stretches = Vec::new();
        for angle in [0.8, 0.2, 0.05, 0.01, 0.002] {
            let direction = camera.forward + camera.up * angle;
            let subject = subject(direction.normalize());
            let matrix = trapezoidal(&subject, &camera, RULE, FRAME).unwrap();
            let (least, most) = range_of(subject.hull.corners.iter().map(|ray| matrix.w.dot(*ray)));
            stretches.push(most / least);
        }
        assert!(stretches.is_sorted_by(|a, b| a >= b), "{stretches:?}");
        assert!(stretches[4] < 1.05, "{stretches:?}");
        let subject = subject(camera.forward);
        assert_eq!(trapezoidal(&subject, &camera, RULE, FRAME), None);
    }
}
