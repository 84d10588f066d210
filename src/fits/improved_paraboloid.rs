//! Improved paraboloids: one paraboloid that looks at what the camera sees, and is zoomed to it.
//!
//! Juraj Vanek, Jan Navrátil, Adam Herout, Pavel Zemčík. High-quality shadows with improved paraboloid mapping. ISVC
//! 2011, sections 3.1-3.3. The text's maximum of dot products in Eq. 2 is meant as the largest angle.

use super::boxes::{Cut, Turn, cut_layers, fit_boxes, parallel_layer};
use super::central::{
    axes_for_scene, fit_box, fit_square, frustum_corners, halves_of_light, places_of,
    smallest_cone_axis,
};
use super::layer::Layer;
use super::parallel::{self, axes_at, projected_box};
use super::receivers::{OutlinePoints, ReceiverQueries, Setting};
use super::rotation::{
    cheapest, laid_lengthwise, paraboloid_off_edges, quarter_in, turned, turned_place,
};
use crate::camera::Camera;
use crate::error::Result;
use crate::geometry::{bounds_of, smallest_rectangle};
use crate::map_size::MapSize;
use crate::projection::{Paraboloid, Projection};
use crate::rounding::{RECEIVER_ROUNDING, ROUNDING};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

/// What the paraboloid is zoomed to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Zoom {
    /// The cone around the truncated view frustum, as in the paper.
    Frustum,
    /// The smallest cone around the receivers.
    Cone,
    /// The box of the receivers.
    Receivers,
}

/// Which way the first of two paraboloids back to back looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Splitting {
    /// Along the light's axis, or down.
    Light,
    /// To the middle of the view.
    View,
}

/// A single paraboloid reaches this far from its axis, in its plane: the rim of a hemisphere. It could go on, but
/// with larger texels than two have.
const WIDEST: f64 = 1.0;

/// So far it reaches around the smallest rectangle, and so far around the samples that the axis is chosen by:
/// to 140 and 136 degrees from the axis. What is opposite to it has no place.
const WIDEST_RECTANGLE: f64 = 2.75;
const FARTHEST: f64 = 2.5;

/// Axes that are tried, and how many times a receiver is put into one of them.
const AXES: u32 = 200;
const MAX_TRIALS: usize = 80_000;

/// Turns of the square around a cone that are tried.
const SQUARES: u32 = 32;

/// One paraboloid, or two where the light is among the receivers; the rays of a light far away are a paraboloid's limit
/// at infinity (Fig. 7).
pub fn fit_improved_paraboloid(
    receivers: &mut dyn ReceiverQueries<'_>,
    zoom: Zoom,
    splitting: Splitting,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    match (setting.near_position(), zoom) {
        (Some(light), Zoom::Frustum) => fit_frustum(receivers, light, splitting, size),
        (Some(light), Zoom::Cone | Zoom::Receivers) => {
            fit_receivers(receivers, light, (zoom, splitting), size)
        }
        (None, Zoom::Frustum) => fit_distant_frustum(receivers, size),
        (None, Zoom::Cone) => {
            let layer = parallel_layer(setting);
            cut_layers(receivers, vec![layer], Cut::Receivers, size)
        }
        (None, Zoom::Receivers) => {
            fit_boxes(receivers, Turn::SmallestRectangle, Cut::Receivers, size)
        }
    }
}

/// Least and greatest depth of the receivers along the viewing direction.
fn depth_range(receivers: &mut dyn ReceiverQueries<'_>) -> Result<Option<(f64, f64)>> {
    let camera = receivers.setting().camera;
    let layer = Layer::everywhere(Projection {
        x_axis: camera.right,
        y_axis: -camera.up,
        ..axes_at(camera.eye, camera.forward)
    });
    let boxes = receivers.bounds(&[layer])?;
    Ok(boxes[0].map(|(low, high)| (low.z, high.z)))
}

/// Two paraboloids back to back around a light: all that can be done where it is in the view is to rotate them
/// (section 5).
pub fn split_halves(
    receivers: &mut dyn ReceiverQueries<'_>,
    light: DVec3,
    splitting: Splitting,
) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    let axis = match splitting {
        Splitting::Light => None,
        Splitting::View => depth_range(receivers)?
            .map(|depths| LightCone::of_frustum(setting.camera, light, depths).axis),
    };
    Ok(halves_of_light(setting, light, axis))
}

