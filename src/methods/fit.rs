//! Fits of maps to the receivers: the step before a map or a warp.

use super::central_fit::{self, cone_layer, cube_faces, plane_radius};
use super::lispsm::LightSpacePerspective;
use super::parallel_fit::{self, axes_at, projected_box};
use super::parameters::Value;
use super::scene_optimized::SceneOptimized;
use super::view::{Fitted, View};
use crate::error::Result;
use crate::geometry::smallest_rectangle;
use crate::passes::outline::Points;
use crate::projection::{Kind, Projection};
use crate::region::Region;
use glam::{DMat2, DVec2, DVec3};

/// How a map is turned around the light's direction, before its sides are fitted to the receivers; or
/// the method that makes all of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// The world's Y is up in the map.
    DesiredView,
    /// As the smallest rectangle around the receivers.
    MinSm,
    /// Along the principal axes of the receivers.
    PrincipalAxes,
    /// With the perspective of `lispsm`.
    LightSpacePerspective,
    /// With the light matrix of `scene_optimized`.
    SceneOptimized,
}

impl Fit {
    pub const NAME: &'static str = "fit";

    pub const CHOICES: &'static [(&'static str, Self)] = &[
        ("desired_view", Self::DesiredView),
        ("min_sm", Self::MinSm),
        ("principal_axes", Self::PrincipalAxes),
        ("lispsm", Self::LightSpacePerspective),
        ("scene_optimized", Self::SceneOptimized),
    ];

    pub fn default_value() -> Value {
        Value::Text("desired_view".to_string())
    }

    /// The maps around the receivers that face the light: one for parallel rays or a cone, up to six
    /// faces of a cube for a point. A layer without receivers is left out. Submits what was recorded so
    /// far.
    pub fn fit(self, view: &mut View, resolution: u32) -> Result<Vec<Fitted>> {
        match self {
            Self::DesiredView | Self::MinSm | Self::PrincipalAxes => {}
            Self::LightSpacePerspective => return LightSpacePerspective::new(resolution).fit(view),
            Self::SceneOptimized => return SceneOptimized::new(resolution).fit(view),
        }
        let scene = view.scene.bounds();
        let mut layers = match (view.light.position(), view.light.cone()) {
            (None, _) => vec![parallel_layer(view)],
            (Some(position), Some(cone)) => vec![cone_layer(position, cone, scene)],
            (Some(position), None) => cube_faces(position, scene),
        };
        for layer in &mut layers {
            let turn = match self {
                Self::DesiredView | Self::LightSpacePerspective | Self::SceneOptimized => continue,
                Self::MinSm => {
                    let points = view.outline(layer, Points::Extremes)?;
                    smallest_rectangle(&points).map_or(DVec2::X, |rectangle| rectangle.axis)
                }
                Self::PrincipalAxes => principal_axis(&view.outline(layer, Points::Samples)?),
            };
            // Less than a quarter of a turn, so that no map lies on its side or its head without a need.
            let turn = quarter_turned(turn);
            let axes = &mut layer.projection;
            let (right, down) = (axes.x_axis, axes.y_axis);
            axes.x_axis = right * turn.x + down * turn.y;
            axes.y_axis = down * turn.x - right * turn.y;
        }
        fit_receivers(view, layers, resolution)
    }
}

/// Axes of parallel rays. Around the eye float32 resolves what the camera sees best.
fn parallel_layer(view: &View) -> Fitted {
    let direction = -view.light.vector_from_point(view.camera.eye);
    Fitted {
        projection: axes_at(view.camera.eye, direction),
        region: Region::everywhere(),
    }
}

/// Each layer, given by its axes, cut to the box of its receivers; those without any are left out.
/// Submits what was recorded so far.
pub fn fit_receivers(view: &mut View, layers: Vec<Fitted>, resolution: u32) -> Result<Vec<Fitted>> {
    let boxes = view.receiver_bounds(&layers)?;
    let mut fitted = Vec::new();
    for (layer, corners) in layers.into_iter().zip(boxes) {
        let Some(corners) = corners else {
            view.skip_layer();
            continue;
        };
        let Fitted { projection, region } = layer;
        let projection = match projection.kind {
            Kind::Parallel => parallel_box(view, &projection, corners, resolution),
            Kind::Perspective | Kind::Paraboloid => {
                central_box(view, &projection, &region, corners, resolution)
            }
        };
        fitted.push(Fitted { projection, region });
    }
    Ok(fitted)
}

fn parallel_box(
    view: &View,
    axes: &Projection,
    corners: (DVec3, DVec3),
    resolution: u32,
) -> Projection {
    let casters = projected_box(axes, view.scene.bounds());
    // How far a receiver may lie outside the box that float32 found: the box is relative to the eye.
    let farthest = corners.0.abs().max(corners.1.abs()).length();
    let rounding = 4.0 * f64::from(f32::EPSILON) * farthest;
    parallel_fit::fit_box(axes, corners, casters.0.z, resolution, rounding)
}

fn central_box(
    view: &View,
    axes: &Projection,
    region: &Region,
    corners: (DVec3, DVec3),
    resolution: u32,
) -> Projection {
    // No receiver of a pyramid or of half of space leaves the unit square of its plane, turned or not.
    let widest = match view.light.cone() {
        Some(cone) if region.is_everywhere() => plane_radius(axes.kind, cone.cosine.acos()),
        _ => std::f64::consts::SQRT_2,
    };
    let distances = (view.camera.eye - axes.origin).length() + corners.1.z;
    let rounding = 8.0 * f64::from(f32::EPSILON) * distances;
    central_fit::fit_box(axes, corners, 1.001 * widest, resolution, rounding)
}

/// The direction turned by the quarters that bring it nearest to x.
fn quarter_turned(direction: DVec2) -> DVec2 {
    let turned = if direction.x.abs() < direction.y.abs() {
        direction.perp()
    } else {
        direction
    };
    if turned.x < 0.0 { -turned } else { turned }
}

/// The direction along which points scatter most; x where there is none.
fn principal_axis(points: &[DVec2]) -> DVec2 {
    let mean = points.iter().sum::<DVec2>() / (points.len().max(1) as f64);
    let covariance = points.iter().fold(DMat2::ZERO, |sum, &point| {
        let offset = point - mean;
        sum + DMat2::from_cols(offset * offset.x, offset * offset.y)
    });
    let difference = covariance.x_axis.x - covariance.y_axis.y;
    DVec2::from_angle(0.5 * (2.0 * covariance.x_axis.y).atan2(difference))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_principal_axis_is_that_of_a_long_row() {
        for turn in -8..8 {
            let axis = DVec2::from_angle(f64::from(turn) * 0.19);
            let points: Vec<_> = (0..60)
                .map(|i| DVec2::splat(5.0) + axis * f64::from(i) + axis.perp() * f64::from(i % 3))
                .collect();
            assert!(principal_axis(&points).dot(axis).abs() > 0.999);
            assert!(quarter_turned(axis).x >= 0.7);
        }
        assert_eq!(principal_axis(&[]), DVec2::X);
        assert_eq!(principal_axis(&[DVec2::ONE]), DVec2::X);
    }
}
