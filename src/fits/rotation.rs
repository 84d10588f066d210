//! Rotations of a map's axes, so that its rows and columns run diagonally to the scene's dominant edges.
//!
//! Triangle lookup misses a caster that no texel nearby has seen. A triangle that is thinner than a texel and parallel to
//! a row is seen by all texels of that row or by none; if it runs diagonally, some texels all along it see it. In
//! buildings most edges are parallel to three axes, those of the world, so one rotation serves most of them.
//! The rotation depends on the light and the scene alone, so that a map holds still while the camera moves; only that of
//! a paraboloid that looks at the receivers depends on them, too.
//!
//! A map that is not square changes nothing of this: its texels have the area of the box over their number, so the
//! smallest box is the best one still, and which of two quarters it lies in follows from its sides.

use super::central::places_of;
use super::layer::Layer;
use super::parallel::projected_box;
use super::receivers::Corners;
use crate::geometry::bounds_of_places;
use crate::map_size::MapSize;
use crate::projection::Projection;
use crate::scene::Scene;
use glam::{DMat3, DVec2, DVec3, EulerRot};
use std::f64::consts::FRAC_PI_2;

/// Rotations that are tried in a quarter of a turn. 8 and 64 leave as many misclassified pixels, within a hundredth of
/// those of 336 directional lights in eight scenes.
const TURNS: u32 = 16;

/// The same about each of a cube's axes.
const CUBE_TURNS: u32 = 4;

/// Directions of a paraboloid's receivers at which the edges are asked for, at most.
const MAX_SIGHTS: usize = 64;

/// How many times as wide a map's sides may be, as a natural logarithm, for edges that all run diagonally instead of any
/// way. Values from 0.3 to 0.4 misclassify as few pixels, of 112 directional lights in eight scenes.
const EDGES_WORTH: f64 = 0.35;

/// How the plane of a light's map is rotated around the light's direction, whatever the receivers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Rotation {
    /// Off the scene's edges.
    OffEdges,
    /// By an angle in radians, from axes that have the world's Y up.
    By(f64),
}

impl Rotation {
    /// Axes of parallel rays, rotated.
    pub fn of_parallel(self, scene: &Scene, axes: Projection) -> Projection {
        match self {
            Self::OffEdges => parallel_off_edges(scene, axes),
            Self::By(angle) => turned(&axes, DVec2::from_angle(angle)),
        }
    }

    /// A layer of rays from a point nearby. Those that share the space around it with others stay as they are.
    pub fn of_layer(self, layer: Layer) -> Layer {
        match self {
            Self::By(angle) if layer.region.is_everywhere() => Layer {
                projection: turned(&layer.projection, DVec2::from_angle(angle)),
                ..layer
            },
            Self::OffEdges | Self::By(_) => layer,
        }
    }
}

/// `None` is off the edges.
impl From<Option<f64>> for Rotation {
    fn from(angle: Option<f64>) -> Self {
        angle.map_or(Self::OffEdges, Self::By)
    }
}

/// Axes with a direction of their plane along the map, turned by less than a quarter, so that no map lies on
/// its side or its head without a need.
pub fn turned(axes: &Projection, direction: DVec2) -> Projection {
    rotated(axes, quarter_turned(direction))
}

/// Axes with a unit direction of their plane along the map.
pub fn rotated(axes: &Projection, direction: DVec2) -> Projection {
    let (right, down) = (axes.x_axis, axes.y_axis);
    Projection {
        x_axis: right * direction.x + down * direction.y,
        y_axis: down * direction.x - right * direction.y,
        ..axes.clone()
    }
}

/// Axes and a box in their plane, turned by a quarter where what has those sides lies across the map: then its texels are
/// as even as its shape lets them be. Nothing is turned in a square.
pub fn laid_lengthwise(
    axes: &Projection,
    corners: Corners,
    sides: DVec2,
    size: MapSize,
) -> (Projection, Corners) {
    match size.lies_across(sides) {
        true => turned_by_a_quarter(axes, corners),
        false => (axes.clone(), corners),
    }
}

/// Axes turned by a quarter, and a box in their plane as it is there.
fn turned_by_a_quarter(axes: &Projection, (low, high): Corners) -> (Projection, Corners) {
    let corners = (
        DVec3::new(low.y, -high.x, low.z),
        DVec3::new(high.y, -low.x, high.z),
    );
    (rotated(axes, DVec2::Y), corners)
}

/// A place in the plane of axes, in that of the axes `turned` to the direction but for whole quarters.
pub fn turned_place(place: DVec2, direction: DVec2) -> DVec2 {
    DVec2::new(direction.dot(place), direction.perp_dot(place))
}

