//! Layers of light matrices: what they are fitted to, and the projections that they make.

use super::boxes::{Cut, boxed_layers, layers_of_light, whole_layer};
use super::central::{axes_for_scene, cube_faces};
use super::hull::MapFrame;
use super::layer::Layer;
use super::light_matrix::LightMatrix;
use super::parallel::projected_box;
use super::receivers::{ReceiverQueries, Setting};
use super::samples::SampledReceivers;
use super::subject::Subject;
use crate::error::Result;
use crate::frustum::visible_part;
use crate::geometry::bounds_of;
use crate::map_size::MapSize;
use crate::projection::{Homography, Perspective, Projection};
use crate::region::{HalfSpace, Region};
use crate::rounding::BOX_ROUNDING;
use glam::{DMat3, DVec2, DVec3, DVec4};

/// What a light matrix must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// The part of the scene's box in the camera's frustum: needs nothing but its corners.
    Frustum,
    /// The receivers, from samples of the image.
    Receivers,
}

/// What light matrices are fitted to, and the size of their maps.
#[derive(Debug, Clone, Copy)]
pub struct Target {
    pub extent: Extent,
    /// Receivers looked at along the longer side of the image.
    pub sample_resolution: u32,
    pub frame: MapFrame,
}

/// What one map is fitted to.
pub struct Part {
    pub subject: Subject,
    pub region: Region,
    /// Of each point its index among the samples; none where the points are corners.
    pub samples: Vec<usize>,
}

impl Part {
    fn everywhere(subject: Subject, samples: Vec<usize>) -> Self {
        Self {
            subject,
            region: Region::EVERYWHERE,
            samples,
        }
    }

    /// What of it is in a half-space; `None` without a sample.
    pub fn within(&self, half: HalfSpace) -> Option<Self> {
        let points = self.subject.points.iter().zip(&self.samples);
        let inside = points.filter(|(point, _)| half.height(**point) >= 0.0);
        let (points, samples) = inside.unzip();
        Some(Self {
            subject: self.subject.with_points(points)?,
            region: self.region.with(half),
            samples,
        })
    }
}

/// The parts of some of the samples, one map each: one part for parallel rays, for a light far away and for one that has
/// all in front of it, else those faces of a cube around it that hold any.
pub fn parts_of_receivers(
    receivers: &mut dyn ReceiverQueries<'_>,
    samples: &SampledReceivers,
    chosen: Vec<usize>,
) -> Vec<Part> {
    let setting = receivers.setting();
    let points_of = |chosen: &[usize]| chosen.iter().map(|&i| samples.points[i]).collect();
    if let Some(subject) = Subject::new(setting.source(), points_of(&chosen)) {
        return vec![Part::everywhere(subject, chosen)];
    }
    let mut parts = Vec::new();
    for Layer { projection, region } in faces(setting) {
        let is_inside = |&i: &usize| region.contains(samples.points[i]);
        let own: Vec<_> = chosen.iter().copied().filter(is_inside).collect();
        match Subject::central(projection.origin, projection.z_axis, points_of(&own)) {
            Some(subject) => parts.push(Part {
                subject,
                region,
                samples: own,
            }),
            None => receivers.skip_layer(),
        }
    }
    parts
}

/// What is in the camera's frustum, whatever the receivers.
pub fn parts_of_frustum(setting: Setting) -> Vec<Part> {
    let corners = visible_part(setting.camera, setting.scene.bounds());
    if let Some(subject) = Subject::new(setting.source(), corners) {
        return vec![Part::everywhere(subject, vec![])];
    }
    // Each face as it is.
    let whole = faces(setting)
        .into_iter()
        .filter_map(|Layer { projection, region }| {
            let (origin, forward) = (projection.origin, projection.z_axis);
            let sides = [-projection.y_axis, projection.y_axis].map(|y| projection.x_axis - y);
            let corners = sides.into_iter().flat_map(|side| [side, -side]);
            let points = corners.map(|side| origin + (forward + side) * projection.far);
            Some(Part {
                subject: Subject::central(origin, forward, points.collect())?,
                region,
                samples: vec![],
            })
        });
    whole.collect()
}

