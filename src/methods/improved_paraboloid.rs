//! Improved paraboloid shadow maps: a paraboloid that looks at what the camera sees, and is cut to it.
//!
//! The view frustum is truncated to the depths of the receivers. A cone from the light holds its eight corners;
//! the paraboloid is turned along the cone's axis and zoomed to its angle, so that one map does where dual
//! paraboloids need two.
//!
//! Juraj Vanek, Jan Navrátil, Adam Herout, Pavel Zemčík. High-quality shadows with improved paraboloid
//! mapping. ISVC 2011, sections 3.1-3.3, Eq. 1-2. The text's maximum of dot products in Eq. 2 is meant as
//! the largest angle. Rasterization is exact here, with no tessellation.
//!
//! Parameters: those of every map, and `cut`: `frustum`, the paper's; `cone`, the smallest square around the axis
//! of the smallest cone of the receivers themselves; `receivers`, their box in the paraboloid whose axis gives
//! them the finest texels, turned across the scene's edges. The last two go past the paper, and cut also where
//! the light is inside the frustum, its future work.
//!
//! Limits: with the light inside the truncated frustum, or so near that a hemisphere does not hold the cone,
//! `frustum` falls back to dual paraboloids. `cone`, and `receivers` with the light in the view, do so only
//! where a hemisphere does not hold the receivers, each half cut to its own. The axis that gives the finest
//! texels is one of two hundred, and jumps as the camera moves.

use super::dual_paraboloid::{fit_dual_paraboloid, halves_of_light};
use super::schema::{Choices, Groups, Rule, word};
use super::{Fitted, MapParameters, Parameters, Recorded, ShadowMethod, View};
use crate::error::Result;
use crate::fits::boxes::{self, Fit, cut_layers, parallel_layer};
use crate::fits::central::{
    axes_for_scene, fit_box, fit_square, frustum_corners, places_of, smallest_cone_axis,
};
use crate::fits::parallel::{self, axes_at, bounds_of, projected_box};
use crate::fits::rotation::{cheapest, paraboloid_off_edges, quarter_in, turned, turned_place};
use crate::geometry::smallest_rectangle;
use crate::gpu::passes::outline::Points;
use crate::projection::{Paraboloid, Projection};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use std::f64::consts::PI;

