//! Fits of central projections, for lights with a position.

use super::layer::Layer;
use super::parallel::axes_at;
use super::receivers::Setting;
use super::snapping::snapped;
use crate::camera::Camera;
use crate::geometry::farthest_in_box;
use crate::light::Cone;
use crate::map_size::MapSize;
use crate::projection::{Kind, Paraboloid, Perspective, Projection};
use crate::region::{HalfSpace, Region};
use glam::{DMat3, DVec2, DVec3};

/// Nearest depth of a perspective map as a share of its farthest: nothing between a light and a
/// receiver is cut off, down to the rounding of float32 numbers near the light.
const NEAR_SHARE: f64 = 1.0 / (1 << 30) as f64;

/// A cone up to this angle is one perspective map; a wider one is stretched too much at its rim.
const WIDEST_PERSPECTIVE: f64 = 1.2;

/// Directions that the smallest cone around some is found by, and steps to its axis.
const MAX_TOUCHED: usize = 30;
const STEPS_TO_MIDDLE: u32 = 400;

/// Axes of a kind with one texel to the unit, whose depths end at the farthest corner of a box of the world.
pub fn axes_for_scene(
    kind: impl Into<Kind>,
    origin: DVec3,
    direction: DVec3,
    bounds: (DVec3, DVec3),
) -> Projection {
    let far = farthest_in_box(bounds, origin).max(f64::MIN_POSITIVE.sqrt());
    Projection {
        kind: kind.into(),
        near: NEAR_SHARE * far,
        far,
        normalizes_depth: true,
        ..axes_at(origin, direction)
    }
}

/// The six faces of a cube around a point, each with the pyramid that it is for: +X, -X, +Y, -Y, +Z, -Z.
pub fn cube_faces(position: DVec3, scene: (DVec3, DVec3)) -> Vec<Layer> {
    turned_cube_faces(position, DMat3::IDENTITY, scene)
}

/// The same of a cube whose axes are the columns of `cube`.
pub fn turned_cube_faces(position: DVec3, cube: DMat3, scene: (DVec3, DVec3)) -> Vec<Layer> {
    let directions = [DVec3::X, DVec3::Y, DVec3::Z];
    let both_ways = directions.into_iter().flat_map(|axis| [axis, -axis]);
    let faces = both_ways.map(|direction| {
        let axes = axes_for_scene(Perspective, position, direction, scene);
        let projection = Projection {
            x_axis: cube * axes.x_axis,
            y_axis: cube * axes.y_axis,
            z_axis: cube * axes.z_axis,
            ..axes
        };
        let (x, y) = (projection.x_axis, projection.y_axis);
        let sides = [x, -x, y, -y];
        let half_spaces = sides.map(|side| HalfSpace {
            origin: position,
            normal: (projection.z_axis + side).normalize(),
        });
        Layer {
            projection,
            region: Region::new(half_spaces.to_vec()),
        }
    });
    faces.collect()
}

/// Two paraboloids back to back, each with its half of space; the first looks along the axis that is given, or the
/// light's, or down where it has none.
pub fn halves_of_light(setting: Setting, position: DVec3, axis: Option<DVec3>) -> Vec<Layer> {
    let own = || setting.light.cone().map_or(DVec3::NEG_Y, |cone| cone.axis);
    let axis = axis.unwrap_or_else(own);
    hemispheres(position, axis, setting.scene.bounds())
}

fn hemispheres(position: DVec3, axis: DVec3, scene: (DVec3, DVec3)) -> Vec<Layer> {
    let halves = [axis, -axis].map(|forward| Layer {
        projection: axes_for_scene(Paraboloid::UNIT, position, forward, scene),
        region: Region::new(vec![HalfSpace {
            origin: position,
            normal: forward,
        }]),
    });
    halves.to_vec()
}

