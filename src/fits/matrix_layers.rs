//! Fits of light matrices: what they are fitted to, and the projections that they make.

use super::boxes::{Cut, boxed_layers, layers_of_light, whole_layer};
use super::central::{axes_for_scene, cube_faces};
use super::light_fits::{Subject, focused};
use super::light_matrix::{LightMatrix, MapSize};
use super::parallel::{axes_at, bounds_of, projected_box};
use crate::error::Result;
use crate::frustum::visible_part;
use crate::methods::Fitted;
use crate::methods::parameters::FitParameters;
use crate::methods::view::{SampledReceivers, View};
use crate::projection::{Homography, Perspective, Projection};
use crate::region::Region;
use glam::{DMat3, DVec2, DVec3, DVec4};

/// What a light matrix must hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// The part of the scene's box in the camera's frustum: needs nothing but its corners.
    Frustum,
    /// The receivers that face the light, from samples of the image.
    Receivers,
}

/// What one map is fitted to.
pub struct Part {
    pub subject: Subject,
    pub region: Region,
    /// Of each point its index among the samples; none where the points are corners.
    pub samples: Vec<usize>,
}

/// The parts of some of the samples, one map each: one part for parallel rays and for a light that has
/// all in front of it, else those faces of a cube around it that hold any.
pub fn parts_of_receivers(
    view: &mut View,
    samples: &SampledReceivers,
    chosen: Vec<usize>,
) -> Vec<Part> {
    let points: Vec<_> = chosen.iter().map(|&i| samples.points[i]).collect();
    if let Some(subject) = Subject::new(view.light, points) {
        return vec![Part {
            subject,
            region: Region::EVERYWHERE,
            samples: chosen,
        }];
    }
    let mut parts = Vec::new();
    for Fitted { projection, region } in faces(view) {
        let is_inside = |&i: &usize| region.contains(samples.points[i]);
        let own: Vec<_> = chosen.iter().copied().filter(is_inside).collect();
        let points: Vec<_> = own.iter().map(|&i| samples.points[i]).collect();
        match Subject::central(projection.origin, projection.z_axis, points) {
            Some(subject) => parts.push(Part {
                subject,
                region,
                samples: own,
            }),
            None => view.skip_layer(),
        }
    }
    parts
}

fn parts_of_frustum(view: &View) -> Vec<Part> {
    let corners = visible_part(view.camera, view.scene.bounds());
    if let Some(subject) = Subject::new(view.light, corners) {
        return vec![Part {
            subject,
            region: Region::EVERYWHERE,
            samples: vec![],
        }];
    }
    // Each face as it is.
    let whole = faces(view)
        .into_iter()
        .filter_map(|Fitted { projection, region }| {
            let Projection {
                origin,
                x_axis,
                y_axis,
                z_axis,
                ..
            } = projection;
            let sides = [x_axis + y_axis, x_axis - y_axis];
            let corners = sides.into_iter().flat_map(|side| [side, -side]);
            let points = corners.map(|side| origin + (z_axis + side) * projection.far);
            Some(Part {
                subject: Subject::central(origin, z_axis, points.collect())?,
                region,
                samples: vec![],
            })
        });
    whole.collect()
}

/// The light's own layers, each over the box of what the map must hold, on texels that hold still while
/// that moves. Submits what was recorded so far.
pub fn still_layers(
    view: &mut View,
    resolution: u32,
    parameters: FitParameters,
) -> Result<Vec<Fitted>> {
    let layers = layers_of_light(view);
    let points = match parameters.fit {
        Fit::Receivers => {
            let samples = view.sampled_receivers(parameters.sample_resolution)?;
            let facing = samples.facing_the_light().into_iter();
            Some(facing.map(|i| samples.points[i]).collect::<Vec<_>>())
        }
        // The frustum may cross a layer around a light and have no corner in it.
        Fit::Frustum if view.light.position().is_some() => None,
        Fit::Frustum => Some(visible_part(view.camera, view.scene.bounds())),
    };
    let corners = |layer: &Fitted| {
        // Depths are those of the scene: a receiver may lie behind all samples.
        let (low, high) = whole_layer(view, &layer.projection);
        let Some(points) = &points else {
            return Some((low, high));
        };
        let own = points.iter().filter(|point| layer.region.contains(**point));
        let places = own.map(|point| layer.projection.texel_from_point(*point));
        let (first, last) = bounds_of(places);
        if first.x > last.x {
            return None;
        }
        let room = parameters.margin * 0.5 * (last - first).truncate();
        Some((
            (first.truncate() - room).extend(low.z),
            (last.truncate() + room).extend(high.z),
        ))
    };
    let boxes = layers.iter().map(corners).collect();
    Ok(boxed_layers(view, layers, boxes, Cut::Snapped, resolution))
}

