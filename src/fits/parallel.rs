//! Fits of parallel projections, for directional lights.

use crate::geometry::bounds_of;
use crate::projection::{Parallel, Projection};
use glam::{DVec2, DVec3};

/// Axes without a size: projection space in world units around `origin`, y down. The world's Y is up in the map, Z where
/// the light looks along Y.
pub fn axes_at(origin: DVec3, direction: DVec3) -> Projection {
    let world_up = if direction.y.abs() < 0.99 {
        DVec3::Y
    } else {
        DVec3::Z
    };
    let right = direction.cross(world_up).normalize();
    Projection {
        kind: Parallel.into(),
        origin,
        x_axis: right,
        y_axis: -right.cross(direction),
        z_axis: direction,
        centre: DVec2::ZERO,
        width: 1,
        height: 1,
        near: f64::NEG_INFINITY,
        far: f64::INFINITY,
        normalizes_depth: false,
    }
}

/// Least and greatest corner, in the projection space of `axes`, of a box of the world.
pub fn projected_box(axes: &Projection, (low, high): (DVec3, DVec3)) -> (DVec3, DVec3) {
    let corners = (0..8).map(|i| {
        let pick = |bit: i32, low: f64, high: f64| if i & bit == 0 { low } else { high };
        axes.projected_from_point(DVec3::new(
            pick(1, low.x, high.x),
            pick(2, low.y, high.y),
            pick(4, low.z, high.z),
        ))
    });
    bounds_of(corners)
}

/// The map whose sides are the box's, `resolution` texels each; the box has a size, and room for rounding
/// at its border. `casters_near` is the least depth of a caster; nothing is stored behind the far side of
/// the box. All in the projection space of `axes`.
pub fn fit_box(
    axes: &Projection,
    (low, high): (DVec3, DVec3),
    casters_near: f64,
    resolution: u32,
) -> Projection {
    let middle = 0.5 * (low + high);
    let half = 0.5 * (high - low);
    let texels_per_unit = 0.5 * f64::from(resolution) / half;
    let origin =
        axes.origin + axes.x_axis * middle.x + axes.y_axis * middle.y + axes.z_axis * middle.z;
    Projection {
        kind: Parallel.into(),
        origin,
        x_axis: axes.x_axis * texels_per_unit.x,
        y_axis: axes.y_axis * texels_per_unit.y,
        z_axis: axes.z_axis,
        centre: DVec2::splat(0.5 * f64::from(resolution)),
        width: resolution,
        height: resolution,
        near: casters_near.min(low.z) - middle.z,
        far: half.z,
        normalizes_depth: true,
    }
}
