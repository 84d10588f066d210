//! Logarithmic perspective: a perspective along the view whose rows are spread by a logarithm.
//!
//! D. Brandon Lloyd, Naga K. Govindaraju, Cory Quammen, Steven E. Molnar, Dinesh Manocha. Logarithmic perspective shadow
//! maps. ACM Transactions on Graphics 27(4), 2008.

use super::hull::{MapFrame, without_interior};
use super::layer::Layer;
use super::light_matrix::{LightMatrix, product, rows};
use super::lispsm::light_space_perspective;
use super::matrix_layers::{Target, matrix_layers, parts_of_target};
use super::receivers::ReceiverQueries;
use super::subject::Subject;
use super::view_across::{ViewAcross, place};
use crate::camera::{Camera, Rays};
use crate::error::Result;
use crate::geometry::{convex_hull, range_of};
use crate::projection::{Kind, LogPerspective};
use glam::{DMat3, DVec2, DVec3};

/// A light matrix to columns and to one over the distance from the apex, and the rows for a distance that is e times as
/// large.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogMatrix {
    pub matrix: LightMatrix,
    pub rate: f64,
}

/// Nothing is taken for nearer than this share of the farthest depth: a sample beside the eye would take rows from all
/// others.
const NEAREST: f64 = 1e-3;

/// What is shorter along the view, against its distance from the axis, has no nearer and no farther part.
const LEAST_LENGTH: f64 = 1e-6;

/// Distances of the apex that are tried, as shares of the length of what is seen: the nearest, the farthest, and by what
/// factor one is farther than the one before. A row that is farthest away is longer than the nearest one by one over that;
/// of less than a tenth float32 would not know much.
const DISTANCES: (f64, f64, f64) = (1e-3, 10.0, 1.15);

/// Halvings of the interval around the best of them.
const REFINEMENTS: usize = 20;

/// What a perspective from an apex along the view does to what is seen.
struct Candidates<'a> {
    subject: &'a Subject,
    view: ViewAcross,
    length: f64,
    /// Columns of the map for one of its rows.
    aspect: f64,
    /// For points of surfaces, one over the width of their pixel, and that times how far along the view they are: corners of
    /// the hull, among which the largest error is whatever the apex.
    points: Vec<DVec2>,
}

/// Least and greatest column, as a slope from the apex, and the logarithm of how many times as far the farthest row is as
/// the nearest.
struct Sides {
    slopes: (f64, f64),
    log_ratio: f64,
}

impl<'a> Candidates<'a> {
    fn new(subject: &'a Subject, camera: &Camera, aspect: f64) -> Option<Self> {
        let view = ViewAcross::new(subject, camera)?;
        let (start, end) = view.range;
        let length = end - start;
        if length <= LEAST_LENGTH * (1.0 + start.abs().max(end.abs())) {
            return None;
        }
        let (_, farthest) = subject.depths(camera);
        let points = subject.points.iter().map(|point| {
            let ray = subject.rays.ray_from_point(*point);
            let along = view.beside_and_along(place(ray)).y - start;
            DVec2::new(1.0, along) / pixel_width(camera, *point, NEAREST * farthest)
        });
        Some(Self {
            points: convex_hull(&without_interior(points.collect())),
            length,
            aspect,
            subject,
            view,
        })
    }

    fn sides(&self, distance: f64) -> Sides {
        let column = self.view.beside_and_along(self.view.eye).x;
        let corners = self.subject.hull.corners.iter();
        let slopes = corners.map(|corner| {
            let corner = self.view.beside_and_along(place(*corner));
            (corner.x - column) / (corner.y - self.view.range.0 + distance)
        });
        Sides {
            slopes: range_of(slopes),
            log_ratio: (1.0 + self.length / distance).ln(),
        }
    }

    /// The largest perspective aliasing error, but for a factor: the longer side of a texel over the width of a pixel. With
    /// w the distance from the apex a texel is as wide as the range of slopes by w, and as long as the logarithm of the ratio
    /// by w along its slope, each over as many texels as the map has that way.
    fn largest_error(&self, distance: f64) -> f64 {
        let Sides {
            slopes: (left, right),
            log_ratio,
        } = self.sides(distance);
        let steepest = left.abs().max(right.abs());
        let along = log_ratio * (1.0 + steepest * steepest).sqrt() * self.aspect;
        let longer = (right - left).max(along);
        let widths = self.points.iter().map(|p| p.y + p.x * distance);
        longer * widths.fold(0.0, f64::max)
    }