/// What the maps of a target must hold.
pub fn parts_of_target(
    receivers: &mut dyn ReceiverQueries<'_>,
    target: Target,
) -> Result<Vec<Part>> {
    Ok(match target.extent {
        Extent::Frustum => parts_of_frustum(receivers.setting()),
        Extent::Receivers => {
            let samples = receivers.samples(target.sample_resolution)?;
            parts_of_receivers(receivers, &samples, samples.facing_the_light())
        }
    })
}

/// The light's own layers, each over the box of what the map must hold, on texels that hold still while
/// that moves.
pub fn still_layers(receivers: &mut dyn ReceiverQueries<'_>, target: Target) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    let layers = layers_of_light(setting);
    let points = match target.extent {
        Extent::Receivers => {
            let samples = receivers.samples(target.sample_resolution)?;
            let facing = samples.facing_the_light().into_iter();
            Some(facing.map(|i| samples.points[i]).collect::<Vec<_>>())
        }
        // The frustum may cross a layer around a light and have no corner in it.
        Extent::Frustum if setting.near_position().is_some() => None,
        Extent::Frustum => Some(visible_part(setting.camera, setting.scene.bounds())),
    };
    let corners = |layer: &Layer| {
        // Depths are those of the scene: a receiver may lie behind all samples.
        let (low, high) = whole_layer(setting, &layer.projection);
        let Some(points) = &points else {
            return Some((low, high));
        };
        let own = points.iter().filter(|point| layer.region.contains(**point));
        let places = own.map(|point| layer.projection.texel_from_point(*point));
        let (first, last) = bounds_of(places);
        if first.x > last.x {
            return None;
        }
        let room = target.frame.margin * 0.5 * (last - first).truncate();
        Some((
            (first.truncate() - room).extend(low.z),
            (last.truncate() + room).extend(high.z),
        ))
    };
    let boxes = layers.iter().map(corners).collect();
    Ok(boxed_layers(
        receivers,
        layers,
        boxes,
        Cut::Snapped,
        target.frame.size,
    ))
}

fn faces(setting: Setting) -> Vec<Layer> {
    let position = setting.near_position();
    position.map_or_else(Vec::new, |position| {
        cube_faces(position, setting.scene.bounds())
    })
}

/// The projection of a light matrix for some points: its rows x, y and w, in texels from the middle of the map, over
/// homogeneous points of the world.
pub fn projection(
    setting: Setting,
    rows: [DVec4; 3],
    points: &[DVec3],
    size: MapSize,
) -> Projection {
    let bounds = setting.scene.bounds();
    let centre = size.middle();
    if let Some(position) = setting.near_position() {
        // The optical axis is the third axis, and the rest is in the other two.
        let [x_axis, y_axis, z_axis] = rows.map(DVec4::truncate);
        let length = z_axis.length();
        return Projection {
            x_axis: x_axis / length,
            y_axis: y_axis / length,
            z_axis: z_axis / length,
            centre,
            width: size.width,
            height: size.height,
            ..axes_for_scene(Perspective, position, z_axis / length, bounds)
        };
    }
    let axes = setting.axes();
    let steps = axes.steps();
    // Rows that vanish at the light follow from what they are at the origin and across the rays.
    let columns = [steps.x_axis, steps.y_axis]
        .map(|step| DVec3::from(rows.map(|row| row.truncate().dot(step))));
    let constant = DVec3::from(rows.map(|row| row.dot(axes.origin.extend(1.0))));
    let homography = DMat3::from_cols(columns[0], columns[1], constant);
    let across = |point: &DVec3| axes.texel_from_point(*point).truncate();
    let reach = points.iter().map(|point| across(point).length());
    let reach = reach.fold(0.0, f64::max);
    // One on the rays of the middle of the points.
    let middle = points.iter().map(across).sum::<DVec2>() / points.len() as f64;
    let w = (homography * middle.extend(1.0)).z;
    let (low, high) = projected_box(&axes, bounds);
    let rounding = BOX_ROUNDING * (low.abs().max(high.abs())).length();
    Projection {
        kind: Homography::new(homography * (1.0 / w), reach)
            .with_convergence(axes.kind.convergence())
            .into(),
        centre,
        width: size.width,
        height: size.height,
        near: low.z - rounding,
        far: high.z + rounding,
        normalizes_depth: true,
        ..axes
    }
}