/// Axes of parallel rays, rotated off the edges as far as the box of the scene does not grow too much.
pub fn parallel_off_edges(scene: &Scene, axes: Projection) -> Projection {
    let cost = |axes: &Projection| {
        let (low, high) = projected_box(axes, scene.bounds());
        let area = (high - low).truncate().element_product();
        let alignment = scene.edge_directions().alignment(axes.x_axis, axes.y_axis);
        cost_of_turn(area, alignment)
    };
    let turns = quarter_in(TURNS).map(|angle| turned(&axes, DVec2::from_angle(angle)));
    cheapest(turns, cost)
}

/// Axes of a paraboloid, rotated off the edges as far as the box of the directions that it looks at does not grow too
/// much.
pub fn paraboloid_off_edges(scene: &Scene, axes: &Projection, directions: &[DVec3]) -> Projection {
    let places = places_of(axes, directions);
    let step = directions.len().div_ceil(MAX_SIGHTS).max(1);
    let sights: Vec<_> = directions.iter().step_by(step).collect();
    let cost = |&right: &DVec2| {
        let turned_places = places.iter().map(|&place| turned_place(place, right));
        let (low, high) = bounds_of_places(turned_places);
        let area = (high - low).element_product();
        let axes = turned(axes, right);
        let alignments = sights.iter().map(|sight| {
            let [x, y] = axes_at_direction(&axes, sight.normalize());
            scene.edge_directions().alignment(x, y)
        });
        let alignment = alignments.sum::<f64>() / sights.len() as f64;
        cost_of_turn(area, alignment)
    };
    turned(
        axes,
        cheapest(quarter_in(TURNS).map(DVec2::from_angle), cost),
    )
}

/// What a paraboloid makes of its axes across it at a unit direction: its map is part of an inversion, whose
/// derivative is a reflection.
fn axes_at_direction(axes: &Projection, direction: DVec3) -> [DVec3; 2] {
    let normal = (axes.z_axis + direction).normalize();
    [axes.x_axis, axes.y_axis].map(|axis| axis - 2.0 * axis.dot(normal) * normal)
}

/// Of a map with that area around what it holds.
fn cost_of_turn(area: f64, alignment: f64) -> f64 {
    0.5 * area.ln() + EDGES_WORTH * alignment
}

/// Axes of a cube whose faces' rows and columns run diagonally to the dominant edges.
pub fn cube_off_edges(scene: &Scene) -> DMat3 {
    let edges = scene.edge_directions();
    let cost = |cube: &DMat3| {
        let [x, y, z] = [cube.x_axis, cube.y_axis, cube.z_axis];
        edges.alignment(x, y) + edges.alignment(y, z) + edges.alignment(z, x)
    };
    let turns = quarter_in(CUBE_TURNS).flat_map(|a| {
        quarter_in(CUBE_TURNS).flat_map(move |b| quarter_in(CUBE_TURNS).map(move |c| [a, b, c]))
    });
    let cubes = turns.map(|[a, b, c]| DMat3::from_euler(EulerRot::YXZ, a, b, c));
    cheapest(cubes, cost)
}

/// The first of the turns that cost the least.
pub fn cheapest<T>(turns: impl Iterator<Item = T>, cost: impl Fn(&T) -> f64) -> T {
    turns
        .map(|turn| (cost(&turn), turn))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .expect("at least one turn")
        .1
}

