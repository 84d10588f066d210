//! Turns of a map's axes, so that its rows and columns lie across the edges of the scene.
//!
//! A triangle that is thinner than a texel and lies along a row is seen by all of its texels or by none; one
//! that lies across rows is seen by some all along. So most light rays that triangle lookup misses do so along
//! edges that lie as the texels do, and where people build most edges lie along three axes, the world's.
//! What a turn depends on is the light and the scene, so that a map holds still while the camera moves.

use super::parallel_fit::projected_box;
use crate::projection::Projection;
use crate::scene::Scene;
use glam::{DMat3, DVec2, EulerRot};
use std::f64::consts::FRAC_PI_2;

/// Turns that are tried in a quarter.
const TURNS: u32 = 8;

/// The same about each of a cube's axes.
const CUBE_TURNS: u32 = 4;

/// The natural logarithm of how much wider a map's sides may be so that all of the edges lie midway between rows
/// and columns, and not either way alike. From 0.3 to 0.4 all are alike: chosen by the wrong pixels of 112 suns
/// over eight scenes.
const EDGES_WORTH: f64 = 0.35;

/// Axes with a direction of their plane along the map, turned by less than a quarter, so that no map lies on
/// its side or its head without a need.
pub fn turned(axes: &Projection, direction: DVec2) -> Projection {
    let direction = quarter_turned(direction);
    let (right, down) = (axes.x_axis, axes.y_axis);
    Projection {
        x_axis: right * direction.x + down * direction.y,
        y_axis: down * direction.x - right * direction.y,
        ..axes.clone()
    }
}

/// Axes of parallel rays, turned across the edges as far as the box of the scene does not grow too much.
pub fn parallel_across_edges(scene: &Scene, axes: Projection) -> Projection {
    let cost = |axes: &Projection| {
        let (low, high) = projected_box(axes, scene.bounds());
        let area = (high - low).truncate().element_product();
        let alignment = scene.edge_directions().alignment(axes.x_axis, axes.y_axis);
        0.5 * area.ln() + EDGES_WORTH * alignment
    };
    let turns = quarter_in(TURNS).map(|angle| turned(&axes, DVec2::from_angle(angle)));
    cheapest(turns, cost)
}

/// Axes of a cube whose faces' rows and columns lie across the edges.
pub fn cube_across_edges(scene: &Scene) -> DMat3 {
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
fn cheapest<T>(turns: impl Iterator<Item = T>, cost: impl Fn(&T) -> f64) -> T {
    turns
        .map(|turn| (cost(&turn), turn))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .expect("at least one turn")
        .1
}

/// Angles of a quarter, in equal steps.
fn quarter_in(steps: u32) -> impl Iterator<Item = f64> {
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
    use crate::methods::parallel_fit::axes_at;
    use glam::{DQuat, DVec3};

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
    fn maps_lie_across_the_edges_of_a_fence_however_it_is_turned() {
        for turn in [0.0, 0.4, 1.0] {
            let turn = DQuat::from_rotation_y(turn);
            let bars = (0..9).map(|i| {
                let sides = [DVec3::X * 0.1, DVec3::Y * 8.0].map(|side| turn * side);
                square(turn * DVec3::X * f64::from(i), sides)
            });
            let scene = scene_of(&bars.flatten().collect::<Vec<_>>());
            let light = (turn * DVec3::new(0.3, -0.4, 1.0)).normalize();
            let axes = parallel_across_edges(&scene, axes_at(DVec3::ZERO, light));
            let of_bar = turn * DVec3::Y;
            let angle = axes.x_axis.dot(of_bar).atan2(axes.y_axis.dot(of_bar));
            assert!((4.0 * angle).cos() < -0.9, "{angle}");
            assert!((axes.x_axis.cross(axes.y_axis) - axes.z_axis).length() < 1e-12);
            assert!(axes.x_axis.dot(axes_at(DVec3::ZERO, light).x_axis) > 0.7);
        }
    }

    #[test]
    fn quarters_bring_a_direction_nearest_to_x() {
        for turn in -8..8 {
            let axis = DVec2::from_angle(f64::from(turn) * 0.19);
            assert!(quarter_turned(axis).x >= 0.7);
        }
    }

    #[test]
    fn no_map_lies_across_the_sides_of_a_square_floor() {
        let scene = scene_of(&square(DVec3::ZERO, [DVec3::X, DVec3::Z]));
        let axes = parallel_across_edges(&scene, axes_at(DVec3::ZERO, DVec3::NEG_Y));
        assert!((axes.x_axis.abs().max_element() - 1.0).abs() < 1e-12);
    }
}