/// A layer for each part that has a light matrix.
pub fn matrix_layers(
    setting: Setting,
    parts: Vec<Part>,
    size: MapSize,
    mut matrix: impl FnMut(&Part) -> Option<LightMatrix>,
) -> Vec<Layer> {
    let layers = parts.into_iter().filter_map(|part| {
        let matrix = matrix(&part)?;
        let rows = part.subject.rays.world_rows(matrix.rows());
        Some(Layer {
            projection: projection(setting, rows, &part.subject.points, size),
            region: part.region,
        })
    });
    layers.collect()
}

/// The layers of a method that fits a light matrix to each part, by no more than focusing where `fit`
/// finds none.
pub fn fit_light_matrices(
    receivers: &mut dyn ReceiverQueries<'_>,
    target: Target,
    fit: impl Fn(&Subject) -> Option<LightMatrix>,
) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    let parts = parts_of_target(receivers, target)?;
    let frame = target.frame;
    Ok(matrix_layers(setting, parts, frame.size, |part| {
        fit(&part.subject).or_else(|| part.subject.focused(frame))
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::Camera;
    use crate::fits::fixtures::FRAME;
    use crate::fits::light_rays::Sample;
    use crate::fits::lispsm::light_space_perspective;
    use crate::fits::plane_optimal::{dominant_plane, plane_optimal};
    use crate::fits::psm::perspective;
    use crate::fits::samples::Surface;
    use crate::fits::source::Source;
    use crate::fits::trapezoid::{FocusRule, trapezoidal};
    use glam::DMat4;
    use std::f64::consts::FRAC_PI_6;

    const RULE: FocusRule = FocusRule {
        focus: 0.5,
        line: 0.8,
    };

    fn camera() -> Camera {
        let pose =
            DMat4::from_translation(DVec3::new(1.0, 1.7, 2.0)) * DMat4::from_rotation_x(-0.25);
        let centre = DVec2::splat(90.0);
        Camera::new(pose, DVec2::splat(150.0), centre, (180, 180), (0.1, 60.0)).unwrap()
    }

    fn floor(camera: &Camera) -> Vec<DVec3> {
        let pixels = (0..180)
            .step_by(3)
            .flat_map(|y| (0..180).step_by(5).map(move |x| (x, y)));
        let rays = pixels.map(|(x, y)| camera.ray_from_pixel(x, y).1);
        rays.filter(|ray| ray.y < -0.03)
            .map(|ray| camera.eye - ray * (camera.eye.y / ray.y))
            .collect()
    }

    fn lights() -> Vec<Source> {
        let mut lights = Vec::new();
        for height in [-0.1, -0.5, -1.0, -4.0] {
            for turn in 0..12 {
                let (sin, cos) = (0.1 + f64::from(turn) * FRAC_PI_6).sin_cos();
                let direction = DVec3::new(sin, height, cos).normalize();
                lights.push(Source::AtInfinity { direction });
                let position = direction * -1e3;
                lights.push(Source::FarAway { position });
            }
        }
        // So high that it has all of the floor in front.
        let position = DVec3::new(5.0, 80.0, -20.0);
        lights.push(Source::Near { position });
        lights
    }

    fn samples(subject: &Subject, camera: &Camera) -> Vec<Sample> {
        let points = subject.points.iter();
        points
            .map(|&point| Sample::new(&subject.rays, camera, point, DVec3::Y))
            .collect()
    }

    #[test]
    fn every_formula_holds_its_points() {
        let camera = camera();
        let body = visible_part(&camera, (DVec3::splat(-50.0), DVec3::splat(50.0)));
        for light in lights() {
            for points in [floor(&camera), body.clone()] {
                let Some(subject) = Subject::new(light, points) else {
                    continue;
                };
                let fits = [
                    subject.focused(FRAME),
                    light_space_perspective(&subject, &camera, FRAME),
                    perspective(&subject, &camera, FRAME),
                    trapezoidal(&subject, &camera, RULE, FRAME),
                ];
                for (i, matrix) in fits.into_iter().enumerate() {
                    let matrix = matrix.unwrap_or_else(|| panic!("{i} {light:?}"));
                    for point in &subject.points {
                        let place = matrix.place(subject.rays.ray_from_point(*point));
                        assert!(place.abs().max_element() <= 200.0, "{i} {place}");
                    }
                }
            }
        }
    }

    #[test]
    fn perspectives_serve_a_floor_better_than_none() {
        let camera = camera();
        let mut sums = [0.0; 4];
        for light in lights() {
            let subject = Subject::new(light, floor(&camera)).unwrap();
            let samples = samples(&subject, &camera);
            let fits = [
                subject.focused(FRAME),
                light_space_perspective(&subject, &camera, FRAME),
                perspective(&subject, &camera, FRAME),
                trapezoidal(&subject, &camera, RULE, FRAME),
            ];
            for (sum, fit) in sums.iter_mut().zip(fits) {
                *sum += fit.unwrap().h(&samples).ln() / lights().len() as f64;
            }
        }
        let focused = sums[0];
        assert!(sums[1..].iter().all(|sum| *sum < focused - 0.5), "{sums:?}");
    }

    #[test]
    fn texels_of_the_optimal_plane_are_pixels() {
        let camera = camera();
        for light in lights() {
            let subject = Subject::new(light, floor(&camera)).unwrap();
            let points = subject.points.iter();
            let surfaces: Vec<_> = points.map(|p| surface(*p, DVec3::Y, 0.5)).collect();
            let plane = dominant_plane(&surfaces).unwrap();
            let matrix = plane_optimal(&subject, &camera, plane, Extent::Receivers, FRAME).unwrap();
            let badness: Vec<_> = samples(&subject, &camera)
                .iter()
                .map(|sample| matrix.badness(sample))
                .collect();
            for value in &badness {
                assert!(
                    (value / badness[0] - 1.0).abs() < 1e-6,
                    "{value} {}",
                    badness[0]
                );
            }
        }
    }

    fn surface(point: DVec3, normal: DVec3, weight: f64) -> Surface {
        Surface {
            point,
            normal,
            weight,
        }
    }

    #[test]
    fn the_plane_of_most_weight_is_found() {
        // A wall with a third of the floor's points.
        for (floor_weight, expected) in [(1.0, DVec3::Y), (0.5, DVec3::Y), (0.1, DVec3::Z)] {
            let points = floor(&camera()).into_iter();
            let mut surfaces: Vec<_> = points.map(|p| surface(p, DVec3::Y, floor_weight)).collect();
            for i in 0..surfaces.len() / 3 {
                let point = DVec3::new(i as f64 * 0.01, 3.0, -4.0);
                surfaces.insert(i * 2, surface(point, DVec3::Z, 1.0));
            }
            let plane = dominant_plane(&surfaces).unwrap();
            assert_eq!(plane.function.truncate(), expected);
        }
        assert_eq!(dominant_plane(&[]), None);
    }

    #[test]
    fn degenerate_subjects_have_no_fit() {
        let along = |direction| Source::AtInfinity { direction };
        assert_eq!(Subject::new(along(DVec3::NEG_Y), vec![]), None);
        let position = DVec3::ZERO;
        let around = Subject::new(Source::Near { position }, vec![DVec3::X, DVec3::NEG_X]);
        assert_eq!(around, None);
        let camera = camera();
        let subject = Subject::new(along(camera.forward), floor(&camera)).unwrap();
        assert_eq!(light_space_perspective(&subject, &camera, FRAME), None);
        let subject = Subject::new(along(DVec3::X), floor(&camera)).unwrap();
        let plane = dominant_plane(&[surface(DVec3::ZERO, DVec3::Y, 1.0)]).unwrap();
        assert_eq!(
            plane_optimal(&subject, &camera, plane, Extent::Frustum, FRAME),
            None
        );
    }
}