/// Angles of a quarter, in equal steps.
pub fn quarter_in(steps: u32) -> impl Iterator<Item = f64> {
    (0..steps).map(move |i| FRAC_PI_2 * f64::from(i) / f64::from(steps))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fits::central::axes_for_scene;
    use crate::fits::parallel::axes_at;
    use crate::projection::Paraboloid;
    use glam::DQuat;

    const BOX: (DVec3, DVec3) = (DVec3::splat(-10.0), DVec3::splat(10.0));

    /// A square of two triangles.
    fn square(corner: DVec3, sides: [DVec3; 2]) -> [[DVec3; 3]; 2] {
        let [a, b] = sides;
        [
            [corner, corner + a, corner + a + b],
            [corner, corner + a + b, corner + b],
        ]
    }

    fn scene_of(triangles: &[[DVec3; 3]]) -> Scene {
        let indices = (0..triangles.len() as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]);
        Scene::new(triangles.as_flattened().to_vec(), indices.collect()).unwrap()
    }

    #[test]
    fn rows_and_columns_run_diagonally_to_a_fence_at_any_angle() {
        for turn in [0.0, 0.4, 1.0] {
            let turn = DQuat::from_rotation_y(turn);
            let bars = (0..9).map(|i| {
                let sides = [DVec3::X * 0.1, DVec3::Y * 8.0].map(|side| turn * side);
                square(turn * DVec3::X * f64::from(i), sides)
            });
            let scene = scene_of(&bars.flatten().collect::<Vec<_>>());
            let light = (turn * DVec3::new(0.3, -0.4, 1.0)).normalize();
            let axes = parallel_off_edges(&scene, axes_at(DVec3::ZERO, light));
            let of_bar = turn * DVec3::Y;
            let angle = axes.x_axis.dot(of_bar).atan2(axes.y_axis.dot(of_bar));
            assert!((4.0 * angle).cos() < -0.9, "{angle}");
            assert!((axes.x_axis.cross(axes.y_axis) - axes.z_axis).length() < 1e-12);
            assert!(axes.x_axis.dot(axes_at(DVec3::ZERO, light).x_axis) > 0.7);
        }
    }

    #[test]
    fn a_paraboloid_is_rotated_off_the_edges_where_it_sights() {
        let bars =
            (0..9).map(|i| square(DVec3::X * f64::from(i), [DVec3::X * 0.1, DVec3::Y * 8.0]));
        let scene = scene_of(&bars.flatten().collect::<Vec<_>>());
        // Far from its axis, where its own axes are not those of its map.
        let axes = axes_for_scene(
            Paraboloid::UNIT,
            DVec3::ZERO,
            DVec3::new(0.9, 0.5, 0.2).normalize(),
            BOX,
        );
        let sights: Vec<_> = (0..900)
            .map(|i| {
                DVec3::new(
                    0.1 * (0.05 * f64::from(i)).sin(),
                    0.0001 * f64::from(i),
                    1.0,
                )
            })
            .collect();
        let found = paraboloid_off_edges(&scene, &axes, &sights);
        let step = 1e-6;
        let [low, high] = [0.0, step].map(|up| {
            let place = found.texel_from_point(DVec3::new(0.0, 0.04 + up, 1.0));
            place.truncate()
        });
        let bar = (high - low) / step;
        assert!((4.0 * bar.to_angle()).cos() < -0.7, "{bar}");
    }

    #[test]
    fn a_paraboloid_reflects_its_axes() {
        let axes = axes_for_scene(
            Paraboloid::UNIT,
            DVec3::ONE,
            DVec3::new(0.3, -0.8, 0.5).normalize(),
            BOX,
        );
        for place in [DVec2::ZERO, DVec2::new(0.4, -0.7), DVec2::new(-1.9, 0.2)] {
            let sight = axes.ray_from_texel(place).1.normalize();
            let steps = [DVec2::X, DVec2::Y].map(|step| {
                let beside = axes.ray_from_texel(place + 1e-6 * step).1.normalize();
                (beside - sight).normalize()
            });
            for (found, step) in axes_at_direction(&axes, sight).into_iter().zip(steps) {
                assert!(found.distance(step) < 1e-5, "{found} {step}");
            }
        }
    }

    #[test]
    fn what_is_turned_by_a_quarter_keeps_its_points() {
        let axes = axes_at(DVec3::new(1.0, -2.0, 0.5), DVec3::new(0.6, 0.0, 0.8));
        let corners = (DVec3::new(-1.0, 2.0, 3.0), DVec3::new(5.0, 2.5, 9.0));
        let (turned, turned_corners) = turned_by_a_quarter(&axes, corners);
        let there = [corners.0, corners.1].map(|corner| {
            let point = axes.origin + axes.steps() * corner;
            turned.texel_from_point(point)
        });
        let found = crate::geometry::bounds_of(there.into_iter());
        assert!(found.0.distance(turned_corners.0) < 1e-12, "{found:?}");
        assert!(found.1.distance(turned_corners.1) < 1e-12, "{found:?}");
        assert!((turned.x_axis.cross(turned.y_axis) - turned.z_axis).length() < 1e-12);
    }

    #[test]
    fn quarters_bring_a_direction_nearest_to_x() {
        for turn in -8..8 {
            let axis = DVec2::from_angle(f64::from(turn) * 0.19);
            assert!(quarter_turned(axis).x >= 0.7);
        }
    }

    #[test]
    fn no_map_is_rotated_off_the_sides_of_a_square_floor() {
        let scene = scene_of(&square(DVec3::ZERO, [DVec3::X, DVec3::Z]));
        let axes = parallel_off_edges(&scene, axes_at(DVec3::ZERO, DVec3::NEG_Y));
        assert!((axes.x_axis.abs().max_element() - 1.0).abs() < 1e-12);
    }
}
