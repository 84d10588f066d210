//! Layers whose light matrices somebody gives: checked against the light, and made projections of.

use super::layer::Layer;
use super::matrix_layers::projection;
use super::receivers::{ReceiverQueries, Setting};
use super::samples::SampledReceivers;
use crate::error::{Result, ensure_value};
use crate::geometry::box_corners;
use crate::map_size::MapSize;
use crate::projection::{Parallel, Projection};
use crate::region::{HalfSpace, Region};
use glam::{DMat4, DVec2, DVec3, DVec4};
use std::sync::Arc;

/// Matrices and the regions of their layers, as they are given.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct GivenLayers {
    /// (x, y, depth, w) from a point in the world: x / w and y / w are from 0 to 1 in the map, from its left and its top.
    pub matrices: Arc<[DMat4]>,
    /// Of each layer the planes (a, b, c, d) with a x + b y + c z + d >= 0 for its receivers. `None`: what is in its map,
    /// and everything where there is but one.
    pub regions: Option<Arc<[Vec<DVec4>]>>,
}

/// Receivers looked at along the longer side of the image.
const SAMPLES: u32 = 180;

/// The light may be so far beside where the rows vanish, as a share of the scene's size: what float32 numbers leave.
const BESIDE_LIGHT: f64 = 1e-5;

/// The least volume that unit rows x, y and w span.
const LEAST_VOLUME: f64 = 1e-13;

/// By what share of itself a depth of float32 numbers may fall along a ray where it should grow.
const ROUNDED_DEPTH: f64 = 1e-5;

/// A row of a map without a perspective, as a share of its value: what rounding leaves.
const EVEN: f64 = 1e-12;

/// Each matrix as a layer. Of several layers those that no receiver falls in are left out.
pub fn fit_given(
    receivers: &mut dyn ReceiverQueries<'_>,
    given: &GivenLayers,
    size: MapSize,
) -> Result<Vec<Layer>> {
    if given.matrices.is_empty() {
        return Ok(vec![]);
    }
    let setting = receivers.setting();
    let samples = match setting.near_position() {
        // Rays from a point have no places that float32 must hold.
        Some(_) => None,
        None => Some(receivers.samples(SAMPLES)?),
    };
    let count = given.matrices.len();
    let mut layers = Vec::new();
    for (i, matrix) in given.matrices.iter().enumerate() {
        let name = match count {
            1 => "matrix".to_string(),
            _ => format!("matrix[{i}]"),
        };
        check(setting, *matrix, &name)?;
        let region = region_of(setting, given, i);
        let points = points_of(setting, samples.as_ref(), &region, matrix.row(3));
        if points.is_empty() && count > 1 {
            receivers.skip_layer();
            continue;
        }
        ensure_value!(
            !points.is_empty(),
            "{name} must have w, its last row, above 0 somewhere in the scene: all of it is behind the map's horizon"
        );
        let rows = texel_rows(*matrix, size);
        let projection = even(projection(setting, rows, &points, size));
        layers.push(Layer { projection, region });
    }
    if layers.len() > 1 && receivers.leaves_out_empty_layers() {
        let boxes = receivers.bounds(&layers)?;
        let made = layers.into_iter().zip(boxes);
        let mut kept = Vec::new();
        for (layer, corners) in made {
            match corners {
                Some(_) => kept.push(layer),
                None => receivers.skip_layer(),
            }
        }
        return Ok(kept);
    }
    Ok(layers)
}

/// Rows x, y and w of a matrix in texels from the middle of the map.
fn texel_rows(matrix: DMat4, size: MapSize) -> [DVec4; 3] {
    let [x, y, w] = [0, 1, 3].map(|i| matrix.row(i));
    let texels = size.texels();
    [(x - w * 0.5) * texels.x, (y - w * 0.5) * texels.y, w]
}

