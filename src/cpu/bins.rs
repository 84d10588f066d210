//! Which triangles may touch which tiles of a view.

use super::lanes::{
    LANES, Simd, bits, dispatch, f32x8, greatest, indices, least, level, mask_bits, splat,
};
use super::shapes::Corners;
use super::tiles::{TILE, Tiling, share_jobs};
use super::view::{Place, Planes, View};
use crate::lanes::Each;
use crate::scene::Scene;
use fearless_simd::prelude::*;
use glam::DVec2;
use std::cell::OnceCell;
use std::ops::Range;

/// Triangles that are sorted in one job.
const CHUNK: usize = 512;

/// Triangles in the box of so many tiles and more are tested against each.
const MANY_TILES: usize = 4;

/// Which part of a tile counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cover {
    /// The middles of pixels.
    Middles,
    /// Everything.
    Whole,
}

/// Triangles of a tile.
#[derive(Debug, Default)]
pub struct Bin {
    /// Whose corners float32 knows well.
    pub near: Vec<u32>,
    /// That pass the origin, reach far beside the view, or are thinner than rounding: set up in float64.
    pub wide: Vec<u32>,
}

/// For each thread what it found for each tile.
pub type Bins<B = Bin> = Vec<Vec<B>>;

/// What triangles of a tile are put into.
pub trait TileBin: Default + Send {
    /// By how much of what rounding may have moved a corner by a triangle's box is wider; `None`: boxes are not asked for.
    const ROOM: Option<f32>;

    /// Least and greatest column, least and greatest row are those of its box.
    fn push(&mut self, id: u32, kind: InTile, sides: [f32; 4]);
}

/// How a triangle is in a tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum InTile {
    /// In no other tile, and float32 knows its corners well.
    Own,
    /// In others, too.
    Shared,
    /// Set up in float64.
    Wide,
}

impl TileBin for Bin {
    const ROOM: Option<f32> = None;

    #[inline(always)]
    fn push(&mut self, id: u32, kind: InTile, _: [f32; 4]) {
        match kind {
            InTile::Own | InTile::Shared => self.near.push(id),
            InTile::Wide => self.wide.push(id),
        }
    }
}

/// Which tiles of a view are drawn, each with a bin.
pub trait DrawnTiles: Sync {
    fn bins(&self) -> usize;

    /// That of a tile, if it is drawn.
    fn bin(&self, tile: usize) -> Option<usize>;

    /// Gives the bins of tiles between first and last column and row, of those squares that are touched: each is told by
    /// its first pixel and its side.
    fn each_in(
        &self,
        sides: [usize; 4],
        touches: &impl Fn(DVec2, f64) -> bool,
        found: impl FnMut(usize),
    );
}

/// All of them.
impl DrawnTiles for Tiling {
    fn bins(&self) -> usize {
        self.tiles()
    }

    #[inline(always)]
    fn bin(&self, tile: usize) -> Option<usize> {
        Some(tile)
    }

    #[inline(always)]
    fn each_in(
        &self,
        [x0, x1, y0, y1]: [usize; 4],
        touches: &impl Fn(DVec2, f64) -> bool,
        mut found: impl FnMut(usize),
    ) {
        for row in y0..y1 + 1 {
            for column in x0..x1 + 1 {
                let corner = DVec2::new((column * TILE) as f64, (row * TILE) as f64);
                if touches(corner, TILE as f64) {
                    found(row * self.columns + column);
                }
            }
        }
    }
}

/// Sorts the triangles of a scene into the tiles that are drawn.
pub fn bins<T: DrawnTiles, B: TileBin>(
    view: &View,
    (tiling, drawn): (Tiling, &T),
    scene: &Scene,
    places: &[Place],
    cover: Cover,
) -> Bins<B> {
    bins_among(view, (tiling, drawn), (scene, None), places, cover)
}

/// The same of some triangles of a scene, or of all.
pub fn bins_among<T: DrawnTiles, B: TileBin>(
    view: &View,
    (tiling, drawn): (Tiling, &T),
    (scene, among): (&Scene, Option<&[u32]>),
    places: &[Place],
    cover: Cover,
) -> Bins<B> {
    let sorter = Sorter {
        view,
        tiling,
        drawn,
        scene,
        among,
        places,
        cover,
    };
    let of_thread = || (0..drawn.bins()).map(|_| B::default()).collect();
    let mut bins: Bins<B> = (0..rayon::current_num_threads())
        .map(|_| of_thread())
        .collect();
    let count = among.map_or(scene.triangles().len(), <[u32]>::len);
    share_jobs(&mut bins, count.div_ceil(CHUNK), |bins, job| {
        let range = job * CHUNK..((job + 1) * CHUNK).min(count);
        dispatch!(level(), simd => sorter.sort(simd, range, bins));
    });
    bins
}

/// The numbers of a range, eight at a time, and how many there are; the last one stands for those that are missing.
pub struct Eights(Range<usize>);

#[inline(always)]
pub fn eights(range: Range<usize>) -> Eights {
    Eights(range)
}

impl Iterator for Eights {
    type Item = ([usize; LANES], usize);

    #[inline(always)]
    fn next(&mut self) -> Option<Self::Item> {
        let Range { start, end } = self.0;
        if start >= end {
            return None;
        }
        let mut places = [start; LANES];
        for (i, place) in places.iter_mut().enumerate() {
            *place = (start + i).min(end - 1);
        }
        self.0.start = start + LANES;
        Some((places, LANES.min(end - start)))
    }
}