#[derive(Debug, Clone, PartialEq)]
pub struct ImprovedParaboloid {
    pub map: MapParameters,
    pub cut: Cut,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cut {
    Frustum,
    Cone,
    Receivers,
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

const CUTS: Choices<Cut> = &[
    ("frustum", Cut::Frustum),
    ("cone", Cut::Cone),
    ("receivers", Cut::Receivers),
];

impl ShadowMethod for ImprovedParaboloid {
    const NAME: &'static str = "improved_paraboloid";
    const TITLE: &'static str = "Improved paraboloid shadow maps";
    const CITATION: &'static str = "Vanek, J., Navrátil, J., Herout, A., and Zemčík, P. 2011. \
         High-quality shadows with improved paraboloid mapping. ISVC.";

    const PARAMETERS: Groups = &[
        MapParameters::PARAMETERS,
        &[word("cut", "receivers", Rule::Choice(&CUTS))],
    ];

    fn from_parameters(parameters: &Parameters) -> Result<Self> {
        Ok(Self {
            map: MapParameters::from_parameters(parameters),
            cut: parameters.choice("cut", CUTS),
        })
    }

    fn record(&self, view: &mut View) -> Result<Recorded> {
        let layers = fit_improved_paraboloid(view, self.cut, self.map.resolution)?;
        view.shadows(&self.map, layers)
    }
}

/// One paraboloid, or two where the light is among the receivers; parallel rays are a paraboloid's limit
/// at infinity (Fig. 7). Submits what was recorded so far.
pub fn fit_improved_paraboloid(view: &mut View, cut: Cut, resolution: u32) -> Result<Vec<Fitted>> {
    match (view.light.position(), cut) {
        (Some(light), Cut::Frustum) => fit_frustum(view, light, resolution),
        (Some(light), Cut::Cone | Cut::Receivers) => fit_receivers(view, light, cut, resolution),
        (None, Cut::Frustum) => fit_distant_frustum(view, resolution),
        (None, Cut::Cone) => {
            let layer = parallel_layer(view);
            cut_layers(view, vec![layer], boxes::Cut::Receivers, resolution)
        }
        (None, Cut::Receivers) => Fit::MinSm.fit(view, false, resolution),
    }
}

/// Least and greatest depth of the receivers along the viewing direction.
fn depth_range(view: &mut View) -> Result<Option<(f64, f64)>> {
    let camera = view.camera;
    let layer = Fitted::everywhere(Projection {
        x_axis: camera.right,
        y_axis: -camera.up,
        ..axes_at(camera.eye, camera.forward)
    });
    let boxes = view.receiver_bounds(&[layer])?;
    Ok(boxes[0].map(|(low, high)| (low.z, high.z)))
}

/// Section 3.2: the light cone of the truncated view frustum.
fn fit_frustum(view: &mut View, light: DVec3, resolution: u32) -> Result<Vec<Fitted>> {
    let Some(depths) = depth_range(view)? else {
        return Ok(vec![]);
    };
    let scene = view.scene.bounds();
    let (axis, border_points) = light_cone(view, light, depths);
    // Eq. 2.
    let angles = border_points.map(|point| axis.angle_between(point));
    let field_of_view = angles.into_iter().fold(0.0, f64::max);
    // Section 3.3: the zoom factor is where the mapping takes the edge of the cone.
    let zoom = (0.5 * field_of_view).tan();
    if is_in_frustum(view, light, depths) || zoom > WIDEST {
        return fit_dual_paraboloid(view, boxes::Cut::Whole, resolution);
    }
    let farthest = border_points.map(DVec3::length);
    let far = farthest.into_iter().fold(0.0, f64::max) * (1.0 + 1e-6);
    let axes = axes_for_scene(Paraboloid::UNIT, light, axis, scene);
    let projection = fit_square(&axes, 1.001 * zoom, far.min(axes.far), resolution);
    Ok(vec![Fitted::everywhere(projection)])
}

/// Axis of the light cone (Eq. 1), and the vectors from the light to the frustum's border points.
fn light_cone(view: &View, light: DVec3, depths: (f64, f64)) -> (DVec3, [DVec3; 8]) {
    let border_points = frustum_corners(view.camera, depths).map(|point| point - light);
    // The sum of the vectors as they are: of unit vectors it is mostly wider.
    let sum: DVec3 = border_points.into_iter().sum();
    let axis = sum.try_normalize().unwrap_or(view.camera.forward);
    (axis, border_points)
}

fn is_in_frustum(view: &View, point: DVec3, (near, far): (f64, f64)) -> bool {
    let image = Projection::from_camera(view.camera);
    let depth = image.projected_from_point(point).z;
    let pixel = image.texel_from_point(point);
    depth >= near
        && depth <= far
        && (0.0..=f64::from(view.camera.width)).contains(&pixel.x)
        && (0.0..=f64::from(view.camera.height)).contains(&pixel.y)
}

/// The receivers themselves: the smallest square around the axis of their smallest cone, or their box.
fn fit_receivers(view: &mut View, light: DVec3, cut: Cut, resolution: u32) -> Result<Vec<Fitted>> {
    let scene = view.scene.bounds();
    // Around a light in the view one map past the hemisphere is coarser than two.
    let chooses_axis = cut == Cut::Receivers && !is_in_frustum(view, light, (0.0, f64::INFINITY));
    let (most, tried) = match chooses_axis {
        true => (WIDEST_RECTANGLE, AXES),
        false => (WIDEST, 0),
    };
    let points = match cut {
        Cut::Frustum | Cut::Cone => Points::Extremes,
        Cut::Receivers => Points::Samples,
    };
    // Directions to receivers, from a first paraboloid along the view.
    let first = axes_for_scene(Paraboloid::UNIT, light, view.camera.forward, scene);
    let layer = Fitted::everywhere(first);
    let places = view.outline(&layer, points)?;
    let rays = places
        .into_iter()
        .map(|place| layer.projection.ray_from_texel(place).1);
    let directions: Vec<_> = rays.collect();
    let axis = smallest_cone_axis(&directions).unwrap_or(view.camera.forward);
    let axes_along = |axis| axes_for_scene(Paraboloid::UNIT, light, axis, scene);
    let along_cone = axes_along(axis);
    let axes = match cut {
        Cut::Frustum | Cut::Cone => across_smallest_square(&along_cone, &directions),
        Cut::Receivers => {
            let finest = finest_axes(axes_along, axis, tried, &directions).unwrap_or(along_cone);
            paraboloid_off_edges(view.scene, &finest, &directions)
        }
    };
    let layer = Fitted::everywhere(axes);
    // Some receivers often tell that one map does not hold them all.
    let is_outside = |direction: &DVec3| {
        let place = layer.projection.texel_from_point(light + *direction);
        place.truncate().abs().max_element() > most
    };
    if directions.iter().any(is_outside) {
        return fit_halves(view, light, &directions, resolution);
    }
    let Some(corners) = view.receiver_bounds(std::slice::from_ref(&layer))?[0] else {
        return Ok(vec![]);
    };
    let axes = layer.projection;
    let outermost = corners.0.truncate().abs().max(corners.1.truncate().abs());
    let widest = outermost.max_element();
    if widest > most {
        return fit_halves(view, light, &directions, resolution);
    }
    let distances = (view.camera.eye - light).length() + corners.1.z;
    let rounding = 8.0 * f64::from(f32::EPSILON) * distances;
    let far = (corners.1.z + rounding).min(axes.far);
    let projection = match cut {
        Cut::Frustum | Cut::Cone => {
            let room = (rounding / corners.0.z.max(axes.near)).clamp(1e-7, 1e-3);
            fit_square(&axes, widest + room, far, resolution)
        }
        Cut::Receivers => fit_box(&axes, corners, most, resolution, rounding, false),
    };
    Ok(vec![Fitted::everywhere(projection)])
}

/// Two paraboloids, each turned across the edges and cut to its receivers.
fn fit_halves(
    view: &mut View,
    light: DVec3,
    directions: &[DVec3],
    resolution: u32,
) -> Result<Vec<Fitted>> {
    let mut halves = halves_of_light(view, light);
    for half in &mut halves {
        let axes = &half.projection;
        let own = directions.iter().filter(|d| d.dot(axes.z_axis) > 0.0);
        let own: Vec<_> = own.copied().collect();
        half.projection = paraboloid_off_edges(view.scene, axes, &own);
    }
    cut_layers(view, halves, boxes::Cut::Receivers, resolution)
}

/// The axes, turned so that the square around them that holds the directions is the smallest: down to 1 / sqrt(2)
/// of that around their circle.
fn across_smallest_square(axes: &Projection, directions: &[DVec3]) -> Projection {
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
        let width = rectangle.half.x + rectangle.half.y;
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
fn fit_distant_frustum(view: &mut View, resolution: u32) -> Result<Vec<Fitted>> {
    let Some(depths) = depth_range(view)? else {
        return Ok(vec![]);
    };
    let direction = -view.light.vector_from_point(view.camera.eye);
    let axes = axes_at(view.camera.eye, direction);
    let border_points = frustum_corners(view.camera, depths);
    let points = border_points.map(|point| axes.projected_from_point(point));
    let middle = points.into_iter().sum::<DVec3>() / 8.0;
    let distances = points.map(|point| point.truncate().distance(middle.truncate()));
    let radius = distances.into_iter().fold(0.0, f64::max);
    let (low, high) = bounds_of(points.into_iter());
    let around =
        |z: f64, side: f64| DVec3::new(middle.x + side * radius, middle.y + side * radius, z);
    let corners = (around(low.z, -1.0), around(high.z, 1.0));
    let casters = projected_box(&axes, view.scene.bounds());
    let rounding = 4.0 * f64::from(f32::EPSILON) * low.abs().max(high.abs()).length();
    let corners = (corners.0 - rounding, corners.1 + rounding);
    let projection = parallel::fit_box(&axes, corners, casters.0.z - rounding, resolution);
    Ok(vec![Fitted::everywhere(projection)])
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: (DVec3, DVec3) = (DVec3::splat(-10.0), DVec3::splat(10.0));

    fn axes_along(axis: DVec3) -> Projection {
        axes_for_scene(Paraboloid::UNIT, DVec3::ONE, axis, SCENE)
    }

    #[test]
    fn the_finest_paraboloid_holds_what_most_receivers_are_in_away_from_its_axis() {
        // A floor under a lamp, nine tenths of it seen far away, on one side.
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
        let finest = finest_axes(axes_along, cone, AXES, &directions).unwrap();
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
        let looks = corners.map(|corner| axes.ray_from_texel(corner).1);
        let turned = across_smallest_square(&axes, &looks);
        let sides = places_of(&turned, &looks).into_iter();
        let widest = sides
            .map(|place| place.abs().max_element())
            .fold(0.0, f64::max);
        assert!((widest - 0.3 / 2.0_f64.sqrt()).abs() < 1e-9, "{widest}");
    }

    #[test]
    fn no_paraboloid_holds_all_directions() {
        let directions: Vec<_> = (0..300).map(|i| spiral_direction(i, 300)).collect();
        assert!(finest_axes(axes_along, DVec3::X, AXES, &directions).is_none());
        assert!(finest_axes(axes_along, DVec3::X, AXES, &[DVec3::NEG_X]).is_some());
    }
}