/// Section 3.2: the light cone of the truncated view frustum.
fn fit_frustum(
    receivers: &mut dyn ReceiverQueries<'_>,
    light: DVec3,
    splitting: Splitting,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let Some(depths) = depth_range(receivers)? else {
        return Ok(vec![]);
    };
    let setting = receivers.setting();
    let Setting { scene, camera, .. } = setting;
    let cone = LightCone::of_frustum(camera, light, depths);
    let zoom_factor = cone.zoom_factor();
    if is_in_frustum(camera, light, depths) || zoom_factor > WIDEST {
        let to_view = (splitting == Splitting::View).then_some(cone.axis);
        let halves = halves_of_light(setting, light, to_view);
        return cut_layers(receivers, halves, Cut::Whole, size);
    }
    let axes = axes_for_scene(Paraboloid::UNIT, light, cone.axis, scene.bounds());
    let far = (cone.farthest * (1.0 + 1e-6)).min(axes.far);
    let projection = fit_square(&axes, 1.001 * zoom_factor, far, size);
    Ok(vec![Layer::everywhere(projection)])
}

/// The cone from the light that holds the truncated view frustum.
#[derive(Debug, Clone, Copy)]
struct LightCone {
    axis: DVec3,
    /// The largest angle to the axis, radians.
    field_of_view: f64,
    /// The greatest distance from the light.
    farthest: f64,
}

impl LightCone {
    fn of_frustum(camera: &Camera, light: DVec3, depths: (f64, f64)) -> Self {
        let border_points = frustum_corners(camera, depths).map(|point| point - light);
        // Eq. 1, as the sum of the vectors as they are: that of unit vectors mostly makes a wider cone.
        let sum: DVec3 = border_points.into_iter().sum();
        let axis = sum.try_normalize().unwrap_or(camera.forward);
        // Eq. 2.
        let angles = border_points.map(|point| axis.angle_between(point));
        let distances = border_points.map(DVec3::length);
        let greatest = |values: [f64; 8]| values.into_iter().fold(0.0, f64::max);
        Self {
            axis,
            field_of_view: greatest(angles),
            farthest: greatest(distances),
        }
    }

    /// Section 3.3: where the mapping takes the edge of the cone, sin F / (1 + cos F).
    fn zoom_factor(&self) -> f64 {
        (0.5 * self.field_of_view).tan()
    }
}

fn is_in_frustum(camera: &Camera, point: DVec3, (near, far): (f64, f64)) -> bool {
    let image = Projection::from_camera(camera);
    let depth = image.projected_from_point(point).z;
    let pixel = image.texel_from_point(point);
    depth >= near
        && depth <= far
        && (0.0..=f64::from(camera.width)).contains(&pixel.x)
        && (0.0..=f64::from(camera.height)).contains(&pixel.y)
}

