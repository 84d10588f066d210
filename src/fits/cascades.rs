//! Cascades: the view is cut into slabs of depth, each with a map over the box of its receivers, or of itself.
//!
//! Fan Zhang, Hanqiu Sun, Leilei Xu, Lee Kit Lun. Parallel-split shadow maps for large-scale virtual environments.
//! VRCIA 2006, section 3. Andrew Lauritzen, Marco Salvi, Aaron Lefohn. Sample distribution shadow maps. I3D 2011.

use super::boxes::{Cut, boxed_layers, cut_layers, rotated_layers, whole_layer};
use super::central::frustum_corners;
use super::layer::Layer;
use super::receivers::{Corners, ReceiverQueries, Setting};
use super::rotation::Rotation;
use super::samples::SampledReceivers;
use super::snapping::stepped;
use crate::camera::Rays;
use crate::error::Result;
use crate::frustum::visible_part;
use crate::geometry::bounds_of;
use crate::map_size::MapSize;
use crate::projection::Projection;
use crate::region::{HalfSpace, Region};

/// Where the view is cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Splits {
    /// Slabs of one thickness, between the camera's planes.
    Uniform,
    /// Each slab so many times as far as the one before, between the camera's planes.
    Logarithmic,
    /// Between the two.
    Practical,
    /// Logarithmic, between the nearest and the farthest receiver that faces the light.
    Receivers,
    /// As many receivers in each.
    Quantiles,
}

/// What the map of a slab is over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Boxes {
    /// The box of the slab's receivers (Lauritzen et al.).
    Receivers,
    /// The box of the slab of the view frustum (Zhang et al.).
    Slabs,
}

/// How the view is cut into slabs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slabs {
    pub count: u32,
    pub splits: Splits,
    /// Of the logarithmic in the practical splits.
    pub weight: f64,
    /// Receivers looked at along the longer side of the image.
    pub sample_resolution: u32,
    /// Whether slabs and texels hold still while the receivers move.
    pub snaps: bool,
    pub rotation: Rotation,
    pub boxes: Boxes,
}

/// The faces of a cube around a point are not split.
pub fn fit_cascades(
    receivers: &mut dyn ReceiverQueries<'_>,
    slabs: Slabs,
    size: MapSize,
) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    let cut = Cut::Receivers.snapped_where(slabs.snaps);
    let layers = rotated_layers(setting, slabs.rotation);
    let [axes] = &layers[..] else {
        return cut_layers(receivers, layers, cut, size);
    };
    let depths = split_depths(receivers, slabs)?;
    let layers = slab_layers(setting, &axes.projection, &depths);
    let mut boxes = receivers.bounds(&layers)?;
    if slabs.boxes == Boxes::Slabs {
        let ends: Vec<_> = [setting.camera.znear]
            .into_iter()
            .chain(depths)
            .chain([farthest_depth(setting)])
            .collect();
        for (own, slab) in boxes.iter_mut().zip(ends.windows(2)) {
            // A slab without receivers stays without a map.
            *own = own.map(|_| slab_box(setting, &axes.projection, (slab[0], slab[1])));
        }
    }
    Ok(boxed_layers(receivers, layers, boxes, cut, size))
}

/// Around the corners of the view frustum between two depths.
fn slab_box(setting: Setting, axes: &Projection, depths: (f64, f64)) -> Corners {
    let corners = frustum_corners(setting.camera, depths);
    let places = corners.map(|corner| axes.texel_from_point(corner));
    // What is beside or behind a light has no place in its plane.
    let is_behind = axes.kind.is_central() && places.iter().any(|place| place.z <= 0.0);
    match is_behind {
        true => whole_layer(setting, axes),
        false => bounds_of(places.into_iter()),
    }
}

/// Along the viewing direction, where the scene ends.
fn farthest_depth(setting: Setting) -> f64 {
    let Setting { scene, camera, .. } = setting;
    let sights = visible_part(camera, scene.bounds()).into_iter();
    let depths = sights.map(|corner| (corner - camera.eye).dot(camera.forward));
    depths.fold(camera.znear, f64::max)
}

/// Depths along the viewing direction between one slab and the next, ascending.
fn split_depths(receivers: &mut dyn ReceiverQueries<'_>, slabs: Slabs) -> Result<Vec<f64>> {
    let Slabs { count, splits, .. } = slabs;
    let setting = receivers.setting();
    let between = |near_and_far| {
        let splits = for_rays(setting.camera.rays, splits);
        splits_between(near_and_far, count, splits, slabs.weight)
    };
    if matches!(splits, Splits::Receivers | Splits::Quantiles) {
        let depths = depths_of(&receivers.samples(slabs.sample_resolution)?);
        // Slabs that grow in steps.
        let held = |depth: f64| if slabs.snaps { stepped(depth) } else { depth };
        return Ok(match (splits, depths.first(), depths.last()) {
            (Splits::Quantiles, Some(_), _) => {
                quantiles(&depths, count).into_iter().map(held).collect()
            }
            (_, Some(near), Some(far)) => between((held(*near), held(*far))),
            _ => vec![],
        });
    }
    Ok(between((setting.camera.znear, farthest_depth(setting))))
}