#[inline(always)]
pub fn triangles_of(scene: &Scene, ids: [u32; LANES]) -> [[u32; 3]; LANES] {
    let mut triangles = [[0; 3]; LANES];
    for (triangle, id) in triangles.iter_mut().zip(ids) {
        *triangle = scene.triangles()[id as usize];
    }
    triangles
}

/// Those of a list at some places.
#[inline(always)]
pub fn ids_at(list: &[u32], places: [usize; LANES]) -> [u32; LANES] {
    let mut ids = [0; LANES];
    for (id, place) in ids.iter_mut().zip(places) {
        *id = list[place];
    }
    ids
}

struct Sorter<'a, T> {
    view: &'a View,
    tiling: Tiling,
    drawn: &'a T,
    scene: &'a Scene,
    /// The triangles; all where there is no list.
    among: Option<&'a [u32]>,
    places: &'a [Place],
    cover: Cover,
}

impl<T: DrawnTiles> Sorter<'_, T> {
    #[inline(always)]
    fn sort<S: Simd, B: TileBin>(&self, simd: S, range: Range<usize>, bins: &mut [B]) {
        let Self { view, tiling, .. } = self;
        let zero = splat(simd, 0.0);
        let last_x = splat(simd, tiling.width as f32 - 1.0);
        let last_y = splat(simd, tiling.height as f32 - 1.0);
        let rounding = view.rounding();
        // Of a pixel, from its number to the first and to the last point that counts.
        let (to_first, to_last) = match self.cover {
            Cover::Middles => (0.5, 0.5),
            Cover::Whole => (1.0, 0.0),
        };
        let (far, near) = view.seen;
        let sure_near = splat(simd, (near * (1.0 - 1e-6 * near.signum())) as f32);
        let sure_far = splat(simd, (far * (1.0 + 1e-6 * far.signum())) as f32);
        for (places, count) in eights(range) {
            let ids = match self.among {
                Some(among) => ids_at(among, places),
                None => places.map(
                    #[inline(always)]
                    |place| place as u32,
                ),
            };
            let triangles = triangles_of(self.scene, ids);
            let corners = Corners::new(simd, self.places, triangles);
            let Corners {
                x,
                y,
                nearness,
                side,
            } = corners;
            let (low_x, high_x, low_y, high_y) = (least(x), greatest(x), least(y), greatest(y));
            let (farthest, nearest) = (least(nearness), greatest(nearness));
            let first_x = (low_x - rounding - to_first).ceil().max(zero);
            let first_y = (low_y - rounding - to_first).ceil().max(zero);
            let end_x = (high_x + rounding - to_last).floor().min(last_x);
            let end_y = (high_y + rounding - to_last).floor().min(last_y);
            let is_before = zero.simd_lt(greatest(side));
            let passes_origin = least(side).simd_lt(zero);
            let leaves_range = sure_near.simd_lt(nearest) | farthest.simd_lt(sure_far);
            let is_in_view = first_x.simd_le(end_x) & first_y.simd_le(end_y);
            let seen = mask_bits(is_before & (passes_origin | is_in_view)) & ((1 << count) - 1);
            if seen == 0 {
                continue;
            }
            let wide = corners.wide(simd, view) | mask_bits(leaves_range);
            let mut boxes = [[0.0; LANES]; 4];
            if let Some(room) = B::ROOM {
                let out_of_reach = corners.out_of_reach(simd, view);
                let found = corners.boxes(simd, out_of_reach, room * rounding);
                boxes = found.each(|side| side.to_array());
            }
            let passes = mask_bits(passes_origin);
            let tile = |pixel: f32x8<S>| (pixel * (1.0 / TILE as f32)).floor();
            let (x0, x1) = (tile(first_x), tile(end_x));
            let (y0, y1) = (tile(first_y), tile(end_y));
            let is_in_one = mask_bits(x0.simd_eq(x1) & y0.simd_eq(y1)) & !(passes | wide);
            let first = y0.mul_add(splat(simd, tiling.columns as f32), x0);
            let first = indices(simd, first);
            for lane in bits(seen & is_in_one) {
                if let Some(bin) = self.drawn.bin(first[lane] as usize) {
                    let sides = boxes.each(|side| side[lane]);
                    bins[bin].push(ids[lane], InTile::Own, sides);
                }
            }
            let ranges = [x0, x1, y0, y1];
            for lane in bits(seen & !is_in_one) {
                let id = ids[lane];
                let tiles = match passes >> lane & 1 {
                    0 => {
                        let [x0, x1, y0, y1] = ranges;
                        [x0[lane], x1[lane], y0[lane], y1[lane]].map(|tile| tile as usize)
                    }
                    _ if self.view.lies_beside(self.scene, id) => continue,
                    _ => [0, tiling.columns - 1, 0, tiling.rows - 1],
                };
                let kind = match wide >> lane & 1 {
                    0 => InTile::Shared,
                    _ => InTile::Wide,
                };
                let sides = boxes.each(|side| side[lane]);
                self.touched(id, tiles, |tile| bins[tile].push(id, kind, sides));
            }
        }
    }

    /// Gives each tile of a box that a triangle may touch.
    #[inline(never)]
    fn touched(&self, id: u32, sides: [usize; 4], found: impl FnMut(usize)) {
        let [x0, x1, y0, y1] = sides;
        let has_many = (x1 - x0 + 1) * (y1 - y0 + 1) >= MANY_TILES;
        let planes = OnceCell::new();
        let touches = |corner: DVec2, side: f64| {
            let planes = || {
                planes.get_or_init(|| Planes::even_edge_on(self.view, self.scene, id, DVec2::ZERO))
            };
            // Without an extent it touches none.
            !has_many || planes().is_some_and(|planes| planes.may_touch(corner, side))
        };
        self.drawn.each_in(sides, &touches, found);
    }
}
