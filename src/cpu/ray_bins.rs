//! The triangles of a view's tiles with their boxes, so that those near the rays of a map's tile are found without a look
//! at their corners.

use super::bins::{Bins, InTile, TileBin};
use super::lanes::{LANES, Simd, bits, f32x8};
use super::rasterize::Painter;
use super::tile_rays::{TileRays, boxes_met};
use crate::lanes::Each;
use fearless_simd::SimdFrom;

/// A box that nothing meets.
const NOWHERE: [f32; 4] = [
    f32::INFINITY,
    f32::NEG_INFINITY,
    f32::INFINITY,
    f32::NEG_INFINITY,
];

/// The triangles of a tile.
#[derive(Default)]
pub struct RayBin {
    own: Boxes,
    shared: Boxes,
    wide: Boxes,
}

/// For each thread what it found for each tile.
pub type RayBins = Bins<RayBin>;

impl TileBin for RayBin {
    /// Rays are rounded, too.
    const ROOM: Option<f32> = Some(4.0);

    #[inline(always)]
    fn push(&mut self, id: u32, kind: InTile, sides: [f32; 4]) {
        let boxes = match kind {
            InTile::Own => &mut self.own,
            InTile::Shared => &mut self.shared,
            InTile::Wide => &mut self.wide,
        };
        boxes.push(id, sides);
    }
}

/// Triangles with their boxes, eight together.
#[derive(Default)]
struct Boxes {
    eights: Vec<EightBoxes>,
    count: usize,
}

/// Least and greatest column, least and greatest row of triangles. Nothing meets those that are missing.
struct EightBoxes {
    sides: [[f32; LANES]; 4],
    ids: [u32; LANES],
}

impl Boxes {
    #[inline(always)]
    fn push(&mut self, id: u32, sides: [f32; 4]) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.eights.push(EightBoxes {
                sides: NOWHERE.each(|side| [side; LANES]),
                ids: [0; LANES],
            });
        }
        self.count += 1;
        let Some(last) = self.eights.last_mut() else {
            return;
        };
        last.ids[lane] = id;
        for (values, side) in last.sides.iter_mut().zip(sides) {
            values[lane] = side;
        }
    }

    /// Adds the triangles whose box meets a box.
    #[inline(always)]
    fn find<S: Simd>(&self, simd: S, sides: [f32; 4], found: &mut Vec<u32>) {
        for eight in &self.eights {
            let boxes = eight.sides.each(|side| f32x8::simd_from(simd, side));
            let met = boxes_met(simd, boxes, sides);
            found.extend(bits(met).map(|lane| eight.ids[lane]));
        }
    }
}

impl Painter<'_> {
    /// The triangles whose boxes meet that of the rays, and those that are set up in float64.
    #[inline(always)]
    pub fn near_rays<S: Simd>(
        &self,
        simd: S,
        bins: &RayBins,
        rays: &TileRays,
    ) -> (Vec<u32>, Vec<u32>) {
        let [x0, x1, y0, y1] = rays.tiles(self.tiling);
        let ([low_x, high_x, low_y, high_y], [x, y]) = (rays.sides(), rays.origin);
        let sides = [low_x + x, high_x + x, low_y + y, high_y + y];
        let (mut near, mut shared, mut wide) = (Vec::new(), Vec::new(), Vec::new());
        for tile in (y0..=y1).flat_map(|y| (x0..=x1).map(move |x| y * self.tiling.columns + x)) {
            for bin in bins.iter().map(|of_thread| &of_thread[tile]) {
                bin.own.find(simd, sides, &mut near);
                bin.shared.find(simd, sides, &mut shared);
                bin.wide.find(simd, sides, &mut wide);
            }
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
