//! Layers over the boxes of their receivers.

use super::central::{cone_layer, cube_faces, fit_box, fit_square};
use super::layer::Layer;
use super::parallel::{self, projected_box};
use super::receivers::{Corners, OutlinePoints, ReceiverQueries, Setting};
use super::rotation::{Rotation, laid_lengthwise, turned};
use super::snapping::snapped;
use super::source::Source;
use crate::error::Result;
use crate::geometry::smallest_rectangle;
use crate::map_size::MapSize;
use crate::projection::Projection;
use crate::region::Region;
use crate::rounding::{RECEIVER_ROUNDING, ROUNDING};
use glam::{DMat2, DVec2, DVec3};
use std::f64::consts::SQRT_2;

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
    /// The box of the receivers on texels that hold still, where `snaps`.
    pub fn snapped_where(self, snaps: bool) -> Self {
        match self {
            Self::Receivers if snaps => Self::Snapped,
            cut => cut,
        }
    }
}

/// How the maps of the receivers' boxes are turned around the light's direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Turn {
    /// Not as the receivers lie: "desired view".
    Still(Rotation),
    /// As their smallest rectangle: "MIN-SM".
    SmallestRectangle,
    /// Along their principal axes.
    PrincipalAxes,
}

/// The light's own layers over the boxes of their receivers: one map for parallel rays, a light far away or a cone,
/// faces of a cube for a point. A layer without receivers is left out.
pub fn fit_boxes(
    receivers: &mut dyn ReceiverQueries<'_>,
    turn: Turn,
    cut: Cut,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let rotation = match turn {
        Turn::Still(rotation) => rotation,
        Turn::SmallestRectangle | Turn::PrincipalAxes => Rotation::OffEdges,
    };
    let mut layers = rotated_layers(receivers.setting(), rotation);
    for layer in &mut layers {
        let direction = match turn {
            Turn::Still(_) => continue,
            Turn::SmallestRectangle => {
                let extremes = receivers.outline(layer, OutlinePoints::Extremes)?;
                smallest_rectangle(&extremes).map_or(DVec2::X, |rectangle| rectangle.axis)
            }
            Turn::PrincipalAxes => {
                principal_axis(&receivers.outline(layer, OutlinePoints::Samples)?)
            }
        };
        layer.projection = turned(&layer.projection, direction);
    }
    cut_layers(receivers, layers, cut, size)
}

/// The same, not turned, but all of them with straight edges: a cone that is too wide for one perspective takes faces
/// of a cube.
pub fn fit_straight_boxes(
    receivers: &mut dyn ReceiverQueries<'_>,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let layers = straight_layers(receivers.setting());
    cut_layers(receivers, layers, Cut::Receivers, size)
}

/// The light's own layers, given by their axes, where all of them have straight edges, else faces of a cube.
pub fn straight_layers(setting: Setting) -> Vec<Layer> {
    let own = layers_of_light(setting);
    let are_straight = own
        .iter()
        .all(|layer| layer.projection.kind.has_straight_edges());
    match setting.near_position() {
        Some(position) if !are_straight => cube_faces(position, setting.scene.bounds()),
        _ => own,
    }
}

/// The light's own layers, given by their axes: one for parallel rays, a light far away or a cone, faces of a
/// cube for a point.
pub fn layers_of_light(setting: Setting) -> Vec<Layer> {
    rotated_layers(setting, Rotation::OffEdges)
}

/// The same, rotated where there is one.
pub fn rotated_layers(setting: Setting, rotation: Rotation) -> Vec<Layer> {
    let scene = setting.scene.bounds();
    let Some(position) = setting.near_position() else {
        return vec![Layer::everywhere(setting.axes_rotated(rotation))];
    };
    let layers = match setting.light.cone() {
        Some(cone) => vec![cone_layer(position, cone, scene)],
        None => cube_faces(position, scene),
    };
    let rotated = layers.into_iter().map(|layer| rotation.of_layer(layer));
    rotated.collect()
}

/// The layers around a light's position; of a light far away, for which one holds all that it lights, that one.
pub fn layers_around(
    setting: Setting,
    layers: impl FnOnce(DVec3) -> Result<Vec<Layer>>,
) -> Result<Vec<Layer>> {
    let far_away = || Ok(vec![parallel_layer(setting)]);
    setting.near_position().map_or_else(far_away, layers)
}