/// The receivers themselves: the smallest square around the axis of their smallest cone, or their box.
fn fit_receivers(
    receivers: &mut dyn ReceiverQueries<'_>,
    light: DVec3,
    (zoom, splitting): (Zoom, Splitting),
    size: MapSize,
) -> Result<Vec<Layer>> {
    let Setting { scene, camera, .. } = receivers.setting();
    let axes_along = |axis| axes_for_scene(Paraboloid::UNIT, light, axis, scene.bounds());
    // Around a light in the view one map past the hemisphere is coarser than two.
    let chooses_axis =
        zoom == Zoom::Receivers && !is_in_frustum(camera, light, (0.0, f64::INFINITY));
    let (widest_allowed, tried) = match chooses_axis {
        true => (WIDEST_RECTANGLE, AXES),
        false => (WIDEST, 0),
    };
    let points = match zoom {
        Zoom::Frustum | Zoom::Cone => OutlinePoints::Extremes,
        Zoom::Receivers => OutlinePoints::Samples,
    };
    // Directions to receivers, from a first paraboloid along the view.
    let first = Layer::everywhere(axes_along(camera.forward));
    let places = receivers.outline(&first, points)?.into_iter();
    let rays = places.map(|place| first.projection.ray_from_texel(place).1);
    let directions: Vec<_> = rays.collect();
    let axis = smallest_cone_axis(&directions).unwrap_or(camera.forward);
    let axes = match zoom {
        Zoom::Frustum | Zoom::Cone => turned_to_smallest_square(&axes_along(axis), &directions),
        Zoom::Receivers => {
            let finest = finest_axes(axes_along, axis, tried, &directions, size);
            let axes = finest.unwrap_or_else(|| axes_along(axis));
            paraboloid_off_edges(scene, &axes, &directions)
        }
    };
    // Some receivers often tell that one map does not hold them all.
    let is_outside = |place: &DVec2| place.abs().max_element() > widest_allowed;
    if places_of(&axes, &directions).iter().any(is_outside) {
        return fit_halves(receivers, (light, splitting), &directions, size);
    }
    let layer = Layer::everywhere(axes);
    let Some(corners) = receivers.bounds(std::slice::from_ref(&layer))?[0] else {
        return Ok(vec![]);
    };
    let axes = layer.projection;
    let outermost = corners.0.truncate().abs().max(corners.1.truncate().abs());
    let widest = outermost.max_element();
    if widest > widest_allowed {
        return fit_halves(receivers, (light, splitting), &directions, size);
    }
    let distances = (camera.eye - light).length() + corners.1.z;
    let rounding = RECEIVER_ROUNDING * distances;
    let projection = match zoom {
        Zoom::Frustum | Zoom::Cone => {
            let far = (corners.1.z + rounding).min(axes.far);
            let room = (rounding / corners.0.z.max(axes.near)).clamp(1e-7, 1e-3);
            fit_square(&axes, widest + room, far, size)
        }
        Zoom::Receivers => {
            let sides = (corners.1 - corners.0).truncate();
            let (axes, corners) = laid_lengthwise(&axes, corners, sides, size);
            fit_box(&axes, corners, widest_allowed, size, rounding, false)
        }
    };
    Ok(vec![Layer::everywhere(projection)])
}

/// Two paraboloids, each rotated off the edges and cut to its receivers.
fn fit_halves(
    receivers: &mut dyn ReceiverQueries<'_>,
    (light, splitting): (DVec3, Splitting),
    directions: &[DVec3],
    size: MapSize,
) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    let mut halves = split_halves(receivers, light, splitting)?;
    for half in &mut halves {
        let axes = &half.projection;
        let own = directions.iter().filter(|d| d.dot(axes.z_axis) > 0.0);
        let own: Vec<_> = own.copied().collect();
        half.projection = paraboloid_off_edges(setting.scene, axes, &own);
    }
    cut_layers(receivers, halves, Cut::Receivers, size)
}

/// The axes, turned so that the square around them that holds the directions is the smallest: down to 1 / sqrt(2)
/// of that around their circle.
fn turned_to_smallest_square(axes: &Projection, directions: &[DVec3]) -> Projection {
    let places = places_of(axes, directions);
    let widest = |&right: &DVec2| {
        let sides = places
            .iter()
            .map(|&place| turned_place(place, right).abs().max_element());
        sides.fold(0.0, f64::max)
    };
    turned(
        axes,
        cheapest(quarter_in(SQUARES).map(DVec2::from_angle), widest),
    )
}

