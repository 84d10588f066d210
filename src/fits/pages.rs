//! Maps that are cut into pages: squares, whose texels are as long as wide, since a level is chosen by the area of a texel.

use super::boxes::{Cut, boxed_layers, straight_layers, whole_layer};
use super::layer::Layer;
use super::receivers::{Corners, ReceiverQueries, Setting};
use super::rotation::Rotation;
use crate::error::Result;
use crate::map_size::MapSize;
use crate::paging::grid::PageGrid;
use crate::projection::Projection;
use glam::DVec3;

/// What the maps are over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PagesOver {
    /// The receivers' square, and the depths that they have.
    Receivers,
    /// The scene, whatever the camera sees of it: then pages hold still while it moves.
    Scene,
}

/// One map for parallel rays, a light far away or a narrow cone, faces of a cube around a point. A map without receivers is
/// left out.
pub fn fit_pages(
    receivers: &mut dyn ReceiverQueries<'_>,
    over: PagesOver,
    resolution: u32,
) -> Result<Vec<Layer>> {
    let setting = receivers.setting();
    let layers = match (over, setting.near_position()) {
        // Their origin follows from the scene, not from the eye.
        (PagesOver::Scene, None) => {
            vec![Layer::everywhere(setting.axes_of_scene(Rotation::OffEdges))]
        }
        _ => straight_layers(setting),
    };
    let boxes = receivers.bounds(&layers)?.into_iter().zip(&layers);
    let boxes = boxes.map(|(corners, layer)| {
        let corners = corners?;
        Some(page_box(setting, &layer.projection, corners, over))
    });
    let boxes = boxes.collect();
    Ok(boxed_layers(
        receivers,
        layers,
        boxes,
        Cut::Whole,
        MapSize::square(resolution),
    ))
}

/// A level of a map, cut into pages.
pub struct Level {
    pub layer: Layer,
    pub grid: PageGrid,
    pub map: usize,
    pub level: usize,
}

/// The levels of all maps, one map after the other, the finest level of each first; `sides` are their texels.
pub fn levels_of(maps: &[Layer], sides: &[u32], page_size: u32) -> Vec<Level> {
    let maps = maps.iter().enumerate();
    let levels = maps.flat_map(|(map, layer)| {
        sides.iter().enumerate().map(move |(level, &side)| Level {
            layer: layer.with_resolution(side),
            grid: PageGrid::new(side, page_size),
            map,
            level,
        })
    });
    levels.collect()
}

fn page_box(setting: Setting, axes: &Projection, receivers: Corners, over: PagesOver) -> Corners {
    let (low, high) = match over {
        PagesOver::Receivers => receivers,
        PagesOver::Scene => whole_layer(setting, axes),
    };
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low));
    let side = half.truncate().max_element();
    let half = DVec3::new(side, side, half.z);
    (middle - half, middle + half)
}