    /// The distance of the apex before what is seen that has the least largest error.
    fn best_distance(&self) -> f64 {
        let (nearest, farthest, factor) = DISTANCES;
        let count = ((farthest / nearest).ln() / factor.ln()).ceil() as i32;
        let tried = (0..=count).map(|i| self.length * nearest * factor.powi(i));
        let best = tried.min_by(|a, b| self.largest_error(*a).total_cmp(&self.largest_error(*b)));
        let mut best = best.expect("some are tried");
        let mut step = factor;
        for _ in 0..REFINEMENTS {
            step = step.sqrt();
            for nearby in [best / step, best * step] {
                if self.largest_error(nearby) < self.largest_error(best) {
                    best = nearby;
                }
            }
        }
        best
    }
}

/// The width of a pixel where it meets a point, across its beam, in world units.
fn pixel_width(camera: &Camera, point: DVec3, nearest: f64) -> f64 {
    let from_eye = point - camera.eye;
    let depth = from_eye.dot(camera.forward);
    let cosine = match from_eye.length() {
        0.0 => 1.0,
        length => (depth / length).max(0.1),
    };
    let area = cosine / (camera.focal.x * camera.focal.y);
    camera.width_at(depth.max(nearest)) * area.sqrt()
}

/// `None` where the light shines along the view, and where pixels do not narrow along what is seen.
pub fn log_perspective(subject: &Subject, camera: &Camera, frame: MapFrame) -> Option<LogMatrix> {
    if camera.rays == Rays::Orthographic {
        return None;
    }
    let candidates = Candidates::new(subject, camera, frame.size.aspect())?;
    let distance = candidates.best_distance();
    let view = &candidates.view;
    let Sides { slopes, log_ratio } = candidates.sides(distance);
    // Half of the rows lie nearer than this.
    let middle = (distance * (distance + candidates.length)).sqrt();
    let apex = DVec2::new(view.beside_and_along(view.eye).x, view.range.0 - distance);
    // (x, s, w): beside the apex and along the view from it, in units of the middle; s is one over w.
    let perspective = rows([
        DVec3::new(1.0, 0.0, -apex.x) / middle,
        DVec3::Z,
        DVec3::new(0.0, 1.0, -apex.y) / middle,
    ]);
    let (left, right) = slopes;
    let half =
        (0.5 + frame.margin) * (right - left).max(1e-6 * (1.0 + left.abs().max(right.abs())));
    let DVec2 {
        x: columns,
        y: rows,
    } = frame.size.texels();
    let focus = product([
        DMat3::from_diagonal(DVec3::new(0.5 * columns / half, 1.0, 1.0)),
        DMat3::from_translation(DVec2::new(-0.5 * (left + right), 0.0)),
    ]);
    Some(LogMatrix {
        matrix: product([focus, perspective, view.align()]).into(),
        rate: rows / ((1.0 + 2.0 * frame.margin) * log_ratio),
    })
}