fn faces(view: &View) -> Vec<Fitted> {
    let position = view.light.position();
    position.map_or_else(Vec::new, |position| {
        cube_faces(position, view.scene.bounds())
    })
}

/// The projection of a light matrix.
pub fn projection(
    view: &View,
    subject: &Subject,
    matrix: &LightMatrix,
    resolution: u32,
) -> Projection {
    let rows = subject.rays.world_rows(matrix);
    let bounds = view.scene.bounds();
    let centre = DVec2::splat(0.5 * f64::from(resolution));
    if let Some(position) = view.light.position() {
        // The optical axis is the third axis, and the rest is in the other two.
        let [x_axis, y_axis, z_axis] = rows.map(DVec4::truncate);
        let length = z_axis.length();
        return Projection {
            x_axis: x_axis / length,
            y_axis: y_axis / length,
            z_axis: z_axis / length,
            centre,
            width: resolution,
            height: resolution,
            ..axes_for_scene(Perspective, position, z_axis / length, bounds)
        };
    }
    let direction = subject.rays.light().truncate();
    // Around the eye float32 resolves what the camera sees best.
    let axes = axes_at(view.camera.eye, direction);
    let columns = [axes.x_axis, axes.y_axis]
        .map(|axis| DVec3::from(rows.map(|row| row.truncate().dot(axis))));
    let constant = DVec3::from(rows.map(|row| row.dot(axes.origin.extend(1.0))));
    let homography = DMat3::from_cols(columns[0], columns[1], constant);
    let across = |point: &DVec3| axes.projected_from_point(*point).truncate();
    let reach = subject.points.iter().map(|point| across(point).length());
    let reach = reach.fold(0.0, f64::max);
    // One on the rays of the middle of the points.
    let middle = subject.points.iter().map(across).sum::<DVec2>() / subject.points.len() as f64;
    let w = (homography * middle.extend(1.0)).z;
    let (low, high) = projected_box(&axes, bounds);
    let rounding = f64::from(f32::EPSILON) * (low.abs().max(high.abs())).length();
    Projection {
        kind: Homography::new(homography * (1.0 / w), reach).into(),
        centre,
        width: resolution,
        height: resolution,
        near: low.z - rounding,
        far: high.z + rounding,
        normalizes_depth: true,
        ..axes
    }
}

/// The layers of a method that fits a light matrix to each part, by no more than focusing where `fit`
/// finds none. Submits what was recorded so far.
pub fn fitted_layers(
    view: &mut View,
    resolution: u32,
    parameters: FitParameters,
    fit: impl Fn(&Subject, MapSize) -> Option<LightMatrix>,
) -> Result<Vec<Fitted>> {
    let parts = match parameters.fit {
        Fit::Frustum => parts_of_frustum(view),
        Fit::Receivers => {
            let samples = view.sampled_receivers(parameters.sample_resolution)?;
            parts_of_receivers(view, &samples, samples.facing_the_light())
        }
    };
    let size = MapSize {
        texels: f64::from(resolution),
        margin: parameters.margin,
    };
    let layers = parts.into_iter().filter_map(
        |Part {
             subject, region, ..
         }| {
            let matrix = fit(&subject, size).or_else(|| focused(&subject, size))?;
            let projection = projection(view, &subject, &matrix, resolution);
            Some(Fitted { projection, region })
        },
    );
    Ok(layers.collect())
}
