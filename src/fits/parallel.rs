//! Fits of parallel projections, for directional lights, and of those that nearly are, for lights far away.

use crate::geometry::{bounds_of, box_corners};
use crate::map_size::MapSize;
use crate::projection::{Homography, Parallel, Projection};
use glam::{DMat3, DVec2, DVec3};

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

/// Least and greatest corner, in the plane of `axes` and in depth, of a box of the world.
pub fn projected_box(axes: &Projection, bounds: (DVec3, DVec3)) -> (DVec3, DVec3) {
    let corners = box_corners(bounds).into_iter();
    bounds_of(corners.map(|corner| axes.texel_from_point(corner)))
}

/// Axes of rays that are nearly parallel, around another origin: places in their plane change by a constant. No receiver is farther than `reach`
/// from there across the rays.
pub fn moved(axes: &Projection, reach: f64, origin: DVec3) -> Projection {
    let to_origin = axes.projected_from_point(origin);
    let width = 1.0 + axes.kind.convergence() * to_origin.z;
    let convergence = axes.kind.convergence() / width;
    // What does not change along the ray through the origin.
    let across = |axis: DVec3, offset: f64| (axis - axes.z_axis * (offset * convergence)) / width;
    let kind = Homography::new(DMat3::IDENTITY, reach);
    Projection {
        kind: kind.with_convergence(convergence).into(),
        origin,
        x_axis: across(axes.x_axis, to_origin.x),
        y_axis: across(axes.y_axis, to_origin.y),
        ..axes.clone()
    }
}

/// The map whose sides are the box's; the box has a size, and room for rounding
/// at its border. `casters_near` is the least depth of a caster; nothing is stored behind the far side of
/// the box. All in the plane of `axes` and in depth.
pub fn fit_box(
    axes: &Projection,
    (low, high): (DVec3, DVec3),
    casters_near: f64,
    size: MapSize,
) -> Projection {
    let middle = 0.5 * (low + high);
    let half = 0.5 * (high - low);
    let texels_per_unit = size.middle() / half.truncate();
    let map = match axes.kind.convergence() == 0.0 {
        true => Projection {
            kind: Parallel.into(),
            origin: axes.origin
                + axes.x_axis * middle.x
                + axes.y_axis * middle.y
                + axes.z_axis * middle.z,
            ..axes.clone()
        },
        false => {
            let (start, ray) = axes.ray_from_texel(middle.truncate());
            moved(axes, half.truncate().length(), start + ray * middle.z)
        }
    };
    Projection {
        near: casters_near.min(low.z) - middle.z,
        far: half.z,
        normalizes_depth: true,
        ..map.around(DVec2::ZERO, texels_per_unit, size)
    }
}