/// Along the first axis or one of `count` others, those axes, turned as the receivers lie, whose texels are the
/// finest on the mean of directions to some receivers; none if no axes hold them all.
///
/// A paraboloid is a stereographic projection, so a map keeps its shapes along any axis, but texels grow
/// finer away from it: those in the plane's place r have 2 / (1 + r²) of the angle of those at the rim. Most
/// pixels see what is far from the light, and there an axis that looks past them has its fine texels.
fn finest_axes(
    axes_along: impl Fn(DVec3) -> Projection + Send + Sync,
    first: DVec3,
    count: u32,
    directions: &[DVec3],
    size: MapSize,
) -> Option<Projection> {
    let step = (directions.len() * count as usize)
        .div_ceil(MAX_TRIALS)
        .max(1);
    let samples: Vec<_> = directions.iter().copied().step_by(step).collect();
    let tried = (0..count).map(|i| spiral_direction(i, count));
    let tried: Vec<_> = std::iter::once(first).chain(tried).collect();
    let fitted = tried.into_par_iter().map(axes_along).filter_map(|axes| {
        let places = places_of(&axes, &samples);
        let mut angles = 0.0;
        for place in &places {
            let squared = place.length_squared();
            // The direction that is opposite to the axis gives no number.
            if squared.is_nan() || squared > FARTHEST * FARTHEST {
                return None;
            }
            angles += 2.0 / (1.0 + squared);
        }
        let rectangle = smallest_rectangle(&places)?;
        // Around a texel, whose sides follow from the map's: its longer one lies along the longer one of the rectangle.
        let longer = rectangle.half.max_element() / size.aspect().max(size.aspect().recip());
        let width = longer + rectangle.half.min_element();
        Some((width * angles, turned(&axes, rectangle.axis)))
    });
    // In their order, so that the first of several is the same at every run.
    let fitted: Vec<_> = fitted.collect();
    let finest = fitted.into_iter().min_by(|a, b| a.0.total_cmp(&b.0));
    finest.map(|(_, axes)| axes)
}

/// One of `count` directions that cover the sphere evenly: a spiral by the golden angle (Vogel, "A better way
/// to construct the sunflower head", 1979).
fn spiral_direction(i: u32, count: u32) -> DVec3 {
    let z = 1.0 - f64::from(2 * i + 1) / f64::from(count);
    let turn = f64::from(i) * PI * (3.0 - 5.0_f64.sqrt());
    (DVec2::from_angle(turn) * (1.0 - z * z).sqrt()).extend(z)
}