/// One layer of rays that do not start nearby.
pub fn parallel_layer(setting: Setting) -> Layer {
    Layer::everywhere(setting.axes_rotated(Rotation::OffEdges))
}

/// Each layer, given by its axes, as a map; those without receivers are left out.
pub fn cut_layers(
    receivers: &mut dyn ReceiverQueries<'_>,
    layers: Vec<Layer>,
    cut: Cut,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let boxes = receivers.bounds(&layers)?;
    Ok(boxed_layers(receivers, layers, boxes, cut, size))
}

/// The same, with the boxes of the layers' receivers.
pub fn boxed_layers(
    receivers: &mut dyn ReceiverQueries<'_>,
    layers: Vec<Layer>,
    boxes: Vec<Option<Corners>>,
    cut: Cut,
    size: MapSize,
) -> Vec<Layer> {
    let setting = receivers.setting();
    let leaves_out = receivers.leaves_out_empty_layers();
    let mut fitted = Vec::new();
    for (Layer { projection, region }, corners) in layers.into_iter().zip(boxes) {
        let whole = || whole_layer(setting, &projection);
        let Some(corners) = corners.or_else(|| (!leaves_out).then(whole)) else {
            receivers.skip_layer();
            continue;
        };
        // A map whose texels hold still lies as the scene does, which holds still, too.
        let (low, high) = match cut {
            Cut::Receivers => corners,
            Cut::Whole | Cut::Snapped => whole(),
        };
        let sides = (high - low).truncate();
        let (projection, corners) = laid_lengthwise(&projection, corners, sides, size);
        let projection = match projection.kind.is_central() {
            false => parallel_box(setting, &projection, corners, cut, size),
            true => central_map(setting, &projection, &region, corners, cut, size),
        };
        fitted.push(Layer { projection, region });
    }
    fitted
}

/// Corners that no receiver of a layer is beyond.
pub fn whole_layer(setting: Setting, axes: &Projection) -> Corners {
    let side = DVec2::splat(2.0);
    match axes.kind.is_central() {
        false => projected_box(axes, setting.scene.bounds()),
        true => ((-side).extend(axes.near), side.extend(axes.far)),
    }
}

fn parallel_box(
    setting: Setting,
    axes: &Projection,
    (low, high): Corners,
    cut: Cut,
    size: MapSize,
) -> Projection {
    let casters = projected_box(axes, setting.scene.bounds());
    // How far a receiver may lie outside the box that float32 found: the box is relative to the eye.
    let farthest = low.abs().max(high.abs()).length();
    let rounding = ROUNDING * farthest;
    let (mut low, mut high) = (low - rounding, high + rounding);
    if cut == Cut::Snapped {
        // From a point that holds still: the axes' own origin moves with the eye. The world's origin may be beyond a
        // light far away.
        let still = match setting.source() {
            Source::FarAway { .. } => setting.middle(),
            Source::AtInfinity { .. } | Source::Near { .. } => DVec3::ZERO,
        };
        let origin = -axes.texel_from_point(still).truncate();
        let place = |corner: DVec3| corner.truncate() + origin;
        let sides = snapped((place(low), place(high)), size);
        low = (sides.0 - origin).extend(low.z);
        high = (sides.1 - origin).extend(high.z);
    }
    parallel::fit_box(axes, (low, high), casters.0.z - rounding, size)
}

/// How far a receiver may be from the middle of the plane of central axes. The unit square holds a pyramid or half of
/// space.
pub fn widest_place(setting: Setting, axes: &Projection, region: &Region) -> f64 {
    match setting.light.cone() {
        Some(cone) if region.is_everywhere() => axes.kind.plane_radius(cone.cosine.acos()),
        _ => 1.0,
    }
}

fn central_map(
    setting: Setting,
    axes: &Projection,
    region: &Region,
    corners: Corners,
    cut: Cut,
    size: MapSize,
) -> Projection {
    let widest = widest_place(setting, axes, region);
    let distances = (setting.camera.eye - axes.origin).length() + corners.1.z;
    let rounding = RECEIVER_ROUNDING * distances;
    match cut {
        Cut::Whole => {
            let far = (corners.1.z + rounding).min(axes.far);
            fit_square(axes, 1.001 * widest, far, size)
        }
        // The square may be turned.
        Cut::Receivers | Cut::Snapped => {
            let widest = 1.001 * SQRT_2 * widest;
            let snaps = cut == Cut::Snapped;
            fit_box(axes, corners, widest, size, rounding, snaps)
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
