//! Fits of maps to the receivers: the step before a map or a warp.

use super::central::{cone_layer, cube_faces, fit_box, fit_square};
use super::parallel::{self, axes_at, projected_box};
use super::rotation::{parallel_off_edges, turned};
use super::snapping::snapped;
use crate::error::Result;
use crate::geometry::smallest_rectangle;
use crate::gpu::passes::outline::Points;
use crate::methods::cube::fit_cube;
use crate::methods::dual_paraboloid::fit_dual_paraboloid;
use crate::methods::improved_paraboloid::{self, fit_improved_paraboloid};
use crate::methods::lispsm::LightSpacePerspective;
use crate::methods::scene_optimized::SceneOptimized;
use crate::methods::spot::fit_spot;
use crate::methods::view::{Fitted, View};
use crate::projection::Projection;
use crate::region::Region;
use glam::{DMat2, DMat3, DVec2, DVec3};
use std::f64::consts::SQRT_2;

/// Which maps there are, before their sides are fitted to the receivers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fit {
    /// The light's own: one map for parallel rays or a cone, faces of a cube for a point.
    DesiredView,
    /// The same, turned as the smallest rectangle around the receivers.
    MinSm,
    /// The same, turned along the principal axes of the receivers.
    PrincipalAxes,
    /// With the perspective of `lispsm`.
    LightSpacePerspective,
    /// With the light matrix of `scene_optimized`.
    SceneOptimized,
    /// Six faces of a cube around the light.
    Cube,
    /// Two paraboloids back to back.
    DualParaboloid,
    /// A paraboloid that looks at the receivers.
    ImprovedParaboloid,
    /// One map along the axis of a spot light.
    Spot,
}

/// What a layer of an omnidirectional map is cut to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    /// All that the layer is for.
    Whole,
    /// The box of its receivers.
    Receivers,
    /// That box, on texels that hold still while it moves.
    Snapped,
}

impl Cut {
    /// The box of the receivers; on texels that hold still where `snaps`.
    pub fn to_receivers(snaps: bool) -> Self {
        if snaps {
            Self::Snapped
        } else {
            Self::Receivers
        }
    }
}

impl Fit {
    /// The maps around the receivers that face the light. A layer without receivers is left out. Submits
    /// what was recorded so far.
    pub fn fit(self, view: &mut View, snaps: bool, resolution: u32) -> Result<Vec<Fitted>> {
        let cut = Cut::to_receivers(snaps);
        let points = match self {
            Self::LightSpacePerspective => return LightSpacePerspective::new(resolution).fit(view),
            Self::SceneOptimized => return SceneOptimized::new(resolution).fit(view),
            Self::Cube => return fit_cube(view, DMat3::IDENTITY, cut, resolution),
            Self::DualParaboloid => return fit_dual_paraboloid(view, cut, resolution),
            Self::ImprovedParaboloid => {
                return fit_improved_paraboloid(
                    view,
                    improved_paraboloid::Cut::Receivers,
                    resolution,
                );
            }
            Self::Spot => return fit_spot(view, cut, resolution),
            Self::DesiredView => None,
            Self::MinSm => Some(Points::Extremes),
            Self::PrincipalAxes => Some(Points::Samples),
        };
        let mut layers = layers_of_light(view);
        if let Some(points) = points {
            for layer in &mut layers {
                turn(view, layer, points)?;
            }
        }
        cut_layers(view, layers, cut, resolution)
    }
}

/// Turns a layer's axes as its receivers lie.
fn turn(view: &mut View, layer: &mut Fitted, points: Points) -> Result<()> {
    let found = view.outline(layer, points)?;
    let direction = match points {
        Points::Extremes => smallest_rectangle(&found).map_or(DVec2::X, |r| r.axis),
        Points::Samples => principal_axis(&found),
    };
    layer.projection = turned(&layer.projection, direction);
    Ok(())
}

/// The light's own layers, given by their axes: one for parallel rays or a cone, faces of a cube for a
/// point.
pub fn layers_of_light(view: &View) -> Vec<Fitted> {
    let scene = view.scene.bounds();
    match (view.light.position(), view.light.cone()) {
        (None, _) => vec![parallel_layer(view)],
        (Some(position), Some(cone)) => vec![cone_layer(position, cone, scene)],
        (Some(position), None) => cube_faces(position, scene),
    }
}