/// Refuses a matrix that is none of the light's.
fn check(setting: Setting, matrix: DMat4, name: &str) -> Result<()> {
    // Around the scene, in units of its size.
    let (low, high) = setting.scene.bounds();
    let size = low.distance(high).max(f64::MIN_POSITIVE.sqrt());
    let middle = setting.middle();
    let scaled = matrix * DMat4::from_translation(middle) * DMat4::from_scale(DVec3::splat(size));
    let light = match setting.light.position() {
        Some(position) => ((position - middle) / size).extend(1.0),
        None => (-setting.light.vector_from_point(middle)).extend(0.0),
    };
    let rows = [0, 1, 3].map(|i| scaled.row(i).normalize_or_zero());
    let meeting = across(rows);
    ensure_value!(
        meeting.length() > LEAST_VOLUME,
        "{name} must be invertible: rows x, y and w must not follow from each other, got {}",
        shown(matrix)
    );
    let rays_of_light = match setting.light.position() {
        Some(position) => format!("meet at {position}"),
        None => format!("run along {}", light.truncate()),
    };
    let beside = rows.map(|row| row.dot(light.normalize()).abs());
    ensure_value!(
        beside.into_iter().fold(0.0, f64::max) <= BESIDE_LIGHT,
        "{name} must send every point of a light's ray to one place of the map: the light's rays {rays_of_light}, and those \
         of the matrix {}",
        rays_in_words(meeting, middle, size)
    );
    let (depth, w) = (scaled.row(2), scaled.row(3));
    let falls = box_corners((low, high)).into_iter().any(|corner| {
        let point = ((corner - middle) / size).extend(1.0);
        let away = match light.w == 0.0 {
            true => light,
            false => (point - light).normalize_or_zero(),
        };
        let beyond = point + away * 0.25;
        let is_seen = w.dot(point) > 0.0 && w.dot(beyond) > 0.0;
        let [first, last] = [point, beyond].map(|place| depth.dot(place) / w.dot(place));
        is_seen && last < first - ROUNDED_DEPTH * (first.abs() + last.abs())
    });
    ensure_value!(
        !falls,
        "{name} must have depths, row 3 over row 4, that grow away from the light, got {}",
        shown(matrix)
    );
    Ok(())
}

/// What is orthogonal to three rows: the point, finite or at infinity, that they send nowhere. As long as the volume that
/// they span.
fn across(rows: [DVec4; 3]) -> DVec4 {
    let minor = |columns: [usize; 3]| {
        let [a, b, c] = rows.map(|row| DVec3::from(columns.map(|column| row[column])));
        a.cross(b).dot(c)
    };
    let minors = [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]].map(minor);
    DVec4::new(minors[0], -minors[1], minors[2], -minors[3])
}

/// Where rays meet, a point in units of the scene's size around its middle, as an error says it.
fn rays_in_words(point: DVec4, middle: DVec3, size: f64) -> String {
    let direction = point.truncate();
    match point.w.abs() > 1e-9 * direction.length() {
        true => format!("meet at {}", middle + direction / point.w * size),
        false => format!("run along {}", direction.normalize()),
    }
}

/// A matrix as an error shows it.
fn shown(matrix: DMat4) -> String {
    format!("{:?}", [0, 1, 2, 3].map(|i| matrix.row(i).to_array()))
}

/// Which receivers a layer is for.
fn region_of(setting: Setting, given: &GivenLayers, index: usize) -> Region {
    let planes = match &given.regions {
        Some(regions) => regions[index].clone(),
        None if given.matrices.len() == 1 => vec![],
        None => {
            let [x, y, w] = [0, 1, 3].map(|i| given.matrices[index].row(i));
            vec![x, w - x, y, w - y]
        }
    };
    let middle = setting.middle();
    let half_space = |plane: DVec4| {
        let length = plane.truncate().length();
        let normal = plane.truncate() / length;
        let origin = middle - normal * (normal.dot(middle) + plane.w / length);
        HalfSpace { origin, normal }
    };
    Region::new(planes.into_iter().map(half_space).collect())
}

