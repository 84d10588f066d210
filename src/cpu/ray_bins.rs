//! The triangles of a view's tiles with their boxes, so that those near the rays of a map's tile are found without a look
//! at their corners.

use super::bins::{Bins, eights, ids_at, triangles_of};
use super::lanes::{LANES, Simd, bits, dispatch, f32x8, level};
use super::rasterize::Painter;
use super::shapes::Corners;
use super::tile_rays::{TileRays, boxes_met};
use super::tiles::TILE;
use crate::lanes::Each;
use fearless_simd::prelude::*;
use rayon::prelude::*;

/// A box that nothing meets.
const NOWHERE: [f32; 4] = [
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::INFINITY,
    f32::NEG_INFINITY,
];

/// Of what rounding may have moved a corner by, how much a box is wider: rays are rounded, too.
const ROOM: f32 = 4.0;

/// The triangles of a tile.
#[derive(Default)]
pub struct RayBin {
    /// Those that are in no other tile.
    own: Boxes,
    shared: Boxes,
    /// Those that are set up in float64.
    wide: Boxes,
}

/// Triangles and their boxes: least and greatest column, least and greatest row.
#[derive(Default)]
struct Boxes {
    ids: Vec<u32>,
    sides: [Vec<f32>; 4],
}

/// The bins of all tiles.
pub fn ray_bins(painter: &Painter, bins: &Bins) -> Vec<RayBin> {
    let tiles = (0..painter.tiling.tiles()).into_par_iter();
    let of_tile = |tile| dispatch!(level(), simd => RayBin::new(simd, painter, bins, tile));
    tiles.map(of_tile).collect()
}

impl RayBin {
    #[inline(always)]
    fn new<S: Simd>(simd: S, painter: &Painter, bins: &Bins, tile: usize) -> Self {
        let (x, y) = painter.tiling.corner(tile);
        let [x, y] = [x, y].map(|first| first as f32..=(first + TILE) as f32);
        let mut of_tile = Self::default();
        for bin in bins.iter().map(|of_thread| &of_thread[tile]) {
            let Self { own, shared, wide } = &mut of_tile;
            each_box(simd, painter, &bin.near, |id, sides| {
                let [x0, x1, y0, y1] = &sides;
                let is_own = x.contains(x0) && x.contains(x1) && y.contains(y0) && y.contains(y1);
                if is_own { &mut *own } else { &mut *shared }.push(id, sides);
            });
            each_box(simd, painter, &bin.wide, |id, sides| wide.push(id, sides));
        }
        let Self { own, shared, wide } = &mut of_tile;
        for boxes in [own, shared, wide] {
            boxes.fill_up();
        }
        of_tile
    }
}

/// Gives triangles with their boxes.
#[inline(always)]
fn each_box<S: Simd>(
    simd: S,
    painter: &Painter,
    ids: &[u32],
    mut found: impl FnMut(u32, [f32; 4]),
) {
    let room = ROOM * painter.view.rounding();
    for (places, count) in eights(0..ids.len()) {
        let ids = ids_at(ids, places);
        let corners = Corners::new(simd, painter.places, triangles_of(painter.scene, ids));
        let out_of_reach = corners.out_of_reach(simd, painter.view);
        let boxes = corners.boxes(simd, out_of_reach, room);
        let boxes = boxes.each(|side| side.to_array());
        for (lane, &id) in ids.iter().enumerate().take(count) {
            found(id, boxes.each(|side| side[lane]));
        }
    }
}

impl Boxes {
    fn push(&mut self, id: u32, sides: [f32; 4]) {
        self.ids.push(id);
        for (values, side) in self.sides.iter_mut().zip(sides) {
            values.push(side);
        }
    }

    /// Adds boxes that nothing meets, up to a multiple of eight.
    fn fill_up(&mut self) {
        while !self.ids.len().is_multiple_of(LANES) {
            self.push(0, NOWHERE);
        }
    }

    /// Adds the triangles whose box meets a box.
    #[inline(always)]
    fn find<S: Simd>(&self, simd: S, sides: [f32; 4], found: &mut Vec<u32>) {
        for first in (0..self.ids.len()).step_by(LANES) {
            let eight = |k: usize| f32x8::from_slice(simd, &self.sides[k][first..first + LANES]);
            let met = boxes_met(simd, [eight(0), eight(1), eight(2), eight(3)], sides);
            found.extend(bits(met).map(|lane| self.ids[first + lane]));
        }
    }
}

impl Painter<'_> {
    /// The triangles whose boxes meet that of the rays, and those that are set up in float64.
    #[inline(always)]
    pub fn near_rays<S: Simd>(
        &self,
        simd: S,
        bins: &[RayBin],
        rays: &TileRays,
    ) -> (Vec<u32>, Vec<u32>) {
        let [x0, x1, y0, y1] = rays.tiles(self.tiling);
        let ([low_x, high_x, low_y, high_y], [x, y]) = (rays.sides(), rays.origin);
        let sides = [low_x + x, high_x + x, low_y + y, high_y + y];
        let (mut near, mut shared, mut wide) = (Vec::new(), Vec::new(), Vec::new());
        for tile in (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| y * self.tiling.columns + x)) {
            let bin = &bins[tile];
            bin.own.find(simd, sides, &mut near);
            bin.shared.find(simd, sides, &mut shared);
            bin.wide.find(simd, sides, &mut wide);
        }
        if (x0, y0) != (x1, y1) {
            for list in [&mut shared, &mut wide] {
                list.sort_unstable();
                list.dedup();
            }
        }
        near.append(&mut shared);
        (near, wide)
    }
}