/// Axes of parallel rays. Around the eye float32 resolves what the camera sees best.
pub fn parallel_layer(view: &View) -> Fitted {
    let direction = -view.light.vector_from_point(view.camera.eye);
    let axes = axes_at(view.camera.eye, direction);
    Fitted::everywhere(parallel_off_edges(view.scene, axes))
}

/// Each layer, given by its axes, as a map; those without receivers are left out. Submits what was
/// recorded so far.
pub fn cut_layers(
    view: &mut View,
    layers: Vec<Fitted>,
    cut: Cut,
    resolution: u32,
) -> Result<Vec<Fitted>> {
    let boxes = view.receiver_bounds(&layers)?;
    Ok(boxed_layers(view, layers, boxes, cut, resolution))
}

/// The same, with the boxes of the layers' receivers.
pub fn boxed_layers(
    view: &mut View,
    layers: Vec<Fitted>,
    boxes: Vec<Option<(DVec3, DVec3)>>,
    cut: Cut,
    resolution: u32,
) -> Vec<Fitted> {
    let mut fitted = Vec::new();
    for (layer, corners) in layers.into_iter().zip(boxes) {
        let whole = || whole_layer(view, &layer.projection);
        let Some(corners) = corners.or_else(|| (!view.culls()).then(whole)) else {
            view.skip_layer();
            continue;
        };
        let Fitted { projection, region } = layer;
        let projection = match projection.kind.is_central() {
            false => parallel_box(view, &projection, corners, cut, resolution),
            true => central_map(view, &projection, &region, corners, cut, resolution),
        };
        fitted.push(Fitted { projection, region });
    }
    fitted
}

/// Corners that no receiver of a layer is beyond.
pub fn whole_layer(view: &View, axes: &Projection) -> (DVec3, DVec3) {
    let side = DVec2::splat(2.0);
    match axes.kind.is_central() {
        false => projected_box(axes, view.scene.bounds()),
        true => ((-side).extend(axes.near), side.extend(axes.far)),
    }
}

fn parallel_box(
    view: &View,
    axes: &Projection,
    (low, high): (DVec3, DVec3),
    cut: Cut,
    resolution: u32,
) -> Projection {
    let casters = projected_box(axes, view.scene.bounds());
    // How far a receiver may lie outside the box that float32 found: the box is relative to the eye.
    let farthest = low.abs().max(high.abs()).length();
    let rounding = 4.0 * f64::from(f32::EPSILON) * farthest;
    let (mut low, mut high) = (low - rounding, high + rounding);
    if cut == Cut::Snapped {
        // From the world's origin: the axes' own moves with the eye.
        let origin = DVec2::new(axes.x_axis.dot(axes.origin), axes.y_axis.dot(axes.origin));
        let place = |corner: DVec3| corner.truncate() + origin;
        let sides = snapped((place(low), place(high)), resolution);
        low = (sides.0 - origin).extend(low.z);
        high = (sides.1 - origin).extend(high.z);
    }
    parallel::fit_box(axes, (low, high), casters.0.z - rounding, resolution)
}

fn central_map(
    view: &View,
    axes: &Projection,
    region: &Region,
    corners: (DVec3, DVec3),
    cut: Cut,
    resolution: u32,
) -> Projection {
    // The unit square of the plane holds a pyramid or half of space.
    let widest = match view.light.cone() {
        Some(cone) if region.is_everywhere() => axes.kind.plane_radius(cone.cosine.acos()),
        _ => 1.0,
    };
    let distances = (view.camera.eye - axes.origin).length() + corners.1.z;
    let rounding = 8.0 * f64::from(f32::EPSILON) * distances;
    match cut {
        Cut::Whole => {
            let far = (corners.1.z + rounding).min(axes.far);
            fit_square(axes, 1.001 * widest, far, resolution)
        }
        // The square may be turned.
        Cut::Receivers | Cut::Snapped => {
            let widest = 1.001 * SQRT_2 * widest;
            let snaps = cut == Cut::Snapped;
            fit_box(axes, corners, widest, resolution, rounding, snaps)
        }
    }
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
        }
        assert_eq!(principal_axis(&[]), DVec2::X);
        assert_eq!(principal_axis(&[DVec2::ONE]), DVec2::X);
    }
}