/// The layers: as those of light space perspective around a light that is near, by no more than focusing where there is
/// no perspective.
pub fn fit_log_perspectives(
    receivers: &mut dyn ReceiverQueries<'_>,
    target: Target,
) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    let parts = parts_of_target(receivers, target)?;
    let (camera, frame) = (setting.camera, target.frame);
    let is_near = setting.near_position().is_some();
    let mut rates = Vec::new();
    let mut layers = matrix_layers(setting, parts, frame.size, |part| {
        let subject = &part.subject;
        let log = match is_near {
            true => None,
            false => log_perspective(subject, camera, frame),
        };
        let perspective = || light_space_perspective(subject, camera, frame);
        let matrix = log.map(|log| log.matrix);
        let matrix = matrix
            .or_else(|| is_near.then(perspective)?)
            .or_else(|| subject.focused(frame))?;
        rates.push(log.map(|log| log.rate));
        Some(matrix)
    });
    for (layer, rate) in layers.iter_mut().zip(rates) {
        let projection = &mut layer.projection;
        if let (Kind::Homography(straight), Some(rate)) = (projection.kind, rate) {
            projection.kind = LogPerspective::new(straight, rate).into();
        }
    }
    Ok(layers)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::fixtures::{FRAME, camera, surfaces};
    use crate::fits::source::Source;
    use crate::map_size::MapSize;

    fn subject(direction: DVec3) -> Subject {
        let points = surfaces(&camera(-0.2)).into_iter().map(|(point, _)| point);
        Subject::new(Source::AtInfinity { direction }, points.collect()).unwrap()
    }

    #[test]
    fn what_is_seen_fills_the_map() {
        let camera = camera(-0.2);
        let directions = [
            DVec3::NEG_Y,
            DVec3::new(0.5, -1.0, 0.3),
            DVec3::new(-1.0, -0.4, -0.2),
            DVec3::new(0.1, -0.2, -1.0),
        ];
        for direction in directions {
            let subject = subject(direction.normalize());
            let size = MapSize {
                width: 400,
                height: 150,
            };
            let frame = MapFrame { size, margin: 0.0 };
            let LogMatrix { matrix, rate } = log_perspective(&subject, &camera, frame).unwrap();
            let places = subject.hull.corners.iter().map(|ray| {
                let place = matrix.place(*ray);
                DVec2::new(place.x, -rate * place.y.ln())
            });
            let places: Vec<_> = places.collect();
            for side in [DVec2::X, DVec2::Y] {
                let half = frame.size.middle().dot(side);
                let (low, high) = range_of(places.iter().map(|place| side.dot(*place)));
                let error = (low + half).abs().max((high - half).abs());
                assert!(error < 1e-9, "{direction} {low} {high}");
            }
        }
    }

    #[test]
    fn a_point_has_no_perspective() {
        let points = vec![DVec3::new(1.3, 0.2, -8.1)];
        let direction = DVec3::new(0.3, -1.0, 0.2).normalize();
        let subject = Subject::new(Source::AtInfinity { direction }, points).unwrap();
        assert_eq!(log_perspective(&subject, &camera(-0.2), FRAME), None);
    }

    #[test]
    fn no_other_distance_has_a_smaller_error() {
        let camera = camera(-0.2);
        for direction in [
            DVec3::NEG_Y,
            DVec3::new(0.5, -1.0, 0.3),
            DVec3::new(0.1, -0.2, -1.0),
        ] {
            let subject = subject(direction.normalize());
            let candidates = Candidates::new(&subject, &camera, 1.0).unwrap();
            let least = candidates.largest_error(candidates.best_distance());
            for i in 0..1000 {
                let distance = candidates.length * 1e-3 * 1.0092_f64.powi(i);
                let error = candidates.largest_error(distance);
                assert!(
                    least <= 1.0001 * error,
                    "{direction} {distance} {least} {error}"
                );
            }
        }
    }

    #[test]
    fn a_texel_is_as_long_along_its_slope_as_differences_say() {
        let camera = camera(-0.2);
        for direction in [DVec3::NEG_Y, DVec3::new(0.5, -1.0, 0.3)] {
            let subject = subject(direction.normalize());
            for (share, aspect) in [(0.01, 1.0), (0.3, 2.0), (5.0, 0.5)] {
                let candidates = Candidates::new(&subject, &camera, aspect).unwrap();
                let distance = share * candidates.length;
                let Sides {
                    slopes: (left, right),
                    log_ratio,
                } = candidates.sides(distance);
                let ahead = |row: f64| distance * (row * log_ratio).exp();
                let longest = [left, right].map(|slope| {
                    let place = |row: f64| DVec2::new(slope, 1.0) * ahead(row);
                    aspect * (place(1.0) - place(1.0 - 1e-7)).length() / 1e-7
                });
                let wide = (right - left) * ahead(1.0);
                let longest = longest.into_iter().fold(wide, f64::max) / ahead(1.0);
                let pixels = candidates.points.iter().map(|p| p.y + p.x * distance);
                let expected = longest * pixels.fold(0.0, f64::max);
                let found = candidates.largest_error(distance);
                assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
            }
        }
    }
}