/// Points of a region that a map must hold, before its horizon: receivers, or corners of the scene's box where none was
/// sampled.
fn points_of(
    setting: Setting,
    samples: Option<&SampledReceivers>,
    region: &Region,
    w: DVec4,
) -> Vec<DVec3> {
    let is_ahead = |point: &DVec3| w.dot(point.extend(1.0)) > 0.0;
    let receivers = samples.iter().flat_map(|samples| {
        let facing = samples.facing_the_light().into_iter();
        facing.map(|i| samples.points[i])
    });
    let receivers = receivers.filter(|point| region.contains(*point));
    let receivers: Vec<_> = receivers.filter(is_ahead).collect();
    if !receivers.is_empty() {
        return receivers;
    }
    let corners = box_corners(setting.scene.bounds()).into_iter();
    corners.filter(is_ahead).collect()
}

/// The projection without its homography, where that leaves all texels alike: around the middle of the map.
fn even(projection: Projection) -> Projection {
    let Some([texel_from_place, place_from_texel]) = projection.kind.matrices() else {
        return projection;
    };
    let reach = projection.kind.greatest_coordinate(&projection);
    let last = texel_from_place.row(2);
    let is_even = last.truncate().length() * reach <= EVEN * last.z;
    if projection.kind.is_central() || projection.kind.convergence() != 0.0 || !is_even {
        return projection;
    }
    let place = place_from_texel.z_axis;
    let place = DVec2::new(place.x, place.y) / place.z;
    let depth = 0.5 * (projection.near + projection.far);
    let [x_axis, y_axis] = [0, 1].map(|i| {
        let row = texel_from_place.row(i) / last.z;
        projection.x_axis * row.x + projection.y_axis * row.y
    });
    Projection {
        kind: Parallel.into(),
        origin: projection.origin + projection.steps() * place.extend(depth),
        x_axis,
        y_axis,
        near: projection.near - depth,
        far: projection.far - depth,
        ..projection
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::projection::Homography;
    use glam::DMat3;

    #[test]
    fn rows_send_nowhere_what_is_across_all_of_them() {
        let rows = [
            DVec4::new(1.0, 2.0, -0.5, 0.3),
            DVec4::new(0.2, -1.0, 4.0, 1.0),
            DVec4::new(-3.0, 0.1, 0.7, 2.0),
        ];
        let meeting = across(rows);
        assert!(rows.iter().all(|row| row.dot(meeting).abs() < 1e-12));
        let volume = DMat4::from_cols(rows[0], rows[1], rows[2], meeting).determinant();
        assert!((volume.abs() / meeting.length_squared() - 1.0).abs() < 1e-12);
        assert!(across([rows[0], rows[1], rows[0] - rows[1]]).length() < 1e-12);
    }

    #[test]
    fn a_homography_without_a_perspective_is_left_out() {
        let matrix = DMat3::from_cols_array(&[40.0, 3.0, 0.0, -5.0, 30.0, 0.0, 7.0, -2.0, 2.0]);
        let map = |matrix| Projection {
            kind: Homography::new(matrix, 10.0).into(),
            origin: DVec3::new(3.0, -2.0, 5.0),
            x_axis: DVec3::X,
            y_axis: DVec3::Z,
            z_axis: DVec3::NEG_Y,
            centre: DVec2::splat(32.0),
            width: 64,
            height: 64,
            near: -4.0,
            far: 9.0,
            normalizes_depth: true,
        };
        let (given, made) = (map(matrix), even(map(matrix)));
        assert_eq!(made.kind.name(), "parallel");
        let point = DVec3::new(2.4, 1.0, 4.6);
        let [want, got] = [&given, &made].map(|map| map.texel_from_point(point));
        assert!(
            (want.truncate() - got.truncate()).length() < 1e-9,
            "{want} {got}"
        );
        // Depths are from another origin, between the same planes.
        assert!((want.z - given.near - (got.z - made.near)).abs() < 1e-9);
        assert!((made.near + made.far).abs() < 1e-12);
        let bent = map(matrix + DMat3::from_cols(DVec3::Z * 1e-3, DVec3::ZERO, DVec3::ZERO));
        assert_eq!(even(bent.clone()), bent);
    }
}