/// Pixels of parallel rays do not widen with the depth, and so slabs are of one thickness.
fn for_rays(rays: Rays, splits: Splits) -> Splits {
    match rays {
        Rays::Perspective => splits,
        Rays::Orthographic => Splits::Uniform,
    }
}

/// Between two depths; `weight` is that of the logarithmic in the practical splits.
fn splits_between((near, far): (f64, f64), count: u32, splits: Splits, weight: f64) -> Vec<f64> {
    let weight = match splits {
        Splits::Uniform => 0.0,
        Splits::Practical => weight,
        Splits::Logarithmic | Splits::Receivers | Splits::Quantiles => 1.0,
    };
    // Zhang et al., section 3.3.
    let depth = |share: f64| {
        let uniform = near + (far - near) * share;
        if weight == 0.0 {
            return uniform;
        }
        let logarithmic = near * (far / near).powf(share);
        weight * logarithmic + (1.0 - weight) * uniform
    };
    shares(count).map(depth).collect()
}

fn shares(count: u32) -> impl Iterator<Item = f64> {
    (1..count).map(move |i| f64::from(i) / f64::from(count))
}

/// As many of the ascending depths in each slab.
fn quantiles(depths: &[f64], count: u32) -> Vec<f64> {
    let quantile = |share: f64| depths[(share * depths.len() as f64) as usize];
    shares(count).map(quantile).collect()
}

/// Depths of the samples that face the light, ascending.
fn depths_of(samples: &SampledReceivers) -> Vec<f64> {
    let facing = samples.facing_the_light().into_iter();
    let mut depths: Vec<_> = facing.map(|i| samples.depths[i]).collect();
    depths.sort_unstable_by(f64::total_cmp);
    depths
}

/// The axes of a layer for each slab; the first and the last have no end.
fn slab_layers(setting: Setting, axes: &Projection, depths: &[f64]) -> Vec<Layer> {
    let camera = setting.camera;
    let plane = |depth: f64, normal| HalfSpace {
        origin: camera.eye + camera.forward * depth,
        normal,
    };
    let slab = |i: usize| {
        let near = i.checked_sub(1).map(|i| plane(depths[i], camera.forward));
        let far = depths.get(i).map(|depth| plane(*depth, -camera.forward));
        Layer {
            region: Region::new(near.into_iter().chain(far).collect()),
            projection: axes.clone(),
        }
    };
    (0..=depths.len()).map(slab).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(found: &[f64], expected: &[f64]) {
        assert_eq!(found.len(), expected.len());
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-9 * b, "{found:?} {expected:?}");
        }
    }

    /// Zhang et al., Eq. 2, 3 and 5, by hand: from 1 to 81 in four slabs.
    #[test]
    fn splits_are_uniform_logarithmic_or_weighed() {
        let near_and_far = (1.0, 81.0);
        let between = |splits, weight| splits_between(near_and_far, 4, splits, weight);
        assert_near(&between(Splits::Uniform, 0.5), &[21.0, 41.0, 61.0]);
        assert_near(&between(Splits::Logarithmic, 0.5), &[3.0, 9.0, 27.0]);
        assert_near(&between(Splits::Practical, 0.5), &[12.0, 25.0, 44.0]);
        assert_near(&between(Splits::Practical, 0.25), &[16.5, 33.0, 52.5]);
        assert_near(&between(Splits::Practical, 1.0), &[3.0, 9.0, 27.0]);
    }

    #[test]
    fn quantiles_leave_as_many_depths_in_each_slab() {
        let depths: Vec<_> = (0..1200).map(|i| 1.001_f64.powi(i * i / 400)).collect();
        for count in [2, 3, 5, 8] {
            let splits = quantiles(&depths, count);
            assert_eq!(splits.len(), count as usize - 1);
            for (i, split) in splits.iter().enumerate() {
                let nearer = depths.iter().filter(|depth| *depth < split).count();
                let expected = 1200 * (i + 1) / count as usize;
                assert!(nearer.abs_diff(expected) <= 20, "{nearer} {expected}");
            }
        }
    }

    #[test]
    fn a_single_slab_is_not_split() {
        assert!(splits_between((0.1, 9.0), 1, Splits::Uniform, 0.5).is_empty());
        assert!(quantiles(&[1.0, 2.0], 1).is_empty());
    }
}