/// One layer for a cone of light: perspective, or a paraboloid where it is wide.
pub fn cone_layer(position: DVec3, cone: Cone, scene: (DVec3, DVec3)) -> Layer {
    let kind: Kind = if cone.cosine >= WIDEST_PERSPECTIVE.cos() {
        Perspective.into()
    } else {
        Paraboloid::UNIT.into()
    };
    Layer::everywhere(axes_for_scene(kind, position, cone.axis, scene))
}

/// The map whose sides are the box's; (x, y) in the plane of the axes, which
/// no receiver leaves by more than `widest`, and depth. Nothing is stored behind the far side. Texels hold
/// still where `snaps`.
pub fn fit_box(
    axes: &Projection,
    (low, high): (DVec3, DVec3),
    widest: f64,
    size: MapSize,
    rounding: f64,
    snaps: bool,
) -> Projection {
    let limit = DVec2::splat(widest);
    // Room for rounding at the border, which a receiver near the light has more of, and for a box
    // without a width.
    let nearest = low.z.max(axes.near);
    let room = (rounding / nearest).clamp(1e-7, 1e-3) * widest.max(1.0);
    let low_place = low.truncate().clamp(-limit, limit) - room;
    let high_place = high.truncate().clamp(-limit, limit) + room;
    let (low_place, high_place) = match snaps {
        true => snapped((low_place, high_place), size),
        false => (low_place, high_place),
    };
    let middle = 0.5 * (low_place + high_place);
    let texels_per_unit = size.texels() / (high_place - low_place);
    let far = (high.z + rounding).clamp(axes.near, axes.far);
    sized(axes, middle, texels_per_unit, size, far)
}

/// The map over the square around the axes, `widest` from its middle to its sides.
pub fn fit_square(axes: &Projection, widest: f64, far: f64, size: MapSize) -> Projection {
    let texels_per_unit = size.middle() / widest;
    sized(axes, DVec2::ZERO, texels_per_unit, size, far)
}

fn sized(
    axes: &Projection,
    middle: DVec2,
    texels_per_unit: DVec2,
    size: MapSize,
    far: f64,
) -> Projection {
    Projection {
        near: NEAR_SHARE * far,
        far,
        ..axes.around(middle, texels_per_unit, size)
    }
}

/// The eight corners of the view frustum between two depths along the viewing direction.
pub fn frustum_corners(camera: &Camera, depths: (f64, f64)) -> [DVec3; 8] {
    let image = Projection::from_camera(camera);
    let size = DVec2::new(f64::from(camera.width), f64::from(camera.height));
    std::array::from_fn(|i| {
        let right = f64::from(u8::from(i & 1 != 0));
        let bottom = f64::from(u8::from(i & 2 != 0));
        let depth = if i & 4 == 0 { depths.0 } else { depths.1 };
        let (eye, ray) = image.ray_from_texel(size * DVec2::new(right, bottom));
        eye + ray * depth
    })
}

/// Where directions lie in the plane of central axes.
pub fn places_of(axes: &Projection, directions: &[DVec3]) -> Vec<DVec2> {
    let places = directions
        .iter()
        .map(|&direction| axes.texel_from_point(axes.origin + direction).truncate());
    places.collect()
}

/// The axis of the smallest cone around unit directions: of those few that it touches, which are found one by one as
/// the farthest of all from the axis (Bădoiu and Clarkson, "Smaller core-sets for balls", SODA 2003); none if they
/// cancel.
pub fn smallest_cone_axis(directions: &[DVec3]) -> Option<DVec3> {
    let mut touched = vec![*directions.first()?];
    let mut middle = touched[0];
    for _ in 0..MAX_TOUCHED {
        let farthest = farthest_from(middle, directions)?;
        if touched.contains(&farthest) {
            break;
        }
        touched.push(farthest);
        middle = middle_of_ball(&touched)?;
    }
    (middle.length() > 1e-3).then(|| middle.normalize())
}

/// The middle of the smallest ball around points, by walking towards the farthest one in shrinking steps (the same
/// paper, section 3).
fn middle_of_ball(points: &[DVec3]) -> Option<DVec3> {
    let mut middle = points.iter().sum::<DVec3>() / points.len() as f64;
    for step in 1..=STEPS_TO_MIDDLE {
        middle += (farthest_from(middle, points)? - middle) / f64::from(step + 1);
    }
    Some(middle)
}