/// `fit_frustum` with the light at infinity: its cone becomes a cylinder, its paraboloid a plane.
fn fit_distant_frustum(
    receivers: &mut dyn ReceiverQueries<'_>,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let Some(depths) = depth_range(receivers)? else {
        return Ok(vec![]);
    };
    let setting = receivers.setting();
    let Setting { scene, camera, .. } = setting;
    let axes = setting.axes();
    let border_points = frustum_corners(camera, depths);
    let points = border_points.map(|point| axes.texel_from_point(point));
    let middle = points.into_iter().sum::<DVec3>() / 8.0;
    let distances = points.map(|point| point.truncate().distance(middle.truncate()));
    let radius = distances.into_iter().fold(0.0, f64::max);
    let (low, high) = bounds_of(points.into_iter());
    let around =
        |z: f64, side: f64| DVec3::new(middle.x + side * radius, middle.y + side * radius, z);
    let corners = (around(low.z, -1.0), around(high.z, 1.0));
    let casters = projected_box(&axes, scene.bounds());
    let rounding = ROUNDING * low.abs().max(high.abs()).length();
    let corners = (corners.0 - rounding, corners.1 + rounding);
    let projection = parallel::fit_box(&axes, corners, casters.0.z - rounding, size);
    Ok(vec![Layer::everywhere(projection)])
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat4;

    const SCENE: (DVec3, DVec3) = (DVec3::splat(-10.0), DVec3::splat(10.0));
    const SIZE: MapSize = MapSize::square(64);

    fn axes_along(axis: DVec3) -> Projection {
        axes_for_scene(Paraboloid::UNIT, DVec3::ONE, axis, SCENE)
    }

    /// Vanek et al., Eq. 1 and section 3.3: the paraboloid is turned along the mean of the vectors to the border points,
    /// and so far zoomed that the outermost of them lies on the rim.
    #[test]
    fn the_frustum_is_looked_at_along_its_mean_and_reaches_the_rim() {
        let depths = (2.0, 9.0);
        for (turn, light) in [
            (0.3, DVec3::new(4.0, 7.0, -1.0)),
            (1.4, DVec3::new(-3.0, 2.0, 9.0)),
            (2.2, DVec3::new(0.5, 12.0, 0.0)),
        ] {
            let pose = DMat4::from_rotation_y(turn) * DMat4::from_rotation_x(-0.2);
            let (focal, centre) = (DVec2::new(150.0, 140.0), DVec2::new(90.0, 40.0));
            let camera = Camera::new(pose, focal, centre, (180, 120), (0.1, 60.0)).unwrap();
            let mut vectors = Vec::new();
            for depth in [depths.0, depths.1] {
                for (column, row) in [(0.0, 0.0), (180.0, 0.0), (0.0, 120.0), (180.0, 120.0)] {
                    let image = (DVec2::new(column, row) - centre) / focal;
                    let ray = camera.forward + camera.right * image.x - camera.up * image.y;
                    vectors.push(camera.eye + ray * depth - light);
                }
            }
            let mean = vectors.iter().sum::<DVec3>().normalize();
            let cone = LightCone::of_frustum(&camera, light, depths);
            assert!(cone.axis.distance(mean) < 1e-12, "{}", cone.axis);
            // As the paper's shader: normalize, add one to z, divide by it.
            let place = |vector: &DVec3| {
                let z = vector.normalize().dot(mean);
                (1.0 - z * z).max(0.0).sqrt() / (z + 1.0)
            };
            let rim = vectors.iter().map(place).fold(0.0, f64::max);
            assert!((cone.zoom_factor() - rim).abs() < 1e-12, "{rim}");
        }
    }

    #[test]
    fn the_finest_paraboloid_holds_what_most_receivers_are_in_away_from_its_axis() {
        // A floor under a point light, nine tenths of it seen far away, on one side.
        let directions: Vec<_> = (0..2000)
            .map(|i| {
                let (turn, slope) = (f64::from(i % 50) / 50.0, f64::from(i / 50) / 40.0);
                let (turn, slope) = match i % 10 {
                    0 => (3.0 * turn, 0.02 + 2.0 * slope),
                    _ => (0.2 * turn, 0.02 + 0.1 * slope),
                };
                DVec2::from_angle(turn).extend(-slope).normalize()
            })
            .collect();
        let cone = smallest_cone_axis(&directions).unwrap();
        let finest = finest_axes(axes_along, cone, AXES, &directions, SIZE).unwrap();
        // Angle of a texel of a map that is cut to them.
        let mean_angle = |axes: &Projection| {
            let places = directions
                .iter()
                .map(|&d| axes.texel_from_point(DVec3::ONE + d).truncate());
            let places: Vec<_> = places.collect();
            let angles = places.iter().map(|p| 2.0 / (1.0 + p.length_squared()));
            let half = smallest_rectangle(&places).unwrap().half;
            assert!(places.iter().all(|p| p.length() <= FARTHEST));
            (half.x + half.y) * angles.sum::<f64>()
        };
        let ratio = mean_angle(&finest) / mean_angle(&axes_along(cone));
        assert!(ratio < 0.8, "{ratio}");
        assert!((finest.x_axis.cross(finest.y_axis) - finest.z_axis).length() < 1e-9);
    }

    #[test]
    fn the_square_around_a_cone_stands_on_its_side_where_that_is_smaller() {
        let corners = [[0.1, 0.0], [0.0, 0.3], [0.0, -0.3]].map(DVec2::from);
        let axes = axes_along(DVec3::new(0.2, -0.7, 0.4).normalize());
        let sights = corners.map(|corner| axes.ray_from_texel(corner).1);
        let turned = turned_to_smallest_square(&axes, &sights);
        let sides = places_of(&turned, &sights).into_iter();
        let widest = sides
            .map(|place| place.abs().max_element())
            .fold(0.0, f64::max);
        assert!((widest - 0.3 / 2.0_f64.sqrt()).abs() < 1e-9, "{widest}");
    }

    #[test]
    fn no_paraboloid_holds_all_directions() {
        let directions: Vec<_> = (0..300).map(|i| spiral_direction(i, 300)).collect();
        assert!(finest_axes(axes_along, DVec3::X, AXES, &directions, SIZE).is_none());
        assert!(finest_axes(axes_along, DVec3::X, AXES, &[DVec3::NEG_X], SIZE).is_some());
    }
}