fn farthest_from(middle: DVec3, points: &[DVec3]) -> Option<DVec3> {
    let distance = |point: &DVec3| middle.distance_squared(*point);
    let farther = |a: &&DVec3, b: &&DVec3| distance(a).total_cmp(&distance(b));
    points.iter().max_by(farther).copied()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::EulerRot;

    const SCENE: (DVec3, DVec3) = (DVec3::splat(-10.0), DVec3::splat(10.0));
    const SIZE: MapSize = MapSize {
        width: 512,
        height: 128,
    };

    #[test]
    fn faces_and_hemispheres_cover_every_direction_once_but_at_borders() {
        let position = DVec3::new(1.0, 2.0, 3.0);
        let turned = DMat3::from_euler(EulerRot::YXZ, 0.7, 0.3, 1.1);
        for direction in [
            DVec3::new(0.9, 0.3, -0.2),
            DVec3::new(-0.1, -0.8, 0.5),
            DVec3::new(0.2, 0.1, 0.7),
            DVec3::new(0.3, -0.2, -0.4),
        ] {
            let point = position + direction;
            for layers in [
                cube_faces(position, SCENE),
                turned_cube_faces(position, turned, SCENE),
                hemispheres(position, DVec3::new(0.6, 0.0, 0.8), SCENE),
            ] {
                let own: Vec<_> = layers
                    .iter()
                    .filter(|layer| layer.region.contains(point))
                    .collect();
                assert_eq!(own.len(), 1);
                let place = own[0].projection.texel_from_point(point);
                assert!(place.truncate().abs().max_element() <= 1.0, "{place}");
            }
        }
    }

    #[test]
    fn a_fitted_box_fills_the_map() {
        for kind in [Kind::from(Perspective), Paraboloid::UNIT.into()] {
            let axes = axes_for_scene(kind, DVec3::ONE, DVec3::NEG_Y, SCENE);
            let corners = (DVec3::new(-0.25, 0.1, 2.0), DVec3::new(0.5, 0.3, 4.0));
            let map = fit_box(&axes, corners, 1.0, SIZE, 1e-6, false);
            for (corner, texel) in [(corners.0, DVec2::ZERO), (corners.1, SIZE.texels())] {
                let (start, ray) = axes.ray_from_texel(corner.truncate());
                let there = map.texel_from_point(start + ray * corner.z);
                assert!((there.truncate() - texel).length() < 0.1, "{there}");
                assert!(there.z >= map.near && there.z <= map.far);
            }
        }
    }

    #[test]
    fn the_smallest_cone_is_that_of_its_rim_wherever_the_rest_lies() {
        let axis = DVec3::new(0.48, 0.6, -0.64);
        let (x, y) = axis.any_orthonormal_pair();
        let around = |angle: f64, turn: f64| {
            axis * angle.cos() + (x * turn.cos() + y * turn.sin()) * angle.sin()
        };
        let mut directions: Vec<_> = (0..5).map(|i| around(0.7, f64::from(i) * 1.3)).collect();
        directions.extend((0..100).map(|i| around(0.6, f64::from(i) * 1e-3)));
        let found = smallest_cone_axis(&directions).unwrap();
        assert!(found.dot(axis) > 0.9999, "{found}");
        assert_eq!(smallest_cone_axis(&[]), None);
        assert_eq!(smallest_cone_axis(&[DVec3::X, -DVec3::X]), None);
    }

    #[test]
    fn cones_choose_their_projection_by_their_width() {
        let layer = |angle: f64| {
            let cone = Cone {
                axis: DVec3::X,
                cosine: angle.cos(),
                sine: angle.sin(),
            };
            cone_layer(DVec3::ZERO, cone, SCENE).projection.kind
        };
        assert_eq!(layer(0.5), Perspective.into());
        assert_eq!(layer(1.5), Paraboloid::UNIT.into());
    }
}
